"""`recoil twin`, a gun that is none, on a pseudo-terminal or a TCP port; `recoil doctor`, the rig's self-test."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Literal

from analysis.report.section import Section, Table
from analysis.report.serial import as_json
from analysis.report.terminal import Progress, with_tables
from device.serial_gun.gun import MAX_SPEED
from device.twin.core import IDENTITY
from device.twin.sockets import Pty, Socket, Tcp
from device.twin.twin import Make, Troubles, Twin
from experiments.clock import RealClock
from experiments.config.door import ConfigError
from experiments.doctor.checks import GunLeftArmed, LanguageAsked, carry_out_check, checks
from experiments.doctor.figures import DoctorFinding
from experiments.doctor.verdicts import not_fired, overall
from experiments.load import find, load_gun
from experiments.record import storage


@dataclass(frozen=True, slots=True, kw_only=True)
class TwinRequest:
    """What was asked for on the command line."""

    gun: str
    link: Path | None
    tcp: int | None
    speed: float
    drift_ppm: float
    wire: int | None
    troubles: Sequence[str]
    seed: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Plugged:
    """A twin that can be opened: where, and the `--gun` that opens it."""

    address: str
    gun: str


def serve(asked: TwinRequest, tell: Callable[[Plugged], None]) -> None:
    """Be a gun until interrupted. `tell` is called once it can be opened. `ConfigError`: it cannot be so."""
    gun = load_gun(find(asked.gun))
    methods = {name: gun.rendering(name) for name in gun.methods}
    socket = _socket(asked)
    twin = Twin(socket, methods, _make(asked))
    try:
        socket.plug()
    except OSError as error:
        raise ConfigError(f"the twin cannot be plugged in here: {error}; try --tcp PORT, or another --link") from error
    try:
        tell(Plugged(address=socket.address, gun=_gun_option(socket.address, asked.speed)))
        twin.serve()
    finally:
        socket.unplug()


def _socket(asked: TwinRequest) -> Socket:
    if asked.tcp is not None and asked.link is not None:
        raise ConfigError("--tcp and --link: give one of them")
    return Pty(asked.link) if asked.tcp is None else Tcp(asked.tcp)


def _gun_option(address: str, speed: float) -> str:
    return f"serial:{address}" + (f"?speed={speed:g}" if speed != 1 else "")


def _make(asked: TwinRequest) -> Make:
    if not 0 < asked.speed <= MAX_SPEED:
        raise ConfigError(f"--speed is {asked.speed:g}; it must be above 0 and at most {MAX_SPEED:g}")
    troubles = troubles_of(asked.troubles)
    if troubles.unplugs and asked.tcp is None and asked.link is None:
        raise ConfigError("--trouble unplug...: a new pseudo-terminal has a new name; give --link PATH that stays")
    identity = IDENTITY if asked.wire is None else replace(IDENTITY, wire=asked.wire)
    return Make(identity=identity, speed=asked.speed, drift_ppm=asked.drift_ppm, troubles=troubles, seed=asked.seed)


def troubles_of(words: Sequence[str]) -> Troubles:
    """Troubles from `name=value`. `ConfigError` names the word and what may stand there.

    >>> troubles_of(["lose=0.01", "jitter_s=0.005"]).jitter_s
    0.005
    """
    known, found = [field.name for field in fields(Troubles)], dict[str, float]()
    for word in words:
        name, _, value = word.partition("=")
        try:
            if name not in known:
                raise ValueError(f"unknown; known are {', '.join(known)}")
            found[name] = _number(name, value)
            Troubles(**{name: found[name]})
        except ValueError as error:
            raise ConfigError(f"--trouble {word}: {error}") from error
    return Troubles(**found)


def _number(name: str, value: str) -> float:
    try:
        return float(value)
    except ValueError:
        raise ValueError(f"{name} is {value!r}; it must be a number") from None


@dataclass(frozen=True, slots=True, kw_only=True)
class Examination:
    """What every check found, when, and the worst verdict; `left_armed` says why a gun may be armed still."""

    utc: str
    verdict: Literal["good", "warning", "fails"]
    checks: tuple[DoctorFinding, ...]
    left_armed: str = ""


def examine(
    results: Path,
    gun: str,
    config: str,
    progress: Progress,
    *,
    shots: int = 0,
    sensor: str = "",
    asked: LanguageAsked | None = None,
) -> Examination:
    """Carry out every check; `config` is the gun's, with the limit of its line. With `shots` the gun is fired.

    A participant's language is looked at where it is asked for. A gun that may be left armed ends it.

    `PlaceError`: the gun's address has no such form; `ConfigError`: the config cannot be used.
    """
    findings, device = list[DoctorFinding](), load_gun(find(config))
    methods = device.renderings(tuple(device.methods))
    limit_s = device.serial.round_trip_limit_s
    planned = checks(results, gun, limit_s, shots=shots, sensor=sensor, methods=methods, asked=asked)
    left_armed = ""
    with progress("doctor", len(planned)) as tell:
        try:
            for check in planned:
                fails = check.name == "shots" and any(one.check == "gun" and one.verdict == "fails" for one in findings)
                findings += (not_fired(),) if fails else carry_out_check(check)
                tell(check.name)
        except GunLeftArmed as left:
            findings += left.found
            left_armed = str(left)
    verdict = overall([finding.verdict for finding in findings])
    return Examination(utc=RealClock().utc(), verdict=verdict, checks=tuple(findings), left_armed=left_armed)


def keep(found: Examination, path: Path) -> None:
    """Put the machine-readable result into a file, in place of an older one."""
    storage.make_folder(path.parent)
    storage.write_whole(path, as_json(found))


def examination_text(findings: tuple[DoctorFinding, ...]) -> str:
    """The findings as a table, for people at a terminal."""
    rows = tuple((one.check, str(one.verdict), one.measured, one.advice) for one in findings)
    header = ("check", "verdict", "measured", "what to do")
    section = Section(title="", tables=(Table(caption="", header=header, rows=rows),))
    return with_tables(section, ruled=True, unfolded=2)
