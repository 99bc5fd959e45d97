"""The adaptive tracks of a plan while its session runs: each a function of the answers so far, as they count now.

What was done is read from the journal's own order: a corrected answer counts as if it had been given so, one whose
trial is presented again not at all. An answer that follows makes the next state from the last one; what changes an
earlier answer makes its track anew from the first. A walk follows answers; a posterior takes what was felt.
"""

from __future__ import annotations

from dataclasses import dataclass

from experiments.design.config import DesignConfig
from experiments.design.plan import Condition, Plan, Trial
from experiments.design.procedure_problems import followed_question, guess_of
from experiments.design.procedures.choosing import AdaptiveTrack, ChosenLevels, paired_track, tracks_of_cell
from experiments.design.procedures.config import AdaptiveConfig, NumericConfig, PairingConfig
from experiments.design.streams import Stream
from experiments.session import steps
from experiments.session.history import History
from experiments.session.remarks import EntryCorrected, Remark
from experiments.tasks.questions import AnswerValue, is_success, share_of_first


@dataclass(frozen=True, slots=True)
class CountedAnswer:
    """An answer of a track: to which levels, and what was said."""

    felt: Condition
    value: AnswerValue


class Tracks:
    """Where each track of a plan stands, by what `told` says so far, and by what it will say."""

    def __init__(self, design: DesignConfig, table: AdaptiveConfig, plan: Plan, told: History) -> None:
        self._design, self._table, self._told, self._read = design, table, told, 0
        self._question = followed_question(table, design.questions) or ""
        self._begun = _begun(design, table, plan)
        self._now = dict(self._begun)
        self._felt: dict[Trial, Condition] = {}
        self._answers: dict[int, dict[Trial, CountedAnswer]] = {number: {} for number in self._begun}

    @property
    def over(self) -> frozenset[int]:
        """The tracks that have ended, by the answers as they count now."""
        return frozenset(number for number in self._begun if self.is_over(number))

    def is_over(self, number: int) -> bool:
        """Whether a track has ended, by the answers so far."""
        return self._track(number).over

    def choice(self, number: int) -> ChosenLevels | None:
        """The levels of the next trial of a track; `None` if it is over."""
        track = self._track(number)
        return None if track.over else track.choice()

    def has_answer(self, trial: Trial) -> bool:
        """Whether a trial has an answer that counts."""
        self._catch_up()
        return trial in self._answers[trial.track]

    def as_felt(self, trial: Trial) -> Trial:
        """A trial with the levels at which it was felt last."""
        self._catch_up()
        return trial.with_chosen(self._felt.get(trial, ()))

    def condition(self, choice: ChosenLevels) -> Condition:
        """Chosen levels by their factors."""
        return tuple(zip(self._design.chosen_names, choice.levels, strict=True))

    def _track(self, number: int) -> AdaptiveTrack:
        self._catch_up()
        return self._now[number]

    def _catch_up(self) -> None:
        for step, word in self._told[self._read :]:
            self._take(step, word)
        self._read = len(self._told)

    def _take(self, step: steps.Step | None, word: steps.Outcome | Remark) -> None:
        match word:
            case EntryCorrected() if word.question == self._question and word.trial in self._own(word.trial):
                own = self._own(word.trial)
                own[word.trial] = CountedAnswer(own[word.trial].felt, word.value)
                self._make_anew(word.trial.track)
            case steps.Repeated():
                self._forget(word.trial)
            case steps.Fired() | steps.Presented() if isinstance(step, steps.FireShot | steps.Present):
                self._felt[step.trial] = step.chosen
            case steps.Failed() | steps.Interrupted() if steps.breaks_off(step, word) and (
                trial := steps.trial_of(step)
            ):
                self._forget(trial)
            case steps.Answered() if isinstance(step, steps.Ask) and step.question == self._question:
                self._count(step.trial, word.value)

    def _own(self, trial: Trial) -> dict[Trial, CountedAnswer]:
        return self._answers.get(trial.track, {})

    def _count(self, trial: Trial, value: AnswerValue) -> None:
        """Take one answer more."""
        if trial.track:
            answer = CountedAnswer(self._felt[trial], value)
            self._own(trial)[trial] = answer
            self._now[trial.track] = self._after(self._now[trial.track], trial, answer)

    def _forget(self, trial: Trial) -> None:
        """An answer does not count: its trial is presented again."""
        if self._own(trial).pop(trial, None) is not None:
            self._make_anew(trial.track)

    def _make_anew(self, number: int) -> None:
        track = self._begun[number]
        for trial, answer in self._answers[number].items():
            track = self._after(track, trial, answer)
        self._now[number] = track

    def _after(self, track: AdaptiveTrack, trial: Trial, answer: CountedAnswer) -> AdaptiveTrack:
        felt = tuple(level for _, level in answer.felt)
        return track.after(felt, success=self._success(trial, answer))

    def _success(self, trial: Trial, answer: CountedAnswer) -> float:
        """1 of an answer that succeeds, 0 of another; of a pair how much the first was chosen."""
        question = self._design.questions[self._question]
        if isinstance(self._table, PairingConfig):
            return share_of_first(question, answer.value)
        return float(is_success(self._design, question, trial.with_chosen(answer.felt), answer.value))


def _begun(design: DesignConfig, table: AdaptiveConfig, plan: Plan) -> dict[int, AdaptiveTrack]:
    """Each track before its first answer."""
    if isinstance(table, PairingConfig):
        return _paired(design, table, plan)
    return _numeric(design, table, plan)


def _paired(design: DesignConfig, table: PairingConfig, plan: Plan) -> dict[int, AdaptiveTrack]:
    """Each with a random stream of its own, by which pairs that are alike are ordered."""
    (name,), purpose = table.of, ("pairs", plan.experiment, plan.participant_id)
    items, numbers = design.factors[name].all_levels, {trial.track for trial in plan.trials if trial.track}
    return {number: paired_track(table, items, Stream(plan.seed, *purpose, str(number))) for number in numbers}


def _numeric(design: DesignConfig, table: NumericConfig, plan: Plan) -> dict[int, AdaptiveTrack]:
    """Those of a cell in the order of their starts."""
    question = design.questions[followed_question(table, design.questions) or ""]
    levels = [tuple(float(level) for level in design.factors[name].all_levels) for name in table.of]
    made = tracks_of_cell(table, levels, guess_of(question))
    cells: dict[Condition, list[int]] = {}
    for trial in plan.trials:
        cell = tuple(pair for pair in trial.levels if pair[0] not in table.mixed)
        numbers = cells.setdefault(cell, [])
        if trial.track and trial.track not in numbers:
            numbers.append(trial.track)
    return {
        number: track
        for numbers in cells.values()
        for number, track in zip(sorted(numbers), made, strict=bool(numbers))
    }


def adaptive_tracks(design: DesignConfig, plan: Plan, told: History) -> Tracks | None:
    """The tracks of a plan; `None` where all levels are planned beforehand, as in practice."""
    return None if design.adaptive is None or plan.practice else Tracks(design, design.adaptive, plan, told)
