"""What `import recoil` gives, what it loads, and that the command line answers at once."""

from __future__ import annotations

import doctest
import shutil
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import recoil
from tests.conftest import Recoil
from tests.log_files import trial_rows, trials_path, write_rows

HEAVY = ("numpy", "scipy", "pandas", "matplotlib", "pydantic", "pyarrow", "numba", "PyQt6", "psychopy", "pingouin")


def loaded(code: str) -> set[str]:
    """The heavy packages that a program has loaded at its end."""
    program = f"{code}\nimport sys\nprint(*(name for name in {HEAVY!r} if name in sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return set(done.stdout.splitlines()[-1].split()) if done.stdout.strip() else set()


def test_every_public_name_is_there_and_says_what_it_is() -> None:
    assert dir(recoil) == recoil.__all__
    for name in recoil.__all__:
        assert getattr(recoil, name).__doc__


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in recoil.__all__ if not name.startswith("__")])
def test_every_public_name_has_an_example_that_runs(name: str) -> None:
    public = getattr(recoil, name)
    found = doctest.DocTestFinder(recurse=False).find(public, name, globs=vars(sys.modules[public.__module__]))
    assert [one.examples for one in found] not in ([], [[]])
    for one in found:
        assert doctest.DocTestRunner().run(one).failed == 0


def test_numbers_may_come_as_arrays() -> None:
    found = recoil.power("preference", participants=np.arange(8, 10), effects=np.float64(1), studies=5)  # type: ignore[arg-type]
    assert {design.participants for design in found.designs} == {8, 9}


def test_an_unknown_name_is_refused_with_those_there_are() -> None:
    with pytest.raises(AttributeError, match=r"no attribute 'analyse'; it has .*analyze"):
        recoil.analyse  # noqa: B018 - the access is what fails


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("study") / "results"
    recoil.run_synthetic(recoil.load_config("direction"), ["P01", "P02", "P03"], folder, seed=1)
    return folder


@pytest.mark.slow
def test_logs_are_read_from_one_path_or_several(logs: Path) -> None:
    assert len(recoil.read_logs(str(logs)).trials) == len(recoil.read_logs(logs, logs / "sub-P01").trials) == 180


@pytest.mark.slow
def test_whoever_is_left_out_is_named_in_the_warnings(logs: Path, tmp_path: Path) -> None:
    shutil.copytree(logs, tmp_path / "results")
    table = next((tmp_path / "results" / "sub-P02").glob("*_trials.csv"))
    table.write_text(table.read_text().replace("forward,", "sideways,", 1))
    found = recoil.analyze(tmp_path / "results", tmp_path / "nowhere")
    assert found.direction is not None
    assert found.direction.n == 2
    said = [warning for warning in found.warnings if warning.startswith("left out: ")]
    assert [str(table) in said[1], "nowhere: no such file or folder" in said[0]] == [True, True]


def test_like_warnings_are_cut_at_five_with_their_count(tmp_path: Path) -> None:
    for code in range(13):
        rows = trial_rows(f"P{code}", code)
        rows[0]["response"] = "forward" if code == 0 else "sideways"
        rows[0]["correct"] = str(int(rows[0]["response"] == rows[0]["direction"]))
        write_rows(trials_path(tmp_path, f"P{code}"), rows)
    said = recoil.analyze(tmp_path).warnings
    assert sum("sideways" in warning for warning in said) == 5
    assert any(warning.startswith("... and 7 more like it") for warning in said)


