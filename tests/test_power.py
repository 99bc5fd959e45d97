"""`recoil power` as a user calls it: files, costs, refusals, and the same bytes however it is worked out."""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import psutil
import pytest

from analysis.predict.drawn import DirectionStudies, studies_of
from analysis.predict.jobs import on_cluster, on_processes
from analysis.predict.power import run as feature
from analysis.predict.power.grid import PowerRequest, make_grid, run_chunk
from analysis.predict.power.page import claim_name, in_short
from analysis.predict.power.planned import ALL_PAIRS, ANOVA
from analysis.report.labels import labelled
from analysis.report.serial import plain
from analysis.report.terminal import say_how_long
from experiments.config.door import ConfigError, leaves
from experiments.load import load_setup, shipped_folder
from experiments.synthetic.laws import SyntheticAnswers
from tests.conftest import RECOIL, Recoil
from tests.power_files import files
from tests.waiting import PATIENCE_S, wait_for
from tests.warm_start import warm

SMALL = ("--participants", "8,14", "--effect", "0.75,1", "--studies", "300")
SETUP = load_setup("direction")
DURATION_S = studies_of(SETUP).planned().duration_s


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small grid, on one process; in the environment of `recoil`, which has no settings of git."""
    folder = tmp_path_factory.mktemp("power")
    environment = {"PATH": os.environ["PATH"], "HOME": str(folder)}
    words = warm("power", "direction", *SMALL, "--workers", "1", "--out", folder / "out")
    subprocess.run(words, check=True, capture_output=True, env=environment)
    return folder / "out"


@pytest.fixture
def found(done: Path) -> Any:
    return json.loads((done / "power.json").read_text(encoding="utf-8"))


@pytest.mark.slow
def test_the_page_tells_what_was_found(done: Path, found: Any) -> None:
    page = (done / "report.md").read_text(encoding="utf-8")
    pattern = found["published_pattern"]
    assert f"{100 * pattern['share']:.1f} %" in page.replace("\N{NO-BREAK SPACE}", " ")
    assert [path.name for path in (done / "figures").iterdir()] == ["power.png"]
    assert "data:image/png;base64," in (done / "report.html").read_text(encoding="utf-8")
    assert not list(done.glob("unfinished*"))
    assert all(path.stat().st_mode & 0o077 == 0 for path in done.iterdir())


@pytest.mark.slow
def test_every_design_has_its_claims_with_intervals_and_its_cost(found: Any) -> None:
    assert [(one["participants"], one["effect"]) for one in found["designs"]] == [
        (8, 0.75),
        (14, 0.75),
        (8, 1.0),
        (14, 1.0),
    ]
    for one in found["designs"]:
        assert one["lab_hours"] == pytest.approx(one["participants"] * DURATION_S / 3600)
        assert all(0 <= c["ci_low"] <= c["share"] == c["held"] / 300 <= c["ci_high"] <= 1 for c in one["claims"])
        assert all(p["half_width"] > p["mc_error"] > 0 for p in one["precision"])


@pytest.mark.slow
def test_more_people_and_a_larger_effect_find_more(found: Any) -> None:
    share = {
        (one["participants"], one["effect"]): next(c["share"] for c in one["claims"] if c["claim"] == ALL_PAIRS)
        for one in found["designs"]
    }
    assert share[8, 0.75] < share[8, 1.0] < share[14, 1.0]
    assert share[8, 0.75] < share[14, 0.75] < share[14, 1.0]


@pytest.mark.slow
def test_the_smallest_design_is_the_cheapest_that_reaches_the_target(found: Any) -> None:
    for row in found["smallest"]:
        reaching = [
            one
            for one in found["designs"]
            if one["effect"] == row["effect"]
            and next(c["ci_low"] for c in one["claims"] if c["claim"] == row["claim"]) >= 0.8
        ]
        if row["design"] is None:
            assert not reaching
        else:
            assert row["design"]["lab_hours"] == min(one["lab_hours"] for one in reaching)
    assert any(row["design"] for row in found["smallest"])


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes_on_two_processes(done: Path, recoil: Recoil, tmp_path: Path) -> None:
    again = recoil("power", "direction", *SMALL, "--workers", "2", "--out", "two")
    assert again.returncode == 0, again.stderr
    assert files(tmp_path / "two") == files(done)


@pytest.mark.slow
def test_how_long_it_takes_grows_with_people_and_studies_and_falls_with_workers_and_shards() -> None:
    few, many = (PowerRequest(config="direction", participants=people) for people in ("8", "8-40"))
    long_s = feature.power_time_s(many, workers=1)
    assert long_s > 10 * feature.power_time_s(few, workers=1)
    assert feature.power_time_s(many, workers=4) < 0.4 * long_s
    assert feature.power_time_s(many, workers=1, part=feature.shard_number("1/8")) < 0.3 * long_s
    assert feature.power_time_s(PowerRequest(config="preference", participants="8-40"), workers=1) < 0.4 * long_s
    assert feature.power_time_s(many, scheduler="tcp://somewhere:8786") == 0.0


def test_what_takes_long_says_so_beforehand(capsys: pytest.CaptureFixture[str]) -> None:
    say_how_long(4.0)
    assert capsys.readouterr().err == ""
    for seconds, words in ((27.0, "30 s"), (310.0, "5 minutes")):
        say_how_long(seconds)
        assert capsys.readouterr().err == f"recoil: this takes about {words}\n"


def test_another_seed_gives_other_studies(done: Path, recoil: Recoil, tmp_path: Path) -> None:
    again = recoil("power", "direction", *SMALL, "--seed", "2", "--workers", "1", "--out", "other", "--json")
    found = json.loads(again.stdout)
    assert found == json.loads((tmp_path / "other" / "power.json").read_text(encoding="utf-8"))
    assert found["designs"] != json.loads((done / "power.json").read_text(encoding="utf-8"))["designs"]


@pytest.fixture
def cluster() -> Iterator[str]:
    """A Dask scheduler with two workers, each a process of its own: its address."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, silence_logs="CRITICAL"
    ) as running:
        yield running.scheduler_address


