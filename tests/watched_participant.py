"""The participant's screen as it is, with an eye on its pages: called as a program with a file, then its own words.

Whenever another page was drawn, the file gets a line: the page's kind and, of a plain message, the text. A second
file has the process id.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from typing import Any

from tests.warm_start import warm


def words(file: Path, own: list[str]) -> list[str]:
    """The participant's program, to be carried out under the eye."""
    return warm("-m", "tests.watched_participant", file, *own)


def pages(file: Path) -> list[str]:
    """The pages that were shown, from the first to the last."""
    return file.read_text(encoding="utf-8").splitlines() if file.exists() else []


def pid(file: Path) -> int:
    """The process that was started last."""
    return int(file.with_suffix(".pid").read_text())


def watch(file: Path) -> None:
    """From now on, write down each page once it was drawn."""
    from experiments.screens.participant.stage import Stage

    step, last = Stage.step, None

    def watched_step(stage: Stage) -> None:
        nonlocal last
        step(stage)
        if stage.page is not last and stage.drawn_s:
            last = stage.page
            with file.open("a", encoding="utf-8") as out:
                out.write(f"{_told(last)}\n")

    Stage.step = watched_step


def _told(page: Any) -> str:
    message = getattr(page, "message", None)
    return " ".join(filter(None, (type(page).__name__, getattr(message, "text", "").strip())))


if __name__ == "__main__":
    from experiments.screens.participant.__main__ import main

    file = Path(sys.argv.pop(1))
    file.with_suffix(".pid").write_text(str(os.getpid()))
    watch(file)
    code = main()
    sys.stderr.flush()
    os._exit(code)
