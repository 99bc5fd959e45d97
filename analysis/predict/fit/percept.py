"""`recoil fit percept`: the percept fitted to a paper's forward rates, judged by what else is printed, in words."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path

from analysis.paper.recurrence import WHOLE_PATTERN, wilson_interval
from analysis.predict.fit.figures import RateCurve, RatePoint, SimulatedSpread, figure_percept, figure_places
from analysis.predict.fit.percept_model import Fitted, PerceptFit, PerceptPeak, best_percept, fit_percept
from analysis.predict.fit.percept_results import AssumedNumbers, FittedPercept, FrictionCurve, OtherFit, fitted_percept
from analysis.predict.fit.studies import (
    MAIN,
    PERCENTILES,
    Histograms,
    Judged,
    Judgement,
    PerceptRequest,
    PerceptTask,
    PublishedPlace,
    RecurringClaim,
    cases_of,
    judge,
    read_request,
)
from analysis.predict.synthetic_studies import piece_sizes, spread_sentence
from analysis.report import apa, placing
from analysis.report.copies import process_copies
from analysis.report.labels import display_name, labelled
from analysis.report.page import write_page
from analysis.report.section import Picture, Section, Table, origin_table
from analysis.report.serial import as_json
from analysis.report.terminal import Progress
from experiments.record import storage
from experiments.synthetic.diffusion import People
from experiments.synthetic.percept import PerceptParameters

__all__ = ["PerceptRequest", "in_short", "percept"]

OTHERS: tuple[dict[str, float], ...] = ({"exponent": 1.1}, {"exponent": 2.0}, {"leak_s": 0.01}, {"leak_s": 0.04})
"""Other values of what is assumed: Stevens' exponent for static force, one above, half and twice the leak."""
CASES = 4


def percept(request: PerceptRequest, out: Path, progress: Progress) -> FittedPercept:
    """Fit and judge; write `fit.json`, `percept.toml`, report and figures into `out`; what was found is returned.

    `ConfigError`: rates or files that cannot be used.
    """
    task = read_request(request)
    pieces = len(piece_sizes(task.studies, task.published.n)) if task.published else 0
    with placing.results_in(out, placing.FIT_FILE) as part, labelled(task.labels):
        with progress("fit", 2 + len(OTHERS) + CASES * pieces) as tell:
            fit = fit_percept(task.rates, task.methods, trials=task.trials, people=task.people)
            tell("percept")
            others = [_other(task, fit, changed, tell) for changed in OTHERS]
            found = fitted_percept(task, fit, others, fit_assumptions(fit.parameters, task.people))
            tell("predictions")
            judged, histograms = _judged(task, request, fit, tell) if pieces else (None, [])
        found = replace(found, judged=judged)
        storage.write_whole(part / placing.FIT_FILE, as_json(found))
        storage.write_whole(part / "percept.toml", config_text(found).encode())
        with process_copies():
            parts = sections(found, histograms, part / "figures")
        write_page(part, f"The percept fitted to {found.source}", parts)
    return found


def _other(task: PerceptTask, fit: PerceptFit, changed: dict[str, float], tell: Callable[[str], None]) -> PerceptPeak:
    """The fit under another assumption."""
    base = replace(fit.parameters, **changed)
    found = best_percept(task.rates, task.methods, trials=task.trials, people=task.people, base=base)
    tell(", ".join(f"{name} {value:g}" for name, value in changed.items()))
    return found


def _judged(
    task: PerceptTask, request: PerceptRequest, fit: PerceptFit, tell: Callable[[str], None]
) -> tuple[Judgement | None, list[Histograms]]:
    """Each kind of people's studies against what is published."""
    if task.published is None:
        return None, []
    cases = cases_of(task.rates, task.methods, task.trials, fit.parameters)
    judged = [
        judge(case, task.methods, task.published, studies=task.studies, seed=request.seed, tell=tell) for case in cases
    ]
    judgement = Judgement(
        studies=task.studies,
        seed=request.seed,
        main=[case.name for case in cases].index(MAIN),
        percentiles=PERCENTILES,
        cases=tuple(one for one, _ in judged),
    )
    return judgement, [histograms for _, histograms in judged]


NO_OWN_TIMES = (
    "With no response times from the participant's own hand, drift and boundary cannot be told apart: rates fix only "
    "their product."
)
OUTSIDE = 0.05
"""A number farther out than this share of the studies is at odds with the model."""
UNITS = {"sensitivity": "log odds per N^n", "confusion": "", "start": "z/a"}


