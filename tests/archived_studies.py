"""A small study with all that can be the matter with runs, to be archived."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from analysis.archive import manifest
from experiments.clock import RealClock, VirtualClock
from experiments.config.setup import sha256
from experiments.load import load_setup
from experiments.record.journal import link_of, record_line
from experiments.record.rebuild import rebuild
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.study.new_study import new_study
from experiments.study.register import append, entry
from tests.at_runs import shorten
from tests.journals import raw

NAME = "Dr Ohm"
"""Whom nothing that is published may name."""
WORDS = "It kicked like a mule"
"""What synthetic participants say now and then."""
SECRET_PLACES = ("/dev/ttyUSB7", "/home/ohm")


def small_study(folder: Path) -> Path:
    """P01 to P04 with both experiments, with notes, faults, a run that was stopped and all kinds of runs left out."""
    new_study(folder)
    shorten(folder)
    people = folder / "synthetic" / "preference.toml"
    people.write_text(people.read_text().replace('law = "words"', f'law = "words"\ntexts = ["{WORDS}", ""]'))
    for code in ("P01", "P02", "P03", "P04", "P05"):
        for experiment in ("direction", "preference"):
            _run(folder, experiment, code)
    _run(folder, "direction", "P01", practice=True)
    _write_remarks(_journal(folder, "P01", "direction"))
    _stop(_journal(folder, "P03", "direction"), table=True)
    _stop(_journal(folder, "P04", "direction"), table=False)
    aside = _journal(folder, "P02", "preference")
    aside.with_name(aside.name.replace(".jsonl", ".aside-1.jsonl")).write_bytes(aside.read_bytes())
    edited = _journal(folder, "P04", "preference").with_name("sub-P04_task-preference_ratings.csv")
    edited.write_bytes(edited.read_bytes().replace(b",0.", b",1.").replace(b",5.", b",6.") + b"\r\n")
    for code, age in (("P01", 94), ("P02", 25), ("P06", 30)):
        append(folder / "results", entry("joined", code, facts={"age_years": age, "sex": "female"}), RealClock())
    append(folder / "results", entry("excluded", "P05", reason=f"knew {NAME}"), RealClock())
    return folder


def _run(folder: Path, experiment: str, code: str, *, practice: bool = False) -> None:
    setup = load_setup(folder / f"{experiment}.toml")
    asked = RunRequest(
        setup=setup, participant_id=code, results=folder / "results", practice=practice, seed=int(code[1:])
    )
    if (experiment, code) == ("preference", "P03"):
        asked = replace(asked, sensor="simulated")
    run(asked, synthetic_screen, VirtualClock())


def _journal(folder: Path, code: str, experiment: str) -> Path:
    return folder / "results" / f"sub-{code}" / f"sub-{code}_task-{experiment}_journal.jsonl"


def _write_remarks(path: Path) -> None:
    """Notes, reasons and a fault that name somebody or some place, in the place of a journal's end."""
    entries = raw(path)[:-1]
    times = {key: entries[-1][key] for key in ("monotonic_s", "utc", "synced_s")}
    trial = next(one["body"]["trial"] for one in entries if one["kind"] == "step" and "trial" in one["body"])
    said = [
        {"kind": "noted", "trial": trial, "text": f"{NAME} came in"},
        {"kind": "noted", "trial": None, "text": NAME},
        {"kind": "halt-reason", "text": f"{NAME} fell"},
        {"kind": "test-shot", "method": "vibration", "held_s": None, "cause": f"{SECRET_PLACES[0]}: no answer"},
        {"kind": "flagged", "trial": trial, "flag": "noise"},
    ]
    entries += [{"kind": "remark", "body": body, **times} for body in said]
    entries.append({"kind": "stopped", "reason": f"{NAME} left", **times})
    entries[0]["setup"]["experiment"] |= {"synthetic": f"{SECRET_PLACES[1]}/synthetic.toml", "assumed": []}
    entries[0]["host"] = f"lab-pc of {NAME}"
    path.write_bytes(_with_hashes(entries))
    table, data, _ = rebuild(path)
    table.write_bytes(data)


def _with_hashes(entries: list[dict[str, Any]]) -> bytes:
    """Records as lines whose hashes, numbers and links are right, whatever they say; keys keep their order."""
    entries[0]["setup_sha256"] = sha256(entries[0]["setup"])
    lines: list[bytes] = []
    for n, one in enumerate(entries):
        lines.append(record_line(one | {"n": n, "link": link_of(lines[-1]) if lines else ""}))
    return b"".join(lines)


def _stop(path: Path, *, table: bool) -> None:
    """Cut a journal in its middle, with the table of what was answered by then, or without one."""
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[: len(lines) // 2]))
    where, data, _ = rebuild(path)
    where.unlink()
    if table:
        where.write_bytes(data)


def sealed(folder: Path) -> None:
    """Write an archive's manifest anew, as a forger would who changed it."""
    (folder / manifest.MANIFEST_FILE).write_bytes(manifest.manifest_bytes(folder))
