"""Psychophysics experiments on haptic guns, from a notebook; the command line does the same and more.

    import recoil
    setup = recoil.load_config("direction")
    recoil.run_synthetic(setup, ["P01", "P02", "P03"], "results", seed=1)
    recoil.analyze("results").to_frame()

Names are looked up when they are used, so that importing this costs nothing.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from device.messages import RecoilError
    from device.parameters import GunParameters
    from device.physics import simulate
    from recoil.api import analyze, audit, load_config, plan, power, read_logs, run_synthetic

    __version__: str

__all__ = [
    "GunParameters",
    "RecoilError",
    "__version__",
    "analyze",
    "audit",
    "load_config",
    "plan",
    "power",
    "read_logs",
    "run_synthetic",
    "simulate",
]

_HOMES = {
    "GunParameters": "device.parameters",
    "RecoilError": "device.words",
    "simulate": "device.physics",
}


def __getattr__(name: str) -> object:
    if name == "__version__":
        return import_module("importlib.metadata").version("recoil")
    if name not in __all__:
        raise AttributeError(f"module 'recoil' has no attribute {name!r}; it has {', '.join(__all__)}")
    return getattr(import_module(_HOMES.get(name, "recoil.api")), name)


def __dir__() -> list[str]:
    return __all__
