"""What was measured, as JSON: `python -m tests.benchmarks [REPEATS [BATCH [SEED]]]`."""

from __future__ import annotations

import json
import sys

from tests.benchmarks.leads import compare

given = [int(number) for number in sys.argv[1:]]
sys.stdout.write(json.dumps(compare(*[*given, *(7, 200_000, 1)[len(given) :]])) + "\n")
