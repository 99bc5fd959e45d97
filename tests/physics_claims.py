"""The paper's claims about the force, measured on a simulated gun: what several tests ask."""

from __future__ import annotations

import numpy as np

from device.physics import GunParameters, simulate, trace

BARE, DAMPED = GunParameters(friction_N=0.21), GunParameters(friction_N=1.12)
VARIANTS = [(off, emf) for off in ("shorted", "open") for emf in ("printed", "reciprocal")]
TABLE_FRICTION = 0.3  # assumed: the enclosure on the table
WHOLE_GUN_KG = 0.3402  # paper


def motor_peak_N(gun: GunParameters) -> float:
    """The largest force of the motor."""
    return float(trace(gun, 8000).motor_force_N.max())


def share_after_turn(gun: GunParameters) -> float:
    """The largest force on the hand between turning point and collision, as a part of the recoil's peak."""
    shot = trace(gun, 20_000)
    back = (shot.time_s > shot.summary.firing_end_s) & (shot.time_s < shot.summary.reset_end_s)
    return float(np.abs(shot.force_N[back]).max() / shot.summary.peak_force_N)


def slide_mm(gun: GunParameters) -> float:
    """How far the collision moves the free gun: it takes the magnet's momentum, and the table's friction stops it."""
    together = gun.magnet_mass_kg * simulate(gun).impact_speed_m_s / WHOLE_GUN_KG
    return together**2 / (2 * TABLE_FRICTION * 9.81) * 1e3
