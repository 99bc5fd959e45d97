"""`recoil bench`: what our own methods cost and buy, measured on this machine, as JSON and as a page with one figure.

Parts can be run alone.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis.predict.bench.caution import caution
from analysis.predict.bench.figure import figure_of_trades
from analysis.predict.bench.measured import BenchRequest, Bought, Measured
from analysis.predict.bench.physics import physics
from analysis.predict.bench.studies import missed_by_tests, post_hocs, procedure_errors
from analysis.report import placing
from analysis.report.page import write_page
from analysis.report.section import Picture, Section, Table, origin_table
from analysis.report.serial import as_json
from device.physics.batch import compiler_note
from experiments.record import storage
from experiments.record.provenance import provenance

__all__ = ["PARTS", "TRADES", "Bench", "BenchRequest", "bench", "bench_time_s", "compiler_note", "trade_lines"]

TRADES = "What one more costs, and what it buys"
_FIGURE, _RECORD = "figure-trade", "bench.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class Bench:
    """What was measured, by part, with the seed and where the numbers come from."""

    seed: int
    provenance: dict[str, str]
    parts: dict[str, Measured]

    @property
    def content(self) -> Mapping[str, object]:
        """The content of `bench.json`: a key for each part beside those of the whole."""
        rows = {name: part.rows for name, part in self.parts.items()}
        return {"seed": self.seed, "provenance": self.provenance, **rows}

    @property
    def bought(self) -> tuple[Bought, ...]:
        """The trades of all parts."""
        return tuple(one for part in self.parts.values() for one in part.bought)


def bench(out: Path, chosen: Sequence[str], request: BenchRequest) -> Bench:
    """Measure the chosen parts (all of `PARTS` if none is named); `out` gets `bench.json`, figure and report."""
    with placing.results_in(out, _RECORD) as part:
        parts = {name: PARTS[name](request) for name in chosen or PARTS}
        found = Bench(seed=request.seed, provenance=provenance(), parts=parts)
        storage.write_whole(part / _RECORD, as_json(found.content))
        sections = (*_trade(found, part / "figures"), *(one.section for one in parts.values()), _origin(found))
        write_page(part, "Measured trades of Recoil", sections)
    return found


def _trade(found: Bench, figures: Path) -> Iterator[Section]:
    """What one more costs and buys, with the figure of it; nothing where no part has a trade."""
    panels = [part.panel for part in found.parts.values() if part.panel]
    if not panels:
        return
    figure_of_trades(panels, figures / _FIGURE)
    caption = (
        "What is bought over what it costs, on this machine: the error of a simulated shot, with what each use bears "
        "(a thin line goes down to the error of the best output); the error of a threshold; the misses of a study; "
        "the right answers of synthetic participants. Only parts that were measured are drawn."
    )
    table = Table(
        caption="One more of each",
        header=("One more", "Where", "Costs", "Buys"),
        rows=tuple((one.more, one.where, one.costs, one.buys) for one in found.bought),
    )
    alt = f"Line charts: {'; '.join(f'{one.y_label} over {one.x_label}' for one in panels)}"
    yield Section(
        title=TRADES,
        pictures=(Picture(stem=_FIGURE, caption=caption, alt=alt),),
        tables=(table,),
    )


def trade_lines(found: Bench) -> list[str]:
    """The trades in words, a line each."""
    return [f"{one.more} ({one.where}): costs {one.costs}, buys {one.buys}" for one in found.bought]


def _origin(found: Bench) -> Section:
    return Section(title="Provenance", tables=(origin_table({"seed": found.seed, **found.provenance}),))


def bench_time_s(chosen: Sequence[str], request: BenchRequest) -> float:
    """About how long these parts take, with the compiler's code made before."""
    shots = request.batch * (request.repeats + 1)
    taken = {"physics": 9.0 + 2e-5 * shots, "procedures": 11.0, "tests": 2.0, "caution": 1.0, "post-hocs": 2.0}
    return sum(taken[name] for name in chosen)


PARTS: dict[str, Callable[[BenchRequest], Measured]] = {
    "physics": physics,
    "procedures": procedure_errors,
    "tests": missed_by_tests,
    "caution": caution,
    "post-hocs": post_hocs,
}
