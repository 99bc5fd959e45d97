"""What the two kinds of actuator are made of: plain frozen numbers, checked when built, each with its source.

"Paper" is section II of the haptic gun's paper; "assumed" is ours, because the paper does not say.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from typing import Literal, get_args

from device.words import MAX_EFFECT, is_finite, is_whole_number, shown

DriveOff = Literal["shorted", "open"]
Emf = Literal["printed", "reciprocal"]


@dataclass(frozen=True, slots=True, kw_only=True)
class GunParameters:
    """The voice-coil gun of equations (1) to (3) and its drive pulse. Defaults: the paper's gun without damper.

    `drive_off` is what the coil does after the pulse: `shorted` keeps equation (3) with u = 0 (assumed default),
    `open` lets no current flow from the end of the pulse on. `emf` is the back-EMF: `printed` is k_e dx/dt
    everywhere, `reciprocal` fades with the coil's force, (1 - x/x_c) k_e dx/dt inside the coil and 0 outside, so
    that energy balances. `return_friction_N` is that of a damper which brakes the way back otherwise than the way out
    (the paper's future work). `ValueError` names the field, its value and the rule.

    >>> GunParameters(voltage_V=20.0).friction_N
    0.21
    """

    magnet_mass_kg: float = 0.114  # m, paper
    back_emf_V_s_m: float = 7.6  # k_e, paper
    resistance_ohm: float = 2.9  # R, paper
    inductance_H: float = 0.72e-3  # L, paper
    motor_constant_N_A: float = 7.6  # k_m, paper
    coil_reach_m: float = 0.0075  # x_c, paper (printed as "x")
    stiffness_N_m: float = 14.0  # k, paper, measured
    preload_length_m: float = 0.10  # x_0, paper, measured
    friction_N: float = 0.21  # F_f, paper, measured: 0.21 without damper, 1.12 with it
    voltage_V: float = 16.0  # pulse height, paper
    pulse_s: float = 0.010  # pulse length, paper: 10 % of a 10 Hz period
    contact_depth_m: float = 0.0005  # x_k, assumed: the paper says "submillimeter"
    drive_off: DriveOff = "shorted"  # assumed
    emf: Emf = "printed"  # paper
    return_friction_N: float | None = None  # None: friction_N on both ways

    def __post_init__(self) -> None:
        _take_numbers(self, above_zero=ABOVE_ZERO, not_numbers=("drive_off", "emf"), may_be_none=MAY_BE_NONE)
        _is_one_of("drive_off", self.drive_off, get_args(DriveOff))
        _is_one_of("emf", self.emf, get_args(Emf))

    @property
    def homeward_friction_N(self) -> float:  # noqa: N802 - the unit ends the name
        """The friction on the way back."""
        return self.friction_N if self.return_friction_N is None else self.return_friction_N


ABOVE_ZERO = ("magnet_mass_kg", "resistance_ohm", "inductance_H", "coil_reach_m", "contact_depth_m")
"""What the equations divide by; the other numbers may be 0."""
MAY_BE_NONE = ("return_friction_N",)
"""What takes another number's place if it is left out."""


@dataclass(frozen=True, slots=True, kw_only=True)
class VibrationParameters:
    """The vibration that serves as reference: one library effect of the linear resonant actuator's driver.

    The paper describes "several decaying sinusoidal waves" by peak, root mean square and duration of the
    acceleration. `ValueError` names the field, its value and the rule.
    """

    effect: int = 1  # library waveform of the DRV2605, paper
    peak_m_s2: float = 1000.0  # paper, measured
    rms_m_s2: float = 257.54  # paper, over the duration
    duration_s: float = 0.024  # paper, "about"
    frequency_Hz: float = 175.0  # assumed: the usual resonance of such actuators, 150 to 250 Hz

    def __post_init__(self) -> None:
        if not (is_whole_number(self.effect) and 1 <= self.effect <= MAX_EFFECT):
            raise ValueError(
                f"effect is {shown(self.effect)}; it must be a waveform of the DRV2605, a whole number from 1 to "
                f"{MAX_EFFECT}"
            )
        _take_numbers(self, above_zero=("peak_m_s2", "rms_m_s2", "duration_s", "frequency_Hz"), not_numbers=("effect",))


def _take_numbers(
    parameters: GunParameters | VibrationParameters,
    *,
    above_zero: tuple[str, ...],
    not_numbers: tuple[str, ...] = (),
    may_be_none: tuple[str, ...] = (),
) -> None:
    """Check the numbers by kind and range; whole ones and numpy's become floats, as the physics counts in."""
    for name in (field.name for field in fields(parameters) if field.name not in not_numbers):
        value = getattr(parameters, name)
        if value is None and name in may_be_none:
            continue
        strict = name in above_zero
        if not (is_finite(value) and (value > 0 if strict else value >= 0)):
            raise ValueError(
                f"{name} is {shown(value)}; it must be a finite number {'above 0' if strict else 'of at least 0'}"
            )
        if type(value) is not float:
            object.__setattr__(parameters, name, float(value))


def _is_one_of(name: str, value: str, options: tuple[str, ...]) -> None:
    if value not in options:
        raise ValueError(f"{name} is {value!r}; it must be one of {', '.join(options)}")


def damper_friction(bare_N: float, coefficient: float, stiffness_N_m: float, deformation_m: float) -> float:
    """F_f = F_f0 + 2 mu eps dV in N, for two rubber strips pressed on the magnet (equation 5).

    The paper calls eps the elastic modulus and dV the deformation of one strip; the product must be a force, so eps
    is read as the strip's stiffness in N/m. `ValueError`: a number that is not finite or below 0.

    >>> round(damper_friction(0.21, 0.7, 1300.0, 0.0005), 2)
    1.12
    """
    values = {
        "bare_N": bare_N,
        "coefficient": coefficient,
        "stiffness_N_m": stiffness_N_m,
        "deformation_m": deformation_m,
    }
    for name, value in values.items():
        if not 0 <= value < math.inf:
            raise ValueError(f"{name} is {value}; it must be a finite number of at least 0")
    return bare_N + 2 * coefficient * stiffness_N_m * deformation_m
