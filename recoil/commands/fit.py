"""`recoil fit`: models fitted to rates and to response times."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from typer.core import TyperGroup

from analysis.report.terminal import (
    AsJsonOption,
    FixedSeedOption,
    GunConfigOption,
    end,
    in_text,
    progress,
    say,
    show,
    tracked,
)


class _PerceptUnlessNamed(TyperGroup):
    """`recoil fit` with options alone, or with nothing, fits the percept."""

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # type: ignore[override] # its own context
        named = args and (not args[0].startswith("-") or args[0] in ctx.help_option_names)
        return super().parse_args(ctx, args if named else ["percept", *args])


app = typer.Typer(
    cls=_PerceptUnlessNamed,
    help=(
        "Fit a model: `percept` (what of a shot says its direction, to a paper's rates; also what `recoil fit` alone "
        "does) or `times` (how fast and how carefully people decide, to logs with their own response times)."
    ),
    rich_markup_mode=None,
)

PaperOption = Annotated[str, typer.Option(help="Published numbers: file, or the name of a shipped one.")]
RatesOption = Annotated[
    str | None, typer.Option(metavar="NAME=SHARE,...", help="Forward rates by method instead of a paper's.")
]
TrialsOption = Annotated[
    int | None, typer.Option(min=1, max=10**9, help="Forward trials behind each of --rates (140).")
]
SpreadOption = Annotated[
    float, typer.Option(metavar="FACTOR", help="People differ by so many times the assumed spread; 0: all alike.")
]
StudiesOption = Annotated[
    int, typer.Option(min=0, max=10_000_000, help="Simulated studies to judge the fit by; 0: none.")
]


@app.command()
def percept(
    *,
    paper: PaperOption = "paper",
    rates: RatesOption = None,
    trials: TrialsOption = None,
    gun: GunConfigOption = "gun",
    spread: SpreadOption = 0.0,
    studies: StudiesOption = 10_000,
    seed: FixedSeedOption = 1,
    out: Annotated[Path, typer.Option(help="Folder for fit.json, percept.toml, figures and report.")] = Path(
        "results/fit"
    ),
    as_json: AsJsonOption = False,
) -> None:
    """The percept fitted to forward rates, what they cannot tell, and studies of it against what else is published."""
    from analysis.predict.fit import percept as feature

    request = feature.PerceptRequest(
        paper=paper, rates=rates, trials=trials, gun=gun, spread=spread, studies=studies, seed=seed
    )
    found = feature.percept(request, out, progress)
    text = "\n".join(map(in_text, feature.in_short(found)))
    show(found, f"{text}\nReport: {out / 'report.html'}; for a config: {out / 'percept.toml'}", as_json)


@app.command()
def times(
    logs: Annotated[list[Path], typer.Argument(metavar="LOGS...", help="Logs of experiment 1, or folders with logs.")],
    *,
    lapses: Annotated[
        str, typer.Option(metavar="none|data|A-B", help="Lapses: none, over the times' range, or from A to B s.")
    ] = "none",
    bias: Annotated[bool, typer.Option("--bias/--no-bias", help="Fit the start, or hold it at one half.")] = True,
    profile: Annotated[bool, typer.Option("--profile", help="Likelihood intervals as well; slower.")] = False,
    out: Annotated[Path, typer.Option(help="Folder for fit.json, figure and report.")] = Path("results/fit-times"),
    as_json: AsJsonOption = False,
) -> None:
    """The diffusion model (drift, boundary, start, non-decision time) fitted to people's own response times."""
    from analysis.predict.fit import times as feature

    request = feature.TimesRequest(paths=logs, lapses=lapses, bias=bias, profiled=profile)
    found, problems = feature.times(request, out, tracked, progress)
    missing = [*map(str, problems), *feature.left_out(found)]
    for one in missing:
        say(f"recoil: left out: {one}")
    show(found, f"{in_text(feature.in_short(found))}\nReport: {out / 'report.html'}", as_json)
    raise end(exceptions=bool(missing))
