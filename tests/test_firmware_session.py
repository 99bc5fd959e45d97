"""Whole sessions on the compiled firmware: `recoil run --gun serial:...` on an emulated chip."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from device.serial_gun.reports import WAYS
from experiments.record.journal import read
from tests.conftest import Recoil
from tests.serial_runs import hasty, timings_of
from tests.test_firmware_emulated import Emulated, emulated
from tests.test_serial_run import rows

FAST = 10


@pytest.fixture
def fast_chip(tmp_path):
    """A chip that lives ten times faster than the world."""
    with emulated(tmp_path, f"gun-qemu-{FAST}.elf") as chip:
        yield chip


def logs_of(recoil: Recoil, folder: Path, config: Path, gun: str) -> tuple[list[dict[str, str]], list[dict]]:
    """A run's table but for its times, and how each shot in its journal came about."""
    words = ("--participant", "P01", "--screen", "synthetic", "--seed", 3, "--json", "--results", folder)
    done = recoil("run", config, *words, "--gun", gun)
    assert done.returncode == 0, done.stderr
    paths = {key: config.parent.parent / path for key, path in json.loads(done.stdout).items()}
    return rows(paths["table"]), timings_of(read(paths["journal"]))


def driven(chip: Emulated) -> list[int]:
    """When the chip says that something was begun to be driven."""
    return [call.due_us for call in chip.drives() if not call.text.endswith("OFF")]


def as_on_the_simulated_gun(recoil: Recoil, config: Path, chip: Emulated, speed: int) -> int:
    """The logs are the same but for times, and every shot in them was driven, once, when they say. How many."""
    simulated, _ = logs_of(recoil, Path("simulated"), config, "simulated")
    emulated_rows, timings = logs_of(recoil, Path("emulated"), config, f"serial:{chip.port}?speed={speed}")
    assert emulated_rows == simulated
    starts = [timing["gun_start_us"] for timing in timings]
    assert starts == driven(chip)
    if config.stem == "direction":
        ways = [WAYS[row["direction"]] for row in simulated]
        assert [call.split(",")[1] for call in settings_in_force(chip)] == ways
    return len(starts)


def settings_in_force(chip: Emulated) -> list[str]:
    """The setting of each shot: the last CONF before each TRIG, among what the core was given."""
    found, setting = [], ""
    for call in chip.calls():
        text = bytes.fromhex(call.split()[2]).decode("latin-1") if call.startswith("in ") else ""
        setting = text if " CONF " in text else setting
        found += [setting] if " TRIG " in text else []
    return found


def brief(folder: Path) -> None:
    """Experiment 2 with trains of a few shots and no waiting."""
    config = folder / "preference.toml"
    text = re.sub(r"exposure_s = [\d.]+", "exposure_s = 6.0", config.read_text())
    config.write_text(re.sub(r"\b(instruction|hand_over|rating|description)_s = [\d.]+", r"\1_s = 1.0", text))


@pytest.mark.parametrize("name", ["direction", "preference"])
def test_a_session_on_the_emulated_chip_logs_what_one_on_the_simulated_gun_does(recoil, quick_configs, fast_chip, name):
    hasty(quick_configs)
    brief(quick_configs)
    shots = as_on_the_simulated_gun(recoil, quick_configs / f"{name}.toml", fast_chip, FAST)
    assert shots >= {"direction": 60, "preference": 3}[name]


def test_the_doctor_measures_the_way_to_the_emulated_chip(recoil, tmp_path):
    with emulated(tmp_path) as chip:
        done = recoil("doctor", "--json", "--gun", f"serial:{chip.port}")
    (gun,) = [row for row in json.loads(done.stdout)["checks"] if row["check"] == "gun"]
    assert gun["verdict"] in {"good", "warning"}  # a busy machine makes the way longer
    assert gun["figures"]["round_trip_ms"]["n"] == 200
    assert gun["measured"].startswith("haptic-gun:QEMU-1, disarmed; round trip median")
