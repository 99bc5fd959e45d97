"""Designs whose studies can be drawn by the thousand: which way the gun shot, method by method, and how it was liked.

What a design asks decides, not its name. Others are simulated run by run (`--screen synthetic`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

from device.words import DIRECTIONS, Direction
from experiments.config.door import ConfigError, at_key
from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.language import DIRECTION_FACTOR, INSTRUCTION_FACTOR, METHOD_FACTOR, NumberScale
from experiments.design.plan import condition
from experiments.design.planned import PlannedRun, workload
from experiments.design.planning import plan_of
from experiments.synthetic.laws import DiffusionLaw, Law, RatesLaw, RatingsLaw, SyntheticAnswers, of_condition


@dataclass(frozen=True, slots=True, kw_only=True)
class DirectionStudies:
    """Studies of a design that asks which way the gun shot, one method a session.

    `trials`: forward and backward ones of one method; `question`: the name of what is asked.
    """

    design: DesignConfig
    question: str
    law: RatesLaw | DiffusionLaw

    @property
    def methods(self) -> tuple[str, ...]:
        """The methods that are compared."""
        return self.design.methods

    @property
    def trials(self) -> tuple[int, int]:
        """Forward and backward trials of one method."""
        levels, each = self.design.factors[DIRECTION_FACTOR].all_levels, self.design.order.repetitions
        forward, backward = (each if way in levels else 0 for way in DIRECTIONS)
        return forward, backward

    @property
    def trials_per_set(self) -> int:
        """Trials of a set."""
        return sum(self.trials) // self.design.order.sets

    @property
    def instructions(self) -> tuple[str, ...]:
        """The instructions that sets are met under; none if there are none."""
        told = self.design.factors.get(INSTRUCTION_FACTOR)
        return tuple(map(str, told.all_levels)) if told else ()

    def varied(self, methods: Sequence[str], trials: int) -> DirectionStudies:
        """The same with other methods and so many trials of each; not checked again, so what breaks can be told."""
        order = self.design.order.model_copy(
            update={
                "repetitions": trials // sum(1 for one in self.trials if one),
                "sets": trials // self.trials_per_set,
            }
        )
        return replace(self, design=_with_methods(self.design, methods).model_copy(update={"order": order}))

    def planned(self) -> PlannedRun:
        """What a run comes to."""
        return _planned(self.design)


@dataclass(frozen=True, slots=True, kw_only=True)
class RatingStudies:
    """Studies of a design that has each method rated once."""

    design: DesignConfig
    question: str
    law: RatingsLaw

    @property
    def methods(self) -> tuple[str, ...]:
        """The methods that are compared."""
        return self.design.methods

    @property
    def scale(self) -> NumberScale:
        """What may be rated."""
        return self.design.questions[self.question].scale

    def varied(self, methods: Sequence[str], trials: int) -> RatingStudies:  # noqa: ARG002 - there is one a method
        """The same with other methods."""
        return replace(self, design=_with_methods(self.design, methods))

    def planned(self) -> PlannedRun:
        """What a run comes to."""
        return _planned(self.design)


Drawn = DirectionStudies | RatingStudies


def studies_of(setup: Setup[DesignConfig]) -> Drawn:
    """The studies of a design. `ConfigError`: they cannot be drawn, and why."""
    name, law = drawn_question(setup)
    found = _view(setup.config, name, law)
    if found is None:
        rule = _RATES if setup.config.questions[name].correct else _RATINGS
        people = setup.source.parent / str(setup.config.synthetic)
        raise ConfigError(at_key(people, f'questions.{name}.law: "{law.law}" has no power; {rule}'))
    if isinstance(found, DirectionStudies) and not found.trials[0]:
        raise ConfigError(
            f"{setup.source}: factors.direction has no level forward; the planned analysis is of forward trials"
        )
    return found


_RATES = 'studies are drawn from "diffusion", or from "rates" by method and direction'
_RATINGS = 'studies are drawn from "ratings" with by = ["method"]'


def drawn_question(setup: Setup[DesignConfig]) -> tuple[str, Law]:
    """The question that studies are drawn of, and its law. `ConfigError`: the design asks nothing of the kind."""
    design, laws = setup.config, setup.laws
    if not isinstance(laws, SyntheticAnswers):
        raise ConfigError(f"{setup.source}: synthetic is missing; it names the file that says how people answer")
    name = next((name for name in design.questions if _is_direction(design, name) or _is_rating(design, name)), None)
    if name is None and design.trial.kind == "pair":
        raise ConfigError(
            f"{setup.source}: studies of paired comparisons are not drawn; simulate as many people as you think of, "
            "each by recoil run CONFIG --participant CODE --screen synthetic --results DIR; then recoil analyze DIR "
            "says how wide the intervals of the scores are"
        )
    if name is None:
        raise ConfigError(
            f"{setup.source}: studies are drawn of designs that ask which way the gun shot, one method a session, or "
            "have each method rated once; simulate others run by run: --screen synthetic"
        )
    return name, laws.questions[name]


def _view(design: DesignConfig, name: str, law: Any) -> Drawn | None:
    by_cell = isinstance(law, RatesLaw) and set(law.by) <= {METHOD_FACTOR, DIRECTION_FACTOR}
    if _is_direction(design, name) and (by_cell or isinstance(law, DiffusionLaw)):
        return DirectionStudies(design=design, question=name, law=law)
    if _is_rating(design, name) and isinstance(law, RatingsLaw) and law.by == (METHOD_FACTOR,):
        return RatingStudies(design=design, question=name, law=law)
    return None


def _is_direction(design: DesignConfig, name: str) -> bool:
    varied = set(design.factors) - {METHOD_FACTOR, DIRECTION_FACTOR, INSTRUCTION_FACTOR}
    return (
        design.questions[name].correct == DIRECTION_FACTOR
        and design.order.session == (METHOD_FACTOR,)
        and not varied
        and not design.trial.catch
    )


def _is_rating(design: DesignConfig, name: str) -> bool:
    several = [one for one, factor in design.factors.items() if len(factor.all_levels) > 1]
    question = design.questions[name]
    return question.kind == "rating" and several == [METHOD_FACTOR] and design.order.repetitions == 1


def _with_methods(design: DesignConfig, methods: Sequence[str]) -> DesignConfig:
    factor = design.factors[METHOD_FACTOR].model_copy(update={"levels": tuple(methods)})
    return design.model_copy(update={"factors": design.factors | {METHOD_FACTOR: factor}})


def _planned(design: DesignConfig) -> PlannedRun:
    return workload(design, plan_of(design, "P01", 0))


def rates_by_method(law: RatesLaw, methods: Sequence[str], direction: Direction) -> dict[str, float]:
    """The share of right answers to shots of a direction in the mean over people, by method."""
    cells = {method: condition(method=method, direction=direction) for method in methods}
    return {method: of_condition(law.share, law.by, cell, "share") for method, cell in cells.items()}