@pytest.mark.soak
def test_two_dask_workers_give_the_same_bytes_as_one_process(
    done: Path, cluster: str, recoil: Recoil, tmp_path: Path
) -> None:
    again = recoil("power", "direction", *SMALL, "--scheduler", cluster, "--out", "dask")
    assert again.returncode == 0, again.stderr
    assert files(tmp_path / "dask") == files(done)


@pytest.mark.slow
def test_an_interrupted_job_goes_on_where_it_was(tmp_path: Path) -> None:
    words = warm("power", "direction", "--participants", 14, "--effect", 1, "--studies", 60000, "--workers", 1, "--out")
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    subprocess.run([*words, whole], check=True, capture_output=True)
    with subprocess.Popen([*words, cut], stderr=subprocess.PIPE) as running:
        wait_for(lambda: [kept for kept in cut.glob("unfinished*") if kept.stat().st_size])
        running.send_signal(signal.SIGINT)
        _, errors = running.communicate(timeout=PATIENCE_S)
    assert running.returncode == 130, errors
    assert b"Traceback" not in errors
    kept = next(cut.glob("unfinished*"))
    begun = len(kept.read_bytes().splitlines())
    assert 0 < begun < 12
    with kept.open("ab") as file:
        file.write(b'[11, {"studies": 50')  # as a kill in the middle of a line leaves it
    subprocess.run([*words, cut], check=True, capture_output=True)
    assert files(cut) == files(whole)


