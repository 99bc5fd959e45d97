"""What a plan asks of a participant and of the experimenter: how long it takes, rests, and what hands change. Pure."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from experiments.config.door import ConfigError
from experiments.config.setup import GunConfig
from experiments.design.config import DesignConfig
from experiments.design.language import DIRECTION_FACTOR, shown_level
from experiments.design.plan import CHOSEN, Condition, Plan, Trial
from experiments.design.planning import groups, plan_of
from experiments.design.procedures.config import least_of_track
from experiments.design.stimuli import by_hand, settings
from experiments.design.track_planning import own_tracks_words


@dataclass(frozen=True, slots=True, kw_only=True)
class PlannedRun:
    """One run as planned: `break_s` of `duration_s` are rests; `hand_changes` is how often hands set something anew.

    `session_trials`: how many trials each session has. `least_trials` and `least_duration_s` are those where every
    track of a procedure is as short as it can be, the others where it is as long. `hands_within`: how often hands have
    something to set or to turn between the intervals of a trial.
    """

    sessions: int
    sets: int
    trials: int
    session_trials: tuple[int, ...]
    break_s: float
    duration_s: float
    trials_without_break: int
    hand_changes: int
    hands_within: int
    least_trials: int
    least_duration_s: float


def planned_run(design: DesignConfig, plan: Plan, gun: GunConfig | None = None) -> PlannedRun:
    """What a plan comes to. `ConfigError`: it is more than the design lets a participant be asked for.

    Which methods have dampers that hands set, the `gun` knows.
    """
    found = workload(design, plan, gun)
    _check_fatigue(design, found)
    return found


def workload(design: DesignConfig, plan: Plan, gun: GunConfig | None = None) -> PlannedRun:
    """What a plan comes to, whether or not the design allows it."""
    trials = plan.trials
    rests_s = [_rest_s(design, before, trial) for before, trial in pairwise(trials)]
    shortest = _shortest(design, trials)
    return PlannedRun(
        sessions=len({trial.session for trial in trials}),
        sets=len({(trial.session, trial.set) for trial in trials}),
        trials=len(trials),
        session_trials=tuple(Counter(trial.session for trial in trials).values()),
        break_s=sum(rests_s),
        duration_s=_duration_s(design, trials, gun),
        trials_without_break=max(_stretches(rests_s)),
        hand_changes=sum(_by_hand(design, gun, one) != _by_hand(design, gun, other) for one, other in pairwise(trials)),
        hands_within=sum(_hands_within(design, gun, trial) for trial in trials),
        least_trials=len(shortest),
        least_duration_s=_duration_s(design, shortest, gun),
    )


def _duration_s(design: DesignConfig, trials: Sequence[Trial], gun: GunConfig | None) -> float:
    """How long some trials take, with the rests between them."""
    timing = design.timing
    rests_s = sum(_rest_s(design, before, trial) for before, trial in pairwise(trials))
    trial_s = timing.hand_over_s + timing.stimulus_s + timing.answer_s
    within = sum(_hands_within(design, gun, trial) for trial in trials)
    return timing.opening_s + len(trials) * trial_s + within * timing.hand_over_s + rests_s


def _shortest(design: DesignConfig, trials: Sequence[Trial]) -> list[Trial]:
    """The trials that there are where every track ends as early as it can."""
    if design.adaptive is None:
        return list(trials)
    least, taken = least_of_track(design.adaptive), Counter[int]()
    kept = []
    for trial in trials:
        taken[trial.track] += 1
        if not trial.track or taken[trial.track] <= least:
            kept.append(trial)
    return kept


def plans_of_groups(design: DesignConfig) -> list[Plan]:
    """A plan of someone in each group: all that is ever met. `ConfigError` as `plan_of`."""
    return [plan_of(design, "P01", 0, group=group) for group in range(len(groups(design)))]


def runs_of_groups(design: DesignConfig, gun: GunConfig | None = None) -> list[PlannedRun]:
    """What is asked of someone in each group."""
    return [workload(design, plan, gun) for plan in plans_of_groups(design)]


def _rest_s(design: DesignConfig, before: Trial, trial: Trial) -> float:
    """How long the rest is that lies between two trials."""
    if before.session != trial.session:
        return design.breaks.between_sessions_s
    return design.breaks.between_sets_s if before.set != trial.set else 0.0


def _stretches(rests_s: list[float]) -> Iterator[int]:
    """How many trials there are from one rest to the next."""
    length = 1
    for rest_s in rests_s:
        if rest_s > 0:
            yield length
            length = 0
        length += 1
    yield length


def _by_hand(design: DesignConfig, gun: GunConfig | None, trial: Trial) -> object:
    """What hands set for a trial: the factors that are theirs, and the method's damper."""
    if gun is not None:
        return settings(design, gun, trial.levels_at(0) or trial.levels)
    return tuple(trial.level(name) for name in by_hand(design))


