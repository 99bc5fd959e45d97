"""A synthetic participant of experiment 1 who answers from what the gun does: percept, then diffusion."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from experiments.direction.diffusion import Decision, Lapses, People, decide, person
from experiments.direction.percept import Percept, PerceptParameters, diffusion_of, evidence
from experiments.plan import Plan, Trial
from experiments.streams import Stream

NEUTRAL = "neutral"
"""The instruction of a trial that has none."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Mind:
    """What the participants are made of. All but the percept's fitted numbers is assumed: the paper has no times."""

    percept: PerceptParameters = field(default_factory=PerceptParameters)
    boundaries: Mapping[str, float] = field(default_factory=lambda: {"speed": 1.0, NEUTRAL: 1.5, "accuracy": 2.2})
    non_decision_s: float = 0.35
    lapses: Lapses = field(default_factory=Lapses)
    people: People = field(default_factory=People)


class FeltParticipant:
    """A person drawn once, by the seed, who then decides each trial by its own stream.

    The sensitivity is that at the neutral boundary, so a hurried person has the same drift and errs more.
    """

    def __init__(self, mind: Mind, percepts: Mapping[str, Percept], plan: Plan) -> None:
        self._mind, self._seed, self._who = mind, plan.seed, (plan.experiment, plan.participant_id)
        self._log_odds = {name: evidence(percept, mind.percept) for name, percept in percepts.items()}
        self._person = person(mind.people, Stream(plan.seed, "person", *self._who))

    def decide(self, trial: Trial, instruction: str = NEUTRAL) -> Decision:
        """The decision on a shot of this trial's method and direction; "upper" is "forward".

        `KeyError`: a method without a percept or an instruction without a boundary.
        """
        mind, sign = self._mind, 1.0 if trial.direction == "forward" else -1.0
        neutral = diffusion_of(
            sign * self._log_odds[trial.method],
            mind.percept,
            boundary=mind.boundaries[NEUTRAL],
            non_decision_s=mind.non_decision_s,
            lapses=mind.lapses,
        )
        draws = Stream(self._seed, "answer", *self._who, str(trial.session), str(trial.trial))
        return decide(self._person.own(replace(neutral, boundary=mind.boundaries[instruction])), draws)
