"""The checks in their order. Each has a deadline; none stops another."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from device import DeviceError
from experiments.doctor import children, measures, verdicts
from experiments.doctor.children import Answer, within
from experiments.doctor.figures import Finding
from experiments.doctor.verdicts import Latencies, latencies, together
from experiments.record import journal
from experiments.record.journal import JournalError
from experiments.study.places import PlaceError

DEADLINE_S = 20.0
PSYCHOPY_DEADLINE_S = 60.0
"""Its import alone takes 6 to 9 s on a disk that has it in memory."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One thing to look at."""

    name: str
    look: Callable[[], tuple[Finding, ...]]


def checks(results: Path, gun: str, limit_s: float) -> tuple[Check, ...]:
    """What there is to look at, for a results folder and a gun's address; `limit_s` is its line's, there and back."""
    looks: dict[str, Callable[[], tuple[Finding, ...]]] = {
        "machine": lambda: (verdicts.of_machine(measures.machine()),),
        "clock": lambda: (verdicts.of_clock(measures.ticks()),),
        "disk": partial(_disk, results),
        "gun": partial(_gun, gun, limit_s),
        "USB adapter": lambda: (verdicts.of_adapters(measures.adapters()),),
        "display": partial(_on_display, "display", "display"),
        "PsychoPy": partial(_on_display, "PsychoPy", "stage", PSYCHOPY_DEADLINE_S),
        "sound": _sound,
        "keyboard": partial(_on_display, "keyboard", "keys"),
        "console": partial(_console, results),
    }
    return tuple(Check(name=name, look=look) for name, look in looks.items())


def carry_out(check: Check) -> tuple[Finding, ...]:
    """What a check found; that it broke off is a finding too. `PlaceError` if it was asked for the impossible."""
    try:
        return check.look()
    except PlaceError:
        raise
    except Exception as error:  # noqa: BLE001 - a rig in trouble is what this is for: the other checks go on
        return (verdicts.of_failure(check.name, _reason(error)),)


def _reason(error: Exception) -> str:
    return str(error) if isinstance(error, TimeoutError | DeviceError) else f"{type(error).__name__}: {error}"


def no_display(environment: Mapping[str, str], platform: str) -> str:
    """Why no window can open here; empty if one may. Qt ends the process where it has no display."""
    if platform != "linux" or any(map(environment.get, ("DISPLAY", "WAYLAND_DISPLAY", "QT_QPA_PLATFORM"))):
        return ""
    return "neither DISPLAY nor WAYLAND_DISPLAY is set"


def _disk(results: Path) -> tuple[Finding, ...]:
    try:
        return (verdicts.of_disk(within(DEADLINE_S, partial(measures.appends, results))),)
    except OSError as error:  # a deadline that passed is one as well
        return (verdicts.of_disk_failure(str(results), error.strerror or str(error)),)


def _gun(address: str, limit_s: float) -> tuple[Finding, ...]:
    try:
        return (verdicts.of_link(within(DEADLINE_S, partial(measures.link, address)), limit_s),)
    except (DeviceError, OSError) as error:
        return (verdicts.of_link_failure(str(error)),)


def _on_display(name: str, program: str, seconds: float = DEADLINE_S) -> tuple[Finding, ...]:
    missing = no_display(os.environ, sys.platform)
    answer = Answer(absent=missing) if missing else children.ask(program, seconds)
    if answer.figures is not None:
        return (verdicts.of_seen(answer.figures),)
    return (verdicts.of_absent(name, answer.absent) if answer.absent else verdicts.of_failure(name, answer.error),)


def _sound() -> tuple[Finding, ...]:
    answer = children.ask("sound", DEADLINE_S)
    seen = answer.figures
    return (verdicts.no_sound(answer.absent or answer.error) if seen is None else verdicts.of_seen(seen),)


def _console(results: Path) -> tuple[Finding, ...]:
    return within(DEADLINE_S, lambda: verdicts.of_latencies(together(_latencies(results))))


def _latencies(results: Path) -> Iterator[Latencies]:
    for path in sorted(results.glob("sub-*/sub-*_journal.jsonl")):
        try:
            yield latencies(journal.read(path).records)
        except JournalError:
            continue  # `recoil study` tells of journals that cannot be read; here they have no stamps to give
