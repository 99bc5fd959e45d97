"""One shot of the haptic gun, predicted: its summary and its course over time.

    m d2x/dt2 = F_m - k (x + x_0) - F_f sign(dx/dt)    (1), the spring pre-loaded against the rear stop at x = 0
    F_m = (x_c - x)/x_c k_m i inside the coil, else 0  (2)
    u = k_e dx/dt + i R + L di/dt                      (3)

All times count from the onset of the pulse. The force on the hand F = m d2x/dt2 is positive in the direction of
recoil; the collision with the stop is apart from it.

One shot's summary needs no arrays; what batches, traces and scenes need is imported when they are used.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from device.parameters import DriveOff, Emf, GunParameters
from device.physics.equations import FIDELITIES, Status
from device.physics.shot import ShotSummary, simulate

if TYPE_CHECKING:
    from device.physics.batch import ShotBatch, compiled_simulator, simulate_batch
    from device.physics.scenes import SCENES, Scene, choose_model
    from device.physics.traces import ShotTrace, trace

__all__ = [
    "FIDELITIES",
    "SCENES",
    "DriveOff",
    "Emf",
    "GunParameters",
    "Scene",
    "ShotBatch",
    "ShotSummary",
    "ShotTrace",
    "Status",
    "choose_model",
    "compiled_simulator",
    "simulate",
    "simulate_batch",
    "trace",
]

_HOMES = {
    **dict.fromkeys(("ShotBatch", "compiled_simulator", "simulate_batch"), "batch"),
    **dict.fromkeys(("SCENES", "Scene", "choose_model"), "scenes"),
    **dict.fromkeys(("ShotTrace", "trace"), "traces"),
}


def __getattr__(name: str) -> object:
    if name not in _HOMES:
        raise AttributeError(f"module 'device.physics' has no attribute {name!r}; it has {', '.join(__all__)}")
    return getattr(import_module(f"device.physics.{_HOMES[name]}"), name)