def fit_assumptions(parameters: PerceptParameters, people: People) -> tuple[str, ...]:
    """What the numbers rest on."""
    return (
        f"Assumed, not fitted: exponent {parameters.exponent:g} (Stevens 1975, muscle force) and leak "
        f"{parameters.leak_s:g} s (assumed). The boundary may be any: it bears on times alone.",
        f"{spread_sentence(people)} No lapses are assumed.",
        "One bias for all methods, so a vibration without a direction is answered “forward” at the bias's rate.",
        "The likelihood is binomial, trials independent; intervals are from the profile likelihood, 95 %.",
        "All of it is a model's guess: predictions for shots that nobody has felt are predictions.",
    )


def in_short(found: FittedPercept) -> tuple[Section, ...]:
    """What a reader looks for, in a few lines."""
    fit = Section(
        title=f"The percept fitted to {found.source} ({found.trials} forward trials a method)",
        items=tuple(_numbers(found)),
    )
    untold = Section(title="What cannot be told:", items=tuple(f"- {sentence}" for sentence in found.unknown))
    if found.judged is None:
        title = "Not judged: there is nothing published to judge these studies by, or none were asked for."
        return fit, untold, Section(title=title)
    case = found.judged.main_case
    judged = Section(
        title=f"Judged by what was not fitted: {found.judged.studies} simulated studies, {case.name}, 95 % CI",
        items=(*map(_place_sentence, case.places), *_claim_lines(case)),
    )
    return fit, untold, judged, Section(title=verdict_sentence(case))


def _numbers(found: FittedPercept) -> Iterator[str]:
    for name, one in found.fitted.items():
        yield f"{name:12} {apa.number(one.value, 3):>7} {_limits(one)} {UNITS[name]}".rstrip()
    yield f"assumed: exponent {found.assumed.exponent:g}, leak {found.assumed.leak_s:g} s, any boundary"
    rates = (
        f"{name} {apa.percent(one.observed)} (fit {apa.percent(one.predicted)})" for name, one in found.rates.items()
    )
    yield f"rates: {', '.join(rates)}"


def _claim_lines(case: Judged) -> Iterator[str]:
    for claim in case.claims:
        share = f"{apa.number(100.0 * claim.share, 1)} %"
        yield f"{share:>7} {_percents(claim)}  {claim.claim}{' (fitted)' if claim.fitted else ''}"


def config_text(found: FittedPercept) -> str:
    """`percept.toml`: sections to paste into a file of synthetic people, with `law = "diffusion"`."""
    return "\n".join(_config_lines(found)) + "\n"


def _config_lines(found: FittedPercept) -> Iterator[str]:
    version = found.provenance["recoil"]
    yield f"# Fitted by `recoil fit percept` (Recoil {version}) to {found.source}; in brackets 95 % intervals."
    yield f"# {spread_sentence(found.people)}"
    yield "[questions.response.percept]"
    yield f"exponent = {found.assumed.exponent!r}  # assumed"
    yield f"leak_s = {found.assumed.leak_s!r}  # assumed"
    for name, one in found.fitted.items():
        yield f"{name} = {one.value:.6g}  # {_limits(one)}"
    if found.people != People():
        yield "\n[questions.response.people]  # assumed"
        yield from (f"{name} = {sd!r}" for name, sd in asdict(found.people).items())


def _limits(one: Fitted) -> str:
    """The interval of a fitted number; no end where there is none."""
    low, high = (apa.number(end, 3) if math.isfinite(end) else "∞" for end in (one.ci_low, one.ci_high))
    return f"[{low}, {high}]"


def _percents(one: Fitted | PublishedPlace | RecurringClaim) -> str:
    """An interval of shares, in percent; dashes where there is none."""
    return apa.interval(100.0 * one.ci_low, 100.0 * one.ci_high, 1)


def _place_sentence(place: PublishedPlace) -> str:
    """Where a published number lies."""
    fitted = "; fitted, so no test" if place.fitted else ""
    return (
        f"{place.quantity} = {place.published}: percentile {apa.number(100.0 * place.percentile, 1)} "
        f"{_percents(place)}{fitted}"
    )


def verdict_sentence(case: Judged) -> str:
    """Is the model at odds with what was not fitted? It is where all that a printed number may be lies outside 95 %."""
    places: dict[str, list[PublishedPlace]] = {}
    for place in case.places:
        if not place.fitted:
            places.setdefault(place.quantity, []).append(place)
    found: dict[str, list[str]] = {}
    for quantity, alike in places.items():
        found.setdefault(_verdict(alike), []).append(f"{quantity} = {' or '.join(one.published for one in alike)}")
    whole = next(claim for claim in case.claims if claim.claim == WHOLE_PATTERN)
    recurs = f"the whole pattern of significance recurs in {apa.percent(whole.share)} of the studies {_percents(whole)}"
    told = [f"{words}: {'; '.join(found[words])}" for words in (AT_ODDS, TOO_FEW_STUDIES) if words in found]
    return f"{'; '.join(told or [WITHIN])}; {recurs}."


