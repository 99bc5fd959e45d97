"""The full figures behind "the next stimulus is that of the unbroken run, every time", kept as a table: `make soak`."""

from __future__ import annotations

import math
import random
import time
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from experiments.config.setup import Setup
from experiments.design.config import DesignConfig
from experiments.design.planning import plan_of
from experiments.session.design_session import design_session
from experiments.session.history import GrowingHistory
from experiments.session.steps import Ask, FireShot, step_after, step_record
from tests.adaptive_kills import killed_until_done, unbroken
from tests.adaptive_runs import (
    KINDS,
    adaptive,
    check_ends,
    check_levels,
    step_after_cut,
    step_after_that,
    undone_run,
)
from tests.conftest import Soak
from tests.designs import changed
from tests.driven_designs import done

pytestmark = pytest.mark.soak

KILLS, CUTS, CUTS_OF_ONE, UNDONE = 100, 1000, 25, 1000
ONE_DIMENSION_MS, TWO_DIMENSIONS_MS = 1.0, 20.0
SETUPS = {kind: adaptive(kind) for kind in KINDS}


@pytest.fixture(scope="module")
def memory() -> Iterator[Path]:
    """A folder for runs that are about order and not about the disk: in memory, where that can be."""
    shared = Path("/dev/shm")  # noqa: S108 - a folder of its own in it
    with TemporaryDirectory(dir=shared if shared.is_dir() else None) as folder:
        yield Path(folder)


@pytest.mark.parametrize("name", ["staircase", "pairs"])
def test_real_kills(name: str, tmp_path: Path, soak: Soak) -> None:
    wanted, kills, runs, draw = unbroken(name, tmp_path / "unbroken"), 0, 0, random.Random(100)
    while kills < KILLS:
        more, rows = killed_until_done(name, tmp_path / str(runs), draw, KILLS - kills)
        assert rows == wanted
        kills, runs = kills + more, runs + 1
    how = f"kill -9 at random records of {runs} runs, each resumed to its end; levels and answers compared"
    what = "active pairing" if name == "pairs" else f"`{name}`"
    soak(
        f"levels of {what} after a kill that are those of the unbroken run",
        f"all, after {kills} kills",
        "all of 100",
        how,
    )


def test_undo_sequences(memory: Path, soak: Soak) -> None:
    levels = 0
    for seed in range(UNDONE):
        kind = KINDS[seed % len(KINDS)]
        contents = undone_run(SETUPS[kind], plan_of(SETUPS[kind].config, "P01", seed), memory / kind, seed, share=0.4)
        levels += check_levels(SETUPS[kind], contents)
        check_ends(SETUPS[kind], contents)
        contents.path.unlink()
    how = f"runs of {', '.join(KINDS)} with corrections and repeats at random; each level against a track begun anew"
    soak("random undo sequences", f"{levels} levels right in {UNDONE} runs", "all of 1,000 runs", how)


def test_cuts(memory: Path, soak: Soak) -> None:
    compared, draw, journals = 0, random.Random(1000), CUTS // CUTS_OF_ONE
    for seed in range(journals):
        kind = KINDS[seed % len(KINDS)]
        contents = undone_run(SETUPS[kind], plan_of(SETUPS[kind].config, "P02", seed), memory / "cuts", seed, share=0.2)
        data = contents.path.read_bytes()
        for at in (draw.randrange(data.index(b"\n") + 1, len(data)) for _ in range(CUTS_OF_ONE)):
            wanted = step_after_that(contents, data[:at].count(b"\n"))
            step = step_after_cut(SETUPS[kind], contents, data[:at])
            if wanted is not None:
                assert step is not None
                assert step_record(step) == step_record(wanted)
                compared += 1
    how = f"{journals} journals cut at random bytes and replayed; {CUTS - compared} at the end, or before a correction"
    soak("cuts of journals in process", f"{compared} next steps alike in {CUTS} cuts", "all of 1,000 cuts", how)


def test_times(soak: Soak) -> None:
    one = _times_ms(_one_dimension(), 4)
    figure, how = (
        _shown(one),
        "grid 60 × 20 × 5, 65 levels, 4 runs of 2 tracks of 60 trials; answer to next shot, in process",
    )
    soak("from answer to next stimulus, one dimension", figure, f"99 % under {ONE_DIMENSION_MS:g} ms", how)
    assert np.quantile(one, 0.99) < ONE_DIMENSION_MS
    two = _times_ms(_two_dimensions(), 1)
    figure, how = _shown(two), "900 levels of two factors, 20 × 10 × 6 × 5 = 6,000 places of the grid, by entropy"
    soak("from answer to next stimulus, two dimensions", figure, f"99 % under {TWO_DIMENSIONS_MS:g} ms", how)
    assert np.quantile(two, 0.99) < TWO_DIMENSIONS_MS


def _shown(times_ms: np.ndarray) -> str:
    half, most = np.quantile(times_ms, [0.5, 0.99])
    return f"median {half:.2f} ms, 99 % under {most:.2f} ms ({len(times_ms)} answers)"


def _one_dimension() -> Setup[DesignConfig]:
    axes = {
        "threshold": {"minimum": 4.0, "maximum": 18.0, "points": 60},
        "width": {"minimum": 1.0, "maximum": 16.0, "points": 20},
        "lapse": {"minimum": 0.0, "maximum": 0.08, "points": 5},
    }
    return changed("threshold", procedure={"trials": 60, **axes}, fatigue={"max_trials_without_break": 1000})


def _two_dimensions() -> Setup[DesignConfig]:
    axes = {
        "threshold": {"minimum": 4.0, "maximum": 18.5, "points": 20},
        "width": {"minimum": 0.2, "maximum": 2.0, "points": 10},
        "rise": {"minimum": -1.5, "maximum": 0.0, "points": 6},
        "lapse": {"minimum": 0.0, "maximum": 0.08, "points": 5},
    }
    both = {"of": ("voltage_V", "pulse_s"), "rule": "entropy", "scale": "log", "tracks": 1, "trials": 100}
    factors = {
        "voltage_V": {"levels": {"minimum": 4.0, "maximum": 18.5, "grain": 0.5}},
        "pulse_s": {"levels": {"minimum": 0.00275, "maximum": 0.01, "grain": 0.00025}},
    }
    return changed("threshold", procedure={**both, **axes}, factors=factors)


def _times_ms(setup: Setup[DesignConfig], runs: int) -> np.ndarray:
    """Milliseconds from each answer to the next shot's level, the steps between them done at once."""
    return np.array([one for seed in range(runs) for one in _of_run(setup, seed)])


def _of_run(setup: Setup[DesignConfig], seed: int) -> Iterator[float]:
    told: GrowingHistory = []
    session, draw = design_session(plan_of(setup.config, "P01", seed), setup, told), random.Random(seed)
    step, spent_s = next(session, None), math.nan
    while step is not None:
        if isinstance(step, FireShot) and spent_s > 0:
            yield 1000 * spent_s
        spent_s = 0.0 if isinstance(step, Ask) else spent_s
        outcome = done(step, draw.randrange(2))
        told.append((step, outcome))
        began_s = time.perf_counter()
        step = step_after(session, outcome)
        spent_s += time.perf_counter() - began_s
