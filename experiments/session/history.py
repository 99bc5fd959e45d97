"""What was done in a run so far, what became of each trial, and what of it can be corrected or repeated. Pure."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

from experiments.design.config import DesignConfig
from experiments.design.plan import Condition, Plan, Trial
from experiments.session import steps
from experiments.session.remarks import EntryCorrected, Remark
from experiments.session.steps import Asking
from experiments.tasks.questions import AnswerValue

Word = TypeVar("Word")

History = Sequence[tuple[steps.Step | None, steps.Outcome | Remark]]
"""What a journal tells, in order: steps with their outcomes, and remarks, which have no step."""
GrowingHistory = list[tuple[steps.Step | None, steps.Outcome | Remark]]
"""The same while it is still told."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TrialHistory:
    """What the journal tells of one trial, in order, what of it counts, and whether it was asked to be repeated."""

    items: GrowingHistory
    counting: GrowingHistory
    repeated: bool

    @property
    def words(self) -> list[steps.Outcome | Remark]:
        """The outcomes and remarks, in order."""
        return [word for _, word in self.items]

    def all(self, kind: type[Word]) -> list[Word]:
        """The outcomes or remarks of a kind."""
        return [word for word in self.words if isinstance(word, kind)]

    def last(self, kind: type[Word]) -> Word | None:
        """The last outcome or remark of a kind."""
        return next(reversed(self.all(kind)), None)

    @property
    def chosen(self) -> Condition:
        """The levels that a procedure chose, when it was felt last; empty if it was not, or had levels of its own."""
        felt = self._felt
        return () if felt is None else felt.chosen

    @property
    def at_edge(self) -> bool:
        """Whether those are at the end of what there is."""
        felt = self._felt
        return felt is not None and felt.at_edge

    @property
    def stimulus(self) -> list[steps.Fired | steps.Presented]:
        """What was felt last: the shots of the last presentation, in their order, or its train. Empty: nothing was."""
        found: list[steps.Fired | steps.Presented] = []
        for step, word in reversed(self.items):
            if isinstance(word, steps.Fired | steps.Presented):
                found.append(word)
                if not (isinstance(step, steps.FireShot) and step.interval):
                    break
        return found[::-1]

    @property
    def _felt(self) -> steps.FireShot | steps.Present | None:
        done = (step for step, word in reversed(self.items) if isinstance(word, steps.Fired | steps.Presented))
        return next((step for step in done if isinstance(step, steps.FireShot | steps.Present)), None)

    def entered(self, question: str) -> list[steps.Answered | EntryCorrected]:
        """What was answered to a question of the last presentation, and corrected, in order: the last counts."""
        return [
            word
            for step, word in self.counting
            if (isinstance(word, EntryCorrected) and word.question == question)
            or (isinstance(word, steps.Answered) and isinstance(step, Asking) and step.question == question)
        ]

    @property
    def questions(self) -> tuple[str, ...]:
        """The questions that were asked, in order."""
        return tuple(dict.fromkeys(step.question for step, _ in self.items if isinstance(step, Asking)))


def by_trial(trials: Sequence[Trial], history: History) -> dict[Trial, TrialHistory]:
    """What the journal tells, by trial."""
    repeated = {word.trial for _, word in history if isinstance(word, steps.Repeated)}
    found = {trial: TrialHistory(items=[], counting=[], repeated=trial in repeated) for trial in trials}
    for step, word in history:
        trial = _trial(step, word)
        if trial is not None:
            found[trial].items.append((step, word))
    for step, word in counting(history):
        trial = _trial(step, word)
        if trial is not None:
            found[trial].counting.append((step, word))
    return found


def counting(history: History) -> GrowingHistory:
    """The history without what counts no more: what was felt and said of a trial before it was presented again.

    Of one that was spoiled, or broke off, nothing counts from then on, also while it waits for its next presentation:
    no answer is ever taken for one to a stimulus that it was not given to.
    """
    found, gone = GrowingHistory(), set[tuple[int, int, int]]()
    for step, word in reversed(history):
        trial = _trial(step, word)
        if not (isinstance(word, _OF_A_PRESENTATION) and trial is not None and trial.place in gone):
            found.append((step, word))
        if isinstance(word, steps.Repeated):
            gone.add(word.trial.place)
        elif trial is not None and (steps.breaks_off(step, word) or is_attempt(step, word)):
            gone.add(trial.place)
    return found[::-1]


def about_trials(history: History, trials: Iterable[Trial]) -> GrowingHistory:
    """What is told of some trials, that they were spoiled included: little, where much is looked at again and again."""
    places = {trial.place for trial in trials}
    return [
        (step, word)
        for step, word in history
        if (isinstance(word, steps.Repeated) and word.trial.place in places)
        or ((trial := _trial(step, word)) is not None and trial.place in places)
    ]


_OF_A_PRESENTATION = (steps.Fired, steps.Presented, steps.Answered, EntryCorrected)


def _trial(step: steps.Step | None, word: steps.Outcome | Remark) -> Trial | None:
    """The trial that an event is about, if it is about one."""
    return getattr(word, "trial", None) if step is None else steps.trial_of(step)


def is_attempt(step: steps.Step | None, word: steps.Outcome | Remark) -> bool:
    """Whether a stimulus was felt, or may have been: what `attempts` counts."""
    first = isinstance(step, steps.Present) or (isinstance(step, steps.FireShot) and step.interval == 0)
    return first and not (isinstance(word, steps.Failed | steps.Interrupted) and not word.presented)


