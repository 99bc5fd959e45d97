"""Whole sessions on the compiled firmware: `recoil run --gun serial:...` on an emulated chip."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from tests.at_runs import SHORT_TRIALS, shorten
from tests.firmware import FAST, as_on_the_simulated_gun, emulated
from tests.serial_runs import hasty
from tests.waiting import wait_for

pytestmark = pytest.mark.slow


def brief(folder: Path) -> None:
    """Experiment 2 with trains of a few shots and no waiting."""
    config = folder / "preference.toml"
    text, times = re.subn(r"\n(opening|hand_over|answer)_s = [\d.]+", r"\n\1_s = 1.0", config.read_text())
    text, trains = re.subn(r"\nstimulus_s = [\d.]+", "\nstimulus_s = 4.0", text)
    assert (times, trains) == (3, 1)
    config.write_text(text)


@pytest.mark.parametrize("name", ["direction", "preference"])
def test_a_session_on_the_emulated_chip_logs_what_one_on_the_simulated_gun_does(recoil, quick_configs, name):
    hasty(quick_configs)
    shorten(quick_configs)
    brief(quick_configs)
    shots = as_on_the_simulated_gun(recoil, quick_configs / f"{name}.toml", FAST)
    assert shots >= {"direction": SHORT_TRIALS, "preference": 3}[name]


def test_the_doctor_measures_the_way_to_the_emulated_chip(recoil, tmp_path):
    def examined(port: str) -> dict[str, object]:
        done = recoil("doctor", "--json", "--gun", f"serial:{port}")
        (gun,) = [row for row in json.loads(done.stdout)["checks"] if row["check"] == "gun"]
        return {} if "within its time" in gun["measured"] else gun  # a busy machine hears it too late: look again

    with emulated(tmp_path) as chip:
        gun = wait_for(lambda: examined(chip.port), "the gun was never heard in its time")
    assert gun["verdict"] in {"good", "warning"}  # a busy machine makes the way longer
    assert 0 < gun["figures"]["round_trip_ms"]["n"] <= 200  # a busy machine has time for fewer
    assert gun["measured"].startswith("haptic-gun:QEMU-1, disarmed; round trip median")
