"""Golden values of the binomial test."""

from __future__ import annotations

import json
from pathlib import Path

from mpmath import mp, mpf

GOLDEN = json.loads((Path(__file__).parent / "golden" / "binomial.json").read_text())
"""References of mpmath, remade by `python -m tests.golden.make_binomial`."""


def digits_of(found: float, reference: str) -> float:
    """Correct digits, at most 17; an infinite or vanished reference must be met exactly."""
    with mp.workdps(40):
        exact = mpf(reference)
        if found == exact:
            return 17.0
        return min(17.0, float(-mp.log10(abs(mpf(found) / exact - 1)))) if exact and mp.isfinite(exact) else 0.0