@pytest.mark.slow
def test_what_found_is_shown_in_a_notebook() -> None:
    audited = recoil.audit()
    assert list(audited.to_frame().columns) == ["place", "quote", "verdict", "reason"]
    assert audited.to_dict()["findings"][0]["quote"] == audited.findings[0].quote
    assert "<table" in audited._repr_html_()
    power = recoil.power("preference", participants=[8, 14], studies=50)
    assert set(power.to_frame().participants) == {8, 14}
    assert power.to_dict()["studies"] == 50
    plan = recoil.power("threshold", trials=[10, 12], studies=4)
    assert set(plan.to_frame().trials) == {10, 12}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda setup, _: recoil.plan(setup, participant="a b"), "participant code 'a b'"),
        (lambda setup, _: recoil.plan(setup, seed=-1), "seed = -1: must be a whole number from 0"),
        (lambda setup, _: recoil.plan(setup, seed=1.5), "seed = 1.5: must be a whole number"),
        (lambda setup, _: recoil.plan(setup, order_row=9), "order_row = 9: no order of this design is balanced"),
        (lambda setup, folder: recoil.run_synthetic(setup, "P04", folder), "must be a list of codes, such as ['P04']"),
        (lambda setup, folder: recoil.run_synthetic(setup, ["P07"], folder, seed="x"), "seed = 'x': must be a whole"),
        (lambda _, __: recoil.analyze("nowhere"), "nowhere: no such file or folder"),
        (lambda _, __: recoil.analyze(), "must be files or folders with logs"),
        (lambda _, __: recoil.analyze(""), "must be files or folders with logs"),
        (lambda _, __: recoil.read_logs(None), "must be files or folders with logs"),
        (lambda _, __: recoil.power("preference", studies=0), "studies = 0: must be a whole number from 1"),
        (lambda _, __: recoil.load_config(5), "name = 5: must be a file or the name of a shipped config"),
        (lambda _, __: recoil.plan("direction"), "setup = 'direction': must be what load_config gives"),
        (lambda setup, _: recoil.plan(setup, participant=5), "participant = 5: must be a code, such as 'P01'"),
        (lambda _, folder: recoil.run_synthetic("direction", ["P01"], folder), "setup = 'direction': must be what"),
        (lambda setup, folder: recoil.run_synthetic(setup, [1], folder), "participants = [1]: must be a list of codes"),
        (lambda setup, _: recoil.run_synthetic(setup, ["P01"], 5), "results = 5: must be a path"),
        (lambda _, __: recoil.read_logs("x", columns=5), "columns = 5: must be a path"),
        (lambda _, __: recoil.analyze("x", columns="none.toml"), "none.toml"),
        (lambda _, __: recoil.audit(5), "paper = 5: must be a file"),
        (lambda _, __: recoil.power(5), "config = 5: must be a file"),
        (lambda _, __: recoil.power("preference", participants="abc"), "participants = abc: 'abc' is no whole number"),
        (lambda _, __: recoil.power("preference", participants=None), "participants = None: must be a number, a list"),
        (lambda _, __: recoil.power("preference", trials=-1), "trials = -1: "),
        (lambda _, __: recoil.power("threshold", participants=5), "participants: threshold has a threshold, of which"),
        (lambda _, __: recoil.power("preference", effects="x"), "effects = x: 'x' must be a number"),
        (lambda _, __: recoil.power("preference", methods="ramp"), "methods = 'ramp': must be a list of names"),
        (lambda _, __: recoil.power("preference", methods=["x"]), "methods = x: must be two or more"),
        (lambda _, __: recoil.power("preference", target="x"), "target = 'x': must be a number between 0 and 1"),
        (lambda _, __: recoil.power("preference", target=2), "target = 2: must be a number between 0 and 1"),
    ],
)
def test_what_cannot_be_is_one_message_and_leaves_nothing(call: Any, said: str, tmp_path: Path) -> None:
    with pytest.raises(recoil.RecoilError) as error:
        call(recoil.load_config("direction"), tmp_path / "results")
    assert said in str(error.value)
    assert not (tmp_path / "results").exists()


@pytest.mark.slow
def test_importing_it_loads_nothing_and_a_name_what_it_needs() -> None:
    assert loaded("import recoil") == set()
    assert loaded("import recoil\nrecoil.RecoilError") == set()
    assert "pandas" not in loaded("import recoil\nrecoil.simulate(recoil.GunParameters())")


def test_help_loads_none_of_what_commands_use() -> None:
    code = "from typer.testing import CliRunner\nfrom recoil.cli import app\nCliRunner().invoke(app, ['--help'])"
    assert loaded(code) == set()


