"""`recoil simulate --vary`: tables of shots over a full factorial, whole or not at all."""

import csv
import json
import os
import signal
import subprocess
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest

from analysis.predict.simulate import sweep as shots
from analysis.predict.simulate.request import ModelRequest, SimulateRequest
from device.physics import GunParameters, simulate
from experiments.config.door import ConfigError
from tests.waiting import PATIENCE_S, wait_for
from tests.warm_start import warm

pytestmark = pytest.mark.slow

GUN = GunParameters()


@contextmanager
def silent(_what, _total):
    yield lambda _done: None


def swept(table, *vary, fidelity="full", **others):
    usual = {"gun": "gun", "method": None, "changes": (), "trace": None, "plot": None, "audit": False, "hand": None}
    usual |= {"contact_stiffness_N_m": None, "vary": vary, "table": table, "yes": False}
    model = ModelRequest(fidelity=fidelity, scene=None, needs=())
    return shots.sweep(SimulateRequest(**usual | {"model": model} | others), GUN, silent, lambda _note: None)


def rows_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def test_every_combination_is_shot_the_last_parameter_fastest(tmp_path):
    table = tmp_path / "shots.csv"
    found = swept(table, "friction_N=0.21:1.12:2", "drive_off=open,shorted", "voltage_V=12,16,20")
    rows = rows_of(table)
    assert found.rows == len(rows) == 12
    assert [row["voltage_V"] for row in rows[:4]] == ["12", "16", "20", "12"]
    assert [row["drive_off"] for row in rows[:6]] == ["open"] * 3 + ["shorted"] * 3
    for row in rows:
        gun = GunParameters(
            friction_N=float(row["friction_N"]), drive_off=row["drive_off"], voltage_V=float(row["voltage_V"])
        )
        alone = simulate(gun)
        assert row["status"] == alone.status
        assert float(row["reset_end_s"]) == pytest.approx(alone.reset_end_s, rel=1e-12)


def test_parquet_and_csv_hold_the_same(tmp_path):
    words = ("friction_N=0.2,1.7", "emf=printed,reciprocal")
    for name in ("a.csv", "b.parquet"):
        swept(tmp_path / name, *words)
    table = pq.read_table(tmp_path / "b.parquet").to_pylist()
    for one, other in zip(rows_of(tmp_path / "a.csv"), table, strict=True):
        assert list(one) == list(other)
        for key, value in other.items():
            words = "" if value is None else str(value)
            assert one[key] == words.removesuffix(".0")


def test_what_was_not_reached_is_missing_and_statuses_are_words(tmp_path):
    table = tmp_path / "b.parquet"
    found = swept(table, "friction_N=0.21,1.7,1000")
    assert found.statuses == {"home": 1, "no-break-away": 1, "stuck": 1}
    columns = pq.read_table(table).to_pydict()
    assert columns["status"] == ["home", "stuck", "no-break-away"]
    assert columns["reset_end_s"][1:] == [None, None]
    assert columns["peak_force_N"][2] is None


def test_a_table_says_where_it_comes_from(tmp_path):
    for name in ("a.csv", "b.parquet"):
        swept(tmp_path / name, "friction_N=0.2,0.3", fidelity="no-inductance")
    beside = json.loads((tmp_path / "a.csv.json").read_text())
    inside = json.loads(pq.read_schema(tmp_path / "b.parquet").metadata[b"recoil"])
    assert beside == inside
    assert beside["vary"] == {"friction_N": "0.2,0.3"}
    assert beside["fidelity"] == "no-inductance"
    assert beside["parameters"]["voltage_V"] == 16.0
    assert "friction_N" not in beside["parameters"]
    assert beside["provenance"]["numpy"] == np.__version__


