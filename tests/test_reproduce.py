"""The whole study with one command: what it leaves, and that its parts agree with each other."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import studentized_range
from statsmodels.stats.anova import AnovaRM

from analysis.logs.reading import read_logs
from analysis.predict.drawn import DirectionStudies, RatingStudies, studies_of
from analysis.predict.reproduction.study import MANIFEST, claim_folder, prepared
from analysis.predict.synthetic_studies import direction_counts, preference_scores
from analysis.summary.summary import summarize
from experiments.design.streams import generator
from experiments.load import load_setup
from experiments.study.folders import PlaceError
from tests.reproduced import EXPERIMENTS, scores, statistics
from tests.waiting import PATIENCE_S, wait_for
from tests.warm_start import warm

pytestmark = pytest.mark.slow

METHODS = ["vibration", "asymmetric-1", "asymmetric-2"]
QUESTIONS = ["response", "rating"]
"""What each experiment asks first."""


def test_it_leaves_28_logs_with_their_journals_and_a_report(reproduction: Path) -> None:
    assert len(list(reproduction.glob("logs/sub-*/*_journal.jsonl"))) == 28
    assert len(list(reproduction.glob("logs/sub-*/*.csv"))) == 28
    figures = [f"figures/figure-{name}.png" for name in ("shot", "results")]
    for name in ("report.html", "report.md", "statistics.json", *figures):
        assert (reproduction / name).stat().st_size > 0


def test_every_table_rebuilt_from_its_journal_is_the_same_byte_for_byte(reproduction: Path, tmp_path: Path) -> None:
    shutil.copytree(reproduction / "logs", tmp_path / "logs")
    journals = sorted(tmp_path.glob("logs/sub-*/*_journal.jsonl"))
    before = {path: path.read_bytes() for path in tmp_path.glob("logs/sub-*/*.csv")}
    for path in before:
        path.unlink()
    subprocess.run(warm("rebuild", *journals), check=True, capture_output=True)
    assert before == {path: path.read_bytes() for path in tmp_path.glob("logs/sub-*/*.csv")}


def test_the_tables_alone_give_the_same_numbers(reproduction: Path, tmp_path: Path) -> None:
    for table in reproduction.glob("logs/sub-*/*.csv"):
        (tmp_path / table.name).write_bytes(table.read_bytes())
    found = statistics(reproduction)
    assert found.pop("labels")["vibration"] == "Vibration"  # which the journals know, the tables do not
    assert summarize(read_logs([tmp_path]), fits=True).to_dict() == found


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_f_is_that_of_statsmodels_to_ten_digits(reproduction: Path, experiment: str) -> None:
    ours = statistics(reproduction)[experiment]["anova"]
    theirs = AnovaRM(scores(reproduction, experiment), "score", "participant_id", within=["method"]).fit().anova_table
    assert ours["df"] == [2, 26]
    assert ours["F"] == pytest.approx(theirs["F Value"].iloc[0], rel=1e-10)
    assert ours["p"] == pytest.approx(theirs["Pr > F"].iloc[0], rel=1e-8)


@pytest.mark.parametrize("experiment", EXPERIMENTS)
def test_tukeys_p_is_the_studentized_range_of_the_repeated_measures_error(reproduction: Path, experiment: str) -> None:
    table = scores(reproduction, experiment).pivot_table(index="participant_id", columns="method", values="score")
    residuals = table.sub(table.mean(axis=1), axis=0).sub(table.mean() - table.to_numpy().mean(), axis=1)
    error = (residuals.to_numpy() ** 2).sum() / 26
    for pair in statistics(reproduction)[experiment]["tukey"]:
        q = abs(table[pair["a"]].mean() - table[pair["b"]].mean()) / np.sqrt(error / 14)
        assert pair["p"] == pytest.approx(float(studentized_range.sf(q, 3, 26)), rel=1e-6, abs=1e-12)


def test_reconstructed_participants_give_the_published_statistics_back(reproduction: Path) -> None:
    """Counts and ratings from the logs alone; F of experiment 1 is the nearest that its means leave."""
    logs = read_logs([reproduction / "logs"])
    vibration = logs.trials[logs.trials.method == "vibration"]
    right = {way: int(vibration[vibration.direction == way].correct.sum()) for way in ("forward", "backward")}
    assert right == {"forward": 78, "backward": 67}
    ratings = scores(reproduction, "preference").pivot_table(index="participant_id", columns="method", values="score")
    assert (ratings["vibration"] < ratings[METHODS[1:]].min(axis=1)).all()
    assert (ratings["asymmetric-1"] == ratings["asymmetric-2"]).sum() == 2
    found = statistics(reproduction)
    assert {method: round(100 * mean, 1) for method, mean in found["direction"]["means"].items()} == {
        "vibration": 55.7,
        "asymmetric-1": 79.3,
        "asymmetric-2": 92.9,
    }
    assert f"{found['direction']['anova']['F']:.2f}" == "28.51"
    assert f"{found['preference']['anova']['F']:.3f}" == "33.810"


def test_every_published_number_carries_its_verdict_on_the_page_and_on_the_terminal(reproduction: Path) -> None:
    said = (reproduction.parent / "said.txt").read_text(encoding="utf-8")
    lines = [line.split("  ")[0] for line in said.splitlines() if ": " in line and "  " in line]
    assert lines.count("differs") == 0
    assert lines.count("not obtained") == 0
    assert lines.count("differs as predicted") == 1
    assert lines.count("agrees") == 22
    assert lines.count("not attainable") == 2
    assert "published 28.45: not attainable beside the other numbers, nearest 28.10 and 28.51" in said
    page = (reproduction / "report.md").read_text(encoding="utf-8")
    assert "22 published numbers and claims agree, 0 differ, 1 differs as the audit predicted" in page
    assert "| ANOVA F | 28.45 | 28.51 | differs as predicted | only under a reading |" in page
    assert "They are not the paper's participants" in page


LAWS_OF_TABLES = {
    "direction": """
