"""The collision with the rear stop: a rigid impulse, or a stop that gives way. Both in closed form."""

from __future__ import annotations

import math
from dataclasses import dataclass

from device.parameters import GunParameters


@dataclass(frozen=True, slots=True, kw_only=True)
class Collision:
    """What a collision does to the hand; it lasts from the touch until the magnet has stopped."""

    impulse_Ns: float
    peak_force_N: float
    duration_s: float


def rigid_collision(gun: GunParameters, impact_speed_m_s: float) -> Collision:
    """The impulse m v of the inelastic stop, with the paper's estimate m v^2/x_k of its peak (equation 4).

    A stop that takes v over the depth x_k as a spring does a quarter of a swing: pi x_k/(2 v).
    """
    speed = _checked(impact_speed_m_s)
    duration_s = math.pi * gun.contact_depth_m / (2 * speed) if speed > 0 else 0.0
    peak_N = gun.magnet_mass_kg * speed**2 / gun.contact_depth_m
    return Collision(impulse_Ns=gun.magnet_mass_kg * speed, peak_force_N=peak_N, duration_s=duration_s)


def compliant_collision(gun: GunParameters, impact_speed_m_s: float, stop_N_m: float | None = None) -> Collision:
    """The same through a stop that gives way, under which the pre-loaded spring and friction work on.

    m y'' = k (x_0 - y) - F_f - k_c y for the depth y, until y' = 0. The peak is that of the stop's push. Without a
    stiffness k_c in N/m the stop is as stiff as equation (4) takes it to be: k_c = m v^2/x_k^2. `ValueError`: a
    stiffness that is not above 0.
    """
    speed = _checked(impact_speed_m_s)
    if stop_N_m is not None and not 0 < stop_N_m < math.inf:
        raise ValueError(f"stop_N_m is {stop_N_m}; it must be a finite number above 0")
    if speed == 0:
        return Collision(impulse_Ns=0.0, peak_force_N=0.0, duration_s=0.0)
    m, push_N = gun.magnet_mass_kg, gun.stiffness_N_m * gun.preload_length_m - gun.homeward_friction_N
    stop_N_m = m * (speed / gun.contact_depth_m) ** 2 if stop_N_m is None else stop_N_m
    total_N_m = stop_N_m + gun.stiffness_N_m
    omega = math.sqrt(total_N_m / m)
    centre_m = push_N / total_N_m
    duration_s = math.atan2(speed / omega, -centre_m) / omega
    depth_m = centre_m + math.hypot(centre_m, speed / omega)
    swept_m_s = centre_m * duration_s + speed / omega**2 + centre_m * (-math.sin(omega * duration_s) / omega)
    swept_m_s -= speed / omega**2 * math.cos(omega * duration_s)
    return Collision(impulse_Ns=stop_N_m * swept_m_s, peak_force_N=stop_N_m * depth_m, duration_s=duration_s)


def _checked(speed: float) -> float:
    if not 0 <= speed < math.inf:
        raise ValueError(f"impact_speed_m_s is {speed}; it must be a finite number of at least 0")
    return speed
