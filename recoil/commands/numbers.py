"""Commands around numbers: reproduce, analyse, audit."""

from __future__ import annotations

from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from analysis.report.terminal import (
    AsJsonOption,
    ColumnsOption,
    FixedSeedOption,
    IncludeSyntheticOption,
    RequestsOption,
    RulesOption,
    end,
    progress,
    say,
    say_how_long,
    show,
    tracked,
)
from device.messages import RecoilError, few_of_each


class SyntheticName(StrEnum):
    """Who answers in a reproduction."""

    reconstructed = "reconstructed"
    rates = "rates"


def reproduce(
    out: Annotated[Path, typer.Option(help="Folder for logs, statistics, figures and report.")] = Path(
        "results/reproduction"
    ),
    seed: FixedSeedOption = 1,
    study: Annotated[str, typer.Option(help="Config of a study, or the name of a shipped one.")] = "study",
    synthetic: Annotated[
        SyntheticName | None,
        typer.Option(
            help="Which synthetic participants: `reconstructed` so that their logs give the published numbers back "
            "(where the study is that paper's), or drawn at the `rates` of the configs."
        ),
    ] = None,
    as_json: AsJsonOption = False,
) -> None:
    """Both experiments with synthetic participants on the simulated gun: logs, statistics, figures, report."""
    from analysis.predict.reproduction import reproduce as feature
    from analysis.predict.reproduction.study import prepared

    loaded = prepared(study, seed, synthetic.value if synthetic else None)
    if not loaded.reconstructed and synthetic is None:
        say("\n".join(f"recoil: {note}" for note in loaded.notes))
    say_how_long(feature.reproduction_time_s(loaded))
    with progress("reproduce", len(loaded.runs) + 3) as tell:
        done = feature.reproduce(loaded, out, tell)
    from analysis.predict.reproduction.results import comparison_text

    show(done.statistics, f"{comparison_text(done.comparison)}\n\nReport: {out / 'report.html'}", as_json)


def analyze(
    paths: Annotated[list[Path], typer.Argument(metavar="PATH...", help="Logs, or folders with logs.")],
    out: Annotated[
        Path | None, typer.Option(help="Folder for statistics, figures and report; required.", show_default=False)
    ] = None,
    columns: ColumnsOption = None,
    rules: RulesOption = None,
    paper: Annotated[Path | None, typer.Option(help="Published numbers to compare with.")] = None,
    codebook: Annotated[Path | None, typer.Option(metavar="CODES.toml", help="Codes of free descriptions.")] = None,
    requests: RequestsOption = None,
    fits: Annotated[bool, typer.Option("--fits", help="Fit the diffusion model, and everybody's thresholds.")] = False,
    include_synthetic: IncludeSyntheticOption = False,
    as_json: AsJsonOption = False,
) -> None:
    """Statistics, tables, figures and report of any number of logs."""
    from analysis.summary import analyze as feature

    if out is None:
        raise RecoilError(
            "analyze: give --out DIR, the folder for statistics, figures and report, as in "
            "`recoil analyze results --out analysis`"
        )
    asked = feature.Request(
        paths=paths,
        out=out,
        paper=paper,
        columns=columns,
        rules=rules,
        codebook=codebook,
        requests=requests,
        fits=fits,
        include_synthetic=include_synthetic,
    )
    statistics, said, notes = feature.analyze(asked, tracked, progress)
    for line in few_of_each((*said, *notes)):
        say(f"recoil: {line}")
    show(statistics, f"Report: {out / 'report.html'}", as_json)
    raise end(exceptions=bool(said))


def audit(
    paper: Annotated[str, typer.Argument(metavar="PAPER", help="A paper's file, or a shipped one.")] = "paper",
    out: Annotated[Path, typer.Option(help="Folder for audit.json and the report.")] = Path("results/audit"),
    *,
    as_json: AsJsonOption = False,
) -> None:
    """Are the published numbers attainable and consistent? Each with its proof; exit code 1 if one is not."""
    from analysis.paper.audit import run as feature

    audited = feature.audit_file(paper, progress)
    feature.write(audited, out)
    show(audited.record, f"{audited.as_text()}\n\nReport: {out / 'report.html'}", as_json)
    raise end(exceptions=audited.exceptions)


def grim(
    mean: Annotated[str, typer.Option(help="As printed, such as 3.47; with % for a percentage.")],
    n: Annotated[int, typer.Option(help="How many scores.")],
    sd: Annotated[str | None, typer.Option(help="The standard deviation as printed.")] = None,
    scale: Annotated[str | None, typer.Option(metavar="A-B", help="Its ends, such as 1-5; 0-1 for yes and no.")] = None,
    grain: Annotated[str, typer.Option(help="The steps in which scores come.")] = "1",
    items: Annotated[int, typer.Option(help="A score is the mean of so many answers.")] = 1,
    *,
    as_json: AsJsonOption = False,
) -> None:
    """Can n scores have this mean (GRIM), and with it this SD (GRIMMER, DEBIT)? Exit code 1 if not."""
    from analysis.paper.audit import one_number as feature

    found = feature.mean_and_sd(mean, n, sd, scale, grain=grain, items=items)
    show(found, found.as_text(), as_json)
    raise end(exceptions=found.exceptions)