[questions.response]
law = "table"
file = "reconstructed_direction.csv"
by = ["method", "direction"]
""",
    "preference": """
[questions.rating]
law = "table"
file = "reconstructed_preference.csv"

[questions.comment]
law = "words"
""",
}


def test_the_tables_of_reconstructed_answers_seat_the_same_people_again(reproduction: Path, tmp_path: Path) -> None:
    subprocess.run(warm("configs", "--copy", tmp_path), check=True, capture_output=True)
    for name in EXPERIMENTS:
        config, table = tmp_path / f"{name}.toml", f"reconstructed_{name}.csv"
        (tmp_path / "synthetic" / f"{name}.toml").write_text(LAWS_OF_TABLES[name], encoding="utf-8")
        (tmp_path / table).write_bytes((reproduction / table).read_bytes())
        run = (
            "run",
            config,
            "--participant",
            "P03",
            "--screen",
            "synthetic",
            "--results",
            tmp_path / "logs",
        )
        subprocess.run(warm(*run), check=True, capture_output=True)
        there = scores(reproduction, name)
        there = there[there.participant_id == "P03"].set_index("method").score
        assert scores(tmp_path, name).set_index("method").score.to_dict() == there.to_dict()


def test_participants_drawn_by_the_configs_stay_an_option() -> None:
    """Loaded, not run: they are the setups of the configs themselves."""
    study, other = prepared("study", 1, "rates"), prepared("study", 2)
    assert study.answering == study.setups
    assert "other participants were asked for" in study.notes[0]
    assert other.manifest() == prepared("study", 2, "reconstructed").manifest()
    assert other.manifest() != study.manifest()
    laws = [setup.laws.questions[question] for setup, question in zip(other.answering, QUESTIONS, strict=True)]
    assert [law.law for law in laws] == ["table", "table"]


@pytest.mark.parametrize("content", [b"{", b"\xff", b"[" * 100_000])
def test_a_manifest_that_is_no_json_is_named_and_its_folder_left_alone(tmp_path: Path, content: bytes) -> None:
    (tmp_path / MANIFEST).write_bytes(content)
    with pytest.raises(PlaceError, match=rf"{MANIFEST}: is no manifest of a reproduction that can be read"):
        claim_folder(prepared("study", 1, "rates"), tmp_path)
    assert (tmp_path / MANIFEST).read_bytes() == content


def test_what_is_killed_is_set_aside_by_another_seed_and_gone_on_with_by_the_same(
    reproduction: Path, tmp_path: Path
) -> None:
    out, aside = tmp_path / "out", tmp_path / "out.aside-1"
    for seed, begins in (("2", lambda: True), ("1", aside.exists)):
        words = warm("reproduce", "--out", out, "--seed", seed)
        with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as killed:
            wait_for(lambda begins=begins: (begins() and len(tables(out)) >= 5) or killed.poll() is not None)
            killed.kill()
    other, begun = tables(aside), tables(out)
    assert len(other) >= 5
    assert {path.name: path.read_bytes() for path in other[:4]} != {path.name: path.read_bytes() for path in begun[:4]}
    _terminated(words, lambda: len(tables(out)) > len(begun) + 2)  # one may be the killed one's
    assert len(tables(out)) < 28
    with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as finishing:
        wait_for(lambda: len(tables(out)) == 28 or finishing.poll() is not None)
        finishing.kill()  # what follows, from the same tables, `reproduction` has seen
    for experiment in EXPERIMENTS:
        assert scores(out, experiment).equals(scores(reproduction, experiment))


def _terminated(words: list[str], when: Callable[[], bool]) -> None:
    """Start the command, interrupt it then, and see that it says so."""
    with subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as interrupted:
        wait_for(lambda: when() or interrupted.poll() is not None)
        interrupted.terminate()
        _, said = interrupted.communicate(timeout=PATIENCE_S)
    assert interrupted.returncode == 130
    assert "Traceback" not in said
    assert "interrupted" in said


def tables(out: Path) -> list[Path]:
    return sorted(out.glob("logs/sub-*/*.csv"))


def test_a_study_that_the_published_numbers_do_not_fit_is_that_of_its_configs(tmp_path: Path) -> None:
    subprocess.run(warm("configs", "--copy", tmp_path / "quick"), check=True, capture_output=True)
    study = tmp_path / "quick" / "study.toml"
    study.write_text(study.read_text().replace("participants = 14", "participants = 2"))
    assert "the study has 2 participants, the paper 14" in prepared(str(study), 1).notes[0]
    asked = warm("reproduce", "--study", study, "--out", tmp_path / "no", "--synthetic", "reconstructed")
    refused = subprocess.run(asked, check=False, capture_output=True, text=True)
    assert (refused.returncode, "the study has 2 participants" in refused.stderr) == (2, True)
    told = warm("reproduce", "--study", study, "--out", study)
    done = subprocess.run(told, check=False, capture_output=True, text=True)
    assert done.stderr.startswith("recoil: The participants are those of the configs: the study has 2 participants")


def test_a_strangers_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "theirs").touch()
    done = subprocess.run(warm("reproduce", "--out", tmp_path), check=False, capture_output=True, text=True)
    assert done.returncode == 2
    assert "is no reproduction" in done.stderr


def test_the_odds_draw_the_same_kind_of_people_as_the_session(reproduction: Path) -> None:
    """The people behind the odds are drawn without a session; here they have the session's rates and spread."""
    studies = studies_of(load_setup("direction"))
    assert isinstance(studies, DirectionStudies)
    counts = direction_counts(studies, 14, 2000, generator(1, "odds", "direction"))
    rates = studies.law.share
    for place, method in enumerate(METHODS):
        assert counts[:, :, place, 0].mean() / 10 == pytest.approx(rates[f"{method}/forward"], abs=0.004)
        assert counts[:, :, place, 1].mean() / 10 == pytest.approx(rates[f"{method}/backward"], abs=0.004)
    seen = statistics(reproduction)["direction"]["means"]
    for place, method in enumerate(METHODS):
        means = counts[:, :, place, 0].mean(axis=1) / 10
        assert means.min() <= seen[method] <= means.max()


def test_simulated_ratings_keep_the_published_habits() -> None:
    studies = studies_of(load_setup("preference"))
    assert isinstance(studies, RatingStudies)
    ratings = preference_scores(studies, 14, 300, generator(1, "test"))
    assert (ratings[..., 0] <= ratings[..., 1:].min(axis=-1)).all()
    assert (ratings[..., 1] == ratings[..., 2]).mean() == pytest.approx(0.143, abs=0.03)
