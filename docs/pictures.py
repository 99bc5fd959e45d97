"""The pictures in `docs/pictures`, made again by real windows and commands: `make pictures`.

Windows stand on a virtual display and are worked by real keys, as in the tests; every run is on the simulated gun.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path

from PIL import Image
from Xlib import X

from experiments.clock import VirtualClock
from experiments.load import load_setup
from experiments.run import run
from experiments.run_request import RunRequest
from experiments.screens.synthetic import synthetic_screen
from experiments.study.new_study import new_study
from tests import figure_files, warm_start, watched_start
from tests.at_display import AtConsole, AtDisplay, virtual_display
from tests.pseudo_languages import LONG, RIGHT_TO_LEFT, write_pseudo_languages
from tests.shown_languages import opened_in

OUT = Path(__file__).parent / "pictures"
ROOT = Path(__file__).parent.parent
SIZE = "1280x800"
COLOURS = 160
"""So many colours are enough for windows and figures, and make small files, where each that there is is near to one."""
PARTICIPANT = "Recoil: participant"
FIGURES = {
    "shot": "simulate --method asymmetric-2 --plot OUT/shot.png",
    "power": "power direction --participants 8,10,12,14,16,20 --studies 1000 --out OUT/power",
    "design": "design --grid 20 --out OUT/design",
    "percept": "fit percept --studies 500 --out OUT/percept",
    "trade": "bench --out OUT/trade",
}
"""The commands whose figures the gallery shows."""
OF_DESIGNS = {
    "voltages": ("figure-voltages", "figure-voltages-response-functions"),
    "hurry": ("figure-hurry-response-conditional-accuracy", "figure-hurry-response-quantile-probability"),
}
"""Designs, and the figures of their analysis that the gallery shows."""
PEOPLE = 12
"""So many synthetic participants do a design of the gallery."""


def keep(image: Image.Image, name: str, width: int = 1280) -> None:
    """Write a picture in few colours, no wider than `width`."""
    if image.width > width:
        image = image.resize((width, round(image.height * width / image.width)), Image.Resampling.LANCZOS)
    few = image.convert("RGB").quantize(COLOURS, Image.Quantize.MAXCOVERAGE, kmeans=1, dither=Image.Dither.NONE)
    few.save(OUT / f"{name}.png", optimize=True)
    sys.stdout.write(f"{name}.png\n")


def shoot(screen: AtDisplay, name: str, place: tuple[int, int, int, int] | None = None) -> None:
    """A picture of the whole display or of a part of it, once it stands still; a countdown never does."""
    before = None
    for _ in range(10):
        if (now := _grab(screen, place)) == before:
            break
        before = now
        time.sleep(0.15)
    keep(now, name)


def _grab(screen: AtDisplay, place: tuple[int, int, int, int] | None) -> Image.Image:
    root = screen.keys.display.screen().root
    seen = root.get_geometry()
    left, top, width, height = place or (0, 0, seen.width, seen.height)
    raw = root.get_image(left, top, width, height, X.ZPixmap, 0xFFFFFFFF)
    return Image.frombytes("RGB", (width, height), raw.data, "raw", "BGRX")


# the lab day


def lab_day(folder: Path, display: str) -> None:
    """The start window, a run of experiment 1 up to an emergency stop, and what there is to see when it is resumed."""
    new_study(folder / "pilot")
    for experiment in ("direction", "preference"):
        _run_by_a_person(folder, experiment, "P01")
    day = ["run", "pilot/direction.toml", "--screen", "console", "--results", "pilot/results", "--seed", 25]
    eye = folder / "start.jsonl"
    with AtDisplay(watched_start.words(eye, day), folder, display) as screen:
        screen.focus_on("start")
        _start(screen, eye)
    with AtConsole([*day, "--participant", "P02"], folder, display) as screen:
        _first_set(screen)
        _watched(folder)
        _emergency(screen)
    journal = _run_by_a_person(folder, "direction", "P03")
    journal.write_bytes(b"".join(journal.read_bytes().splitlines(keepends=True)[:40]))
    with AtDisplay([*day, "--participant", "P03"], folder, display) as screen:
        shoot(screen, "unfinished", screen.focus_on("unfinished"))


class LabClock(VirtualClock):
    """A clock on one day, so that a picture made again has the same date."""

    def utc(self) -> str:
        """That day."""
        return "2001-01-01T09:30:00.000000Z"


def _run_by_a_person(folder: Path, experiment: str, code: str) -> Path:
    setup = load_setup(str(folder / "pilot" / f"{experiment}.toml"))
    results = folder / "pilot" / "results"
    request = RunRequest(setup=setup, participant_id=code, results=results, seed=1, screen="terminal")
    return run(request, synthetic_screen, LabClock()).place.journal


def _start(screen: AtDisplay, eye: Path) -> None:
    _shown(screen, eye, "Next: P02", "start")
    screen.keys.press("t", "Control_L")
    _shown(screen, eye, "STAND CLEAR", "test-shot")
    _shown(screen, eye, "Fired", "")
    time.sleep(1.0)  # what came of it is to be read first: no key leaves it at once
    screen.keys.press("Escape")
    _shown(screen, eye, "Next: P02", "")
    for key in ("P", "0", "2"):
        screen.keys.type(key)
    screen.keys.press("Tab")
    screen.keys.type("25")
    for _ in range(2):
        screen.keys.press("Tab")
        screen.keys.press("Down")
    shoot(screen, "start-filled")
    screen.keys.press("Return", "Control_L")
    _shown(screen, eye, "The gun is SIMULATED", "simulated")


def _shown(screen: AtDisplay, eye: Path, words: str, name: str) -> None:
    """Wait until some words stand in the start window, and take its picture if it has a name."""
    watched_start.wait_for(eye, lambda look: any(words in text for text in look["texts"]))
    if name:
        shoot(screen, name)


def _first_set(screen: AtConsole) -> None:
    for state in ("setting", "preparing", "asking"):
        screen.to(state)
        shoot(screen, state)
    screen.to("preparing", trial=3)
    _and_back(screen, "n", "note", lambda look: look.line)
    _and_back(screen, "F1", "keys", lambda look: look.page)
    screen.keys.press("u")
    screen.at("correcting")
    shoot(screen, "correcting")
    screen.keys.press("Escape")
    screen.at("preparing")
    screen.keys.press("p")
    screen.at("paused")
    shoot(screen, "paused")
    screen.keys.press("p")
    screen.to("resting")
    shoot(screen, "resting")


def _and_back(screen: AtConsole, key: str, name: str, there: Callable[..., object]) -> None:
    screen.keys.press(key)
    screen.until(there)
    shoot(screen, name)
    screen.keys.press("Escape")
    screen.until(lambda look: not there(look))


def _watched(folder: Path) -> None:
    """The page of `recoil watch`, while the run goes on."""
    command = warm_start.warm("watch", folder / "pilot" / "results", "--port", "0")
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as server:
        address = next(word for line in server.stdout or () for word in line.split() if word.startswith("http://"))
        _page(address, folder / "watch.png", "1000,680")
        server.terminate()
    keep(Image.open(folder / "watch.png"), "watch", 1000)


def _emergency(screen: AtConsole) -> None:
    screen.keys.press("F12")
    screen.until(lambda look: look.state == "halted")
    screen.heard()
    screen.heard()
    shoot(screen, "halted")
    screen.keys.press("q")
    screen.until(lambda look: look.ended)
    shoot(screen, "stopped")
    screen.keys.press("q")


# experiment 2, and the participant's own screen


def ratings(folder: Path, display: str) -> None:
    """A run of experiment 2 to its end, with the first rating on the participant's own screen."""
    new_study(folder / "pilot")
    command = ["run", "pilot/preference.toml", "--screen", "console", "--results", "pilot/results", "--seed", 1]
    with AtConsole([*command, "--participant", "P02", "--participant-screen"], folder, display) as screen:
        screen.to("train", trial=2)
        shoot(screen, "train")
        screen.to("rating", trial=1)
        screen.participant_shows("RatingPage")
        left, top, width, height = screen.focus_on(PARTICIPANT)
        screen.keys.click(left + int(0.7 * width), top + int(0.56 * height))
        shoot(screen, "participant-rating", (left, top, width, height))
        screen.keys.press("Return")
        screen.participant_shows("DescriptionPage")
        screen.keys.type("like a push")
        shoot(screen, "participant-description", (left, top, width, height))
    with AtConsole([*command, "--participant", "P03"], folder, display) as screen:
        screen.to("rating", trial=1)
        shoot(screen, "rating")
        screen.to("closing")
        shoot(screen, "closing")
        screen.keys.press("Return")
        screen.until(lambda look: look.ended)
        shoot(screen, "finished")


