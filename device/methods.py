"""The rendering methods: what each is made of, how it is driven, and how long its shot takes by the model."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

from device.limits import Load, load_of
from device.parameters import GunParameters, VibrationParameters
from device.words import Drive, Effect, LimitError, Pulse

Method = GunParameters | VibrationParameters

FRICTION_I_N = 0.21
"""Asymmetric Force I, without damper (paper)."""
FRICTION_II_N = 1.12
"""Asymmetric Force II, with the friction damper (paper)."""

_PAPER_GUN = GunParameters()


@dataclass(frozen=True, slots=True, kw_only=True)
class Rendering:
    """What the model says of one shot: the motion's status (`rendered` for a vibration), and what it asks of the coil.

    `settle_s` are the seconds from the onset of the pulse until the next shot may start: when the magnet is back at its
    stop, and never before the end of the pulse; for a vibration its duration. `peak_force_N`: `None` of a vibration.
    """

    motion: str
    settle_s: float
    load: Load
    peak_force_N: float | None = None


def paper_methods(gun: GunParameters = _PAPER_GUN) -> dict[str, Method]:
    """The paper's three methods; all but the friction of the two asymmetric ones comes from `gun`."""
    return {
        "vibration": VibrationParameters(),
        "asymmetric-1": replace(gun, friction_N=FRICTION_I_N),
        "asymmetric-2": replace(gun, friction_N=FRICTION_II_N),
    }


def drive_of(method: Method) -> Drive:
    """The drive that the method's own numbers ask for. `LimitError`: beyond what a command may be."""
    if isinstance(method, VibrationParameters):
        return Effect(effect=method.effect)
    if not isinstance(method, GunParameters):
        raise LimitError(f"method is {method!r}; it must be GunParameters or VibrationParameters")
    return Pulse(voltage_V=method.voltage_V, pulse_s=method.pulse_s)


def rendering_of(method: Method, drive: Drive | None = None) -> Rendering:
    """What the model says of one shot of the method, driven by `drive` or by its own.

    `LimitError`: the shot would never bring the magnet home, or the drive is not of the method's kind.
    """
    drive = drive_of(method) if drive is None else drive
    if isinstance(method, VibrationParameters) and isinstance(drive, Effect):
        return Rendering(motion="rendered", settle_s=method.duration_s, load=load_of(drive, 0.0))
    if isinstance(method, GunParameters) and isinstance(drive, Pulse):
        return _shot(replace(method, voltage_V=drive.voltage_V, pulse_s=drive.pulse_s))
    wanted = "an Effect" if isinstance(method, VibrationParameters) else "a Pulse"
    raise LimitError(f"drive is {drive}; this method is driven by {wanted}")


@lru_cache(maxsize=4096)
def _shot(gun: GunParameters) -> Rendering:
    from device.physics import simulate  # noqa: PLC0415 - the heavy import waits until the physics is used

    summary = simulate(gun)
    if summary.status not in ("home", "no-break-away"):
        raise LimitError(
            f"drive of {gun.voltage_V:g} V for {gun.pulse_s:g} s at friction_N {gun.friction_N:g}: the model's magnet "
            f"does not come home ({summary.status}), so no shot could follow; lower the friction or change the pulse"
        )
    load = load_of(Pulse(voltage_V=gun.voltage_V, pulse_s=gun.pulse_s), gun.resistance_ohm)
    return Rendering(
        motion=summary.status,
        settle_s=max(summary.reset_end_s or 0.0, gun.pulse_s),
        load=load,
        peak_force_N=summary.peak_force_N,
    )
