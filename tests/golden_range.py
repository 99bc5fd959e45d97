"""golden_range"""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

GOLDEN = json.loads((Path(__file__).parent / "golden" / "studentized_range.json").read_text())["rows"]
K, DF, Q, P, LOG_P = np.array(GOLDEN, dtype=np.float64).T
AS_DOUBLE = P > 1e-305
"""Rows whose p is a double with all its digits; the others are there for the logarithm."""
KS = (2, 3, 4, 5, 10, 20)
DFS = (2, 3, 5, 10, 26, 100, 1e3, 1e4, 1e5, np.inf)
