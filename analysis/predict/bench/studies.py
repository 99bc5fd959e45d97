"""Error against trials, of procedures, and against people, of tests; and which post-hoc tests keep what they claim."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from analysis.paper.recurrence import ShareOfStudies
from analysis.predict.bench.figure import Demand, TradeCurve, TradePanel
from analysis.predict.bench.measured import BenchRequest, Bought, Measured
from analysis.predict.power.grid import PowerRequest
from analysis.predict.power.planned import ALL_PAIRS, ANOVA, ANY_PAIR
from analysis.predict.power.results import DesignPower, Power
from analysis.predict.power.run import simulated_power
from analysis.predict.threshold_plan.page import procedure_table
from analysis.predict.threshold_plan.run import (
    ProcedurePower,
    ThresholdPower,
    ThresholdRequest,
    people_fitted,
    threshold_power,
)
from analysis.report import apa
from analysis.report.section import Section, Table
from analysis.stats import operating
from experiments.design.methods_section import factor_words

_THRESHOLD_DESIGN, _TRIALS = "threshold", "10,20,40,80"
_STUDY_DESIGN, _PEOPLE, _EFFECT = "direction", "4,6,8,10,14,20,28,40", 0.5
"""Published effects are rather too large than too small, so half of them is what tests are to find."""
_TARGET = 0.8


def procedure_errors(request: BenchRequest) -> Measured:
    """What synthetic people's thresholds are off by, by procedure and trials."""
    plan = ThresholdRequest(config=_THRESHOLD_DESIGN, trials=_TRIALS, people=request.people, seed=request.seed)
    with request.progress("bench procedures", people_fitted(plan)) as tell:
        found = threshold_power(plan, tell)
    text = (
        f"The design is `{_THRESHOLD_DESIGN}`, with {found.people} synthetic people a procedure. The error is the "
        "root of the mean squared one. `recoil power` shows the same of a design of yours."
    )
    return Measured(
        rows=found.procedures,
        section=Section(
            title="Error against trials of a procedure", paragraphs=(text,), tables=(procedure_table(found),)
        ),
        bought=tuple(_trials_bought(found)),
        panel=_procedure_panel(found),
    )


def _trials_bought(found: ThresholdPower) -> Iterator[Bought]:
    """What a trial more buys with the procedure that is best in the end, step by step."""
    best = _curve_of(found, list(found.best.values())[-1])
    for less, more in pairwise(best):
        trials = more.trials - less.trials
        yield Bought(
            more="trial",
            where=f"{more.procedure}, from {less.trials} to {more.trials} trials",
            costs=f"{60.0 * (more.minutes - less.minutes) / trials:.0f} s in the lab",
            buys=(
                f"{(less.rms_error - more.rms_error) / trials:.2g} less error, {factor_words(found.factor)}: "
                f"{more.rms_error:.2g} after the last"
            ),
        )


def _curve_of(found: ThresholdPower, procedure: str) -> list[ProcedurePower]:
    return [one for one in found.procedures if one.procedure == procedure]


def _procedure_panel(found: ThresholdPower) -> TradePanel:
    names = list(dict.fromkeys(one.procedure for one in found.procedures))
    curves = [(name, _curve_of(found, name)) for name in names]
    return TradePanel(
        title="a threshold's procedure",
        x_label="trials",
        y_label=f"error of the threshold, {factor_words(found.factor)}",
        curves=[
            TradeCurve(name=name, place=place, x=[one.trials for one in own], y=[one.rms_error for one in own])
            for place, (name, own) in enumerate(curves)
        ],
        scales=("log", "linear"),
        ticks=[one.trials for one in curves[0][1]],
    )


def missed_by_tests(request: BenchRequest) -> Measured:
    """How often the tests of a study miss what is there, by the number of people."""
    with request.progress("bench tests", 1) as tell:
        found = simulated_power(
            PowerRequest(
                config=_STUDY_DESIGN,
                participants=_PEOPLE,
                effects=f"{_EFFECT}",
                studies=request.studies,
                target=_TARGET,
                seed=request.seed,
            )
        )
        tell("studies")
    claims = _claims(found)
    table = Table(
        caption=f"Shares of {found.studies:,} simulated studies that miss what is there",
        header=("People", "Hours in the lab", *claims),
        rows=tuple(
            (
                str(one.participants),
                f"{one.lab_hours:g}",
                *(apa.percent(1.0 - _share(one, claim).share) for claim in claims),
            )
            for one in found.designs
        ),
    )
    text = (
        f"The design is `{_STUDY_DESIGN}`; its people feel {_EFFECT:g} of the published effect, as published effects "
        "are rather too large than too small. `recoil power` shows the same of a design and an effect of yours."
    )
    return Measured(
        rows=found.designs,
        section=Section(title="Misses of the tests against people", paragraphs=(text,), tables=(table,)),
        bought=tuple(_people_bought(found)),
        panel=_test_panel(found),
    )