# a threshold


def threshold(folder: Path, display: str) -> None:
    """The shipped threshold at the console, and its tracks as they are drawn."""
    command = ["run", "threshold", "--screen", "console", "--participant", "P01", "--results", "results", "--seed", 4]
    with AtConsole(command, folder, display) as screen:
        screen.to("preparing", trial=5)
        shoot(screen, "threshold")
    for code in ("S01", "S02", "S03"):
        _recoil(f"run threshold --participant {code} --screen synthetic --seed 1 --results {folder}/threshold")
    _recoil(f"analyze {folder}/threshold --out {folder}/threshold-analysis")
    drawn = folder / "threshold-analysis" / "figures" / "figure-threshold-response-tracks.png"
    keep(Image.open(drawn), "figure-threshold-tracks", 1000)


# languages


def languages(folder: Path, display: str) -> None:
    """The participant's pages in Chinese and in both languages of the tests."""
    own = write_pseudo_languages(folder)
    for code in ("zh", LONG, RIGHT_TO_LEFT):
        with opened_in(code, own, display) as pages:
            for name, image in pages.pictures():
                keep(image, f"language-{code}-{name}", 640)


# figures


def figures(folder: Path) -> None:
    """The figures of the gallery, each by its command, and the first page of a report."""
    for name, stems in OF_DESIGNS.items():
        for number in range(1, PEOPLE + 1):
            _recoil(f"run {name} --participant S{number:02d} --screen synthetic --seed 1 --results {folder}/{name}")
        _recoil(f"analyze {folder}/{name} --out {folder}/{name}-analysis")
        for stem in stems:
            keep(Image.open(folder / f"{name}-analysis" / "figures" / f"{stem}.png"), stem, 1000)
    for name, command in FIGURES.items():
        _recoil(command.replace("OUT", str(folder)))
        drawn = sorted(folder.glob(f"{name}.png")) or sorted((folder / name / "figures").glob("*.png"))
        for number, path in enumerate(drawn, 1):
            keep(Image.open(path), f"figure-{name}{f'-{number}' if len(drawn) > 1 else ''}", 1000)
    _page(f"file://{ROOT / 'results' / 'reference' / 'report.html'}", folder / "report.png", "1100,1400")
    keep(Image.open(folder / "report.png"), "report", 1000)


