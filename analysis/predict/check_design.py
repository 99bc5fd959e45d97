"""What a design means, without running it: Methods section, cells, orders, duration, exposure, what is assumed."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, partial
from typing import Any

from analysis.predict.drawn import RatingStudies, studies_of
from analysis.predict.exposure import Exposure, exposure
from analysis.report.section import Section, Table
from analysis.report.serial import OPTIONAL, written
from device.limits import MAX_COIL_C, MAX_DUTY, MAX_SHOTS_PER_MINUTE
from device.messages import how_many
from device.methods import Method
from device.words import MAX_PULSE_S, MAX_VOLTAGE_V, Pulse
from experiments.catalogues.catalogue import language
from experiments.config.door import ConfigError, at_key
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.language import DRIVEN, INTERVAL_NAMES, NO, shown_level
from experiments.design.limits import ConditionLimits, limits
from experiments.design.methods_section import methods_section
from experiments.design.plan import Condition, Plan
from experiments.design.planned import (
    PlannedRun,
    levels_text,
    planned_run,
    plans_of_groups,
    runs_of_groups,
    trial_text,
    warnings,
)
from experiments.design.planning import groups, plan_of, practice_of, square_size
from experiments.design.procedures.config import PairingConfig
from experiments.design.stimuli import settings, stimulus
from experiments.load import language_key
from experiments.study.preregistration import FreezeStatus
from experiments.synthetic.answers import synthetic_participant_of
from experiments.synthetic.laws import DiffusionLaw, SyntheticAnswers, far_thresholds, superfluous
from experiments.synthetic.model_based import NEUTRAL, rates_by_instruction
from experiments.tasks.questions import mistaken_keys

_MOST_CELLS = 40
"""So many cells are listed."""
_EXPECTED_EVEN = 5
"""Of fewer participants nobody expects first positions to be even."""


AS_FROZEN: Mapping[str, Any] = OPTIONAL | written(FreezeStatus.record, "preregistration")
"""Metadata of how a config stands beside its preregistration, which is left out where there is none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CellCheck:
    """What a shot of a cell asks of the gun, and of hands."""

    levels: dict[str, str | float]
    settings: dict[str, str]
    status: str
    settle_s: float
    voltage_V: float | None = field(default=None, metadata=OPTIONAL)
    pulse_s: float | None = field(default=None, metadata=OPTIONAL)
    effect: int | None = field(default=None, metadata=OPTIONAL)
    peak_force_N: float | None = field(default=None, metadata=OPTIONAL)


@dataclass(frozen=True, slots=True, kw_only=True)
class DesignCheck:
    """What a design means for some participants. `orders`: what each meets, session by session, or first trials.

    `felt_forward_rates`: of synthetic participants who decide on what the gun does, by method and instruction.
    """

    experiment: str
    title: str
    text: tuple[str, ...]
    trials: int
    duration_s: float
    least_trials: int
    least_duration_s: float
    break_s: float
    stated_duration_s: float
    seed: int
    orders: dict[str, tuple[str, ...]]
    gun: str
    cells: tuple[CellCheck, ...]
    exposure: Exposure
    felt_forward_rates: dict[str, dict[str, float]]
    warnings: tuple[str, ...]
    assumed: tuple[str, ...]
    frozen: FreezeStatus | None = field(default=None, metadata=AS_FROZEN)


def check_design(setup: Setup[DesignConfig], seed: int, codes: Sequence[str]) -> DesignCheck:
    """What a design means. `ConfigError` names what is wrong with it."""
    design = setup.config
    plans = dict(zip(codes, _plans(design, seed, codes), strict=True))
    first = next(iter(plans.values()))
    planned = planned_run(design, first, setup.gun)
    cells, shaken = limits(design, setup.gun), exposure(_shots(setup, first))
    return DesignCheck(
        experiment=design.design,
        title=design.title,
        text=methods_section(design, runs_of_groups(design, setup.gun), setup.gun.labels),
        trials=planned.trials,
        duration_s=planned.duration_s,
        least_trials=planned.least_trials,
        least_duration_s=planned.least_duration_s,
        break_s=planned.break_s,
        stated_duration_s=design.timing.planned_s,
        seed=seed,
        orders={code: _order(design, plan) for code, plan in plans.items()},
        gun=setup.gun.title,
        cells=tuple(_cell(setup, one) for one in cells),
        exposure=shaken,
        felt_forward_rates=_felt(setup, first),
        warnings=(
            *_warnings(design, planned, [*plans.values()], cells, shaken),
            *_without_catalogue(setup),
            *_of_people(setup),
        ),
        assumed=(
            *design.assumed,
            *(f"{design.synthetic}: {key}" for key in getattr(setup.laws, "assumed", ())),
            *(f"{design.gun}: {key}" for key in setup.gun.assumed),
        ),
    )


