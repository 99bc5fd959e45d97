"""The eleven one-way data sets of NIST's Statistical Reference Datasets, as scipy's wheel carries them."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import scipy

FOLDER = Path(scipy.__path__[0]) / "stats" / "tests" / "data" / "nist_anova"
NAMES = ("AtmWtAg", "SiRstv", *(f"SmLs0{number}" for number in range(1, 10)))


def read(name: str) -> tuple[list[np.ndarray], float]:
    """The groups and the certified F."""
    text = (FOLDER / f"{name}.dat").read_text(encoding="ascii")
    row = re.search(r"^Between .*$", text, re.MULTILINE)
    assert row is not None
    data = np.array([line.split() for line in text.splitlines()[60:] if line.strip()], dtype=np.float64)
    return [data[data[:, 0] == group, 1] for group in np.unique(data[:, 0])], float(row.group().split()[-1])
