"""What the levels of a trial come to on a gun: each interval's method, direction and numbers, and what hands must set.

Numbers by which a shot is driven go to the gun with the command. Every other number of it, and every factor of the
lab's own, is set by the experimenter's hand and confirmed; the model is told what the hand did.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, fields, replace
from functools import cache
from typing import cast

from device.methods import Method, drive_of, rendering_of
from device.parameters import VibrationParameters
from device.words import Direction, Drive, LimitError, Shot
from experiments.config.door import ConfigError
from experiments.config.setup import GunConfig
from experiments.design.config import GUN_NUMBERS, DesignConfig
from experiments.design.contents import cells
from experiments.design.language import (
    DIRECTION_FACTOR,
    DRIVEN,
    EMPTY,
    INSTRUCTION_FACTOR,
    METHOD_FACTOR,
    TRAIN_INTERVAL,
    Level,
    shown_level,
)
from experiments.design.plan import CHOSEN, Condition, Trial
from experiments.design.planning import groups

_NOT_OF_A_SHOT = (METHOD_FACTOR, DIRECTION_FACTOR, INSTRUCTION_FACTOR, TRAIN_INTERVAL)


@dataclass(frozen=True, slots=True, kw_only=True)
class IntervalStimulus:
    """One interval's shot: what the gun is told, and what the model takes the gun to be."""

    method: str
    direction: Direction
    parameters: Method
    drive: Drive


def damper(gun: GunConfig, method: str) -> tuple[tuple[str, str], ...]:
    """How the gun's damper is set by hand for a method; nothing if it has none."""
    wanted = gun.methods[method].damper
    return (("damper", wanted),) if wanted else ()


def by_hand(design: DesignConfig) -> tuple[str, ...]:
    """The factors that the experimenter sets by hand."""
    return tuple(name for name in design.factors if name not in (*_NOT_OF_A_SHOT, *DRIVEN))


def settings(design: DesignConfig, gun: GunConfig, levels: Condition) -> tuple[tuple[str, str], ...]:
    """What is set by hand for a cell, as the experimenter reads it: the method's damper, unless a factor says how.

    Of a method that is not chosen yet, or that a catch trial has not, it is that of any: `limits` lets no others by.
    """
    names, method = by_hand(design), dict(levels).get(METHOD_FACTOR)
    method = design.methods[0] if method in (CHOSEN, None) else method
    held = dict(damper(gun, str(method)))
    return tuple((held | {name: design.factors[name].label(level) for name, level in levels if name in names}).items())


@dataclass(frozen=True, slots=True, kw_only=True)
class Stimuli:
    """All that a run can fire: what the gun is opened with, and the shot of some levels.

    A rendering that a hand changes the gun for has a name of its own, which a line to a gun can carry. `last_choice`
    are levels that a procedure could choose, the highest of numbers.
    """

    methods: Mapping[str, Method]
    of_levels: Callable[[Condition], Shot]
    last_choice: Condition = ()

    def shot(self, trial: Trial, interval: int) -> Shot | None:
        """The shot of an interval, counted from 0; `None` where nothing is felt."""
        levels = trial.levels_at(interval)
        return None if levels is None else self.of_levels(levels)

    def work_out(self, trials: Iterable[Trial]) -> None:
        """The shots of trials whose levels are known, beforehand: nobody waits for them in a trial."""
        for trial in (trial for trial in trials if not trial.track):
            for place in range(max(1, len(trial.intervals))):
                self.shot(trial, place)

    def pulse_s(self, shot: Shot) -> float:
        """How long a shot's pulse is, or its vibration."""
        rendering = rendering_of(self.methods[shot.method], shot.drive)
        return rendering.load.on_s or rendering.settle_s

    def first_shot(self, trials: Iterable[Trial]) -> Shot:
        """The first shot that is felt in some trials; a track's is at the last levels, before any is chosen."""
        filled = (trial.with_chosen(self.last_choice) if trial.track else trial for trial in trials)
        shots = (self.shot(trial, place) for trial in filled for place in range(max(1, len(trial.intervals))))
        return next(shot for shot in shots if shot is not None)


def stimuli_of(design: DesignConfig, gun: GunConfig) -> Stimuli:
    """The stimuli of a design. `ConfigError` as `limits`."""
    names: dict[Method, str] = {}
    for levels in dict.fromkeys(shot_cells(design)):
        found = stimulus(design, gun, levels)
        names.setdefault(_undriven(found, gun), _name(found, gun, len(names)))

    @cache
    def of_levels(levels: Condition) -> Shot:
        found = stimulus(design, gun, levels)
        return Shot(method=names[_undriven(found, gun)], direction=found.direction, drive=found.drive)

    return Stimuli(
        methods={name: method for method, name in names.items()},
        of_levels=of_levels,
        last_choice=design.last_choice,
    )


