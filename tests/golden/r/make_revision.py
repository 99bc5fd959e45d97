"""Trials given to R's mixed models: `python make_revision.py` writes `revision.json` beside this file.

Each set has a row a trial: whose it is, its condition, a number x, an answer and a value. Drawn as in `make_datasets`
from raw bits; numbers are rounded, so R reads the very doubles that Python reads.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path

from tests.golden.r.make_datasets import normals


@dataclass(frozen=True, slots=True, kw_only=True)
class Trials:
    """So many people and trials a condition; log odds of the conditions, and how people differ."""

    name: str
    seed: int
    people: int
    each: int
    log_odds: tuple[float, ...]
    person_sd: float
    slope: float = 0.0
    lost: int = 0

    def rows(self) -> list[list[float]]:
        """Person, condition, x, answer, value; every `lost`-th trial is not there."""
        count = self.people * len(self.log_odds) * self.each
        own, noise = normals(self.seed, self.people), normals(self.seed + 1, count)
        chance = normals(self.seed + 2, count)
        found = []
        for i in range(count):
            person, rest = divmod(i, len(self.log_odds) * self.each)
            condition, trial = divmod(rest, self.each)
            x = 12.0 + trial / 2.0
            eta = self.log_odds[condition] + self.slope * (x - 14.0) + self.person_sd * float(own[person])
            share = 0.5 * math.erfc(-float(chance[i]) / math.sqrt(2.0))
            answer = float(share < 1.0 / (1.0 + math.exp(-eta)))
            if not self.lost or i % self.lost:
                found.append([person, condition, x, answer, round(eta + float(noise[i]), 3)])
        return found


SETS = (
    Trials(name="like the paper", seed=100, people=14, each=10, log_odds=(0.2, 1.3, 2.2), person_sd=0.6),
    Trials(name="people hardly differ", seed=200, people=12, each=12, log_odds=(0.0, 0.8), person_sd=0.05),
    Trials(name="people differ a lot", seed=300, people=20, each=8, log_odds=(-0.5, 0.5, 1.0), person_sd=2.5),
    Trials(name="a number", seed=400, people=16, each=10, log_odds=(0.0, 0.6), person_sd=0.8, slope=0.5),
    Trials(name="trials lost", seed=500, people=15, each=9, log_odds=(0.3, 0.9, 1.5), person_sd=1.0, lost=5),
    Trials(name="near the ceiling", seed=600, people=24, each=10, log_odds=(2.5, 3.2), person_sd=1.0),
    Trials(name="four people", seed=700, people=4, each=20, log_odds=(0.0, 1.0), person_sd=0.7),
    Trials(name="many people", seed=800, people=150, each=4, log_odds=(0.0, 0.5, 1.0), person_sd=0.9),
    Trials(name="two trials each", seed=900, people=60, each=1, log_odds=(0.2, 0.9), person_sd=1.2),
    Trials(name="many trials", seed=1000, people=10, each=100, log_odds=(0.0, 0.4), person_sd=0.5, slope=0.02),
)


def as_text() -> str:
    """All sets, a line each."""
    lines = (json.dumps({"name": one.name, "rows": one.rows()}) for one in SETS)
    return "[\n" + ",\n".join(lines) + "\n]\n"


if __name__ == "__main__":
    Path(__file__).with_name("revision.json").write_text(as_text(), encoding="utf-8")
