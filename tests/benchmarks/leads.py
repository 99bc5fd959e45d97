"""Error against time of a shot, of our models and of what a user would take instead."""

from __future__ import annotations

import os
from dataclasses import asdict, dataclass
from typing import Any

from tests.benchmarks import flops as bench_flops
from tests.benchmarks.ours import BATCH, SINGLE, contender_of, contenders
from tests.benchmarks.problem import OFF_STATES, guns, papers_shots
from tests.benchmarks.registry import peers
from tests.benchmarks.timing import Row, measure

EXACT = 1e-9
"""The error within which ways are set against each other."""
WANTED = {("open", "scipy DOP853"): 500.0, ("open", "heyoka"): 2.0}
"""How many times as long the fastest exact setting of a peer should take as ours."""
WANTED_BATCH_US = 5.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Lead:
    """The fastest setting of a family within `EXACT`, and how many times as long as ours it takes."""

    drive_off: str
    family: str
    setting: str
    error: float
    us_per_shot: float
    times_ours: float
    wanted: float | None

    @property
    def verdict(self) -> str:
        """Whether what was wanted is there; empty if nothing was."""
        if self.wanted is None:
            return ""
        reached = self.us_per_shot <= self.wanted if self.family == BATCH else self.times_ours >= self.wanted
        return "met" if reached else "not met"


def compare(repeats: int, batch: int, seed: int) -> dict[str, Any]:
    """Rows, leads and the bound by arithmetic, with the coil open and shorted."""
    entrants = [*contenders(batch, seed), *(contender_of(peer) for peer in peers())]
    load = os.getloadavg()[0]
    rate = bench_flops.flop_rate()
    rows = [row for drive_off in OFF_STATES for row in measure(entrants, papers_shots(drive_off), repeats)]
    return {
        "repeats": repeats,
        "load_before": load,
        "rows": [row.as_json() for row in rows],
        "leads": [asdict(lead) | {"verdict": lead.verdict} for lead in leads(rows)],
        "flops": bounds(rows, rate),
    }


def leads(rows: list[Row]) -> list[Lead]:
    """A lead each family and off-state that has a setting within `EXACT`."""
    best: dict[tuple[str, str], Row] = {}
    for row in rows:
        key = (row.drive_off, row.family)
        if row.error is not None and row.error <= EXACT and _us(row) < _us(best.get(key)):
            best[key] = row
    return [_lead(row) for row in best.values()]


def _us(row: Row | None) -> float:
    return row.us_per_shot if row and row.us_per_shot is not None else float("inf")


def _lead(row: Row) -> Lead:
    wanted = WANTED_BATCH_US if (row.drive_off, row.family) == ("open", BATCH) else None
    return Lead(
        drive_off=row.drive_off,
        family=row.family,
        setting=row.setting,
        error=row.error or 0.0,
        us_per_shot=_us(row),
        times_ours=row.times_ours or 0.0,
        wanted=wanted or WANTED.get((row.drive_off, row.family)),
    )


def bounds(rows: list[Row], rate: float) -> dict[str, Any]:
    """Operations of a full shot, the time they would take at this machine's rate, and how far from it we are."""
    found: dict[str, Any] = {"rate_flop_s": rate}
    for drive_off in OFF_STATES:
        counted = bench_flops.operations(guns(drive_off))
        bound_us = 1e6 * sum(counted.values()) / rate
        ours = {
            row.family: row.us_per_shot / bound_us
            for row in reversed(rows)  # the first of each family stays: one core
            if row.drive_off == drive_off and row.us_per_shot and row.family in (SINGLE, BATCH) and _is_full(row)
        }
        found[drive_off] = {"operations": counted, "bound_us": bound_us, "times_the_bound": ours}
    return found


def _is_full(row: Row) -> bool:
    return row.setting.startswith("full")
