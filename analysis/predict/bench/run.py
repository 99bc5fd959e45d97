"""`recoil bench`: what was measured of our own methods, as JSON and as a report page. Parts can be run alone."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import Any

from analysis.predict.bench.physics import BenchRequest, Measured, physics
from analysis.report import apa
from analysis.report.page import write_page
from analysis.report.section import Section, Table
from analysis.stats import operating
from experiments.record import storage
from experiments.record.provenance import provenance


def bench(out: Path, chosen: list[str], asked: BenchRequest) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Measure the chosen parts (all of `PARTS` if none is named); the JSON, and lines for the terminal.

    `out` gets `bench.json`, the report and its figures.
    """
    storage.make_folder(out)
    found = {name: PARTS[name](asked) for name in chosen or PARTS}
    result = {"seed": asked.seed, "provenance": provenance()} | {name: one.values for name, one in found.items()}
    storage.write_whole(out / "bench.json", (json.dumps(result, indent=1, ensure_ascii=False) + "\n").encode())
    write_page(out, "Measured trades of Recoil", (*(one.section for one in found.values()), _origin(asked.seed)))
    return result, tuple(line for one in found.values() for line in one.lines)


def post_hocs(asked: BenchRequest) -> Measured:
    """Error rates and power of the post-hoc tests at three departures from sphericity."""
    with asked.progress("bench post-hocs", 1) as tell:
        rows = operating.characteristics(asked.seed)
        tell("data sets")
    table = Table(
        caption=(
            f"Shares of {rows[0].data_sets} simulated data sets of {operating.PARTICIPANTS} participants by three "
            f"conditions (standard error at most {max(_errors(rows)):.4f}), at the nominal level {operating.LEVEL}"
        ),
        header=(
            "Post-hoc test",
            "Epsilon",
            "Claimed at most",
            "Any false finding, no difference",
            "Any false finding beside a true difference",
            "Power: any true difference found",
        ),
        rows=tuple(_cells(row) for row in rows),
    )
    section = Section(
        title="Post-hoc tests within participants",
        paragraphs=(
            "The first two conditions have equal means; the third differs by "
            f"{operating.SHIFT:g} standard deviations of a difference, or not at all. Epsilon is Box's, of the "
            "population: 1 is sphericity, 0.5 the least with three conditions. The pooled error claims its level at "
            "sphericity alone; Holm's paired t-tests keep it everywhere; Tukey's test with paired errors stays near "
            "it. Tukey's test between participants, run on such data, gives most of the power away.",
        ),
        tables=(table,),
    )
    return Measured(values=[asdict(row) for row in rows], section=section)


def _errors(rows: tuple[operating.Characteristics, ...]) -> list[float]:
    return [row.monte_carlo_error(share) for row in rows for share in (row.null_error, row.partial_error, row.power)]


def _cells(row: operating.Characteristics) -> tuple[str, ...]:
    claimed = apa.NONE if row.claimed is None else apa.number(row.claimed)
    shares = (apa.number(share, 4) for share in (row.null_error, row.partial_error, row.power))
    return (row.post_hoc, apa.number(row.epsilon, 3), claimed, *shares)


def _origin(seed: int) -> Section:
    rows = (("seed", str(seed)), *provenance().items())
    table = Table(caption="Where the numbers come from", header=("What", "Value"), rows=rows)
    return Section(title="Provenance", tables=(table,))


PARTS: dict[str, Callable[[BenchRequest], Measured]] = {"post-hocs": post_hocs, "physics": physics}