def _without_catalogue(setup: Setup[DesignConfig]) -> Iterator[str]:
    """That no catalogue has the design's language; a lab's own, which a run can be given, is not known here."""
    try:
        language(setup.config.language, asked=language_key(setup))
    except ConfigError as error:
        yield str(error)


def _of_people(setup: Setup[DesignConfig]) -> Iterator[str]:
    """What the file of the synthetic people says of nothing that there is, or far from it, with its line."""
    if isinstance(setup.laws, SyntheticAnswers):
        people, design = setup.source.parent / str(setup.config.synthetic), setup.config
        practised = range(len(groups(design))) if design.practice.repetitions else ()
        plans = (*plans_of_groups(design), *(practice_of(design, "P", 0, group=group) for group in practised))
        found = (*superfluous(design, setup.laws, plans), *far_thresholds(design, setup.laws))
        yield from (at_key(people, one) for one in found)


def _felt(setup: Setup[DesignConfig], plan: Plan) -> dict[str, dict[str, float]]:
    """The forward rates that people who feel the gun will have. `ConfigError`: laws or numbers that make nobody."""
    if setup.laws is None:
        return {}
    synthetic_participant_of(setup, plan)
    try:
        studies = studies_of(setup)
    except ConfigError:
        return {}
    if isinstance(studies, RatingStudies) or not isinstance(studies.law, DiffusionLaw):
        return {}
    from analysis.predict.synthetic_studies import percepts_of_methods  # noqa: PLC0415 - of use for such laws alone

    mind, told = studies.law.own, studies.instructions or (NEUTRAL,)
    return {
        method: {name: rate for name, rate in rates_by_instruction(mind, percept).items() if name in told}
        for method, percept in percepts_of_methods(setup.gun, studies.methods, studies.law).items()
    }


