"""What a part of `recoil bench` is asked, and what it gives back."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from analysis.report.section import Section

Progress = Callable[[str, int], AbstractContextManager[Callable[[str], None]]]
"""Given what is done and in how many parts, takes the name of each part that is done."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """What to measure with. `figures` is the folder of the page's pictures; a batch holds `batch` shots."""

    seed: int
    repeats: int
    batch: int
    figures: Path
    progress: Progress


@dataclass(frozen=True, slots=True, kw_only=True)
class Measured:
    """What a part found: plain JSON values, the section that tells it, and lines for the terminal."""

    values: Any
    section: Section
    lines: tuple[str, ...] = ()
