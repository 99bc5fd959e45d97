"""What `recoil design` says on a terminal."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from analysis.report import apa

Facts = dict[str, Any]

STATUS_WORDS = {
    "no-break-away": "do not move the magnet (no percept)",
    "stuck": "stick",
    "not-home": "are not home within the model's horizon",
}


def as_text(found: Facts) -> str:
    """The findings for a terminal."""
    return "\n".join([f"Design search: {found['title']}", *(f"  {line}" for line in _body(found))])


def _body(found: Facts) -> Iterator[str]:
    yield from swept(found)
    yield "Predictions of a model fitted to three rates; only the paper's own designs were ever felt."
    yield ""
    yield f"{'':28}{'friction':>9}{'voltage':>9}{'pulse':>9}  {'right, forward shot [95 %]':28}{'at most':>9}"
    if found["best"]:
        yield _row(f"best at {found['rate_above_Hz']:g} Hz or faster", found["best"])
    for one in found["own"]:
        yield _row(one["name"], one)
    yield ""
    yield from best_sentences(found["best"]) if found["best"] else [none_sentence(found)]
    critical = found["critical"]
    yield f"{apa.percent(critical['level'], 0)} are right, at a pulse of {_ms(critical['pulse_s'])}, from"
    for one in [own for own in found["own"] if own["swept"]]:
        yield f"  {at_friction(critical, one['friction_N'])} at {one['friction_N']:g} N ({one['name']})"


def swept(found: Facts) -> Iterator[str]:
    """What was looked at, and what of it is not proposed."""
    ends = {name: (axis[0], axis[-1]) for name, axis in found["axes"].items()}
    yield (
        f"{found['designs']['total']:,} designs: friction {ends['friction_N'][0]:.3g} to "
        f"{ends['friction_N'][1]:.3g} N, "
        f"voltage {ends['voltage_V'][0]:.3g} to {ends['voltage_V'][1]:.3g} V, "
        f"pulse {1e3 * ends['pulse_s'][0]:.3g} to {_ms(ends['pulse_s'][1])}"
    )
    for status, words in STATUS_WORDS.items():
        if count := found["designs"]["by_status"].get(status):
            yield f"{count:,} {words}"
    if beyond := found["designs"]["beyond_limits"]:
        parts = ", ".join(f"{words} ({count:,})" for words, count in beyond.items())
        yield f"beyond the device's limits at {found['rate_above_Hz']:g} Hz, so not proposed: {parts}"


def best_sentences(best: Facts) -> Iterator[str]:
    """How far the best design hangs on what is assumed, and on where the sweep ends."""
    shares = [share for share in best["under_other_assumptions"].values() if share is not None]
    if shares:
        ends = f"{apa.number(100.0 * min(shares), 1)} to {apa.percent(max(shares))}"
        yield f"Under other assumed exponents and leaks the best design is predicted at {ends}."
    names = {"friction_N": "friction", "voltage_V": "voltage", "pulse_s": "pulse"}
    if best["at_an_end_of"]:
        words = " and ".join(names[key] for key in best["at_an_end_of"])
        yield f"It lies at the end of the sweep in {words}: what is beyond is not known."


def none_sentence(found: Facts) -> str:
    """Said where no design may be proposed."""
    return (
        f"No design of this sweep can be proposed: none both keeps the device's limits and shoots at "
        f"{found['rate_above_Hz']:g} Hz. Lower --rate-above or widen the ranges."
    )


def share_cell(one: Facts) -> str:
    """A predicted share with its limits, in percent, or why there is none."""
    if one["predicted"] is None:
        return f"no prediction: {one['status']}"
    if one["ci_low"] is None:
        return apa.percent(one["predicted"])
    return f"{apa.percent(one['predicted'])} {apa.interval(100.0 * one['ci_low'], 100.0 * one['ci_high'], 1)}"


def at_friction(critical: Facts, friction_N: float) -> str:
    """The contour's voltage at a friction, with its band, or why there is none."""
    if friction_N not in critical["friction_N"]:
        return "outside the swept frictions"
    place = critical["friction_N"].index(friction_N)
    voltage_V, band = critical["voltage_V"][place], critical["band"]
    if voltage_V is None:
        return str(critical["reached"][place])
    ends = [_end(band[f"{end}_V"][place], band[f"reached_{end}"][place]) for end in ("low", "high")]
    return f"{apa.number(voltage_V, 1)} V [{ends[0]}, {ends[1]}]"


def _end(voltage_V: float | None, reached: str) -> str:
    if voltage_V is not None:
        return apa.number(voltage_V, 1)
    return {"not within the range": "above the range", "from the lowest voltage on": "below the range"}.get(
        reached, "unknown"
    )


def _row(name: str, one: Facts) -> str:
    rate = f"{one['shooting_rate_Hz']:.2f} Hz"
    numbers = f"{one['friction_N']:>7.3g} N{one['voltage_V']:>7.3g} V{_ms(one['pulse_s']):>9}"
    return f"{name:28}{numbers}  {share_cell(one):28}{rate:>9}"


def _ms(seconds: float) -> str:
    return f"{1e3 * seconds:.3g} ms"
