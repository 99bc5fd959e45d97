"""What a design asks of the gun, held against the limits that no config can lift: cells, methods, trains, hands."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from device.limits import MAX_SHOTS_PER_MINUTE, DriveHistory, Load
from device.methods import rendering_of
from device.parameters import GunParameters
from device.words import Drive, LimitError
from experiments.config.door import ConfigError, at_key, said_of
from experiments.config.setup import GunConfig, Setup
from experiments.design.config import GUN_NUMBERS, DesignConfig
from experiments.design.language import METHOD_FACTOR, TRAIN_INTERVAL
from experiments.design.plan import Condition
from experiments.design.stimuli import beyond_limits, damper, settings, shot_cells, shown_cell, stimulus


@dataclass(frozen=True, slots=True, kw_only=True)
class ConditionLimits:
    """What a shot of a cell asks of the gun; `status` is the model's: `home`, `no-break-away`, or `rendered`.

    `peak_force_N`: on the hand, by the model; `None` of a vibration.
    """

    levels: Condition
    drive: Drive
    load: Load
    status: str
    settle_s: float
    peak_force_N: float | None


def limits(design: DesignConfig, gun: GunConfig) -> list[ConditionLimits]:
    """What every cell asks of the gun. `ConfigError`: one is beyond a limit, never comes home, or never moves.

    A cell whose magnet never moves is let through by a design that says `below_break_away = true`. `ConfigError`, too,
    where a hand would have to set what a procedure chooses, or what catch trials have not.
    """
    found = [_limits_of(design, gun, levels) for levels in dict.fromkeys(shot_cells(design))]
    _check_hands(design, gun)
    _check_catch(design, gun)
    return found


def _check_hands(design: DesignConfig, gun: GunConfig) -> None:
    """What is chosen after an answer comes too late for a hand that sets the gun before."""
    by_others: dict[Condition, dict[tuple[tuple[str, str], ...], str]] = {}
    for levels in shot_cells(design) if design.adapted else ():
        others = tuple(pair for pair in levels if pair[0] not in design.adapted)
        by_others.setdefault(others, {}).setdefault(settings(design, gun, levels), shown_cell(levels))
    for found in (found for found in by_others.values() if len(found) > 1):
        (one, cell), (other, other_cell) = [*found.items()][:2]
        name, *_ = design.adapted
        raise ConfigError(
            f"factors.{name}.levels: a procedure chooses them after an answer, when hands have set the gun, and "
            f"{cell} has {_hand_words(one)}, {other_cell} {_hand_words(other)}; take levels that are set alike"
        )


def _check_catch(design: DesignConfig, gun: GunConfig) -> None:
    """A catch trial has no method where that varies from trial to trial: it would be known by the damper."""
    mixed = design.trial.catch > 0 and METHOD_FACTOR in design.varying
    by_damper = {damper(gun, method): method for method in design.methods} if mixed else {}
    if len(by_damper) > 1:
        (one, method), (other, other_method) = [*by_damper.items()][:2]
        raise ConfigError(
            f"factors.method.levels: {method} has {_hand_words(one)}, {other_method} {_hand_words(other)}, and catch "
            "trials, which have no method, would be known; name method in order.session or order.set, or take methods "
            "that are set alike"
        )


def _hand_words(held: tuple[tuple[str, str], ...]) -> str:
    return ", ".join(f"{name} {level}" for name, level in held) or "nothing to set"


def _limits_of(design: DesignConfig, gun: GunConfig, levels: Condition) -> ConditionLimits:
    shot = stimulus(design, gun, levels)
    try:
        rendering = rendering_of(shot.parameters)
    except LimitError as error:
        raise beyond_limits(design, levels, str(error)) from error
    if rendering.motion == "no-break-away" and not design.below_break_away:
        raise beyond_limits(
            design,
            levels,
            "no shot of it ever moves the magnet, by the model; raise the voltage or the pulse; or, if that is what "
            "you study, write `below_break_away = true` on top of the design's file, above its first [table]",
        )
    return ConditionLimits(
        levels=levels,
        drive=shot.drive,
        load=rendering.load,
        status=rendering.motion,
        settle_s=rendering.settle_s,
        peak_force_N=rendering.peak_force_N,
    )


def unchanged_methods(design: DesignConfig) -> tuple[str, ...]:
    """The methods that a design takes as the gun has them: all, or none where a factor changes its numbers."""
    changed = any(name in GUN_NUMBERS or factor.sets for name, factor in design.factors.items())
    return () if changed else design.methods


def check_limits(setup: Setup[DesignConfig]) -> None:
    """Each cell of a design within the limits, its trains as well. `ConfigError` with cell, value and limit."""
    trial = setup.config.trial
    with said_of(setup.source):
        for cell in limits(setup.config, setup.gun):
            every_s = dict(cell.levels).get(TRAIN_INTERVAL, trial.repeat_every_s)
            if trial.kind == "train" and isinstance(every_s, float):
                _check_train(cell, every_s, trial.max_shots)


def check_methods(gun: GunConfig, methods: tuple[str, ...], source: Path) -> None:
    """Methods of a gun that can be run: within the limits, and moving. `ConfigError` names file, method and rule."""
    for name, method in gun.renderings(methods).items():
        try:
            rendering = rendering_of(method)
        except LimitError as error:
            raise ConfigError(at_key(source, f"methods.{name}: {error}")) from error
        if isinstance(method, GunParameters) and rendering.motion == "no-break-away":
            raise ConfigError(at_key(source, f"methods.{name}: {_never_moves(method)}"))


def _never_moves(gun: GunParameters) -> str:
    """Why no shot of a gun ever moves: what holds the standing magnet, and what the coil pulls with at the most.

    Held by k x_0 + F_f; pulled by k_m i, where i = V/R (1 - exp(-R t/L)) is largest at the end of the pulse.
    """
    held_N = gun.stiffness_N_m * gun.preload_length_m + gun.friction_N
    share = -math.expm1(-gun.resistance_ohm * gun.pulse_s / gun.inductance_H)
    pull_N = gun.motor_constant_N_A * gun.voltage_V / gun.resistance_ohm * share
    return (
        f"no shot ever moves the magnet, by the model: spring and friction hold it with {held_N:.4g} N "
        f"(friction_N {gun.friction_N:g}), and the coil pulls with {pull_N:.4g} N at the most (voltage_V "
        f"{gun.voltage_V:g} for pulse_s {gun.pulse_s:g}); lower the friction, or raise the voltage or the pulse"
    )


def _check_train(cell: ConditionLimits, every_s: float, shots: int) -> None:
    history = DriveHistory()
    try:
        for start_s in (shot * every_s for shot in range(min(shots, _ENOUGH_SHOTS))):
            history = history.record(cell.load, start_s, start_s + cell.settle_s)
    except LimitError as error:
        raise ConfigError(
            f"trial.repeat_every_s = {every_s:g}: {shown_cell(cell.levels)} needs {cell.settle_s:.4g} s until its "
            f"magnet is home, and no more than {MAX_SHOTS_PER_MINUTE} shots a minute are allowed ({error}); repeat "
            "more slowly"
        ) from error


_ENOUGH_SHOTS = 2 * MAX_SHOTS_PER_MINUTE
"""A train that keeps the limits for so long keeps them for ever, but for the coil, which is warm by then as well."""
