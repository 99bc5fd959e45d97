"""The kit of what every gun keeps, 10,000 trials a gun: the simulated one, the twin, the firmware and a plug-in."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Any

import pytest

from device.plugin.conformance import ConformanceRig, broken, conformance, rig_at
from tests.firmware import emulated
from tests.gun_plugins import install_sound_card
from tests.twins import a_twin

pytestmark = pytest.mark.soak
TRIALS = 10_000


@contextmanager
def simulated(_: Path) -> Iterator[ConformanceRig]:
    yield rig_at("simulated", trials=TRIALS)


@contextmanager
def twin(folder: Path) -> Iterator[ConformanceRig]:
    with a_twin(folder, speed=10.0) as (gun, socket):
        address = f"serial:{socket.address}?speed=10"
        yield rig_at(address, trials=TRIALS, break_it=lambda: gun.core.fail(1, gun.clock_us()))


@contextmanager
def firmware(folder: Path) -> Iterator[ConformanceRig]:
    with emulated(folder, "gun-qemu-10.elf") as chip:
        yield rig_at(f"serial:{chip.port}?speed=10", trials=TRIALS, break_it=lambda: chip.fail(1))


@contextmanager
def plugin(folder: Path) -> Iterator[ConformanceRig]:
    with pytest.MonkeyPatch.context() as patch:
        install_sound_card(patch, folder)
        import sound_card_gun

        def break_it() -> None:
            patch.setattr(sound_card_gun.Null, "play", lambda *_: 1 / 0)

        yield rig_at("sound-card:null", trials=TRIALS, speed=10.0, break_it=break_it)


@pytest.mark.parametrize("gun", [simulated, twin, firmware, plugin], ids=lambda gun: gun.__name__)
def test_ten_thousand_trials(
    gun: Callable[[Path], AbstractContextManager[ConformanceRig]], tmp_path: Path, soak: Any
) -> None:
    with gun(tmp_path) as rig:
        findings = conformance(rig)
    said = next(one.said for one in findings if one.check == "trials")
    rules = broken(findings)
    soak(f"rules that a gun does not keep: {gun.__name__}", len(rules), "0", f"{said}; {len(findings)} checks")
    assert rules == []
