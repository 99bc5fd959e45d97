"""How a gun of another package is let in: by its entry point, tried in a process of its own first.

    [project.entry-points."recoil.guns"]
    sound-card = "sound_card_gun:open_gun"

`--gun sound-card:REST` calls `open_gun(REST, methods, clock)` and puts the guard before what it gives back.
"""

from __future__ import annotations

import inspect
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from concurrent.futures import Future
from dataclasses import dataclass
from importlib.metadata import Distribution, EntryPoint, distributions
from pathlib import Path
from typing import cast

from device.interrupts import answer_of, answer_within, begin_aside, interrupts_held, wait_awake
from device.messages import error_line, said_by
from device.methods import Method
from device.own_process import own_environment, own_program
from device.plugin.guard import DISARM_S, GuardedGun, GunLeftOpen, PluginError
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

    def takes(self, name: str) -> bool:
        """Whether a plug-in can be called so in an address."""
        return name not in self.own and name != "" and ":" not in name


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


IMPORTED = b"imported"
"""What the process that tries an import says at its end: another end is none of ours, whatever its exit code."""


@dataclass(frozen=True, slots=True, kw_only=True)
class InstalledPlugins:
    """The entry points of a kind, and of which packages they cannot be read or used, with the reason."""

    points: tuple[EntryPoint, ...]
    unreadable: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """What they are called."""
        return tuple(sorted({point.name for point in self.points}))


def installed_plugins(kind: PluginKind = GUN_PLUGINS) -> InstalledPlugins:
    """What is installed beside Recoil. A package whose entry points are broken hides no other's."""
    points, unreadable, seen = list[EntryPoint](), list[str](), set[str]()
    for package in distributions():
        name = _package_name(package)
        if name in seen:  # what comes later on the path is not imported
            continue
        seen.add(name)
        try:
            found = package.entry_points.select(group=kind.group)
        except (TypeError, ValueError) as error:  # a line that is none; bytes that are no UTF-8
            why = error if isinstance(error, UnicodeError) else "a line is no `NAME = MODULE:FUNCTION`"
            unreadable.append(f"{name}: its entry_points.txt cannot be read ({why}): mend or uninstall it")
            continue
        points += (one for one in found if kind.takes(one.name))
        unreadable += (
            f"{name}: its {kind.name} {one.name!r} cannot be called so: another name must be chosen"
            for one in found
            if not kind.takes(one.name)
        )
    return InstalledPlugins(points=tuple(points), unreadable=tuple(unreadable))


def _package_name(package: Distribution) -> str:
    try:
        return package.metadata["Name"] or _NAMELESS
    except UnicodeError:
        return Path(str(getattr(package, "_path", _NAMELESS))).name


_NAMELESS = "a package without a name"


def open_plugin(address: str, methods: Mapping[str, Method], clock: Callable[[], float]) -> GuardedGun:
    """The gun at `NAME:REST`, behind the guard.

    `ValueError`: no such plug-in; `PluginError`: refused, and why; `GunLeftOpen`: refused, and it may be armed.
    """
    name, _, rest = address.partition(":")
    make = _loaded(entry_of(name))
    opened: Future[object] = Future()
    guarded: GuardedGun | None = None
    try:
        gun = _opened(address, opened, lambda: make(rest, dict(methods), clock))
        with interrupts_held():  # else one could come where nobody knows of the gun
            guarded = _guarded(name, gun, methods, clock)
    except KeyboardInterrupt as stop:
        with interrupts_held():
            wait_awake(opened, DISARM_S)
            if not opened.done() or not isinstance(opened.exception(), LinkError | None):
                why = f"gun plug-in {name} was interrupted while it was being opened"
                raise GunLeftOpen(f"{why}; it may be armed: switch off its power") from stop
            if opened.exception() is None:
                (guarded or _guarded(name, opened.result(), methods, clock)).close()
        raise
    return guarded


def _opened(address: str, opened: Future[object], make: Callable[[], object]) -> object:
    """What a plug-in makes of its part of the address."""
    name, _, rest = address.partition(":")
    try:
        begin_aside(opened, make, "plug-in")
        return answer_of(opened, PLUGIN_OPEN_S)
    except LinkError as error:
        raise PluginError(f"{address}: {error_line(error) or 'it did not open, and does not say why'}") from error
    except Exception as error:
        why = f"gun plug-in {name} did not open {rest!r}: {said_by(error)}"
        raise GunLeftOpen(f"{why}; it may be armed: switch off its power") from error


def _guarded(name: str, gun: object, methods: Mapping[str, Method], clock: Callable[[], float]) -> GuardedGun:
    """What a plug-in opened, behind the guard, if it is a gun that is disarmed."""
    try:
        check_commands(f"gun plug-in {name}", gun, GUN_COMMANDS, "a gun")
    except PluginError as error:
        _put_away(gun, error)
        raise
    return GuardedGun(name, cast("Gun", gun), methods, clock)


def _put_away(gun: object, why: PluginError) -> None:
    """Disarm and close what lacks something, as far as it can. `GunLeftOpen`: it may be armed still."""
    failed = False
    with interrupts_held():
        for command in ("disarm", "close"):
            try:
                answer_within(DISARM_S, getattr(gun, command))
            except Exception:  # noqa: BLE001 - a plug-in may do anything
                failed = True
        if failed:
            raise GunLeftOpen(f"{why}; it could not be disarmed and closed: switch off its power") from why


def try_import(name: str, seconds: float = IMPORT_S) -> None:
    """Import a plug-in in a process of its own, which may hang or crash. `PluginError` says what it did."""
    with tempfile.TemporaryFile() as errors:
        try:
            done = subprocess.run(
                own_program("device.plugin", name),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=errors,
                env=own_environment(),
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
    if done.returncode or done.stdout != IMPORTED:
        ended = f"was killed by signal {-done.returncode}" if done.returncode < 0 else "failed"
        ended = ended if done.returncode else "ended the process"
        raise PluginError(f"gun plug-in {name}: its import {ended}: {said.rpartition(chr(10))[2] or 'it said nothing'}")


def entry_of(name: str, kind: PluginKind = GUN_PLUGINS) -> EntryPoint:
    """The one entry point of that name. `ValueError`: there is none; `PluginError`: two packages have it."""
    there = installed_plugins(kind)
    found = [point for point in there.points if point.name == name]
    if not found:
        known = ", ".join(there.names) or "none is"
        raise ValueError(
            f"address is {name!r}; it must be {kind.ours}, or begin with the name of a {kind.name} that is installed "
            + "; ".join([f"beside Recoil ({known})", *there.unreadable])
        )
    if len({point.value for point in found}) > 1:
        packages = ", ".join(sorted(_package(point) for point in found))
        raise PluginError(f"{kind.name} {name}: several packages bring it: {packages}; uninstall all but one")
    point = found[0]
    if not point.pattern.match(point.value):
        raise PluginError(
            f"{kind.name} {name}: the package {_package(point)} gives it as `{name} = {point.value}` in its entry "
            "points; it must be `NAME = MODULE:FUNCTION`"
        )
    return point


def _package(point: EntryPoint) -> str:
    return _package_name(point.dist) if point.dist is not None else point.value


def _loaded(point: EntryPoint) -> Callable[..., object]:
    if point.module not in sys.modules:
        try_import(point.name)
    try:
        make = answer_within(IMPORT_S, point.load)
    except Exception as error:
        raise PluginError(f"gun plug-in {point.name}: {point.value}: {said_by(error)}") from error
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
