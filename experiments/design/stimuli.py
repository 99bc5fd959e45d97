"""What the levels of a trial come to on a gun: each interval's method, direction and numbers, and what hands must set.

Numbers by which a shot is driven go to the gun with the command. Every other number of it, and every factor of the
lab's own, is set by the experimenter's hand and confirmed; the model is told what the hand did.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, replace
from typing import cast

from device.methods import Method, drive_of, rendering_of
from device.parameters import GunParameters, VibrationParameters
from device.words import Direction, Drive, LimitError
from experiments.config.door import ConfigError
from experiments.config.setup import GunConfig
from experiments.design.config import DesignConfig
from experiments.design.language import (
    DIRECTION_FACTOR,
    EMPTY,
    INSTRUCTION_FACTOR,
    METHOD_FACTOR,
    TRAIN_INTERVAL,
    Level,
    shown_level,
)
from experiments.design.plan import Condition, Trial
from experiments.design.planning import cells, groups

DRIVEN = ("voltage_V", "pulse_s")
"""What the command of a shot carries."""
_GUN_NUMBERS = tuple(
    field.name for field in fields(GunParameters) if isinstance(field.default, float) or field.default is None
)
_NOT_OF_A_SHOT = (METHOD_FACTOR, DIRECTION_FACTOR, INSTRUCTION_FACTOR, TRAIN_INTERVAL)


@dataclass(frozen=True, slots=True, kw_only=True)
class IntervalStimulus:
    """One interval's shot: what the gun is told, and what the model takes the gun to be."""

    method: str
    direction: Direction
    parameters: Method
    drive: Drive


@dataclass(frozen=True, slots=True, kw_only=True)
class ConditionLimits:
    """What a shot of a cell asks of the gun; `status` is the model's: `home`, `no-break-away`, or `rendered`."""

    levels: Condition
    drive: Drive
    status: str
    settle_s: float


def by_hand(design: DesignConfig) -> tuple[str, ...]:
    """The factors that the experimenter sets by hand."""
    return tuple(name for name in design.factors if name not in (*_NOT_OF_A_SHOT, *DRIVEN))


def settings(design: DesignConfig, trial: Trial) -> tuple[tuple[str, str], ...]:
    """What is set by hand for a trial, as the experimenter reads it."""
    names = by_hand(design)
    return tuple((name, design.factors[name].label(level)) for name, level in trial.levels if name in names)


def intervals(design: DesignConfig, gun: GunConfig, trial: Trial) -> tuple[IntervalStimulus | None, ...]:
    """The stimulus of each interval; `None` for one that is empty. `ConfigError` as `stimulus`."""
    if trial.catch:
        return (None,)
    if not trial.intervals:
        return (stimulus(design, gun, trial.levels),)
    compared = design.trial.compare or ""
    return tuple(
        None if level == EMPTY else stimulus(design, gun, _with(trial.levels, compared, level))
        for level in trial.intervals
    )


def _with(levels: Condition, name: str, level: Level) -> Condition:
    return (*(pair for pair in levels if pair[0] != name), (name, level))


def stimulus(design: DesignConfig, gun: GunConfig, levels: Condition) -> IntervalStimulus:
    """The shot of a cell. `ConfigError`: the gun has no such method or number, or a number is out of range."""
    held = dict(levels)
    method = str(held[METHOD_FACTOR])
    if method not in gun.methods:
        raise ConfigError(f"factors.method: the gun has no method {method!r}; it has {', '.join(gun.methods)}")
    parameters = _changed(gun.rendering(method), _numbers(design, held), method)
    try:
        drive = drive_of(parameters)
    except LimitError as error:
        raise ConfigError(f"{_place(levels)}: {error}") from error
    return IntervalStimulus(
        method=method,
        direction=cast("Direction", held.get(DIRECTION_FACTOR, "forward")),
        parameters=parameters,
        drive=drive,
    )


def _numbers(design: DesignConfig, held: Mapping[str, Level]) -> dict[str, tuple[str, float]]:
    """The gun's numbers that a cell changes, each with the factor that does."""
    found: dict[str, tuple[str, float]] = {}
    for name, level in held.items():
        if name in _NOT_OF_A_SHOT:
            continue
        own = design.factors[name].sets.get(shown_level(level), {})
        if isinstance(level, float) and name in _GUN_NUMBERS:
            own = {name: level, **own}
        elif isinstance(level, float) and not own and _has_unit_of_the_gun(name):
            raise ConfigError(f"factors.{name}: the gun has no such number; it has {', '.join(_GUN_NUMBERS)}")
        for key, value in own.items():
            if key not in _GUN_NUMBERS:
                raise ConfigError(
                    f"factors.{name}.sets.{shown_level(level)}.{key}: the gun has no such number; it has "
                    f"{', '.join(_GUN_NUMBERS)}"
                )
            if key in found:
                raise ConfigError(
                    f"factors.{name} sets {key}, which factors.{found[key][0]} sets as well; keep one of them"
                )
            found[key] = (name, value)
    return found


def _has_unit_of_the_gun(name: str) -> bool:
    """Whether a factor's name ends as the gun's numbers of a drive do: then it is most likely a misspelling of one."""
    return name.rsplit("_", 1)[-1] in {number.rsplit("_", 1)[-1] for number in DRIVEN}


def _changed(parameters: Method, numbers: Mapping[str, tuple[str, float]], method: str) -> Method:
    if not numbers:
        return parameters
    if isinstance(parameters, VibrationParameters):
        factor = next(iter(numbers.values()))[0]
        raise ConfigError(
            f"factors.{factor}: method {method!r} is a vibration, which has no {next(iter(numbers))}; nest the factor: "
            'within = "method"'
        )
    for key, (name, value) in numbers.items():
        try:
            parameters = replace(parameters, **{key: value})  # type: ignore[arg-type] # all are numbers
        except ValueError as error:
            raise ConfigError(f"factors.{name}: {error}") from error
    return parameters


def limits(design: DesignConfig, gun: GunConfig) -> list[ConditionLimits]:
    """What every cell asks of the gun. `ConfigError`: one is beyond a limit, never comes home, or never moves.

    A cell whose magnet never moves is let through by a design that says `below_break_away = true`.
    """
    return [_limits_of(design, gun, levels) for levels in dict.fromkeys(_shot_cells(design))]


def _shot_cells(design: DesignConfig) -> Iterator[Condition]:
    names = [
        name
        for name in design.factors
        if name not in design.between and name not in (DIRECTION_FACTOR, INSTRUCTION_FACTOR)
    ]
    for given in groups(design):
        for cell in cells(design, names, given):
            levels = (*given, *cell)
            yield levels
            standard = design.trial.standard
            if standard is not None and standard != EMPTY and design.trial.compare is not None:
                yield _with(levels, design.trial.compare, standard)


def _limits_of(design: DesignConfig, gun: GunConfig, levels: Condition) -> ConditionLimits:
    shot = stimulus(design, gun, levels)
    try:
        rendering = rendering_of(shot.parameters)
    except LimitError as error:
        raise ConfigError(f"{_place(levels)}: {error}") from error
    if rendering.motion == "no-break-away" and not design.below_break_away:
        raise ConfigError(
            f"{_place(levels)}: no shot of it ever moves the magnet, by the model; raise the voltage or the pulse, or "
            "say `below_break_away = true` if that is what you study"
        )
    return ConditionLimits(levels=levels, drive=shot.drive, status=rendering.motion, settle_s=rendering.settle_s)


def _place(levels: Condition) -> str:
    return ", ".join(f"{name} = {shown_level(level)}" for name, level in levels)