AT_ODDS = "At odds with the paper (outside the central 95 % of the studies)"
TOO_FEW_STUDIES = "Too few studies to tell whether these lie within their central 95 %"
WITHIN = "Every number that was not fitted lies within the central 95 % of the studies"


def _verdict(alike: Sequence[PublishedPlace]) -> str:
    """Of the places of one printed number; a place is outside, or within, only if its whole interval is."""
    low, high = OUTSIDE / 2.0, 1.0 - OUTSIDE / 2.0
    if all(place.ci_high < low or place.ci_low > high for place in alike):
        return AT_ODDS
    return WITHIN if any(place.ci_low >= low and place.ci_high <= high for place in alike) else TOO_FEW_STUDIES


def sections(found: FittedPercept, histograms: Sequence[Histograms], figures: Path) -> tuple[Section, ...]:
    """The page's sections; their figures are written. `histograms`: of each judged case the simulated values."""
    parts = [_fitted(found), _predictions(found, figures), _unknown(found)]
    if found.judged is not None:
        _draw_places(found.judged, histograms, figures / "places")
        parts.append(_judgement(found.judged))
    return (*parts, _origin(found))


def _fitted(found: FittedPercept) -> Section:
    rows = tuple(
        (name, UNITS[name], apa.number(one.value, 3), apa.number(one.se, 3), _limits(one))
        for name, one in found.fitted.items()
    )
    rates = tuple(
        (
            name,
            apa.percent(one.observed),
            apa.percent(one.predicted),
            f"{apa.percent(one.backward.value)} {_percents(one.backward)}",
            apa.number(found.percepts[name].log_odds, 2),
        )
        for name, one in found.rates.items()
    )
    exactly = "As many numbers as rates: that they are met is no evidence for the model." if not found.freedom else ""
    return Section(
        title="The fit",
        paragraphs=(
            f"Three numbers from {len(found.rates)} mean forward rates of {found.trials} trials each: deviance "
            f"{apa.number(found.deviance, 3)} on {found.freedom} degrees of freedom. {exactly}",
        ),
        tables=(
            Table(
                caption="Fitted numbers, with 95 % intervals from the profile likelihood",
                header=("Number", "Unit", "Estimate", "SE", "95 % CI"),
                rows=rows,
            ),
            Table(
                caption="Rates; the backward ones were not fitted, they are predictions [95 % CI of the fit]",
                header=("Method", "Forward, observed", "Forward, fit", "Backward, predicted", "Evidence (log odds)"),
                rows=rates,
            ),
        ),
    )


def _predictions(found: FittedPercept, figures: Path) -> Section:
    frictions = {name: friction for curve in found.friction for name, friction in curve.methods.items()}
    points = [_point(found, name, frictions.get(name)) for name in found.rates]
    curves = [line for curve in found.friction for line in _curves(found, curve)]
    figure_percept(curves, points, figures / "percept")
    observed = ", ".join(f"{display_name(point.name)} {apa.percent(point.rate)}" for point in points)
    return Section(
        title="Predicted over the damper's friction",
        paragraphs=(
            "A prediction, not a measurement: only the marked points were felt by anybody. The band is the fitted "
            "numbers' uncertainty alone; the thin lines are fits under other assumptions, which meet the same rates.",
        ),
        pictures=(
            Picture(
                stem="percept",
                caption=(
                    "Forward rate predicted by the fit over the damper's friction (band: 95 %), with the observed "
                    "rates (bars: Wilson's 95 % interval, trials taken as independent)"
                ),
                alt=f"Forward rate over friction. {'; '.join(map(_ends_words, curves))}. Observed: {observed}.",
            ),
        ),
    )


def _ends_words(curve: RateCurve) -> str:
    first, last = (f"{apa.percent(curve.rate[end])} at {curve.friction_N[end]:g} N" for end in (0, -1))
    return f"{curve.name}: {first}, {last}"


def _point(found: FittedPercept, name: str, friction_N: float | None) -> RatePoint:
    rate = found.rates[name].observed
    low, high = wilson_interval(round(rate * found.trials), found.trials)
    return RatePoint(name=name, friction_N=friction_N, rate=rate, low=min(low, rate), high=max(high, rate))


def _curves(found: FittedPercept, curve: FrictionCurve) -> list[RateCurve]:
    band = curve.fit
    known = all(map(math.isfinite, (*band.ci_low, *band.ci_high)))
    first = RateCurve(
        name=f"fit: {_assumed(found.assumed)}",
        friction_N=curve.friction_N,
        rate=band.value,
        low=band.ci_low if known else (),
        high=band.ci_high if known else (),
    )
    others = [
        RateCurve(name=_assumed(parameters), friction_N=curve.friction_N, rate=along)
        for parameters, along in zip(found.other_assumptions, curve.other_assumptions, strict=True)
    ]
    return [first, *others]


