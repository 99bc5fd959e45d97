"""What `recoil bench physics` says: lines for the terminal, and the page's section with figure and tables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from analysis.predict.bench.figures import Point, Trade, figure_trade
from analysis.predict.bench.ours import BATCH, INTERPRETED, SINGLE
from analysis.predict.bench.peers.problem import OFF_STATES
from analysis.report import apa
from analysis.report.section import Picture, Section, Table

if TYPE_CHECKING:
    from analysis.predict.bench.physics import Lead

Facts = dict[str, Any]

_STEM = "physics-trade"
_OURS = (SINGLE, INTERPRETED, BATCH)


def lines(found: Facts, leads: Sequence[Lead]) -> tuple[str, ...]:
    """The numbers asked for, for a person at the terminal."""
    return tuple(_lines(found, leads))


def _lines(found: Facts, leads: Sequence[Lead]) -> Iterator[str]:
    yield (
        f"Time a shot at an error of at most {found['exact_error']:.0e} against 50 digits, the paper's two guns, "
        f"medians of {found['repeats']} runs taking turns; {_conditions(found)}"
    )
    for drive_off in OFF_STATES:
        yield f"coil {drive_off}"
        for lead in (lead for lead in leads if lead.drive_off == drive_off):
            yield f"  {_lead_line(lead)}"
        yield f"  {_bound_line(found['flops'], drive_off)}"
    yield from _without_time(found["rows"])


def _conditions(found: Facts) -> str:
    """What the times depend on."""
    load = "" if found["load_before"] is None else f", load {found['load_before']:.1f} before"
    kind = "compiled" if found["compiled"] else "interpreted, as the compiler (extra `fast`) is not installed"
    return f"{found['cores']} cores{load}; ours is {kind}"


def _without_time(rows: Sequence[Facts]) -> Iterator[str]:
    """What failed, and what is not installed."""
    for row in (row for row in rows if row["status"] == "failed"):
        yield f"{row['family']}, {row['setting']}, coil {row['drive_off']}: failed ({row['note']})"
    missing = {row["family"]: row["note"] for row in rows if row["status"] == "not installed"}
    for family, note in missing.items():
        yield f"{family}: not installed ({note})"


def _lead_line(lead: Lead) -> str:
    name = f"{lead.family} ({lead.setting})"
    text = f"{name:42} {_time(lead.us_per_shot):>9} us  error {lead.error:.0e}  {_times(lead.times_ours):>6} times ours"
    if lead.wanted is None:
        return text
    asked = f"at most {lead.wanted:g} us a shot and core" if lead.family == BATCH else f"at least {lead.wanted:g} times"
    return f"{text}  (wanted: {asked}: {lead.verdict})"


def _bound_line(flops: Facts, drive_off: str) -> str:
    one = flops[drive_off]
    counted = sum(one["operations"].values())
    ours = ", ".join(f"{family} {times:.3g} times that" for family, times in one["times_the_bound"].items())
    return (
        f"arithmetic of a full shot: {counted:,.0f} operations, at {flops['rate_flop_s'] / 1e9:.3g} Gflop/s a core "
        f"{one['bound_us']:.2f} us; {ours or 'compiled code was not timed'}"
    )


def section(found: Facts, leads: Sequence[Lead], figures: Path) -> Section:
    """The page's section; its figure is written."""
    figure_trade([(f"coil {off} after the pulse", _trades(found["rows"], off)) for off in OFF_STATES], figures / _STEM)
    picture = Picture(
        stem=_STEM,
        caption=(
            "Largest relative error of the outputs against the time a shot, each point one setting. "
            "Down and to the right is better; errors above 30 are drawn at 30. Batch: time a shot and core."
        ),
        alt="Two panels, coil open and shorted: time a shot over error, lines by solver, ours the lowest",
    )
    return Section(
        title="Error against time of a simulated shot",
        paragraphs=tuple(_paragraphs(found)),
        pictures=(picture,),
        tables=(_lead_table(found, leads), *(_table(found, off) for off in OFF_STATES)),
        items=tuple(_without_time(found["rows"])),
    )


def _paragraphs(found: Facts) -> Iterator[str]:
    yield (
        f"The paper's gun at both frictions, back-EMF as printed. The error is the largest relative one over "
        f"{', '.join(found['outputs'])} and both frictions, against 50 digits by mpmath "
        "(tests/golden/make_physics.py, which shares nothing with our model). All but the reduced models solve the "
        "same equations from event to event; the break-away in closed form starts every peer."
    )
    yield (
        f"Times are medians of {found['repeats']} runs that take turns; each is timed right after ours one at a "
        f"time, and the ratio is the median of the runs' ratios ({_conditions(found)}). First call: preparing, "
        "compiling or loading, and the first shots; of one family the first setting bears it. A batch holds "
        f"{found['batch_shots']:,} random guns "
        "near the paper's. No session waits for a compiler: it runs the same model interpreted."
    )
    for drive_off in OFF_STATES:
        yield f"Coil {drive_off}: {_bound_line(found['flops'], drive_off)}."


def _trades(rows: Sequence[Facts], drive_off: str) -> list[Trade]:
    measured = [row for row in rows if row["drive_off"] == drive_off and row["us_per_shot"] is not None]
    families = dict.fromkeys(row["family"] for row in measured)
    return [
        Trade(
            name=family,
            points=tuple(_point(row) for row in measured if row["family"] == family),
            ours=family in _OURS,
        )
        for family in families
    ]


def _point(row: Facts) -> Point:
    note = row["setting"].partition(",")[0] if row["models"] == "reduced" else ""
    return Point(error=row["error"], us=row["us_per_shot"], note=note)


def _lead_table(found: Facts, leads: Sequence[Lead]) -> Table:
    header = ("Way", "Coil", "Setting", "Error", "us a shot", "Times ours", "Wanted", "Verdict")
    rows = [
        (
            lead.family,
            lead.drive_off,
            lead.setting,
            _error(lead.error),
            _time(lead.us_per_shot),
            _times(lead.times_ours),
            apa.NONE if lead.wanted is None else f"{'≤' if lead.family == BATCH else '≥'} {lead.wanted:g}",
            lead.verdict or apa.NONE,
        )
        for lead in leads
    ]
    caption = f"The fastest setting of each way with an error of at most {found['exact_error']:.0e}"
    return Table(caption=caption, header=header, rows=tuple(rows))


def _table(found: Facts, drive_off: str) -> Table:
    header = ("Way", "Setting", "Error", "us a shot", "Times ours", "Least to most", "First call in s", "Solves")
    rows = [_cells(row) for row in found["rows"] if row["drive_off"] == drive_off and row["status"] != "not installed"]
    return Table(caption=f"All settings, coil {drive_off}", header=header, rows=tuple(rows))


def _cells(row: Facts) -> tuple[str, ...]:
    if row["status"] != "measured":
        return (row["family"], row["setting"], row["status"], *(apa.NONE,) * 4, row["models"])
    return (
        row["family"],
        row["setting"],
        _error(row["error"]),
        _time(row["us_per_shot"]),
        _times(row["times_ours"]),
        f"{_time(row['us_low'])} to {_time(row['us_high'])}",
        f"{row['first_call_s']:.2f}",
        row["models"],
    )


def _error(error: float) -> str:
    return f"{error:.1e}".replace("-", "−")


def _time(us: float) -> str:
    return f"{us:,.0f}" if us >= 100 else f"{us:.3g}"


def _times(ratio: float) -> str:
    return f"{ratio:,.0f}" if ratio >= 100 else f"{ratio:.2g}"