def _hands_within(design: DesignConfig, gun: GunConfig | None, trial: Trial) -> int:
    """How often hands do something else from one interval of a trial to the next."""
    held = [levels for place in range(len(trial.intervals)) if (levels := trial.levels_at(place)) is not None]
    hands = by_hand(design)
    done = [
        (dict(levels).get(DIRECTION_FACTOR), settings(design, gun, levels) if gun else _of(levels, hands))
        for levels in held
    ]
    return sum(one != other for one, other in pairwise(done))


def _of(levels: Condition, names: Sequence[str]) -> Condition:
    return tuple(pair for pair in levels if pair[0] in names)


def _check_fatigue(design: DesignConfig, found: PlannedRun) -> None:
    fatigue = design.fatigue
    if found.trials_without_break > fatigue.max_trials_without_break:
        raise ConfigError(
            f"{found.trials_without_break} trials without a break exceed fatigue.max_trials_without_break = "
            f"{fatigue.max_trials_without_break}; make sets smaller, or breaks.between_sets_s longer than 0"
            f"{own_tracks_words(design)}"
        )
    if found.duration_s > fatigue.max_planned_s:
        raise ConfigError(
            f"the planned duration of {found.duration_s:g} s exceeds fatigue.max_planned_s = "
            f"{fatigue.max_planned_s:g} s; plan fewer or shorter trials and breaks{own_tracks_words(design)}"
        )


_MOST_SHOWN = 6
"""So many trials of one session are shown one by one."""


def order_shown(design: DesignConfig, plan: Plan) -> tuple[str, ...]:
    """What is constant in each session in its order, with the group; of one short session the trials."""
    first = {trial.session: trial for trial in reversed(plan.trials)}
    if len(first) > 1:
        found = [levels_text(first[number], design.order.session) for number in sorted(first)]
    elif len(plan.trials) <= _MOST_SHOWN:
        found = [trial_text(design, trial) for trial in plan.trials]
    else:
        found = []
    group = levels_text(plan.trials[0], design.between)
    if not group:
        return tuple(found)
    return (f"{group}: {found[0]}", *found[1:]) if found else (group,)


def levels_text(trial: Trial, names: Sequence[str]) -> str:
    """A trial's levels of some factors, as orders are shown."""
    return " ".join(shown_level(level) for name, level in trial.levels if name in names)


def trial_text(design: DesignConfig, trial: Trial) -> str:
    """What a trial is, as orders are shown: what varies, and what is compared."""
    if trial.catch:
        return "catch"
    varied = [name for name in design.varying if len(design.factors[name].all_levels) > 1 and name != trial.compare]
    track = f"track {trial.track}" if trial.track else ""
    held = "pair" if set(trial.intervals) == {CHOSEN} else " – ".join(map(shown_level, trial.intervals))
    return " ".join(filter(None, (track, levels_text(trial, varied), held))) or "shot"


_MUCH = 1.5
"""A stated duration may be so many times the planned one before it is most likely a slip (assumed)."""


def warnings(design: DesignConfig, found: PlannedRun) -> Iterator[str]:
    """What is allowed and most likely not meant."""
    if found.duration_s > design.timing.planned_s:
        most = "up to " if found.least_trials < found.trials else ""
        yield (
            f"the plan takes {most}{found.duration_s:g} s, longer than timing.planned_s = "
            f"{design.timing.planned_s:g} s, which is what participants are told"
        )
    if design.timing.planned_s > _MUCH * found.duration_s:
        yield (
            f"timing.planned_s = {design.timing.planned_s:g} s, which is what participants are told, is more than "
            f"{_MUCH:g} times the {found.duration_s:g} s that the plan takes"
        )
    if found.trials > 1 and found.hand_changes > found.trials // 2:
        varied = [
            name for name in by_hand(design) if name in design.varying and len(design.factors[name].all_levels) > 1
        ]
        what = ", ".join(varied) or "method"
        yield (
            f"hands set something anew {found.hand_changes} times in {found.trials} trials ({what}); name the factor "
            "in order.session to set it once a session"
        )
