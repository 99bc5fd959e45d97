"""Programs that look at what could crash or hang: each runs in a process of its own and answers with one JSON object.

Whatever the libraries that it imports print or raise does not spoil the answer. Only here are Qt, PsychoPy, Lab
Streaming Layer, sound and X libraries imported.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from dataclasses import asdict
from typing import NoReturn

from experiments.doctor.figures import ProgramFigures

OPTIONAL = ("PyQt6", "Xlib", "psychopy", "pylsl", "sounddevice")


class Absent(Exception):  # noqa: N818 - that something is not there is no error
    """This machine does not have what the program looks at; the message says what is missing."""


def answer(look: Callable[[], ProgramFigures]) -> NoReturn:
    """Look, answer, and end at once: no library's last acts are waited for."""
    with os.fdopen(os.dup(1), "w", encoding="utf-8") as said:
        os.dup2(2, 1)  # what libraries print goes to the errors
        sys.stdout = sys.stderr
        json.dump(_answer(look), said)
    os._exit(0)


def _answer(look: Callable[[], ProgramFigures]) -> dict[str, object]:
    try:
        return {"figures": asdict(look())}
    except Absent as absent:
        return {"absent": str(absent)}
    except ModuleNotFoundError as error:
        return {"absent": f"{error.name} is not installed"} if error.name in OPTIONAL else {"error": _line(error)}
    except BaseException as error:  # noqa: BLE001 - PsychoPy's errors derive from BaseException, and some parts of it exit
        return {"error": _line(error)}


def _line(error: BaseException) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())
