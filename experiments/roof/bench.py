"""`recoil bench`: what was measured of our own methods, as JSON and as a report page. Parts can be run alone."""

from __future__ import annotations

import json
from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from analysis.around import operating
from analysis.report import apa
from analysis.report.page import Section, Table, write_page
from experiments import storage
from experiments.provenance import provenance

Progress = Callable[[str, int], AbstractContextManager[Callable[[str], None]]]
"""Given what is done and in how many parts, takes the name of each part that is done."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """What a part found: plain JSON values, and the section that tells it."""

    values: Any
    section: Section


def bench(out: Path, seed: int, chosen: list[str], progress: Progress) -> dict[str, Any]:
    """Measure the chosen parts (all of `PARTS` if none is named), write JSON and report, give the JSON back."""
    names = chosen or list(PARTS)
    found: dict[str, Measured] = {}
    with progress("bench", len(names)) as tell:
        for name in names:
            found[name] = PARTS[name](seed)
            tell(name)
    result = {"seed": seed, "provenance": provenance()} | {name: one.values for name, one in found.items()}
    storage.make_folder(out)
    storage.write_whole(out / "bench.json", (json.dumps(result, indent=1, ensure_ascii=False) + "\n").encode())
    write_page(out, "Measured trades of Recoil", (*(one.section for one in found.values()), _origin(seed)))
    return result


def post_hocs(seed: int) -> Measured:
    """Error rates and power of the post-hoc tests at three departures from sphericity."""
    rows = operating.characteristics(seed)
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


PARTS: dict[str, Callable[[int], Measured]] = {"post-hocs": post_hocs}
