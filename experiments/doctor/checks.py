"""The checks in their order. Each has a deadline; none stops another.

Work that may hang is waited for no longer than its deadline. What could crash runs in a child program, which is asked
for figures: its crash or silence is an answer.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import IO, TypeVar

from pydantic import TypeAdapter

from device import DeviceError
from experiments.doctor import measures, verdicts
from experiments.doctor.figures import DoctorFinding, ProgramFigures
from experiments.doctor.verdicts import Latencies, latencies, pooled
from experiments.record import journal
from experiments.record.journal import JournalError
from experiments.study.folders import PlaceError

DEADLINE_S = 20.0
PSYCHOPY_DEADLINE_S = 60.0
"""Its import alone takes 6 to 9 s on a disk that has it in memory."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One thing to look at."""

    name: str
    look: Callable[[], tuple[DoctorFinding, ...]]


def checks(results: Path, gun: str, limit_s: float) -> tuple[Check, ...]:
    """What there is to look at, for a results folder and a gun's address; `limit_s` is its line's, there and back."""
    looks: dict[str, Callable[[], tuple[DoctorFinding, ...]]] = {
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


def carry_out_check(check: Check) -> tuple[DoctorFinding, ...]:
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


def _disk(results: Path) -> tuple[DoctorFinding, ...]:
    try:
        return (verdicts.of_disk(within_seconds(DEADLINE_S, partial(measures.appends, results))),)
    except OSError as error:  # a deadline that passed is one as well
        return (verdicts.of_disk_failure(str(results), error.strerror or str(error)),)


def _gun(address: str, limit_s: float) -> tuple[DoctorFinding, ...]:
    try:
        return (verdicts.of_link(within_seconds(DEADLINE_S, partial(measures.gun_line, address)), limit_s),)
    except (DeviceError, OSError) as error:
        return (verdicts.of_link_failure(str(error)),)


def _on_display(name: str, program: str, seconds: float = DEADLINE_S) -> tuple[DoctorFinding, ...]:
    missing = no_display(os.environ, sys.platform)
    answer = ProgramReply(absent=missing) if missing else ask(program, seconds)
    if answer.figures is not None:
        return (verdicts.of_seen(answer.figures),)
    return (verdicts.of_absent(name, answer.absent) if answer.absent else verdicts.of_failure(name, answer.error),)


def _sound() -> tuple[DoctorFinding, ...]:
    answer = ask("sound", DEADLINE_S)
    seen = answer.figures
    return (verdicts.no_sound(answer.absent or answer.error) if seen is None else verdicts.of_seen(seen),)


def _console(results: Path) -> tuple[DoctorFinding, ...]:
    return within_seconds(DEADLINE_S, lambda: verdicts.of_latencies(pooled(_latencies(results))))


def _latencies(results: Path) -> Iterator[Latencies]:
    for path in sorted(results.glob("sub-*/sub-*_journal.jsonl")):
        try:
            yield latencies(journal.read_journal(path).records)
        except JournalError:
            continue  # `recoil study` tells of journals that cannot be read; here they have no stamps to give


_Result = TypeVar("_Result")

PUT_AWAY_S = 2.0


def within_seconds(seconds: float, work: Callable[[], _Result]) -> _Result:
    """The result of some work, or what it raises. `TimeoutError` if it takes longer; it is then left to itself."""
    results: list[_Result] = []
    errors: list[Exception] = []
    done = threading.Event()  # not `join`: once interrupted, it takes the thread for ended

    def carry_out() -> None:
        try:
            results.append(work())
        except Exception as error:  # noqa: BLE001 - raised again where it is waited for
            errors.append(error)
        finally:
            done.set()

    try:
        threading.Thread(target=carry_out, daemon=True, name="check").start()
        done.wait(seconds)
    except KeyboardInterrupt:
        done.wait(PUT_AWAY_S)  # so that it can close and remove what it opened
        raise
    if errors:
        raise errors[0]
    if not results:
        raise TimeoutError(f"did not end within {seconds:g} s")
    return results[0]


_ROOT = Path(__file__).parents[2]
"""Where `experiments` lies: started there, the child runs the same code, whatever the caller's folder holds."""

_KILLED_S = 5.0

_TALKATIVE = {"QT_DEBUG_PLUGINS": "1"}
"""Else Qt blames one system library whichever is missing."""

_MISSING = re.compile(r"\S+\.so[.\d]*: cannot open shared object file")


@dataclass(frozen=True, slots=True, kw_only=True)
class ProgramReply:
    """What a child said: figures, or why there are none: it is `absent` here, or an `error` came in between."""

    figures: ProgramFigures | None = None
    absent: str = ""
    error: str = ""


_REPLY = TypeAdapter(ProgramReply)


def ask(program: str, seconds: float) -> ProgramReply:
    """Run one of the programs beside this module for so long at most."""
    return run_child([sys.executable, "-m", "experiments.doctor.programs", program], seconds)


def run_child(command: list[str], seconds: float) -> ProgramReply:
    """Run a command that answers with one JSON object; killed after its time, or when this process is interrupted."""
    with tempfile.TemporaryFile() as said, tempfile.TemporaryFile() as errors:
        child = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=said, stderr=errors, cwd=_ROOT, env=os.environ | _TALKATIVE
        )
        try:
            code = child.wait(seconds)
        except subprocess.TimeoutExpired:
            return ProgramReply(error=f"did not end within {seconds:g} s")
        finally:
            child.kill()
            with suppress(subprocess.TimeoutExpired):  # stuck in the system: left behind
                child.wait(_KILLED_S)
        return _answer(code, _text(said), _text(errors))


def _answer(code: int, said: str, errors: str) -> ProgramReply:
    if code == 0 and said:
        return _REPLY.validate_json(said)
    ending = f"was killed by signal {-code}" if code < 0 else f"ended with exit code {code}"
    return ProgramReply(error=f"{ending}: {cause(errors)}")


def cause(errors: str) -> str:
    """What a child that died had to say: the library it missed, else its first line that tells of no search."""
    missing = _MISSING.search(errors)
    lines = (line.strip() for line in errors.splitlines())
    told = (line for line in lines if line and not line.startswith("qt.core."))
    return missing[0] if missing else next(told, "it said nothing")


def _text(file: IO[bytes]) -> str:
    file.seek(0, os.SEEK_SET)
    return file.read().decode(errors="replace").strip()
