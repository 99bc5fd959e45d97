"""Posterior means by psignifit 4.3 (GPL-3): `python tests/golden/make_psignifit.py`, in an environment that has it."""

from __future__ import annotations

import json
import time
from pathlib import Path

import numpy as np
from scipy.stats import norm

NAMES = {"threshold": "threshold", "width": "width", "lambda": "lapse", "gamma": "guess", "eta": "overdispersion"}


def main() -> None:
    """Nine levels of 20 trials, a cumulative normal of sd 2, a lapse rate of 0.02."""
    import psignifit

    draws, cases = np.random.default_rng(0), []
    for number in range(4):
        levels, kind = np.linspace(-4, 4, 9), ("2AFC", "yes/no")[number % 2]
        guess = 0.5 if kind == "2AFC" else 0.05
        shares = guess + (1 - guess - 0.02) * norm.cdf((levels - draws.uniform(-1, 1)) / 2)
        right, fixed = draws.binomial(20, shares), {} if number >= 2 else {"fixed_parameters": {"eta": 0}}
        data, began_s = np.array([levels, right, np.full(9, 20)]).T, time.perf_counter()
        fit = psignifit.psignifit(data, experiment_type=kind, sigmoid="norm", **fixed)
        means = {NAMES[name]: float(value) for name, value in fit.get_parameter_estimate("mean").items()}
        case = {
            "levels": levels.tolist(),
            "right": right.tolist(),
            "trials": 20,
            "kind": kind,
            "overdispersed": not fixed,
        }
        cases.append({**case, "mean": means, "took_s": round(time.perf_counter() - began_s, 1)})
    Path(__file__).with_name("psignifit.json").write_text(json.dumps(cases, indent=1) + "\n")


if __name__ == "__main__":
    main()
