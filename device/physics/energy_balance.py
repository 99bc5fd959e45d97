"""Where a shot's energy and momentum went: integrals of its segments, checked against each other.

    supplied + created = heat + friction + impacts + switched off + stored,   created = motor work - back-EMF work

With the reciprocal back-EMF (and k_e = k_m) nothing is created; the printed one k_e dx/dt is constant along the stroke
while the force fades, and makes or swallows energy. The impulse on the hand over a whole cycle is zero.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from device.parameters import GunParameters
from device.physics.equations import COIL, SETTLED, STOP, grip, pack
from device.physics.traces import Segment, segments

_NODES, _WEIGHTS = (row.tolist() for row in np.polynomial.legendre.leggauss(32))
_PIECE_S = 0.05  # of a free arc: a small part of the spring's period
_FADED = 60.0  # time constants after which no current is left

Motion = tuple[float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class EnergyBalance:
    """The energies of one shot in J and its impulses in N s, from the onset to rest (or to where it was given up)."""

    supplied_J: float  # by the drive
    created_J: float  # by a back-EMF that is not reciprocal; below 0 if it swallows
    heat_J: float
    friction_J: float
    impacts_J: float
    switched_off_J: float  # the coil's energy that an opened drive takes
    stored_J: float  # in spring, motion and coil, more than at the onset
    residual_J: float  # what does not add up: rounding
    force_impulse_Ns: float  # integral of F on the hand
    collision_impulse_Ns: float  # of the impacts on the stop, of the other sign
    residual_impulse_Ns: float  # both, and the momentum that is left


def energy_balance(gun: GunParameters) -> EnergyBalance:
    """The audit of one shot from rest."""
    shot = list(segments(pack(gun)))
    supplied, heat, motor, emf, force = (math.fsum(row) for row in zip(*map(_integrals, shot), strict=True))
    friction = math.fsum(_friction_work(segment) for segment in shot)
    impacts = [gun.magnet_mass_kg * segment.end[1] for segment in shot if segment.ended_by == STOP]
    lost = math.fsum(impulse**2 / gun.magnet_mass_kg / 2 for impulse in impacts)
    cut = math.fsum(gun.inductance_H / 2 * (a.end[2] ** 2 - b.start[2] ** 2) for a, b in pairwise(shot))
    x, v, i = shot[-1].end
    stored = gun.magnet_mass_kg / 2 * v**2 + gun.stiffness_N_m * x * (gun.preload_length_m + x / 2)
    stored += 0.0 if shot[-1].ended_by == SETTLED else gun.inductance_H / 2 * i**2
    return EnergyBalance(
        supplied_J=supplied,
        created_J=motor - emf,
        heat_J=heat,
        friction_J=friction,
        impacts_J=lost,
        switched_off_J=cut,
        stored_J=stored,
        residual_J=supplied + motor - emf - heat - friction - lost - cut - stored,
        force_impulse_Ns=force,
        collision_impulse_Ns=-math.fsum(impacts),
        residual_impulse_Ns=force - math.fsum(impacts) - gun.magnet_mass_kg * v,
    )


def _friction_work(segment: Segment) -> float:
    p = segment.constants
    return (p.friction_back if segment.heading < 0 else p.friction_out) * abs(segment.end[0] - segment.start[0])


def _integrals(segment: Segment) -> tuple[float, ...]:
    """Over the segment: u i, R i^2, F_m v, emf i and F."""
    total = [0.0] * 5
    for start_s, end_s in _pieces(segment):
        half = (end_s - start_s) / 2
        for node, weight in zip(_NODES, _WEIGHTS, strict=True):
            rates = _rates(segment, segment.at(start_s + half * (1 + node)))
            total = [sum_ + half * weight * rate for sum_, rate in zip(total, rates, strict=True)]
    return tuple(total)


def _rates(segment: Segment, state: Motion) -> tuple[float, ...]:
    x, v, i = state
    p = segment.constants
    seen = grip(p, x) if p.reciprocal else 1.0
    heat, emf = p.resistance * i * i, p.back_emf * seen * v * i
    return segment.drive_V * i, heat, segment.motor_force(state) * v, emf, segment.force(state)


def _pieces(segment: Segment) -> Iterator[tuple[float, float]]:
    """Stretches over which 32 nodes integrate to rounding: steps of the series, or doubling from the transient on."""
    if segment.kind == COIL:
        yield segment.start_s, segment.end_s
        return
    time_constant_s = segment.constants.inductance / segment.constants.resistance
    end_s = segment.end_s
    if end_s == math.inf:
        end_s = segment.start_s + (_FADED * time_constant_s if segment.live else 0.0)
    start_s, width_s = segment.start_s, (4 * time_constant_s if segment.live else _PIECE_S)
    while start_s < end_s:
        following_s = min(start_s + width_s, end_s)
        yield start_s, following_s
        start_s, width_s = following_s, min(2 * width_s, _PIECE_S)
