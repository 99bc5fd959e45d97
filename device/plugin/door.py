"""How a gun of another package is let in: by its entry point, tried in a process of its own first.

    [project.entry-points."recoil.guns"]
    sound-card = "sound_card_gun:open_gun"

`--gun sound-card:REST` calls `open_gun(REST, methods, clock)` and puts the guard before what it gives back.
"""

from __future__ import annotations

import inspect
import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import cast

from device.methods import Method
from device.plugin.guard import GuardedGun, PluginError, answer_within
from device.words import Gun, LinkError

GROUP = "recoil.guns"
OUR_OWN = ("simulated", "serial")
"""Names that no plug-in can have."""
IMPORT_S = 20.0
"""So long the import of a plug-in may take; PsychoPy's takes less. Assumed."""
PLUGIN_OPEN_S = 10.0
"""So long it may take to find its device. Assumed."""
GUN_COMMANDS: dict[str, int] = {"identify": 0, "arm": 0, "fire": 2, "disarm": 0, "status": 0, "close": 0}
"""What a gun has, and how many parameters each is called with."""


def plugin_names() -> tuple[str, ...]:
    """The names of the gun plug-ins that are installed."""
    return tuple(sorted({point.name for point in entry_points(group=GROUP)} - {*OUR_OWN}))


def open_plugin(address: str, methods: Mapping[str, Method], clock: Callable[[], float]) -> GuardedGun:
    """The gun at `NAME:REST`, behind the guard. `ValueError`: no such plug-in; `PluginError`: refused, and why."""
    name, _, rest = address.partition(":")
    make = _loaded(entry_of(name))
    try:
        gun = answer_within(PLUGIN_OPEN_S, lambda: make(rest, dict(methods), clock))
    except LinkError as error:
        raise PluginError(f"{address}: {error}") from error
    except Exception as error:
        raise PluginError(f"gun plug-in {name} did not open {rest!r}: {type(error).__name__}: {error}") from error
    _check_commands(name, gun)
    return GuardedGun(name, cast("Gun", gun), methods, clock)


def try_import(name: str, seconds: float = IMPORT_S) -> None:
    """Import a plug-in in a process of its own, which may hang or crash. `PluginError` says what it did."""
    command = [sys.executable, "-P", "-m", "device.plugin", name]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(path or str(Path.cwd()) for path in sys.path)}
    with tempfile.TemporaryFile() as errors:
        try:
            done = subprocess.run(
                command,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=errors,
                env=environment,
                timeout=seconds,
                check=False,
            )
        except subprocess.TimeoutExpired as error:
            raise PluginError(
                f"gun plug-in {name}: its import did not end within {seconds:g} s; a module must not wait for its "
                "device while it is imported, only when it is opened: mend or uninstall it"
            ) from error
        errors.seek(0)
        said = errors.read().decode(errors="replace").strip()
    if done.returncode:
        ended = f"was killed by signal {-done.returncode}" if done.returncode < 0 else "failed"
        raise PluginError(f"gun plug-in {name}: its import {ended}: {said.rpartition(chr(10))[2] or 'it said nothing'}")


def entry_of(name: str) -> EntryPoint:
    """The one entry point of that name. `ValueError`: there is none; `PluginError`: two packages have it."""
    found = [point for point in entry_points(group=GROUP) if point.name == name and name not in OUR_OWN]
    if not found:
        known = ", ".join(plugin_names()) or "none is"
        raise ValueError(
            f'address is {name!r}; it must be "simulated" or "serial:PORT", or begin with the name of a gun plug-in '
            f"that is installed beside Recoil ({known})"
        )
    if len({point.value for point in found}) > 1:
        packages = ", ".join(sorted(_package(point) for point in found))
        raise PluginError(f"gun plug-in {name}: several packages bring it: {packages}; uninstall all but one")
    return found[0]


def _package(point: EntryPoint) -> str:
    return point.dist.name if point.dist is not None else point.value


def _loaded(point: EntryPoint) -> Callable[..., object]:
    if point.module not in sys.modules:
        try_import(point.name)
    try:
        make = answer_within(IMPORT_S, point.load)
    except Exception as error:
        raise PluginError(f"gun plug-in {point.name}: {point.value}: {type(error).__name__}: {error}") from error
    return cast("Callable[..., object]", make)


def _check_commands(name: str, gun: object) -> None:
    """`PluginError` names the commands that a gun lacks, or that do not take what a gun's take."""
    lacking = [command for command in GUN_COMMANDS if not callable(getattr(gun, command, None))]
    if lacking:
        raise PluginError(
            f"gun plug-in {name}: {type(gun).__name__} has no {', '.join(lacking)}; "
            f"a gun has {', '.join(GUN_COMMANDS)} (device.Gun)"
        )
    for command, count in GUN_COMMANDS.items():
        try:
            inspect.signature(getattr(gun, command)).bind(*[None] * count)
        except TypeError as error:
            wanted = f"{command}({'shot, at_s' if count else ''})"
            raise PluginError(f"gun plug-in {name}: it cannot be called as {wanted}: {error}") from error
