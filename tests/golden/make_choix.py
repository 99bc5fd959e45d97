"""Bradley and Terry's scores by choix 0.4 (MIT): `python tests/golden/make_choix.py`, where that is installed."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np


def main() -> None:
    """Fifty designs of three to eight items, each pair compared three to eleven times, that have scores (Ford 1957)."""
    import choix
    from scipy.sparse.csgraph import connected_components

    draws, cases = np.random.default_rng(0), []
    while len(cases) < 50:
        n = int(draws.integers(3, 9))
        worth, wins = draws.normal(0, 1, n), np.zeros((n, n), int)
        for one, other in zip(*np.triu_indices(n, 1), strict=True):
            times = int(draws.integers(3, 12))
            wins[one, other] = draws.binomial(times, 1 / (1 + np.exp(worth[other] - worth[one])))
            wins[other, one] = times - wins[one, other]
        if connected_components(wins > 0, connection="strong")[0] == 1:
            chosen = [pair for pair in np.ndindex(n, n) for _ in range(wins[pair])]
            scores = choix.opt_pairwise(n, chosen, alpha=0, tol=1e-12)
            cases.append({"wins": wins.tolist(), "scores": (scores - scores.mean()).tolist()})
    Path(__file__).with_name("choix.json").write_text(json.dumps(cases) + "\n")


if __name__ == "__main__":
    main()
