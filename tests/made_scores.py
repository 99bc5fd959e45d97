"""Tables of scores of every kind that a repeated-measures ANOVA meets."""

from __future__ import annotations

import numpy as np

KINDS = ("ordinary", "weak", "huge", "far apart")


def made_scores(seed: int, n: int, k: int, kind: str, offset: float) -> np.ndarray:
    """A table (n, k) of spread 1 about `offset`.

    `weak` has F below 0.01, `huge` near 1e8 and above, and no offset, which would leave its residuals no digit; in
    `far apart` each participant has an offset of his own, up to `offset`.
    """
    rng = np.random.default_rng(seed)
    noise, people, effect = rng.normal(size=(n, k)), 2 * rng.normal(size=(n, 1)), rng.normal(size=k)
    match kind:
        case "weak":
            return offset + people + noise - noise.mean(axis=0) + 1e-3 * effect
        case "huge":
            return 1e-4 * (people + noise) + effect
        case "far apart":
            return people + noise + 0.6 * effect + offset ** rng.uniform(0, 1, size=(n, 1))
        case _:
            return offset + people + noise + 0.6 * effect
