"""Programs of their own for what could crash: each is asked for figures, and its crash or silence is an answer."""

from __future__ import annotations

import os
import re
import subprocess
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from typing import IO

from pydantic import TypeAdapter

from device.own_process import how_ended, own_environment, own_program
from experiments.doctor.figures import ProgramFigures

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
    return run_child(own_program("experiments.doctor.programs", program), seconds)


def run_child(command: list[str], seconds: float) -> ProgramReply:
    """Run a command that answers with one JSON object; killed after its time, or when this process is interrupted."""
    with tempfile.TemporaryFile() as said, tempfile.TemporaryFile() as errors:
        child = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=said, stderr=errors, env=own_environment() | _TALKATIVE
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
    return ProgramReply(error=f"{how_ended(code)}: {cause(errors)}")


def cause(errors: str) -> str:
    """What a child that died had to say: the library it missed, else its first line that tells of no search."""
    missing = _MISSING.search(errors)
    lines = (line.strip() for line in errors.splitlines())
    told = (line for line in lines if line and not line.startswith("qt.core."))
    return missing[0] if missing else next(told, "it said nothing")


def _text(file: IO[bytes]) -> str:
    file.seek(0, os.SEEK_SET)
    return file.read().decode(errors="replace").strip()
