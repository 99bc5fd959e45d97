"""Fits by psignifit 4.3 (GPL-3), by a Python that has it: data sets come in as JSON, means and seconds go out.

A line a data set; `free`: with overdispersion fitted. Nothing of ours is imported.
"""

from __future__ import annotations

import json
import sys
import time

import numpy as np

NAMES = {"threshold": "threshold", "width": "width", "lambda": "lapse", "gamma": "guess", "eta": "overdispersion"}


def main() -> None:
    """Stop after the seconds that are given."""
    import psignifit

    began_s, most_s = time.perf_counter(), float(sys.argv[1])
    for case in json.load(sys.stdin):
        if time.perf_counter() - began_s > most_s:
            break
        data = np.array([case["levels"], case["right"], case["trials"]]).T
        fixed = {} if case["free"] else {"fixed_parameters": {"eta": 0}}
        from_s = time.process_time()
        fit = psignifit.psignifit(data, experiment_type=case["kind"], sigmoid="norm", **fixed)
        took_s = time.process_time() - from_s
        means = {NAMES[name]: float(value) for name, value in fit.get_parameter_estimate("mean").items()}
        sys.stdout.write(json.dumps({"took_s": took_s, "mean": means}) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
