"""The console's window holds all that it shows: in every state, on small and large screens, and at 150 %."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path

import pytest

from tests.at_display import AtConsole, needs_display, virtual_display
from tests.at_runs import RUN, words
from tests.warm_start import warm

pytest.importorskip("PyQt6")
pytestmark = pytest.mark.slow

TITLE_BAR_PX = 24
STATES = 30
"""States and what can lie over them, as they are shown."""


@pytest.mark.parametrize(
    ("scale", "sizes"),
    [
        ("1", ("1024x600",)),
        pytest.param("1", ("1366x768", "1920x1080"), marks=pytest.mark.soak),
        ("1.5", ("1024x683",)),  # 1536 x 1024 at 150 %
    ],
)
def test_nothing_is_cut_in_any_state(tmp_path: Path, scale: str, sizes: tuple[str, ...]) -> None:
    beneath = [_beneath_a_title_bar(size) for size in sizes]
    done = subprocess.run(
        warm("-m", "tests.shown_console", tmp_path, *beneath),
        env=os.environ | {"QT_QPA_PLATFORM": "offscreen", "QT_SCALE_FACTOR": scale},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert len(found) == STATES * len(sizes)
    assert {name: cut for name, cut in found.items() if cut} == {}


def _beneath_a_title_bar(size: str) -> str:
    width, height = map(int, size.split("x"))
    return f"{width}x{height - TITLE_BAR_PX}"


@needs_display
@pytest.mark.parametrize("size", ["1024x600", "1366x768"])
def test_the_window_opens_as_a_whole_on_a_small_screen(quick_configs: Path, tmp_path: Path, size: str) -> None:
    width, height = map(int, size.split("x"))
    run = words(quick_configs, "direction", "--participant", "P01")
    with virtual_display(size) as display, AtConsole(run, tmp_path, display) as screen:
        screen.stands(RUN)
        look = screen.to("asking")
        assert {"answer 1", "answer 2", "emergency", "help"} <= set(look.places)
        for left, top, wide, high in look.places.values():
            assert 0 <= left < left + wide <= width
            assert 0 <= top < top + high <= height
        screen.click("emergency")
        screen.at("halted")
