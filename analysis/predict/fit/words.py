"""What `recoil fit percept` says in words: its findings on a terminal, and the fragment of a config."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from analysis.paper.odds import WHOLE_PATTERN
from analysis.report import apa

Facts = dict[str, Any]

NO_TIMES = (
    "The paper's protocol gives no response times from the participant's own hand, so drift and boundary cannot be "
    "told apart from it: rates fix only their product."
)
OUTSIDE = 0.05
"""A number farther out than this share of the studies is at odds with the model."""
UNITS = {"sensitivity": "log odds per N^n", "confusion": "", "start": "z/a"}


def plain(value: Any) -> Any:
    """Values as JSON has them: numbers that are not finite become null."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: plain(one) for key, one in value.items()}
    return [plain(one) for one in value] if isinstance(value, list | tuple) else value


def assumptions(found: Facts) -> list[str]:
    """What the numbers rest on."""
    assumed = found["assumed"]
    return [
        f"Assumed, not fitted: exponent {assumed['exponent']:g} (Stevens 1975, muscle force) and leak "
        f"{assumed['leak_s']:g} s (assumed). The boundary may be any: it bears on times alone.",
        f"{spread_sentence(found['people'])} No lapses are assumed.",
        "One bias for all methods, so a vibration without a direction is answered “forward” at the bias's rate.",
        "The likelihood is binomial, trials independent; intervals are from the profile likelihood, 95 %.",
        "All of it is a model's guess: predictions for shots that nobody has felt are predictions.",
    ]


def spread_sentence(people: dict[str, float]) -> str:
    """How the people differ."""
    if not any(people.values()):
        return "People are taken to be alike."
    return (
        f"People differ (assumed): SD {people['drift_factor_sd']:g} of the factor on the drift, "
        f"{people['log_boundary_sd']:g} of the log boundary, {people['logit_start_sd']:g} of the logit of the start."
    )


def as_text(found: Facts) -> str:
    """The findings for a terminal."""
    return "\n".join(_lines(found))


def limits(one: Facts, digits: int = 3) -> str:
    """The interval of a fitted number; no end where there is none."""
    low, high = (apa.number(one[end], digits) if one[end] is not None else "∞" for end in ("ci_low", "ci_high"))
    return f"[{low}, {high}]"


def place_sentence(place: Facts) -> str:
    """Where a published number lies."""
    fitted = "; fitted, so no test" if place["fitted"] else ""
    return (
        f"{place['quantity']} = {place['published']}: percentile {apa.number(100.0 * place['percentile'], 1)} "
        f"{percents(place)}{fitted}"
    )


def percents(one: Facts) -> str:
    """An interval of shares, in percent; dashes where there is none."""
    low, high = (None if one[end] is None else 100.0 * one[end] for end in ("ci_low", "ci_high"))
    return apa.interval(low, high, 1)


def verdict_sentence(case: Facts) -> str:
    """Is the model at odds with what was not fitted? It is where all that a printed number may be lies outside 95 %."""
    places: dict[str, list[Facts]] = {}
    for place in case["places"]:
        if not place["fitted"]:
            places.setdefault(place["quantity"], []).append(place)
    odd = [
        f"{quantity} = {' or '.join(place['published'] for place in alike)}"
        for quantity, alike in places.items()
        if all(place["outside"] < OUTSIDE for place in alike)
    ]
    whole = next(claim for claim in case["claims"] if claim["claim"] == WHOLE_PATTERN)
    recurs = (
        f"the whole pattern of significance recurs in {apa.percent(whole['share'])} of the studies {percents(whole)}"
    )
    if odd:
        return f"At odds with the paper (outside the central 95 % of the studies): {'; '.join(odd)}; {recurs}."
    return f"Every number that was not fitted lies within the central 95 % of the studies; {recurs}."


def fragment(found: Facts) -> str:
    """`percept.toml`: sections to paste into a config."""
    return "\n".join(_fragment(found)) + "\n"


def _lines(found: Facts) -> Iterator[str]:
    yield f"The percept fitted to {found['source']} ({found['trials']} forward trials a method)"
    for name, one in found["fitted"].items():
        yield f"  {name:12} {apa.number(one['value'], 3):>7} {limits(one)} {UNITS[name]}".rstrip()
    yield f"  assumed: exponent {found['assumed']['exponent']:g}, leak {found['assumed']['leak_s']:g} s, any boundary"
    yield "  rates: " + ", ".join(
        f"{name} {apa.percent(one['observed'])} (fit {apa.percent(one['predicted'])})"
        for name, one in found["rates"].items()
    )
    yield "What cannot be told:"
    yield from (f"  - {sentence}" for sentence in found["unknown"])
    yield from _judged(found)


def _judged(found: Facts) -> Iterator[str]:
    if found["judged"] is None:
        yield "Not judged: there is nothing published to judge these studies by, or none were asked for."
        return
    case = found["judged"]["cases"][found["judged"]["main"]]
    yield f"Judged by what was not fitted: {found['judged']['studies']} simulated studies, {case['name']}, 95 % CI"
    yield from (f"  {place_sentence(place)}" for place in case["places"])
    for claim in case["claims"]:
        share = f"{apa.number(100.0 * claim['share'], 1)} %"
        yield f"  {share:>7} {percents(claim)}  {claim['claim']}{' (fitted)' if claim['fitted'] else ''}"
    yield verdict_sentence(case)


def _fragment(found: Facts) -> Iterator[str]:
    version = found["provenance"]["recoil"]
    yield f"# Fitted by `recoil fit percept` (Recoil {version}) to {found['source']}; in brackets 95 % intervals."
    yield f"# {spread_sentence(found['people'])}"
    yield "[synthetic.percept]"
    for name, value in found["assumed"].items():
        yield f"{name} = {value!r}  # assumed"
    for name, one in found["fitted"].items():
        yield f"{name} = {one['value']:.6g}  # {limits(one)}"
    if any(found["people"].values()):
        yield "\n[synthetic.people]  # assumed"
        yield from (f"{name} = {value!r}" for name, value in found["people"].items())
