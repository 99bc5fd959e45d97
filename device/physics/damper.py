"""Equation (5): the friction that the rubber damper adds."""

from __future__ import annotations

import math


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


def strip_stiffness(modulus_Pa: float, area_m2: float, thickness_m: float) -> float:
    """The stiffness of a strip under pressure, E A/t in N/m. `ValueError`: a number that is not above 0.

    >>> strip_stiffness(1.5e6, 2e-6, 0.003)
    1000.0
    """
    for name, value in (("modulus_Pa", modulus_Pa), ("area_m2", area_m2), ("thickness_m", thickness_m)):
        if not 0 < value < math.inf:
            raise ValueError(f"{name} is {value}; it must be a finite number above 0")
    return modulus_Pa * area_m2 / thickness_m