def trial_at(plan: Plan, history: History, step: steps.Step | None) -> Trial:
    """The trial of a step; if it has none, of the last step that has one; else the first of the plan."""
    backwards = (step, *(one for one, _ in reversed(history)))
    return next((trial for one in backwards if (trial := steps.trial_of(one)) is not None), plan.trials[0])


def chosen_levels(history: History, trial: Trial) -> Condition:
    """The levels that a procedure chose for a trial, when it was felt last; none where it has all of its own."""
    if not trial.track:
        return ()
    fired = (step for step, _ in reversed(history) if isinstance(step, steps.FireShot | steps.Present))
    return next((step.chosen for step in fired if step.trial == trial), ())


def entries(history: History, here: Trial) -> list[Asking]:
    """What was entered in the set of a trial and counts, as what asked for it, in order: what can be corrected.

    What is entered anew, because its trial was presented again, stands where it was entered first.
    """
    counts = set(_answers_asked(counting(history)))
    return [step for step in dict.fromkeys(_answers_asked(history)) if step in counts and of_one_set(step.trial, here)]


def _answers_asked(history: History) -> Iterator[Asking]:
    """What asked for each answer."""
    return (step for step, word in history if isinstance(step, Asking) and isinstance(word, steps.Answered))


def asked_before(history: History, about: EntryCorrected) -> Asking | None:
    """What asked for the entry that a correction is about; `None` if nothing did."""
    steps_back = (step for step, _ in reversed(history) if isinstance(step, Asking))
    wanted = (about.trial, about.question)
    return next((step for step in steps_back if (step.trial, step.question) == wanted), None)


def entered_value(history: History, asked: Asking) -> AnswerValue:
    """What an entry says, as it counts: the last that was entered. `None`: no answer."""
    said = [_value(step, word, asked) for step, word in counting(about_trials(history, [asked.trial]))]
    return next((one[0] for one in reversed(said) if one), None)


def ranks_of_others(history: History, asked: steps.Rate) -> dict[AnswerValue, steps.Rate]:
    """The ranks that other trials of the set have, with what asked for them; none where ranks need not be distinct."""
    if not asked.distinct:
        return {}
    there = (one for one in entries(history, asked.trial) if isinstance(one, steps.Rate))
    others = [one for one in there if one.question == asked.question and one.trial != asked.trial]
    return {value: one for one in others if (value := entered_value(history, one)) is not None}


def exchanged_for(history: History, taken: EntryCorrected) -> EntryCorrected | None:
    """The correction to a rank that another trial had, where `taken` is that other's, corrected along with it."""
    at = next((place for place, (_, word) in enumerate(history) if word is taken), 0)
    before, first = history[: max(at - 1, 0)], history[at - 1][1] if at else None
    asked = asked_before(before, first) if isinstance(first, EntryCorrected) else None
    if not isinstance(first, EntryCorrected) or not isinstance(asked, steps.Rate):
        return None
    had_it = ranks_of_others(before, asked).get(first.value)
    return first if had_it is not None and had_it.trial == taken.trial else None


def _value(step: steps.Step | None, word: steps.Outcome | Remark, asked: Asking) -> tuple[AnswerValue] | None:
    if isinstance(word, EntryCorrected):
        return (word.value,) if (word.trial, word.question) == (asked.trial, asked.question) else None
    return (word.value,) if isinstance(word, steps.Answered) and step == asked else None


def repeatable(history: History, step: steps.Step | None, here: Trial) -> Trial | None:
    """The trial that can be presented again: that at hand, if it has begun, else the last of the set that was felt.

    It can be as long as nothing was told of it from memory, when all of its block were felt.
    """
    told = _told_later(history)
    if isinstance(step, steps.Ask | steps.Rate) or (isinstance(step, steps.Prepare) and steps.is_begun(step)):
        return None if step.trial in told else step.trial
    last = (trial for trial in reversed(_felt(history)) if of_one_set(trial, here))
    return next((trial for trial in last if trial not in told), None)


def _told_later(history: History) -> set[Trial]:
    return {
        step.trial
        for step, word in history
        if isinstance(step, Asking) and step.later and isinstance(word, steps.Answered)
    }


def done(history: History, design: DesignConfig) -> set[Trial]:
    """The trials that are over but for what is asked after their block: felt, and answered to all else."""
    at_once = design.asked_at_once
    return answered(history, at_once) if at_once else felt(history)


def felt(history: History) -> set[Trial]:
    """The trials whose stimulus is over: every interval of it, or all of a train."""
    return set(_felt(history))


def _felt(history: History) -> list[Trial]:
    """The same in the order in which they were felt last."""
    return [
        step.trial
        for step, word in counting(history)
        if isinstance(step, steps.Present | steps.FireShot)
        and (isinstance(word, steps.Presented) or (isinstance(word, steps.Fired) and _is_last(step)))
    ]


def _is_last(step: steps.Step) -> bool:
    return isinstance(step, steps.FireShot) and step.interval + 1 >= len(step.trial.intervals)


def answered(history: History, questions: Collection[str]) -> set[Trial]:
    """The trials with an answer that counts to each of some questions, also if it is that there is none."""
    found: dict[Trial, set[str]] = {}
    for asked in _answers_asked(counting(history)):
        found.setdefault(asked.trial, set()).add(asked.question)
    return {trial for trial, names in found.items() if names.issuperset(questions)}


def of_one_set(one: Trial, other: Trial) -> bool:
    """Whether two trials are of one set."""
    return (one.session, one.set) == (other.session, other.set)