def _plans(design: DesignConfig, seed: int, codes: Sequence[str]) -> Iterator[Plan]:
    """The plans of people who come in this order: groups and rows of the square are filled in turn."""
    rows, kinds = square_size(design), len(groups(design))
    for number, code in enumerate(codes):
        yield plan_of(design, code, seed, row=number // kinds % rows if rows else None, group=number % kinds)


def _order(design: DesignConfig, plan: Plan) -> tuple[str, ...]:
    """What is constant in each session, with the group; of one session the trials."""
    sessions = {trial.session: trial for trial in reversed(plan.trials)}
    blocked = [*design.between, *design.order.session]
    if len(sessions) > 1:
        return tuple(levels_text(sessions[number], blocked) for number in sorted(sessions))
    return (
        *((levels_text(plan.trials[0], blocked),) if blocked else ()),
        *(trial_text(design, one) for one in plan.trials[:_TRIALS_SHOWN]),
    )


def _cell(setup: Setup[DesignConfig], one: ConditionLimits) -> CellCheck:
    drive = one.drive
    return CellCheck(
        levels=dict(one.levels),
        settings=dict(settings(setup.config, setup.gun, one.levels)),
        status=one.status,
        settle_s=one.settle_s,
        voltage_V=drive.voltage_V if isinstance(drive, Pulse) else None,
        pulse_s=drive.pulse_s if isinstance(drive, Pulse) else None,
        effect=None if isinstance(drive, Pulse) else drive.effect,
        peak_force_N=one.peak_force_N,
    )


def _shots(setup: Setup[DesignConfig], plan: Plan) -> list[tuple[Method, int]]:
    """Every shot that a participant may feel in a run, by what it is."""
    design = setup.config
    each = design.trial.max_shots if design.trial.kind == "train" else 1
    felt = Counter[Method]()
    strongest = cache(partial(_strongest, setup))
    for planned in plan.trials:
        trial = planned.with_chosen(strongest(planned.levels)) if planned.track else planned
        for place in range(max(1, len(trial.intervals))):
            if (levels := trial.levels_at(place)) is not None:
                felt[stimulus(design, setup.gun, levels).parameters] += each
    return [*felt.items()]


def _strongest(setup: Setup[DesignConfig], levels: Condition) -> Condition:
    """What a procedure could choose beside some levels that shakes most: the highest numbers; of items two."""
    design = setup.config
    if not isinstance(design.procedure, PairingConfig):
        return design.last_choice
    (name,) = design.adapted
    shaken = {
        level: exposure([(stimulus(design, setup.gun, (*levels, (name, level))).parameters, 1)]).a8_m_s2
        for level in design.factors[name].all_levels
    }
    return tuple(zip(design.chosen_names, sorted(shaken, key=shaken.__getitem__, reverse=True), strict=False))


def _warnings(
    design: DesignConfig, planned: PlannedRun, plans: Sequence[Plan], cells: Sequence[ConditionLimits], shaken: Exposure
) -> Iterator[str]:
    yield from warnings(design, planned)
    yield from _key_warnings(design)
    yield from _score_warnings(design)
    yield from _pair_warnings(design)
    if shaken.a8_m_s2 > shaken.action_m_s2:
        yield (
            f"the vibration of {shaken.a8_m_s2:.2f} m/s² A(8) exceeds the action value of {shaken.action_m_s2:g} of "
            "2002/44/EC, if people take as much of it as the design lets them: shoot less often or fewer"
        )
    slowest_s = max(one.settle_s for one in cells)
    if design.trial.intervals > 1 and not planned.hands_within and design.trial.gap_s < slowest_s:
        yield f"trial.gap_s = {design.trial.gap_s:g} s: it will be longer, as the gun needs {slowest_s:.3g} s"
    if len(plans) >= _EXPECTED_EVEN and design.order.session and design.order.sessions == "random":
        firsts = Counter(levels_text(plan.trials[0], design.order.session) for plan in plans)
        most, least = max(firsts.values()), min(firsts.values()) if len(firsts) > 1 else 0
        if most - least > 1:
            said = ", ".join(f"{name} {count}" for name, count in sorted(firsts.items()))
            yield (
                f"chance leaves the first session uneven over {len(plans)} participants ({said}); "
                'order.sessions = "latin-square" or "williams" balances it'
            )


def _key_warnings(design: DesignConfig) -> Iterator[str]:
    """Keys of the experimenter's that could be pressed for another answer, which would be stored without a word."""
    for name, question in design.questions.items():
        for heard, pressed in mistaken_keys(question):
            key = pressed.key.upper()
            yield (
                f"questions.{name}: {key} is the key of “{pressed.label}”, and “{heard.label}” has a word with {key} "
                "as well: whoever hears it may press the wrong key; label them with words that begin otherwise"
            )


def _score_warnings(design: DesignConfig) -> Iterator[str]:
    """What is scored otherwise than most who write it so mean, which shows when all data are there."""
    trial = design.trial
    levels, standard = design.factors[trial.compare].all_levels if trial.compare else (), trial.standard
    below = [level for level in levels if isinstance(level, float) and isinstance(standard, float) and level < standard]
    for name, question in design.questions.items():
        if question.correct == "interval" and trial.kind == "two-interval" and 0 < len(below) < len(levels):
            yield (
                f"questions.{name}.correct = 'interval': right is the interval of the comparison, also where it is "
                f"below the standard of {shown_level(standard or 0.0)}; if the larger one is asked for, say larger"
            )
        for factor in DRIVEN if question.correct == "stimulus" else ():
            if factor in design.factors and 0.0 in design.factors[factor].all_levels:
                yield (
                    f"factors.{factor}: its level 0 is no shot, and “{question.label(NO)}” is wrong there all the "
                    "same; take it out: trial.catch has the trials without a stimulus"
                )


def _pair_warnings(design: DesignConfig) -> Iterator[str]:
    """What the answers about a pair are counted as, where their names do not say it."""
    for name, question in design.questions.items() if design.trial.kind == "pair" else ():
        if question.answers and question.answers[:2] != INTERVAL_NAMES[:2]:
            one, other, *more = map(question.label, question.answers)
            tie = f", and “{'” or “'.join(more)}” as a tie" if more else ""
            yield (
                f"questions.{name}.answers: of a pair “{one}” counts as a choice of the first interval, “{other}” of "
                f"the second{tie}; if that is meant, call them first and second"
            )


def design_sections(found: DesignCheck) -> tuple[Section, ...]:
    """What a design means, for a person."""
    minutes, stated = found.duration_s / 60, found.stated_duration_s / 60
    a8 = found.exposure
    duration = f"{how_many(found.trials, 'trial')}, {minutes:.1f} min planned"
    if found.least_trials < found.trials:
        least = f"{how_many(found.least_trials, 'trial')}, {found.least_duration_s / 60:.1f} min at the least"
        duration = f"{least}; {how_many(found.trials, 'trial')}, {minutes:.1f} min at the most"
    duration += f" ({stated:.3g} min stated), of which breaks {found.break_s:g} s"
    orders = (
        f"Orders    of sessions, or of the first {_TRIALS_SHOWN} trials where there is one session, as drawn with seed "
        f"{found.seed}; a run without a seed draws its own"
    )
    shaken = (
        f"Exposure  of the hand to vibration: {a8.a8_m_s2:.2f} m/s² A(8) in this run at the most, beside the action "
        f"value of {a8.action_m_s2:g} and the limit of {a8.limit_m_s2:g} m/s² of 2002/44/EC; assumed: {a8.assumed}"
    )
    return (
        Section(title=f"{found.title} ({found.experiment})", paragraphs=found.text),
        Section(
            title="Plan",
            items=(
                f"Duration  {duration}",
                orders,
                *(f"  {code:10} {' > '.join(order)}" for code, order in found.orders.items()),
                shaken,
                *(f"Warning   {one}" for one in found.warnings),
            ),
        ),
        Section(title=f"Gun: {found.gun}", items=(_LIMITS,), tables=(_cells(found.cells),)),
        *_felt_section(found.felt_forward_rates),
        *((Section(title="Assumed", items=found.assumed),) if found.assumed else ()),
    )


def _felt_section(rates: Mapping[str, Mapping[str, float]]) -> Iterator[Section]:
    if rates:
        lines = (
            f"{method:14} {', '.join(f'{100 * rate:.1f} % ({name})' for name, rate in told.items())}"
            for method, told in rates.items()
        )
        yield Section(
            title="Felt: right answers to forward shots, of synthetic participants (by the model)", items=tuple(lines)
        )


def _cells(cells: Sequence[CellCheck]) -> Table:
    names, by_hand = list(dict.fromkeys(name for cell in cells for name in cell.levels)), any(c.settings for c in cells)
    rows = tuple(
        (
            *(shown_level(cell.levels[name]) if name in cell.levels else "" for name in names),
            *((", ".join(f"{name} {how}" for name, how in cell.settings.items()),) if by_hand else ()),
            _drive(cell),
            "" if cell.peak_force_N is None else f"{cell.peak_force_N:.1f} N",
            f"{1000 * cell.settle_s:.0f} ms",
            cell.status,
        )
        for cell in cells
    )
    header = (*names, *(("Set by hand",) if by_hand else ()), "Drive", "Peak force", "Next after", "By the model")
    if len(rows) <= _MOST_CELLS:
        return Table(caption="Cells", header=header, rows=rows)
    ends = _MOST_CELLS // 2
    between = (f"… {len(rows) - 2 * ends} more …", *[""] * (len(header) - 1))
    caption = f"Cells ({2 * ends} of {len(cells)}: the first and the last)"
    return Table(caption=caption, header=header, rows=(*rows[:ends], between, *rows[-ends:]))


_TRIALS_SHOWN = 6
_LIMITS = (
    f"Limits that no config can lift: {MAX_VOLTAGE_V:g} V, pulse {1000 * MAX_PULSE_S:g} ms, duty {100 * MAX_DUTY:g} % "
    f"over any second, {MAX_SHOTS_PER_MINUTE:g} shots a minute, coil {MAX_COIL_C:g} °C"
)


def _drive(cell: CellCheck) -> str:
    if cell.voltage_V is None or cell.pulse_s is None:
        return f"effect {cell.effect}"
    return f"{cell.voltage_V:g} V, {1000 * cell.pulse_s:g} ms"
