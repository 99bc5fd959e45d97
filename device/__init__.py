"""The gun: the words of its protocol, its physics, its limits, and `open_gun`, which gives a `Gun`.

Importing this package is cheap; the physics and its libraries are imported when a gun is opened or simulated.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from device.machine_clock import machine_s
from device.words import (
    DeviceError,
    Effect,
    Gun,
    GunStatus,
    Identity,
    LimitError,
    LinkError,
    Pulse,
    Shot,
    ShotReport,
    ShotTiming,
)

if TYPE_CHECKING:
    from device.methods import Method
    from device.parameters import GunParameters

__all__ = [
    "DeviceError",
    "Effect",
    "Gun",
    "GunStatus",
    "Identity",
    "LimitError",
    "LinkError",
    "Pulse",
    "Shot",
    "ShotReport",
    "ShotTiming",
    "open_gun",
]


def open_gun(
    address: str,
    parameters: GunParameters | Mapping[str, Method] | None = None,
    *,
    clock: Callable[[], float] = machine_s,
) -> Gun:
    """A disarmed gun at `address`, "simulated" or "serial:PORT"; "serial:auto" looks for the one that answers.

    "NAME:..." is the gun that a plug-in of this name brings (`device.plugin`), behind the same limits.

    `parameters`: the rendering methods by name, or a gun from which the paper's three are made (the paper's gun if
    None). `LinkError`: the gun does not answer. `ValueError`: no such form of address.

    >>> gun = open_gun("simulated", clock=lambda: 0.0)
    >>> gun.arm()
    >>> gun.fire(Shot(method="vibration", direction="forward", drive=Effect(effect=1))).motion
    'rendered'
    """
    if not isinstance(address, str):
        raise ValueError(f'address is {address!r}; it must be text: "simulated" or "serial:PORT"')
    # pyserial and the physics wait until they are wanted
    if address.startswith("serial:"):
        from device.serial_gun.gun import open_serial  # noqa: PLC0415

        return open_serial(address, _methods(parameters), clock)
    if address != "simulated":
        from device.plugin.door import open_plugin  # noqa: PLC0415

        return open_plugin(address, _methods(parameters), clock)
    from device.simulated import SimulatedGun  # noqa: PLC0415

    return SimulatedGun(_methods(parameters), clock)


def _methods(parameters: GunParameters | Mapping[str, Method] | None) -> Mapping[str, Method]:
    from device.methods import paper_methods  # noqa: PLC0415 - importing the words alone stays cheap
    from device.parameters import GunParameters  # noqa: PLC0415

    if isinstance(parameters, Mapping):
        return parameters
    if not isinstance(parameters, GunParameters | None):
        raise ValueError(f"parameters is {parameters!r}; it must be a gun, or rendering methods by name")
    return paper_methods() if parameters is None else paper_methods(parameters)
