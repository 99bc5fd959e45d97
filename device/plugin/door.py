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
from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from typing import cast

from device.methods import Method
from device.plugin.guard import GuardedGun, PluginError, answer_within
from device.words import Gun, LinkError


@dataclass(frozen=True, slots=True, kw_only=True)
class PluginKind:
    """What a plug-in may be: the group of its entry points, and what it is called.

    `own` are names that no plug-in can have, `ours` the addresses of our own.
    """

    group: str
    name: str
    own: tuple[str, ...]
    ours: str


GUN_PLUGINS = PluginKind(
    group="recoil.guns",
    name="gun plug-in",
    own=("simulated", "serial"),
    ours='"simulated" or "serial:PORT"',
)
SENSOR_PLUGINS = PluginKind(
    group="recoil.sensors",
    name="sensor plug-in",
    own=("simulated", "csv"),
    ours='"simulated" or "csv:PATH"',
)
IMPORT_S = 20.0
"""So long the import of a plug-in may take; PsychoPy's takes less. Assumed."""
PLUGIN_OPEN_S = 10.0
"""So long it may take to find its device. Assumed."""
GUN_COMMANDS: dict[str, int] = {"identify": 0, "arm": 0, "fire": 2, "disarm": 0, "status": 0, "close": 0}
"""What a gun has, and how many parameters each is called with."""


def plugin_names(kind: PluginKind = GUN_PLUGINS) -> tuple[str, ...]:
    """The names of the plug-ins of a kind that are installed."""
    return tuple(sorted({point.name for point in entry_points(group=kind.group)} - {*kind.own}))


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
    check_commands(f"gun plug-in {name}", gun, GUN_COMMANDS, "a gun")
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


def entry_of(name: str, kind: PluginKind = GUN_PLUGINS) -> EntryPoint:
    """The one entry point of that name. `ValueError`: there is none; `PluginError`: two packages have it."""
    found = [point for point in entry_points(group=kind.group) if point.name == name and name not in kind.own]
    if not found:
        known = ", ".join(plugin_names(kind)) or "none is"
        raise ValueError(
            f"address is {name!r}; it must be {kind.ours}, or begin with the name of a {kind.name} that is installed "
            f"beside Recoil ({known})"
        )
    if len({point.value for point in found}) > 1:
        packages = ", ".join(sorted(_package(point) for point in found))
        raise PluginError(f"{kind.name} {name}: several packages bring it: {packages}; uninstall all but one")
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


def check_commands(who: str, made: object, commands: Mapping[str, int], what: str) -> None:
    """`PluginError` names the commands that `what` has and `made` lacks, or that do not take as many parameters."""
    lacking = [command for command in commands if not callable(getattr(made, command, None))]
    if lacking:
        raise PluginError(f"{who}: {type(made).__name__} has no {', '.join(lacking)}; {what} has {', '.join(commands)}")
    for command, count in commands.items():
        try:
            inspect.signature(getattr(made, command)).bind(*[None] * count)
        except TypeError as error:
            wanted = f"{command}({'shot, at_s' if count else ''})"
            raise PluginError(f"{who}: it cannot be called as {wanted}: {error}") from error