def test_blocks_make_the_table_of_one_piece(tmp_path, monkeypatch):
    words = ("friction_N=0.1:1.2:7", "voltage_V=12:24:5")
    monkeypatch.setattr(shots, "FEW_SHOTS", 0)
    swept(tmp_path / "whole.csv", *words)
    monkeypatch.setattr(shots, "_BLOCK", 4)
    monkeypatch.setattr(shots, "_GROUP", 10)
    swept(tmp_path / "pieces.csv", *words)
    assert (tmp_path / "pieces.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()
    swept(tmp_path / "pieces.parquet", *words)
    assert pq.ParquetFile(tmp_path / "pieces.parquet").num_row_groups == 3


def test_without_the_compiler_the_numbers_are_the_same_and_it_is_said(tmp_path, monkeypatch):
    from device.physics import batch

    monkeypatch.setattr(shots, "FEW_SHOTS", 0)
    swept(tmp_path / "fast.parquet", "friction_N=0.1:1.2:5")
    monkeypatch.setattr(batch, "find_spec", lambda _name: None)
    swept(tmp_path / "slow.parquet", "friction_N=0.1:1.2:5")
    fast, slow = (pq.read_table(tmp_path / f"{name}.parquet").to_pydict() for name in ("fast", "slow"))
    assert slow["impact_speed_m_s"] == pytest.approx(fast["impact_speed_m_s"], rel=1e-12)
    assert "recoil[fast]" in batch.compiler_note()


def test_few_shots_wait_for_no_compiler(tmp_path, monkeypatch):
    from device.physics import batch

    monkeypatch.setattr(batch, "machine_code", lambda: 1 / 0)
    monkeypatch.setattr(shots, "FEW_SHOTS", 6)
    swept(tmp_path / "few.csv", "friction_N=0.1:1.2:6")
    with pytest.raises(ZeroDivisionError):
        swept(tmp_path / "many.csv", "friction_N=0.1:1.2:7")


@pytest.mark.parametrize(
    ("words", "few"),
    [
        ("friction_N=0:2:3", shots.FEW_SHOTS),
        ("drive_off=open,shorted", shots.FEW_SHOTS),
        ("return_friction_N=0.1,1e6", shots.FEW_SHOTS),
        ("magnet_mass_kg=log:1e-6:0.1:3", shots.FEW_FAR_SHOTS),
        ("voltage_V=16,1600", shots.FEW_FAR_SHOTS),
    ],
)
def test_guns_far_from_the_papers_wait_for_the_compiler_sooner(words, few):
    """One of them may take a second, interpreted."""
    assert shots.few_shots(GUN, [shots.axis_of(words, GUN)]) == few
    assert shots.few_shots(replace(GUN, inductance_H=1.0), []) == shots.FEW_FAR_SHOTS


@pytest.mark.parametrize(
    ("words", "values"),
    [
        ("friction_N=0.5:1:3", [0.5, 0.75, 1.0]),
        ("friction_N=1:0.5:2", [1.0, 0.5]),
        ("pulse_s=log:1e-3:1e-1:3", [1e-3, 1e-2, 1e-1]),
        ("friction_N=0.3, 0.1", [0.3, 0.1]),
        ("emf=reciprocal", ["reciprocal"]),
    ],
)
def test_values_are_ranges_logarithmic_ranges_or_lists(words, values):
    found = shots.axis_of(words, GUN).values.tolist()
    assert found == (pytest.approx(values, rel=1e-14) if words[0] != "e" else values)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("mass=1,2", "with a key of magnet_mass_kg"),
        ("friction_N", "must be KEY="),
        ("friction_N=", "must be KEY="),
        ("friction_N=0.1:1.2", "must be KEY="),
        ("friction_N=0.1:1.2:2.5", "must be KEY="),
        ("friction_N=0.1:1.2:1", "COUNT is 1"),
        ("friction_N=0.1:1.2:20000000", "COUNT is 20000000"),
        ("friction_N=0.1:nan:3", "finite"),
        ("friction_N=0.1:0.1:3", "differ"),
        ("friction_N=nan,1", "friction_N is nan"),
        ("friction_N=1,inf", "friction_N is inf"),
        ("friction_N=-1:1:3", "friction_N is -1.0"),
        ("magnet_mass_kg=0:1:3", "magnet_mass_kg is 0.0"),
        ("friction_N=log:0:1:3", "above 0"),
        ("friction_N=1,1", "twice"),
        ("drive_off=ajar", "drive_off is 'ajar'"),
    ],
)
def test_values_that_make_no_sense_are_refused(words, said):
    with pytest.raises(ConfigError, match=said) as raised:
        shots.axis_of(words, GUN)
    assert f"--vary {words}" in str(raised.value)


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"vary": ()}, "go together"),
        ({"table": None}, "go together"),
        ({"table": "shots.xlsx"}, "must end with"),
        ({"fidelity": "perfect"}, "--fidelity perfect"),
        ({"audit": True}, "--audit tells of a single one"),
        ({"changes": ("friction_N=1",)}, "set or varied twice"),
        ({"vary": ("friction_N=1,2", "friction_N=3,4")}, "set or varied twice"),
        ({"vary": ("friction_N=1:2:4000", "voltage_V=1:2:4000")}, "16,000,000 shots; more than 10,000,000 need --yes"),
    ],
)
def test_a_table_that_makes_no_sense_is_refused_before_it_is_begun(tmp_path, changed, said):
    values = {"table": tmp_path / "shots.csv", "vary": ("friction_N=0.1,0.2",)} | changed
    if isinstance(values["table"], str):
        values["table"] = tmp_path / values["table"]
    with pytest.raises(ConfigError, match=said):
        swept(values.pop("table"), *values.pop("vary"), **values)
    assert not list(tmp_path.iterdir())


def test_a_table_that_fails_leaves_the_old_one(tmp_path, monkeypatch):
    table = tmp_path / "shots.csv"
    swept(table, "friction_N=0.2,0.3")
    before = table.read_bytes()
    monkeypatch.setattr(shots, "simulate_batch", lambda *_, **__: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        swept(table, "friction_N=0.2,0.4")
    assert table.read_bytes() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["shots.csv", "shots.csv.json"]


def test_a_table_that_cannot_be_made_is_named_as_it_was_asked_for(tmp_path):
    """The name of the part is a few letters longer: beyond what a file system has."""
    table = tmp_path / f"{'x' * 246}.csv"
    with pytest.raises(OSError, match="too long") as refused:
        swept(table, "friction_N=0.2,0.3")
    assert refused.value.filename == str(table)


def test_an_interrupted_table_leaves_nothing_and_ends_with_130(tmp_path):
    part = tmp_path / ".shots.parquet.part"
    words = ("--vary", "friction_N=0.1:1.2:3000", "--vary", "voltage_V=12:24:3000", "--table", "shots.parquet")
    process = subprocess.Popen(
        warm("simulate", *words), cwd=tmp_path, stderr=subprocess.PIPE, text=True, env=os.environ
    )
    wait_for(lambda: part.exists() or process.poll() is not None)
    assert process.poll() is None
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    assert "Traceback" not in said
    assert not list(tmp_path.iterdir())