def _assumed(numbers: AssumedNumbers | OtherFit) -> str:
    return f"exponent {numbers.exponent:g}, leak {1000.0 * numbers.leak_s:g} ms"


def _unknown(found: FittedPercept) -> Section:
    own = tuple(apa.number(one.value, 3) for one in found.fitted.values())
    others = tuple(
        (
            _assumed(one),
            *(apa.number(value, 3) for value in (one.sensitivity, one.confusion, one.start)),
            apa.number(one.deviance, 3),
        )
        for one in found.other_assumptions
    )
    return Section(
        title="What these rates cannot tell",
        items=(
            *found.unknown,
            NO_OWN_TIMES,
            "Each number is left open (below) from 0, if the rates fix it alone, to 1, if they do not bear on it: its "
            "part in the directions in which the rates have no information.",
        ),
        tables=(
            Table(
                caption="The same rates under other assumptions",
                header=("Assumed", *found.fitted, "Deviance"),
                rows=((_assumed(found.assumed), *own, apa.number(found.deviance, 3)), *others),
            ),
            Table(
                caption="How far each is left open",
                header=("Number", "Left open"),
                rows=tuple((name, apa.number(value, 2)) for name, value in found.untold.items()),
            ),
        ),
    )


def _judgement(judged: Judgement) -> Section:
    main = judged.main_case
    return Section(
        title="Judged by what was not fitted",
        paragraphs=(
            f"{judged.studies:,} studies at the paper's design were simulated from the fit, with seed {judged.seed}, "
            "for people alike, for an assumed spread of people and twice it (the percept fitted anew for each, so that "
            "the mean forward rates are the published ones), and with the fit's own error drawn anew for each study. "
            "A percentile is the share of the studies below the published number plus half of those that print alike; "
            "near 0 or 100 the model would be at odds with the paper.",
            f"{main.name.capitalize()}: "
            + "; ".join(_place_sentence(place) for place in main.places if not place.fitted)
            + ".",
            verdict_sentence(main),
        ),
        pictures=(
            Picture(
                stem="places",
                caption="Simulated distributions of what was not fitted; black: the published numbers",
                alt="Distributions of F and of the correct backward answers, with the published numbers as lines",
            ),
        ),
        tables=(_places_table(judged.cases), _claims_table(judged.cases), _cases_table(judged.cases)),
    )


def _draw_places(judged: Judgement, histograms: Sequence[Histograms], path_stem: Path) -> None:
    places = [place for place in judged.cases[0].places if not place.fitted and "binomial p" not in place.quantity]
    spreads = []
    for quantity in dict.fromkeys(place.quantity for place in places):
        title, _, label = quantity.partition(": ")
        texts = [place.published.split(",")[0] for place in places if place.quantity == quantity]
        cases = {one.name: of_case[quantity] for one, of_case in zip(judged.cases, histograms, strict=True)}
        spreads.append(
            SimulatedSpread(
                title=title, x_label=label or "F", cases=cases, published={f" {text}": float(text) for text in texts}
            )
        )
    figure_places(spreads, path_stem)


def _places_table(cases: Sequence[Judged]) -> Table:
    each = zip(*(case.places for case in cases), strict=True)
    return Table(
        caption="Percentile of each published number among the simulated ones [95 % Monte Carlo interval]",
        header=("Published", *(case.name for case in cases)),
        rows=tuple(_share_row(f"{alike[0].quantity} = {alike[0].published}", alike) for alike in each),
    )


def _claims_table(cases: Sequence[Judged]) -> Table:
    each = zip(*(case.claims for case in cases), strict=True)
    return Table(
        caption="Share of the studies in which a published claim holds, % [95 % Monte Carlo interval]",
        header=("Published claim", *(case.name for case in cases)),
        rows=tuple(_share_row(alike[0].claim, alike) for alike in each),
    )


def _share_row(name: str, alike: Sequence[PublishedPlace | RecurringClaim]) -> tuple[str, ...]:
    """What is said of one published number or claim, in each case, in percent."""
    shares = [one.percentile if isinstance(one, PublishedPlace) else one.share for one in alike]
    cells = [f"{apa.number(100.0 * share, 1)} {_percents(one)}" for share, one in zip(shares, alike, strict=True)]
    return (f"{name} (fitted)" if alike[0].fitted else name, *cells)


def _cases_table(cases: Sequence[Judged]) -> Table:
    rows = tuple(
        (
            case.name,
            spread_sentence(case.people),
            *(apa.number(getattr(case.parameters, name), 3) for name in UNITS),
        )
        for case in cases
    )
    return Table(caption="The people of each case, and their fit", header=("Case", "People", *UNITS), rows=rows)


def _origin(found: FittedPercept) -> Section:
    return Section(title="What this rests on", items=found.assumptions, tables=(origin_table(found.provenance),))
