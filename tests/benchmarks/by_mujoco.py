"""MuJoCo: the mechanics alone. It has no coil; the current is integrated beside it, exactly under a held back-EMF.

A slide joint with a sprung, pre-loaded reference and dry friction (a soft constraint there, made as stiff as the
step allows: with its default the turn comes up to a quarter late), a step at a time from Python; events are placed
between steps by a straight line.
"""

from __future__ import annotations

import math
from typing import Any

from device.parameters import DriveOff, GunParameters
from tests.benchmarks.problem import Outputs, Peer, PeerError, Shoot, break_away

_SETTINGS = (("implicitfast", 1e-3), ("implicitfast", 1e-4), ("implicitfast", 1e-5), ("RK4", 1e-3), ("RK4", 1e-4))
_HORIZON_S = 1.0


def peers() -> list[Peer]:
    """Two of its integrators at several steps."""
    return [
        Peer(
            family=f"MuJoCo {integrator}",
            setting=f"step {h:.0e} s",
            package="mujoco",
            models="mechanics; current by hand",
            build=lambda drive_off, integrator=integrator, h=h: _build(drive_off, integrator, h),  # type: ignore[misc]
        )
        for integrator, h in _SETTINGS
    ]


def _build(drive_off: DriveOff, integrator: str, h: float) -> Shoot:
    import mujoco

    prepared: dict[GunParameters, tuple[Any, Any]] = {}

    def shoot(gun: GunParameters) -> Outputs:
        if gun not in prepared:
            model = mujoco.MjModel.from_xml_string(_page(gun, integrator, h))
            prepared[gun] = model, mujoco.MjData(model)
        model, data = prepared[gun]
        mujoco.mj_resetData(model, data)
        return _shot(gun, drive_off == "shorted", h, data, lambda: mujoco.mj_step(model, data))

    return shoot


def _page(gun: GunParameters, integrator: str, h: float) -> str:
    joint = (
        f'type="slide" axis="1 0 0" stiffness="{gun.stiffness_N_m!r}" springref="{-gun.preload_length_m!r}" '
        f'frictionloss="{gun.friction_N!r}" solreffriction="{2.0 * h!r} 1"'
    )
    body = f'<joint {joint}/><geom type="sphere" size="0.01" mass="{gun.magnet_mass_kg!r}"/>'
    option = f'<option timestep="{h!r}" gravity="0 0 0" integrator="{integrator}"/>'
    return f"<mujoco>{option}<worldbody><body>{body}</body></worldbody></mujoco>"


def _shot(gun: GunParameters, shorted: bool, h: float, data: Any, step: Any) -> Outputs:
    t, i = break_away(gun)
    m, xc, k, R = gun.magnet_mass_kg, gun.coil_reach_m, gun.stiffness_N_m, gun.resistance_ohm
    fade = -math.expm1(-R * h / gun.inductance_H)
    peak, found, x, v = 0.0, dict[str, tuple[float, float]](), 0.0, 0.0
    for _ in range(int(_HORIZON_S / h)):
        u = gun.voltage_V if t + 0.5 * h < gun.pulse_s else 0.0
        i = i + ((u - gun.back_emf_V_s_m * v) / R - i) * fade if u or shorted else 0.0
        motor = gun.motor_constant_N_A * max(0.0, 1.0 - x / xc) * i
        if "edge" not in found:
            peak = max(peak, motor - k * (x + gun.preload_length_m) - gun.friction_N)
        data.qfrc_applied[0] = motor
        step()
        x_last, v_last, x, v = x, v, float(data.qpos[0]), float(data.qvel[0])
        if "edge" not in found and x >= xc:
            part = (xc - x_last) / (x - x_last)
            found["edge"] = t + part * h, m * (v_last + part * (v - v_last))
        if "turn" not in found and "edge" in found and v <= 0.0:
            found["turn"] = t + h * v_last / (v_last - v), x
        if "turn" in found and x <= 0.0:
            part = x_last / (x_last - x)
            return (peak, *found["edge"], *found["turn"], t + part * h, -(v_last + part * (v - v_last)))
        t += h
    raise PeerError("the magnet never landed")