def _claims(found: Power) -> list[str]:
    """The tests of differences between methods."""
    pairs = [one.claim for one in found.designs[0].claims if one.claim.startswith("Tukey, ")]
    return [ANOVA, *(claim for claim in pairs if claim not in (ANY_PAIR, ALL_PAIRS)), ALL_PAIRS]


def _share(design: DesignPower, claim: str) -> ShareOfStudies:
    return next(share for share in design.claims if share.claim == claim)


def _people_bought(found: Power) -> Iterator[Bought]:
    """Of each test: the step in which it comes to find what is there often enough, if one does."""
    for claim in _claims(found):
        for less, more in pairwise(found.designs):
            before, after = _share(less, claim).share, _share(more, claim).share
            if before < _TARGET <= after:
                people = more.participants - less.participants
                yield Bought(
                    more="person",
                    where=f"{claim}, from {less.participants} to {more.participants} people",
                    costs=f"{(more.lab_hours - less.lab_hours) / people:g} h in the lab",
                    buys=(
                        f"{100.0 * (after - before) / people:.1f} of 100 studies fewer that miss it: "
                        f"{100.0 * (1.0 - after):.0f} after the last"
                    ),
                )


def _test_panel(found: Power) -> TradePanel:
    people = [one.participants for one in found.designs]
    return TradePanel(
        title="a study's people",
        x_label="people",
        y_label="studies that miss what is there [%]",
        curves=[
            TradeCurve(
                name=claim,
                place=place,
                x=people,
                y=[100.0 * (1.0 - _share(one, claim).share) for one in found.designs],
            )
            for place, claim in enumerate(_claims(found))
        ],
        demands=[Demand(name=f"a power of {_TARGET:g}", height=100.0 * (1.0 - _TARGET))],
        scales=("log", "linear"),
        ticks=people,
    )


def post_hocs(request: BenchRequest) -> Measured:
    """Error rates and power of the post-hoc tests at three departures from sphericity."""
    with request.progress("bench post-hocs", 1) as tell:
        rows = operating.characteristics(request.seed)
        tell("data sets")
    table = Table(
        caption=(
            f"Shares of {rows[0].data_sets} simulated data sets of {operating.STUDY_SIZE} participants by three "
            f"conditions (standard error at most {max(_errors(rows)):.4f}), at the nominal level {operating.ALPHA}"
        ),
        header=(
            "Post-hoc test",
            "Epsilon",
            "Claimed at most",
            "Any false finding, no difference",
            "Any false finding beside a true difference",
            "Power: any true difference found",
        ),
        rows=tuple(_post_hoc_cells(row) for row in rows),
    )
    section = Section(
        title="Post-hoc tests within participants",
        paragraphs=(
            "The first two conditions have equal means; the third differs by "
            f"{operating.SHIFT:g} standard deviations of a difference, or not at all. Epsilon is Box's, of the "
            "population: 1 is sphericity, 0.5 the least with three conditions. The pooled error claims its level at "
            "sphericity alone; Holm's paired t-tests keep it everywhere; Tukey's test with paired errors stays near "
            "it. Tukey's test between participants takes what sets people apart for noise: the nearer such data are to "
            "sphericity, the less it finds.",
        ),
        tables=(table,),
    )
    return Measured(rows=rows, section=section)


def _errors(rows: tuple[operating.Characteristics, ...]) -> list[float]:
    return [row.monte_carlo_error(share) for row in rows for share in (row.null_error, row.partial_error, row.power)]


def _post_hoc_cells(row: operating.Characteristics) -> tuple[str, ...]:
    claimed = apa.NO_NUMBER if row.claimed is None else apa.number(row.claimed)
    shares = (apa.number(share, 4) for share in (row.null_error, row.partial_error, row.power))
    return (row.post_hoc, apa.number(row.epsilon, 3), claimed, *shares)