def _undriven(found: IntervalStimulus, gun: GunConfig) -> Method:
    """What a stimulus takes the gun to be, apart from how its method is driven."""
    own = gun.rendering(found.method)
    if (
        found.parameters is own
        or isinstance(own, VibrationParameters)
        or isinstance(found.parameters, VibrationParameters)
    ):
        return found.parameters
    return replace(found.parameters, voltage_V=own.voltage_V, pulse_s=own.pulse_s)


def _name(found: IntervalStimulus, gun: GunConfig, number: int) -> str:
    return found.method if _undriven(found, gun) == gun.rendering(found.method) else f"{found.method[:20]}-{number}"


def _with(levels: Condition, name: str, level: Level) -> Condition:
    return tuple((one, level if one == name else old) for one, old in levels)


def stimulus(design: DesignConfig, gun: GunConfig, levels: Condition) -> IntervalStimulus:
    """The shot of a cell. `ConfigError`: the gun has no such method or number, or a number is out of range."""
    held = dict(levels)
    method = str(held[METHOD_FACTOR])
    if method not in gun.methods:
        raise ConfigError(f"factors.method: the gun has no method {method!r}; it has {', '.join(gun.methods)}")
    _check_vibration(gun.rendering(method), held, method)
    parameters = _changed(gun.rendering(method), _numbers(design, held), method)
    try:
        drive = drive_of(parameters)
    except LimitError as error:
        raise beyond_limits(design, levels, str(error)) from error
    return IntervalStimulus(
        method=method,
        direction=cast("Direction", held.get(DIRECTION_FACTOR, "forward")),
        parameters=parameters,
        drive=drive,
    )


def _check_vibration(parameters: Method, held: Mapping[str, Level], method: str) -> None:
    """A hand would set what a factor calls as a number of the vibration, and every trial would fire one effect."""
    named = [name for name in held if name in _NUMBERS_OF_VIBRATION]
    if named and isinstance(parameters, VibrationParameters):
        raise ConfigError(
            f"factors.{named[0]}: method {method!r} is a vibration of effect {parameters.effect}, with the numbers of "
            "that effect: make a method of each in the gun's file (`vibration.effect`), and let `method` vary"
        )


_NUMBERS_OF_VIBRATION = frozenset(field.name for field in fields(VibrationParameters))


def _numbers(design: DesignConfig, held: Mapping[str, Level]) -> dict[str, tuple[str, float]]:
    """The gun's numbers that a cell changes, each with the factor that does."""
    found: dict[str, tuple[str, float]] = {}
    for name, level in held.items():
        if name in _NOT_OF_A_SHOT:
            continue
        own = design.factors[name].sets.get(shown_level(level), {})
        if isinstance(level, float) and name in GUN_NUMBERS:
            own = {name: level, **own}
        for key, value in own.items():
            if key not in GUN_NUMBERS:
                raise ConfigError(
                    f"factors.{name}.sets.{shown_level(level)}.{key}: the gun has no such number; it has "
                    f"{', '.join(GUN_NUMBERS)}"
                )
            if key in found:
                raise ConfigError(
                    f"factors.{name} sets {key}, which factors.{found[key][0]} sets as well; keep one of them"
                )
            found[key] = (name, value)
    return found


def _changed(parameters: Method, numbers: Mapping[str, tuple[str, float]], method: str) -> Method:
    if not numbers:
        return parameters
    if isinstance(parameters, VibrationParameters):
        factor = next(iter(numbers.values()))[0]
        raise ConfigError(
            f"factors.{factor}: method {method!r} is a vibration, which has no {next(iter(numbers))}: take it out of "
            f"factors.method, or make a method of each level in the gun's file, and no factor {factor}"
        )
    for key, (name, value) in numbers.items():
        try:
            parameters = replace(parameters, **{key: value})  # type: ignore[arg-type] # all are numbers
        except ValueError as error:
            raise ConfigError(f"factors.{name}: {error}") from error
    return parameters


def shot_cells(design: DesignConfig) -> Iterator[Condition]:
    """The levels of everything that may be fired in a design, standards too."""
    names = [
        name
        for name in design.factors
        if name not in design.between and name not in (DIRECTION_FACTOR, INSTRUCTION_FACTOR)
    ]
    for given in groups(design):
        found = [(*given, *cell) for cell in cells(design, names, given)]
        yield from found
        standard = design.trial.standard
        if standard is not None and standard != EMPTY and design.trial.compare is not None:
            yield from (_with(levels, design.trial.compare, standard) for levels in found)


def beyond_limits(design: DesignConfig, levels: Condition, why: str) -> ConfigError:
    """That a cell cannot be fired, at the key of the first factor that says a number of the gun; else of the method."""
    numbers = (name for name, factor in design.factors.items() if name in GUN_NUMBERS or factor.sets)
    return ConfigError(f"factors.{next(numbers, METHOD_FACTOR)}.levels: {shown_cell(levels)}: {why}")


def shown_cell(levels: Condition) -> str:
    """A cell in words, as messages name it."""
    return ", ".join(f"{name} = {shown_level(level)}" for name, level in levels)
