import csv
import json
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from analysis.logs.reading import read_logs
from experiments.clock import VirtualClock
from experiments.design.planning import practice_of
from experiments.load import load_setup
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.session.design_session import design_session
from experiments.session.steps import Inform, Informed, Prepare
from experiments.study.folders import PlaceError
from tests.designs import changed

DIRECTION, PREFERENCE = load_setup("direction"), load_setup("preference")


def practise(results: Path, setup: object = DIRECTION) -> Path:
    request = RunRequest(setup=setup, participant_id="P01", results=results, seed=1, practice=True)
    return run(request, synthetic_screen, VirtualClock()).place.table


def test_a_practice_has_as_many_trials_of_each_method_and_direction_as_the_config_says() -> None:
    plan = practice_of(DIRECTION.config, "P01", 1)
    assert Counter(trial.method for trial in plan.trials) == dict.fromkeys(DIRECTION.config.methods, 2)
    assert Counter(trial.direction for trial in plan.trials) == {"forward": 3, "backward": 3}
    assert {(trial.session, trial.set) for trial in plan.trials} == {(1, 1)}


def test_a_practice_has_files_of_its_own_that_are_never_analysed(tmp_path: Path) -> None:
    table = practise(tmp_path)
    assert table.name == "sub-P01_task-direction_practice_trials.csv"
    with table.open(newline="") as file:
        assert len(list(csv.DictReader(file))) == 6
    assert read_logs([tmp_path]).files == ()


@pytest.mark.slow
def test_a_practice_can_be_done_again_and_leaves_the_run_itself_open(tmp_path: Path) -> None:
    practise(tmp_path)
    practise(tmp_path)
    names = sorted(path.name for path in (tmp_path / "sub-P01").glob("*.jsonl"))
    assert names == [
        "sub-P01_task-direction_practice_journal.aside-1.jsonl",
        "sub-P01_task-direction_practice_journal.jsonl",
    ]
    request = RunRequest(setup=DIRECTION, participant_id="P01", results=tmp_path, seed=1)
    assert run(request, synthetic_screen, VirtualClock()).place.table.name == "sub-P01_task-direction_trials.csv"


def test_a_practice_asks_for_consent_before_anything_is_fired_and_tells_nothing_else_first() -> None:
    texts = ({"kind": "instruction", "text": "Hold it."}, {"kind": "consent", "text": "I take part."})
    setup = changed("direction", opening=texts)
    steps = design_session(practice_of(setup.config, "P01", 1), setup)
    assert next(steps) == Inform(text="I take part.", what="consent")
    assert isinstance(steps.send(Informed()), Prepare)


def test_an_experiment_without_a_practice_says_so(tmp_path: Path) -> None:
    with pytest.raises(PlaceError, match="no practice"):
        practise(tmp_path, PREFERENCE)


@pytest.mark.parametrize(
    ("setup", "known"),
    [
        (DIRECTION, ["direction", "method asymmetric-1", "method asymmetric-2"]),
        (
            changed("detection", practice={"repetitions": 1, "of": ("method",)}),
            ["direction", "method asymmetric-1", "stimulus"],
        ),
    ],
)
def test_the_journal_says_what_the_experimenter_could_know(tmp_path: Path, setup: Any, known: list[str]) -> None:
    journal = next(practise(tmp_path, setup).parent.glob("*_practice_journal.jsonl"))
    assert json.loads(journal.read_text().splitlines()[0])["experimenter_knows"] == known
