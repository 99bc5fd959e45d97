"""`recoil doctor`: the rig's self-test as a table for people and as JSON, kept beside the data if asked for."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from analysis.report.section import Section, Table
from analysis.report.serial import as_json
from analysis.report.terminal import Progress, with_tables
from experiments.clock import RealClock
from experiments.doctor.checks import carry_out_check, checks
from experiments.doctor.figures import DoctorFinding
from experiments.doctor.verdicts import overall
from experiments.load import find, load_gun
from experiments.record import storage


@dataclass(frozen=True, slots=True, kw_only=True)
class Examination:
    """What every check found, when, and the worst verdict."""

    utc: str
    verdict: Literal["good", "warning", "fails"]
    checks: tuple[DoctorFinding, ...]


def examine(results: Path, gun: str, config: str, progress: Progress) -> Examination:
    """Carry out every check; `config` is the gun's, with the limit of its line.

    `PlaceError`: the gun's address has no such form; `ConfigError`: the config cannot be used.
    """
    findings, planned = list[DoctorFinding](), checks(results, gun, load_gun(find(config)).serial.round_trip_limit_s)
    with progress("doctor", len(planned)) as tell:
        for check in planned:
            findings += carry_out_check(check)
            tell(check.name)
    verdict = overall([finding.verdict for finding in findings])
    return Examination(utc=RealClock().utc(), verdict=verdict, checks=tuple(findings))


def keep(found: Examination, path: Path) -> None:
    """Put the machine-readable result into a file, in place of an older one."""
    storage.make_folder(path.parent)
    storage.write_whole(path, as_json(found))


def findings_section(findings: tuple[DoctorFinding, ...]) -> Section:
    """The findings as a table."""
    rows = tuple((one.check, str(one.verdict), one.measured, one.advice) for one in findings)
    header = ("check", "verdict", "measured", "what to do")
    return Section(title="", tables=(Table(caption="", header=header, rows=rows),))


def examination_text(findings: tuple[DoctorFinding, ...]) -> str:
    """The table for people at a terminal."""
    return with_tables(findings_section(findings), ruled=True, unfolded=2)
