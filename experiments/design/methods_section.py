"""A design as the Methods section of a paper says it: what varied, in which order, and what was asked. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType

from experiments.design.config import DesignConfig
from experiments.design.language import (
    EMPTY,
    INSTRUCTION_FACTOR,
    METHOD_FACTOR,
    BlockOrder,
    FactorConfig,
    Level,
    QuestionConfig,
    TrialConfig,
    shown_level,
)
from experiments.design.planned import PlannedRun
from experiments.design.procedures.config import AdaptiveConfig, PairingConfig, least_of_track
from experiments.design.procedures.in_words import end_words, pairing_words, rule_words
from experiments.design.stimuli import by_hand
from experiments.design.units import parted, written_unit


def methods_section(
    design: DesignConfig, runs: Sequence[PlannedRun], gun_labels: Mapping[str, str] = MappingProxyType({})
) -> tuple[str, ...]:
    """The paragraphs: what varied, in which order, what a trial was, what was asked, practice, how long it took.

    `runs`: what is planned for a participant of each group, which nested factors make differ. `gun_labels`: what the
    gun calls its methods, which are called so unless the design has labels of its own.
    """
    design = _labelled(design, gun_labels)
    return (
        " ".join(_factors(design)),
        " ".join(_order(design, runs)),
        " ".join(_trial(design, runs[0])),
        " ".join(_questions(design)),
        " ".join(_rests(design, runs)),
    )


def _labelled(design: DesignConfig, gun_labels: Mapping[str, str]) -> DesignConfig:
    """The design with what the gun calls its methods beside its own labels."""
    method = design.factors[METHOD_FACTOR]
    labelled = method.model_copy(update={"labels": {**gun_labels, **method.labels}})
    return design.model_copy(update={"factors": {**design.factors, METHOD_FACTOR: labelled}})


def _factors(design: DesignConfig) -> Iterator[str]:
    own = {name: one for name, one in design.factors.items() if name not in design.adapted}
    within = [(name, one) for name, one in own.items() if not one.between and len(one.all_levels) > 1]
    between = [(name, design.factors[name]) for name in design.between]
    constant = [(name, one) for name, one in design.factors.items() if not one.between and len(one.all_levels) == 1]
    if within:
        yield f"{_sentence(design, within)} varied within participants."
    if design.adaptive is not None:
        yield from _chosen(design, design.adaptive)
    if between:
        yield f"{_sentence(design, between)} varied between participants."
    if constant:
        yield f"{_sentence(design, constant)} was the same in all trials."
    yield from _by_experimenter(design)


def _by_experimenter(design: DesignConfig) -> Iterator[str]:
    """What no command to the gun varies: a hand sets what changes the gun; the rest may be a posture, or a day."""
    varied = [name for name in by_hand(design) if len(design.factors[name].all_levels) > 1]
    if hands := [factor_words(name) for name in varied if design.factors[name].sets]:
        yield f"The experimenter set {joined_by_and(hands)} by hand."
    if shown := [factor_words(name) for name in varied if not design.factors[name].sets]:
        text, (was, them) = joined_by_and(shown), ("was", "it") if len(shown) == 1 else ("were", "them")
        yield f"{text[0].upper() + text[1:]} {was} shown to the experimenter, who confirmed {them}."


def _chosen(design: DesignConfig, table: AdaptiveConfig) -> Iterator[str]:
    if isinstance(table, PairingConfig):
        items = _sentence(design, [(name, design.factors[name]) for name in table.of])
        yield f"{items} was compared in pairs. The pair was chosen after each answer, {pairing_words(table)}."
        return
    levels = [tuple(float(level) for level in design.factors[name].all_levels) for name in table.of]
    ranges = [
        f"{factor_words(name)} ({len(some)} levels, {some[0]:g} to {some[-1]:g})"
        for name, some in zip(table.of, levels, strict=True)
    ]
    text = joined_by_and(ranges)
    was = "was" if len(ranges) == 1 else "were"
    yield f"{text[0].upper() + text[1:]} {was} chosen after each answer, {rule_words(table, levels)}."


def _sentence(design: DesignConfig, named: Sequence[tuple[str, FactorConfig]]) -> str:
    text = joined_by_and([f"{factor_words(name)} ({_levels(design, factor)})" for name, factor in named])
    return text[0].upper() + text[1:]


def _levels(design: DesignConfig, factor: FactorConfig) -> str:
    """The levels; of a nested factor those that each level of the outer one has."""
    if factor.within is None:
        return ", ".join(map(factor.label, factor.all_levels))
    outer = design.factors[factor.within]
    inner = [(outer.label(level), factor.levels_within(level)) for level in outer.all_levels]
    return "; ".join(f"{label}: {', '.join(map(factor.label, some)) or 'none'}" for label, some in inner)


def factor_words(name: str) -> str:
    """A factor's name as words, with its unit.

    >>> factor_words("voltage_V"), factor_words("posture"), factor_words("voltage_V_1")
    ('voltage in V', 'posture', 'voltage in V 1')
    """
    words, unit, interval = parted(name)
    return " ".join([words, *([f"in {written_unit(unit)}"] if unit else []), *([interval] if interval else [])])


def level_words(name: str, level: Level) -> str:
    """A level as words: a number with its unit, or else with its factor's name.

    >>> level_words("voltage_V", 12.0), level_words("grip", "one hand"), level_words("distance", 2.0)
    ('12 V', 'one hand', 'distance 2')
    """
    if isinstance(level, str):
        return level
    unit = parted(name).unit
    return f"{shown_level(level)} {written_unit(unit)}" if unit else f"{factor_words(name)} {shown_level(level)}"


def joined_by_and(words: Sequence[str]) -> str:
    """Words as a sentence lists them.

    >>> joined_by_and(["a"]), joined_by_and(["a", "b"]), joined_by_and(["a", "b", "c"])
    ('a', 'a and b', 'a, b and c')
    """
    return words[0] if len(words) == 1 else f"{', '.join(words[:-1])} and {words[-1]}"


_HOW: dict[BlockOrder, str] = {
    "random": "in random order",
    "fixed": "in a fixed order",
    "latin-square": "in an order balanced over participants by a Latin square",
    "williams": "in an order balanced over participants by a Williams design",
}


def _counts(numbers: Iterable[float]) -> str:
    """A number, or those that there are.

    >>> _counts([2, 2]), _counts([3, 2]), _counts([2, 3, 5])
    ('2', '2 or 3', '2 to 5')
    """
    found = [f"{number:g}" for number in sorted(set(numbers))]
    return f"{found[0]} to {found[-1]}" if len(found) > 2 else " or ".join(found)


def _order(design: DesignConfig, runs: Sequence[PlannedRun]) -> Iterator[str]:
    order, sessions = design.order, [run.sessions for run in runs]
    each = [trials for run in runs for trials in run.session_trials]
    if max(sessions) > 1:
        blocked = joined_by_and([factor_words(name) for name in order.session])
        yield f"There were {_counts(sessions)} sessions, each of one {blocked}, {_HOW[order.sessions]}."
    where = "In each session" if max(sessions) > 1 else "In the session"
    if design.adaptive is not None:
        yield _tracks(design, design.adaptive, where, each)
        return
    times = {1: "once", 2: "twice"}.get(order.repetitions, f"{order.repetitions} times")
    what, how = _what_came(design), _HOW[order.trials]
    yield f"{where} every {what} came {times}, {how}: {_counts(each)} trials{_sets(design, each)}."
    if INSTRUCTION_FACTOR in design.factors:
        yield from _told(design, design.factors[INSTRUCTION_FACTOR])
    if order.set:
        yield f"{joined_by_and([factor_words(name) for name in order.set]).capitalize()} was constant in a set."
    for name, most in order.longest_run.items():
        yield f"No level of {factor_words(name)} came more than {most} times in a row."


def _what_came(design: DesignConfig) -> str:
    """What comes so many times in a session: a condition, or what is left of it where sets have levels of their own."""
    order, factors = design.order, design.factors
    if design.trial.kind == "pair":
        return "pair"
    apart = {*order.session, *order.set, *design.between}
    mixed = [factor_words(name) for name in factors if len(factors[name].all_levels) > 1 and name not in apart]
    if not order.set or not mixed:
        return "condition"
    return mixed[0] if len(mixed) == 1 else f"combination of {joined_by_and(mixed)}"


def _tracks(design: DesignConfig, table: AdaptiveConfig, where: str, each: Sequence[int]) -> str:
    """How many tracks there were, how long each was, and in which order."""
    tracks = sum(trials - design.trial.catch for trials in each) // len(each) // table.trials
    how = "one after another in random order" if not table.interleave else "interleaved in random order"
    some = f"was one track {end_words(table)}" if tracks == 1 else f"were {tracks} tracks {end_words(table)}, {how}"
    if tracks == 1 and not design.trial.catch:
        return f"{where} there {some}{_sets(design, each)}."  # its trials are those of the session
    most = "" if least_of_track(table) == table.trials else "at most "
    return f"{where} there {some}: {most}{_counts(each)} trials{_sets(design, each)}."


def _told(design: DesignConfig, factor: FactorConfig) -> Iterator[str]:
    where = "set" if INSTRUCTION_FACTOR in design.order.set else "session"
    words = [f"{factor.label(level)} “{factor.texts[shown_level(level)]}”" for level in factor.all_levels]
    yield f"Before each {where} participants were told: {'; '.join(words)}."


def _sets(design: DesignConfig, trials: Sequence[int]) -> str:
    sets = design.order.sets
    if sets == 1:
        return ""
    balance = {
        "session": "",
        "set": ", each condition as evenly over the sets as it goes",
        "set-exact": ", each condition equally often in every set",
    }[design.order.balance]
    return f" in {sets} sets of {_counts([count // sets for count in trials])}{balance}"


def _trial(design: DesignConfig, planned: PlannedRun) -> Iterator[str]:
    trial = design.trial
    yield f"A trial was {_one_interval(design) if trial.intervals == 1 else _several_intervals(design, planned)}."
    if trial.catch:
        yield f"Of the trials of a session {trial.catch} were catch trials, without a stimulus."
    yield "Participants were told whether they were right." if trial.feedback else "There was no feedback."
    if design.practice.repetitions:
        each = joined_by_and([factor_words(name) for name in design.practice.of])
        how = (", with feedback" if design.practice.feedback else "") + _rounds(design)
        that = "that had no catch trials and was not analysed" if trial.catch else "that was not analysed"
        yield f"{design.practice.repetitions} of each {each} could be practised first{how}; {that}."


def _rounds(design: DesignConfig) -> str:
    practice = design.practice
    if practice.until_right is None:
        return ""
    share = f"{100.0 * practice.until_right:g} %"
    return f", in at most {practice.rounds} rounds, until {share} of a round's answers were right"


def _one_interval(design: DesignConfig) -> str:
    trial = design.trial
    if trial.kind == "single":
        return "one shot"
    return (
        f"a train of shots, one every {trial.repeat_every_s:g} s, until the participant said next (after "
        f"{trial.least_exposure_s:g} s at the earliest, {trial.max_shots} shots at the most)"
    )


def _several_intervals(design: DesignConfig, planned: PlannedRun) -> str:
    trial, compared = design.trial, factor_words(design.trial.compare or "")
    gap = "with a hand-over between" if planned.hands_within else f"{trial.gap_s:g} s apart"
    if trial.kind == "pair":
        pairs = "all pairs, in both orders as often as it goes"
        if design.adapted:
            pairs = "each pair first in an order drawn at random, and turned round whenever it came again"
        return f"two shots {gap} that differed in {compared}: {pairs}"
    standard = shown_level(trial.standard) if trial.standard is not None else ""
    named = f"the standard ({compared}: {design.factors[trial.compare or ''].labels.get(standard, standard)})"
    if trial.kind == "abx":
        return f"three shots {gap}: A, B and one of them again; one was {named}"
    if trial.kind == "oddity":
        return f"three shots {gap}, two at {named}, in random places"
    if standard == EMPTY:
        return f"two intervals {gap}, one of them empty, {_which_first(trial, 'the {}')}"
    return f"two shots {gap}, one at {named}, {_which_first(trial, 'in the {} interval')}"


def _which_first(trial: TrialConfig, where: str) -> str:
    fixed = trial.standard_interval
    return "each equally often first" if fixed == "random" else f"always {where.format(fixed)}"


def _questions(design: DesignConfig) -> Iterator[str]:
    for when, opening in (("trial", "After each trial"), ("block", "After a set, about each of its trials,")):
        asked = [question for question in design.questions.values() if question.when == when]
        if asked:
            yield f"{opening} participants were asked: {joined_by_and([_question(question) for question in asked])}."


def _question(question: QuestionConfig) -> str:
    match question.kind:
        case "choice" | "yes-no":
            how = " or ".join(question.label(answer) for answer in question.named_answers)
        case "rating":
            low = f"{question.minimum:g}" + (f" = {question.minimum_text}" if question.minimum_text else "")
            high = f"{question.maximum:g}" + (f" = {question.maximum_text}" if question.maximum_text else "")
            how = f"{low} to {high}, in steps of {question.grain:g}"
        case "number":
            how = "a number of their own"
        case "ranking":
            first = f", 1 = {question.minimum_text}" if question.minimum_text else ""
            how = f"an order of the set's trials{first}"
        case "text":
            how = "in their own words"
    return f"“{question.text}” ({how})"


def _rests(design: DesignConfig, runs: Sequence[PlannedRun]) -> Iterator[str]:
    breaks = design.breaks
    if breaks.between_sets_s and any(run.sets > run.sessions for run in runs):
        yield f"Sets were {breaks.between_sets_s:g} s apart."
    if breaks.between_sessions_s and any(run.sessions > 1 for run in runs):
        yield f"Sessions were {breaks.between_sessions_s:g} s apart."
    trials, most = _counts(run.trials for run in runs), _durations(run.duration_s for run in runs)
    if all(run.least_trials == run.trials for run in runs):
        some = "trial was" if trials == "1" else f"{trials} trials were"
        yield f"The {some} planned to take {most}."
    else:
        least = _durations(run.least_duration_s for run in runs)
        fewest = _counts(run.least_trials for run in runs)
        least, most = f"{fewest} trials and {least} at the least", f"{trials} trials and {most} at the most"
        yield f"A run was planned to take {least}, {most}."


def _durations(seconds: Iterable[float]) -> str:
    """Durations as a paper says them: of less than two minutes in seconds, of less than ten to a tenth of a minute.

    >>> _durations([17.6]), _durations([147.0]), _durations([1420.0, 1795.0])
    ('18 s', '2.5 min', '24 or 30 min')
    """
    found = list(seconds)
    if max(found) < 120:
        return f"{_counts(map(round, found))} s"
    minutes = [second / 60 for second in found]
    return f"{_counts(round(one, 1 if one < 10 else None) for one in minutes)} min"
