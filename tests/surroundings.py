"""Sites with whatever could make an analysis hang on the order of its files, and two surroundings to read them in."""

from __future__ import annotations

from pathlib import Path

from experiments.clock import VirtualClock
from experiments.load import load_setup
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from tests.log_files import trial_rows, trials_path, write_rows, write_study

HERE = {"LC_ALL": "C.utf8", "TZ": "UTC", "PYTHONHASHSEED": "0", "OMP_NUM_THREADS": "4", "OPENBLAS_NUM_THREADS": "4"}
ELSEWHERE = {
    "LC_ALL": "tr_TR.UTF-8",
    "LANG": "de_DE",
    "TZ": "Asia/Kathmandu",
    "PYTHONHASHSEED": "4711",
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
}


def write_sites(folder: Path) -> list[Path]:
    """Two sites with the same codes and a third with a design; broken files, and one log twice."""
    for seed, name in enumerate(("oslo", "kyoto")):
        write_study(folder / name, participants=3, seed=seed)
        (folder / name / "sub-P09_task-direction_trials.csv").write_bytes(b"")
    rows = trial_rows("P05", 5)
    write_rows(trials_path(folder / "oslo", "P05"), rows)
    write_rows(folder / "oslo" / "again" / "old_trials.csv", rows)
    setup = load_setup("stronger")
    for code in ("P01", "P02"):
        request = RunRequest(setup=setup, participant_id=code, results=folder / "design", seed=1)
        run(request, synthetic_screen, VirtualClock())
    return [folder / "oslo", folder / "kyoto", folder / "design"]
