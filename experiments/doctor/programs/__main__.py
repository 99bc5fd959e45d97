"""`python -m experiments.doctor.programs NAME`: look at one thing and answer."""

from __future__ import annotations

import sys
from importlib import import_module

from experiments.doctor.figures import ProgramFigures
from experiments.doctor.programs import answer


def look() -> ProgramFigures:
    """Import what the program needs, which may fail, and look."""
    found: ProgramFigures = import_module(f"experiments.doctor.programs.{sys.argv[1]}").look()
    return found


if __name__ == "__main__":
    answer(look)