@pytest.mark.slow
def test_the_version_is_the_packages(recoil: Recoil) -> None:
    done = recoil("--version")
    assert (done.returncode, done.stdout.strip()) == (0, version("recoil"))


@pytest.mark.slow
def test_commands_load_nothing_heavy_that_they_do_not_use() -> None:
    code = """
import sys
from pathlib import Path
from analysis.predict import check
check.check_text(check.check("direction", 1, 3))
assert not {"numpy", "scipy", "matplotlib", "pandas", "pyarrow", "numba"} & set(sys.modules), "check"
from analysis.predict.simulate import run
model = run.ModelRequest(fidelity=None, scene=None, needs=())
usual = dict.fromkeys(("method", "trace", "plot", "hand", "contact_stiffness_N_m", "table"))
alone = run.SimulateRequest(gun="gun", changes=(), model=model, audit=False, vary=(), yes=False, **usual)
run.simulated(alone, None, None)
assert not {"scipy.special", "matplotlib", "pandas", "pyarrow", "numba"} & set(sys.modules), "simulate"
import analysis.summary.analyze
unused = {"scipy.special", "scipy.stats", "numba", "pingouin", "matplotlib", "fontTools", "analysis.paper.audit"}
assert not unused & set(sys.modules), "verify"
import analysis.summary.sections.sections
assert not unused - {"matplotlib", "fontTools"} & set(sys.modules), "analyze"
"""
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.slow
def test_a_report_of_one_participant_is_made_without_scipy_and_docstrings(tmp_path: Path) -> None:
    recoil.run_synthetic(recoil.load_config("direction"), ["P01"], tmp_path, seed=1)
    code = f"""
import sys
from pathlib import Path
from recoil.cli import main
sys.argv = ["recoil", "analyze", {str(tmp_path)!r}, "--out", {str(tmp_path / "out")!r}]
try:
    main()
except SystemExit as end:
    assert not end.code
from matplotlib.lines import Line2D
assert "scipy.special" not in sys.modules
assert "marker" not in Line2D.set.__doc__, "its lists of what can be set are made again"
"""
    done = subprocess.run([sys.executable, "-c", code + "print('seen')"], capture_output=True, text=True, check=False)
    assert done.stdout.endswith("seen\n"), done.stderr
    assert (tmp_path / "out" / "figures" / "figure-directions.pdf").is_file()


@pytest.mark.slow
def test_the_statistics_of_any_design_are_a_frame_and_a_table_in_a_notebook(tmp_path: Path) -> None:
    recoil.run_synthetic(recoil.load_config("realism"), ["P01", "P02", "P03"], tmp_path, seed=1)
    found = recoil.analyze(tmp_path)
    frame = found.to_frame()
    logs = recoil.read_logs(tmp_path).designs[0].table
    cell = frame[(frame.question == "comfort") & (frame.damper == "on") & (frame.voltage_V == 20.0)]
    mine = logs[(logs.damper == "on") & (logs.voltage_V == 20.0)].groupby("participant_id").comfort.mean()
    assert cell["mean"].item() == pytest.approx(mine.mean())
    assert (len(frame), cell["n"].item()) == (12, 3)
    assert "Realism, comfort, voltage_V: F(2, 4) = " in found._repr_html_()


def test_whole_numbers_of_numpy_are_whole_numbers() -> None:
    setup = recoil.load_config("direction")
    assert recoil.plan(setup, "P01", seed=np.int64(3)) == recoil.plan(setup, "P01", seed=3)
    with pytest.raises(recoil.RecoilError, match=r"seed = 3\.0: must be a whole number"):
        recoil.plan(setup, "P01", seed=3.0)  # type: ignore[arg-type]


def test_a_name_that_breaks_the_line_is_shown_on_one() -> None:
    with pytest.raises(recoil.RecoilError, match=r"name = a\\nb: no such file"):
        recoil.load_config("a\nb")
