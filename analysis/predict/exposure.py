"""How much a participant's hand is shaken in a run: an upper figure beside the limits of Directive 2002/44/EC."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from device.methods import Method
from device.parameters import GunParameters, VibrationParameters
from device.physics import simulate

ACTION_M_S2, LIMIT_M_S2 = 2.5, 5.0
"""Daily exposure action value and limit value of hand-arm vibration, A(8) (Directive 2002/44/EC, article 3)."""
DAY_S = 8 * 3600.0
GUN_MASS_KG = 0.5
"""The gun without its magnet; the paper does not give it (assumed, on the light side)."""
EXPOSURE_ASSUMES = (
    f"a free gun of {GUN_MASS_KG:g} kg (a hand that holds it makes it heavier), no frequency weighting, every shot of "
    "the plan, trains as long as they may be, the magnet's way home as hard as its way out"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Exposure:
    """A(8) in m/s², an upper figure: A(8)² = sum over shots of the integral of a² / 8 h."""

    a8_m_s2: float
    action_m_s2: float = ACTION_M_S2
    limit_m_s2: float = LIMIT_M_S2
    assumed: str = EXPOSURE_ASSUMES


def exposure(shots: Iterable[tuple[Method, int]]) -> Exposure:
    """The exposure of so many shots of each kind.

    >>> round(exposure([(VibrationParameters(), 20)]).a8_m_s2, 2)
    1.05
    """
    total = sum(count * _energy_m2_s3(method) for method, count in shots)
    return Exposure(a8_m_s2=math.sqrt(total / DAY_S))


def _energy_m2_s3(method: Method) -> float:
    """The integral of a² over one shot, or more than that.

    Of the recoil at most peak force times impulse, of an impact force times momentum; both over the gun's mass squared.
    """
    if isinstance(method, VibrationParameters):
        return method.rms_m_s2**2 * method.duration_s
    return _of_a_shot(method)


def _of_a_shot(gun: GunParameters) -> float:
    found = simulate(gun)
    recoil = (found.peak_force_N or 0.0) * (found.recoil_impulse_Ns or 0.0)
    impact = (found.collision_force_N or 0.0) * gun.magnet_mass_kg * (found.impact_speed_m_s or 0.0)
    return 2 * (recoil + impact) / GUN_MASS_KG**2