@pytest.mark.slow
@pytest.mark.parametrize("presses", [1, 3])
def test_an_interrupted_job_on_processes_ends_and_leaves_none(tmp_path: Path, presses: int) -> None:
    words = [RECOIL, "power", "direction", "--participants", "14", "--effect", "1", "--studies", "400000"]
    words += ["--workers", "2", "--out", tmp_path / "out"]
    with subprocess.Popen(words, stderr=subprocess.PIPE, start_new_session=True) as running:
        wait_for(lambda: list((tmp_path / "out").glob("unfinished*")))
        for _ in range(presses):
            os.killpg(running.pid, signal.SIGINT)  # as a terminal does: to everybody
            time.sleep(0.1)
        _, errors = running.communicate(timeout=PATIENCE_S)
    ended = (130,) if presses == 1 else (130, -signal.SIGINT)  # a press more may come when all is done, at Python's end
    assert running.returncode in ended, errors
    assert b"Traceback" not in errors
    wait_for(lambda: not alive_in(running.pid), processes)  # the interpreter's own tracker of resources ends later


def processes() -> str:
    return subprocess.run(["ps", "-eo", "pid,ppid,pgid,stat,cmd"], capture_output=True, text=True, check=False).stdout


def alive_in(group: int) -> list[int]:
    found = []
    for process in psutil.process_iter(["status"]):
        with contextlib.suppress(ProcessLookupError):
            if process.info["status"] != psutil.STATUS_ZOMBIE and os.getpgid(process.pid) == group:
                found.append(process.pid)
    return found


@pytest.mark.slow
def test_null_participants_find_what_is_not_there_in_five_percent(recoil: Recoil, tmp_path: Path) -> None:
    again = recoil("power", "preference", "--null", "--participants", "14", "--studies", "3000", "--json", "--out", "n")
    assert again.returncode == 0, again.stderr
    (design,) = json.loads(again.stdout)["designs"]
    anova = next(c for c in design["claims"] if c["claim"] == ANOVA)
    assert anova["ci_low"] - 0.003 < 0.05 < anova["ci_high"] + 0.003
    assert (tmp_path / "n" / "figures" / "false-positives.png").is_file()


BAD = {
    "--participants 0": "--participants 0: 0 must be from 2 to 999",
    "--participants 1": "from 2 to 999",
    "--participants 20-8": "ranges upwards",
    "--participants eight": "'eight' is no whole number",
    "--effect -1": "--effect -1: '-1' must be a number from 0",
    "--effect nan": "must be a number from 0",
    "--trials 15": "15 is no multiple of 10",
    "--trials 11-19": "holds no multiple of 10",
    "--methods vibration": "two or more different ones of vibration, asymmetric-1, asymmetric-2",
    "--methods vibration,hammer": "two or more different ones",
    "--target 1.5": "--target 1.5: must lie between 0 and 1",
    "--null --effect 1": "--null has no effect",
    "--shard 3": "--shard 3: must be K/N",
    "--shard 4/3": "--shard 4/3: shards are counted from 1 to 3, so there is no 4",
    "--shard 0/3": "so there is no 0",
    "--shard 1/0": "--shard 1/0: there must be from 1 to 100000 shards, not 0",
    "--shard 1/3 --merge parts": "--shard 1/3 --merge parts: first each job with --shard",
    "--merge nowhere": "--merge nowhere: is no folder",
    "--paper nowhere": "nowhere: no such file",
    "--scheduler nowhere": "--scheduler nowhere: must be host and port",
    "--scheduler foo://host:8786": "must be host and port",
    "--scheduler tcp://127.0.0.1:1": "--scheduler tcp://127.0.0.1:1: no Dask scheduler answers there",
}