def _recoil(words: str) -> None:
    subprocess.run(warm_start.warm(*words.split()), check=False, stdout=subprocess.DEVNULL)


def _page(address: str, png: Path, size: str) -> None:
    how = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", f"--window-size={size}"]
    subprocess.run(["chromium", *how, f"--screenshot={png}", address], check=True, capture_output=True)


def main() -> None:
    """All pictures, or those of the parts that are named."""
    parts: dict[str, Callable[..., None]] = {
        "lab_day": lab_day,
        "ratings": ratings,
        "threshold": threshold,
        "languages": languages,
        "figures": figures,
    }
    OUT.mkdir(exist_ok=True)
    with ExitStack() as stack:
        server = stack.enter_context(tempfile.TemporaryDirectory())
        os.environ |= {warm_start.FOLDER: server, warm_start.OWNER: str(os.getpid()), figure_files.ASKED: "1"}
        for name in sys.argv[1:] or parts:
            _make(parts[name])


def _make(part: Callable[..., None]) -> None:
    with ExitStack() as stack:
        folder = Path(tempfile.gettempdir()) / "lab"  # the start window shows where its results are
        folder.mkdir()
        stack.callback(shutil.rmtree, folder)
        part(folder, *([] if part is figures else [stack.enter_context(virtual_display(SIZE))]))


if __name__ == "__main__":
    main()