@pytest.mark.slow
@pytest.mark.parametrize("words", BAD)
def test_what_cannot_be_is_refused_in_one_message(
    words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from analysis.predict import jobs
    from recoil import cli

    monkeypatch.setattr(jobs, "CONNECT_S", 1)
    monkeypatch.setattr("sys.argv", ["recoil", "power", "direction", *words.split(), "--out", str(tmp_path / "out")])
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    umask = os.umask(0o077)
    try:
        with pytest.raises(SystemExit) as end:
            cli.main()
    finally:
        os.umask(umask)
        for number, handler in handlers.items():
            signal.signal(number, handler)
    said = capsys.readouterr().err
    assert end.value.code == 2
    assert BAD[words] in said
    assert said.startswith("recoil: ")
    assert len(said.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_a_claim_is_told_with_the_labels_of_the_gun() -> None:
    with labelled({"ramp": "Slow ramp"}):
        assert claim_name("ramp above vibration") == "Slow ramp above Vibration"


def test_experiment_2_has_one_trial_a_method() -> None:
    with pytest.raises(ConfigError, match="one trial a method"):
        make_grid(PowerRequest(config="preference", trials="5"))


def copied(folder: Path, *edits: tuple[str, str, str]) -> str:
    """The shipped experiment 1 in a folder of its own, with texts of its files replaced by others."""
    shutil.copytree(shipped_folder(), folder, dirs_exist_ok=True)
    for name, old, new in edits:
        text = (folder / name).read_text(encoding="utf-8")
        assert old in text
        (folder / name).write_text(text.replace(old, new), encoding="utf-8")
    return str(folder / "direction.toml")


def test_answers_from_a_table_have_no_power(tmp_path: Path) -> None:
    config = copied(tmp_path)
    table = '[questions.response]\nlaw = "table"\nfile = "answers.csv"\nby = ["method", "direction"]\n'
    (tmp_path / "synthetic" / "direction.toml").write_text(table)
    (tmp_path / "answers.csv").write_text("participant_id,method,direction,correct\n")
    with pytest.raises(ConfigError, match=r'direction\.toml:2: questions\.response\.law: "table" has no power'):
        make_grid(PowerRequest(config=config))


def test_without_forward_trials_there_is_no_power(tmp_path: Path) -> None:
    levels = ("direction.toml", 'levels = ["forward", "backward"]', 'levels = ["backward"]')
    config = copied(tmp_path, levels, ("direction.toml", "sets = 4", "sets = 2"))
    with pytest.raises(ConfigError, match=r"factors\.direction has no level forward; .* is of forward trials"):
        make_grid(PowerRequest(config=config))


def test_without_backward_trials_there_is_no_d_prime_and_no_published_pattern(tmp_path: Path) -> None:
    levels = ("direction.toml", 'levels = ["forward", "backward"]', 'levels = ["forward"]')
    config = copied(tmp_path, levels, ("direction.toml", "sets = 4", "sets = 2"))
    grid = make_grid(PowerRequest(config=config, participants="8", effects="1", studies=50))
    (chunk,) = grid.chunks()
    assert chunk.published is None
    assert chunk.design.trials == 10
    claims = run_chunk(chunk).held
    assert ALL_PAIRS in claims
    assert not any("d′" in claim or "backward" in claim for claim in claims)


@pytest.mark.parametrize("name", ["voltages", "magnitude", "grip"])
def test_a_design_that_asks_something_else_has_no_power(name: str) -> None:
    with pytest.raises(ConfigError, match=f"{name}\\.toml: .*simulate others run by run: --screen synthetic"):
        make_grid(PowerRequest(config=name))


def test_power_of_paired_comparisons_says_what_to_do_instead() -> None:
    with pytest.raises(
        ConfigError, match=r"pairs\.toml: studies of paired comparisons are not drawn; simulate as many"
    ):
        make_grid(PowerRequest(config="pairs"))


def test_a_design_without_synthetic_people_has_no_power(tmp_path: Path) -> None:
    config = copied(tmp_path, ("direction.toml", 'synthetic = "synthetic/direction.toml"', ""))
    with pytest.raises(ConfigError, match=r"direction\.toml: synthetic is missing"):
        make_grid(PowerRequest(config=config))


def test_trials_keep_the_sets_and_the_share_of_forward_trials() -> None:
    grid = make_grid(PowerRequest(config="direction", participants="8", trials="10-40", effects="1"))
    found = {cell.design.trials: cell.config for cell in grid.cells}
    assert list(found) == [10, 20, 30, 40]
    for trials, studies in found.items():
        assert isinstance(studies, DirectionStudies)
        assert studies.trials == (trials // 2, trials // 2)
        assert studies.trials_per_set == 5
        assert studies.planned().trials == 3 * trials
    assert found[20].design == SETUP.config


@pytest.mark.slow
def test_a_design_that_keeps_people_too_long_is_shown_and_never_proposed(tmp_path: Path) -> None:
    request = PowerRequest(config="direction", participants="14", trials="20,40", effects="1", studies=200, target=0.75)
    with on_processes(1):
        found = plain(feature.power(request, tmp_path, _silent, workers=1))
    short, long = found["designs"]
    assert short["too_long"] == ""
    assert long["too_long"] == "3060 s a participant exceed fatigue.max_planned_s = 2700 s"
    chosen = next(row["design"] for row in found["smallest"] if row["claim"] == ALL_PAIRS)
    assert chosen is None or chosen["trials"] == 20


@pytest.mark.slow
def test_what_is_reached_only_by_keeping_people_too_long_is_told_so(tmp_path: Path) -> None:
    """An ANOVA of 40 trials a method, whose interval starts above the target; of 10 it does not."""
    request = PowerRequest(config="direction", participants="10", trials="10,40", effects="0.5,1", studies=50)
    with on_processes(1):
        found = feature.power(request, tmp_path, _silent, workers=1)
    (line,) = (item for item in in_short(found).items if " for ANOVA: " in item)
    too_long = "effect × 0.5: none: what reaches it keeps a participant too long (at most 96.0 %)"
    assert line.endswith(f" for ANOVA: {too_long}; effect × 1: 10 people × 10 trials a method, 3.3 h")
    assert "| Asymmetric Force II above Vibration, p < 0.001 |" in (tmp_path / "report.md").read_text(encoding="utf-8")


@pytest.mark.slow
def test_methods_can_be_compared_in_sets(tmp_path: Path) -> None:
    request = PowerRequest(
        config="direction",
        participants="8",
        methods=("asymmetric-2,vibration", "asymmetric-1,asymmetric-2"),
        effects="1",
        studies=100,
    )
    found = plain(feature.power(request, tmp_path, _silent, workers=1))
    assert [one["methods"] for one in found["designs"]] == [
        ["vibration", "asymmetric-2"],
        ["asymmetric-1", "asymmetric-2"],
    ]
    assert found["designs"][0]["duration_s"] < DURATION_S
    assert found["published_pattern"]["participants"] == 14
    assert (tmp_path / "figures" / "power-2.png").is_file()


def test_a_worker_without_this_recoil_is_named() -> None:
    """The check itself, on what a worker might say."""
    from analysis.predict import jobs
    from experiments.record.provenance import versions

    class Client:
        def wait_for_workers(self, number: int, timeout: float) -> None: ...

        def run(self, _: Any) -> dict[str, dict[str, str]]:
            return {"tcp://w:1": versions() | {"numpy": "1.0"}}

    with pytest.raises(match=r"worker tcp://w:1 has numpy 1\.0, not"):
        jobs.check_workers(Client(), "tcp://s:1")


def test_a_missing_dask_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    with pytest.raises(match=r"recoil\[dask\]"), on_cluster("tcp://127.0.0.1:1"):
        pass


@pytest.mark.slow
def test_assumptions_are_told(found: Any) -> None:
    told = " ".join(found["assumptions"])
    assert "0.557" in told
    assert "ability of SD 0.2" in told
    assert isinstance(SETUP.laws, SyntheticAnswers)
    assert "questions.response.ability_sd" in set(leaves(SETUP.laws)) & set(SETUP.laws.assumed)


def _silent(_: str, __: int) -> Any:
    from contextlib import nullcontext

    return nullcontext(lambda _: None)
