"""The full figures behind "a whole lab day without losing an answer", kept as a table: `make soak`."""

from __future__ import annotations

import os
import random
import re
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.doctor.verdicts import Latencies, latencies, pooled
from experiments.record.journal import read_journal
from tests import at_runs as console
from tests import faulty_console as faults
from tests.at_display import (
    AtConsole,
    AtDisplay,
    check_disarmed,
    lose_the_display,
    needs_display,
    records,
    virtual_display,
)
from tests.at_hand import STEM, short_configs, words
from tests.at_terminal import ANSWERS, AtTerminal
from tests.conftest import RECOIL, Soak
from tests.kills import answers as terminal_answers
from tests.kills import words as terminal_words
from tests.waiting import wait_for
from tests.watched_console import Watch

pytest.importorskip("PyQt6")
pytestmark = [pytest.mark.soak, needs_display]

CONSOLE_KILLS, TERMINAL_KILLS = 300, 1000
PARTICIPANTS = 17
"""Of 60 trials each: a little more than 1,000 trials."""
STEP_TO_SCREEN_MS, KEY_TO_DISK_MS, STALL_MS = 50.0, 10.0, 50.0
FAULTS = 5
LOST_DISPLAYS, LOST_S = 20, 2.0
STOPS, SYNC_S, STOP_S = 100, 0.15, 0.05
QUIET_STOPS, LOADED_STOPS, LOAD = 300, 100, 8


@pytest.fixture(scope="module")
def display() -> Iterator[str]:
    with virtual_display() as name:
        yield name


# kill -9


def answers(journal: Path) -> list[str]:
    """The answers of a journal that may not be there yet."""
    return console.answers(journal) if journal.exists() and journal.read_bytes().count(b"\n") else []


def check_rows(folder: Path) -> None:
    """One row a planned trial, and what was answered is what was pressed, in order."""
    table = console.rows(folder, console.DIRECTION, "trials")
    assert len({(row["session"], row["trial"]) for row in table}) == len(table) == 60
    assert [row["response"] for row in table] == ["forward", "backward"] * 30


def work_until_killed(screen: AtConsole, seconds: float) -> int:
    """Answer until killed some seconds from now, or until the run has ended; the answers that were acknowledged."""
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s and not (look := screen.look()).ended:
        if look.ready and look.state in ("setting", "preparing", "asking", "closing"):
            screen.due(look)
            while time.monotonic() < end_s and screen.look().serial == look.serial:
                time.sleep(0.002)
    screen.kill()
    shown = [text for look in screen.watch.looks() for text in look.texts if re.match(r"Saved\. Trial \d+:", text)]
    return len(list(groupby(shown)))  # one stands until the next; a trial of another session may say the same


def test_kills_of_a_console(quick_configs: Path, tmp_path: Path, display: str, soak: Soak) -> None:
    """Participants one after the other, each killed again and again until their run is finished."""
    moments, acknowledged, runs = random.Random(300), 0, 0
    folder = tmp_path / "0"
    for _ in range(CONSOLE_KILLS):
        folder.mkdir(exist_ok=True)
        journal = folder / f"{console.DIRECTION}_journal.jsonl"
        before = answers(journal)
        again = ["--resume"] if journal.exists() and journal.read_bytes().count(b"\n") else ["--fresh"]
        run = console.words(quick_configs, "direction", "--participant", "P01", *again)
        with AtConsole(run, folder, display) as screen:
            screen.stands(console.RUN)
            said = work_until_killed(screen, moments.uniform(0.0, 5.0))
        after = answers(journal)
        assert after[: len(before)] == before
        assert len(after) - len(before) - said in (0, 1)  # the last is on the disk a moment before it is said
        acknowledged += said
        if any(record["kind"] == "finished" for record in records(journal)):
            subprocess.run([RECOIL, "rebuild", journal], check=False, capture_output=True)
            check_rows(folder)
            runs += 1
            folder = tmp_path / str(runs)
    how = (
        f"random moments, each resumed; {acknowledged} answers acknowledged, {runs} runs to their end, rows as unbroken"
    )
    soak(f"acknowledged answers lost or doubled over {CONSOLE_KILLS} `kill -9` of a console", 0, "0", how)


def test_kills_of_a_terminal(quick_configs: Path, tmp_path: Path, soak: Soak) -> None:
    """The same at the terminal."""
    moments, acknowledged, runs = random.Random(1000), 0, 0
    folder = tmp_path / "0"
    for _ in range(TERMINAL_KILLS):
        folder.mkdir(exist_ok=True)
        said, finished = kill_a_terminal(quick_configs, folder, moments.uniform(0.0, 2.0))
        acknowledged += said
        runs += finished
        folder = tmp_path / str(runs)
    how = f"random moments, each resumed; {acknowledged} answers acknowledged, {runs} runs to their end"
    soak(f"acknowledged answers lost or doubled over {TERMINAL_KILLS} `kill -9` of a terminal", 0, "0", how)


def kill_a_terminal(configs: Path, folder: Path, seconds: float) -> tuple[int, bool]:
    """Go on with a run and kill it: the answers that were acknowledged, and whether all are given."""
    journal = folder / "results" / f"{console.DIRECTION.removeprefix('results/')}_journal.jsonl"
    begun = journal.exists() and journal.read_bytes().count(b"\n") > 0
    before = terminal_answers(read_journal(journal)) if begun else ""
    with AtTerminal([RECOIL, *terminal_words(configs, "--resume" if begun else "--fresh")], folder) as screen:
        screen.wait_for("Participant P01", timeout_s=60)
        answer_until_killed(screen, seconds, len(before))
        said = len(re.findall(r"Saved\. Trial", screen.seen))
    after = terminal_answers(read_journal(journal)) if journal.exists() and journal.read_bytes().count(b"\n") else ""
    assert after.startswith(before)
    assert len(after) - len(before) - said in (0, 1)
    assert after == (ANSWERS * 8)[: len(after)]
    return said, len(after) == 60


def answer_until_killed(screen: AtTerminal, seconds: float, already: int) -> None:
    """Type what is asked for, and be killed so many seconds from now."""
    end_s, done = time.monotonic() + seconds, 0
    asked = re.compile(r"Then type d and Enter: |Enter fires: |b = backward: ")
    trial = already
    while time.monotonic() < end_s and trial < 60:
        found = asked.findall(screen.seen)
        if len(found) > done:
            done = len(found)
            if found[-1].startswith("b ="):
                screen.type(ANSWERS[trial % len(ANSWERS)])
                trial += 1
            else:
                screen.type("d" if "type d" in found[-1] else "")
        time.sleep(0.002)
    screen.kill()


# how fast it is


def measured(configs: Path, folder: Path, display: str) -> tuple[Latencies, list[float]]:
    """The stamps of whole runs that a synthetic participant worked through at the console, and bare syncs between."""
    bare_ms: list[float] = []
    for number in range(1, PARTICIPANTS + 1):
        more = ("--participant", f"P{number:02d}", "--visual")
        with AtDisplay(console.words(configs, "direction", *more), folder, display) as screen:
            code, said = screen.end()
        assert code == 0, said
        bare_ms += bare_syncs_ms(folder / "bare")
    return pooled(latencies(read_journal(path).records) for path in folder.glob("results/*/*_journal.jsonl")), bare_ms


def bare_syncs_ms(path: Path) -> list[float]:
    """How long this disk takes to write and sync as many records, with nothing of ours around it."""
    took_ms = []
    with path.open("ab", buffering=0) as file:
        for _ in range(60):
            begun_s = time.perf_counter()
            file.write(b"x" * 300)
            os.fsync(file.fileno())
            took_ms.append(1000 * (time.perf_counter() - begun_s))
    return took_ms


def percentile_99(values: tuple[float, ...] | list[float]) -> float:
    return float(np.percentile(values, 99))


def test_the_99th_percentiles_over_1000_trials(quick_configs: Path, tmp_path: Path, display: str, soak: Soak) -> None:
    found, bare_ms = measured(quick_configs, tmp_path, display)
    screen_ms, disk_ms = percentile_99(found.step_to_screen_ms), percentile_99(found.key_to_disk_ms)
    sync_ms = percentile_99(bare_ms)
    how = f"{found.trials} trials, `--visual` on Xvfb, stamps in the journals; median "
    bounds = f"{STEP_TO_SCREEN_MS:g} ms", f"{KEY_TO_DISK_MS:g} ms more than a bare sync"
    screen_how = f"{how}{np.median(found.step_to_screen_ms):.1f} ms"
    soak("99th percentile, step to the end of its paint", f"{screen_ms:.1f} ms", bounds[0], screen_how)
    disk_how = f"{how}{np.median(found.key_to_disk_ms):.1f} ms; bare syncs between the runs {sync_ms:.1f} ms, median "
    disk_how += f"{np.median(bare_ms):.1f} ms"
    soak("99th percentile, key to synced journal", f"{disk_ms:.1f} ms", bounds[1], disk_how)
    assert found.trials >= 1000
    assert screen_ms < STEP_TO_SCREEN_MS
    assert disk_ms < KEY_TO_DISK_MS + sync_ms


@pytest.mark.parametrize("case", ["good", "hangs", "late", "link", "vanishes", "hangs-emergency", "slow-disk"])
def test_the_windows_longest_pause_while_gun_or_disk_do_not(case: str, tmp_path: Path, soak: Soak) -> None:
    found = [faults.child(case, tmp_path / str(number)) for number in range(FAULTS)]
    longest_ms = float(np.median([seen["longest_ms"] for seen in found]))
    how = f"median of {FAULTS} runs, {faults.TICK_MS} ms between two ticks of its thread"
    soak(f"longest pause of the window, gun or disk: {case}", f"{longest_ms:.0f} ms", f"{STALL_MS:g} ms", how)
    assert longest_ms < STALL_MS
    if case == "hangs-emergency":
        after_ms = float(np.median([1000 * disarmed_after_s(seen) for seen in found]))
        soak("F12 to disarm while a shot hangs", f"{after_ms:.1f} ms", f"{STALL_MS:g} ms", f"median of {FAULTS} runs")
        assert after_ms < STALL_MS


def disarmed_after_s(seen: dict[str, Any]) -> float:
    """How long after the key the gun was told."""
    return min(at_s - seen["pressed_s"] for at_s in seen["disarmed_s"] if at_s >= seen["pressed_s"])


# the display


def test_a_lost_display_ends_the_run_in_time(quick_configs: Path, tmp_path: Path, soak: Soak) -> None:
    took_s = []
    for number in range(LOST_DISPLAYS):
        folder = tmp_path / str(number)
        folder.mkdir()
        experiment, state = (("direction", "asking"), ("preference", "train"))[number % 2]
        took_s.append(lose_the_display(quick_configs, folder, experiment, state))
        check_disarmed(Watch(str(folder)))
    how = f"{LOST_DISPLAYS} times `kill -9` of Xvfb, in a question and in a train; median {np.median(took_s):.2f} s"
    soak("longest from the loss of the display to the end of the process", f"{max(took_s):.2f} s", f"{LOST_S:g} s", how)
    assert max(took_s) < LOST_S


# the emergency stop


def test_f12_while_every_sync_is_slow(tmp_path: Path, display: str, soak: Soak) -> None:
    draw, watch = random.Random(100), Watch(str(tmp_path), sync_s=SYNC_S, times=STOPS, look_ms=50)
    configs, late_s, after_latch, fired = short_configs(tmp_path), [0.0], 0, 0
    with AtConsole(words(configs, "direction", "--fresh"), tmp_path, display, watch) as screen:
        for _ in range(STOPS):
            screen.until(lambda look: look.state in ("rearming", "setting", "preparing"))
            screen.stands("Recoil – P01")
            screen.to("preparing")
            screen.keys.press("space")
            time.sleep(draw.uniform(0.0, 0.4))
            pressed_s = screen.keys.press("F12")
            screen.until(lambda look: look.state == "halted" and look.ready)
            latched_s = halted_s(tmp_path)
            next_run(screen)
            began_s = [call["start_s"] for call in watch.calls("fired") if call["start_s"] > pressed_s]
            late_s += [start_s - pressed_s for start_s in began_s]
            after_latch += sum(call["s"] > latched_s for call in watch.calls("fire"))
            fired += any(call["s"] > pressed_s - 0.5 for call in watch.calls("fired"))
        screen.end()
    how = (
        f"every sync {1000 * SYNC_S:g} ms late, F12 0 to 400 ms after Space; {fired} of {STOPS} shots had begun before"
    )
    soak(f"latest start of a shot after F12, of {STOPS}", f"{1000 * max(late_s):.1f} ms", "50 ms", how)
    soak("shots asked of the gun after the latch", after_latch, "0", "the gun's own book against the journal's stamps")
    assert max(late_s) < STOP_S
    assert after_latch == 0


def halted_s(folder: Path) -> float:
    """When the emergency stop latched, by the journal of the run at hand."""
    (journal,) = folder.glob(f"{STEM}*_journal.jsonl")
    return next(
        float(record["monotonic_s"])
        for record in reversed(records(journal))
        if record.get("body", {}).get("kind") == "halted"
    )


def next_run(screen: AtConsole) -> None:
    """Close a halted run, so that the next begins."""
    screen.keys.press("q")
    screen.until(lambda look: look.ended)
    screen.keys.press("q")
    wait_for(lambda: not screen.look().ended or screen.process.poll() is not None)


@contextmanager
def a_twin(folder: Path) -> Iterator[str]:
    """`recoil twin`, in a program of its own; its address for `--gun`."""
    twin = subprocess.Popen([RECOIL, "twin", "--link", folder / "gun"], stdout=subprocess.DEVNULL)
    try:
        wait_for((folder / "gun").exists)
        yield f"serial:{folder / 'gun'}"
    finally:
        twin.terminate()
        twin.wait()


@contextmanager
def busy(processes: int) -> Iterator[None]:
    """A load of so many processes that only count."""
    with ExitStack() as stack:
        for _ in range(processes):
            load = stack.enter_context(subprocess.Popen([sys.executable, "-c", "while True: pass"]))
            stack.callback(load.kill)
        yield


def key_to_wire_ms(folder: Path, display: str, stops: int) -> list[float]:
    """F12 in a train, again and again: from the key to the bytes of `ABOR` on the gun's line."""
    watch, took_ms = Watch(str(folder), times=stops, look_ms=50), []
    with a_twin(folder) as gun:
        run = words(short_configs(folder), "preference", "--gun", gun, "--fresh")
        with AtConsole(run, folder, display, watch) as screen:
            for _ in range(stops):
                screen.until(lambda look: look.state in ("rearming", "setting", "preparing"))
                screen.stands("Recoil – P01")
                screen.to("train")
                pressed_s = screen.keys.press("F12")
                screen.at("halted")
                sent_s = next(call["s"] for call in watch.calls("ABOR") if call["s"] >= pressed_s)
                took_ms.append(1000 * (sent_s - pressed_s))
                next_run(screen)
            screen.end()
    return took_ms


@pytest.mark.parametrize("load", [0, LOAD])
def test_from_f12_to_the_wire(tmp_path: Path, display: str, soak: Soak, load: int) -> None:
    stops = LOADED_STOPS if load else QUIET_STOPS
    with busy(load):
        took_ms = key_to_wire_ms(tmp_path, display, stops)
    about = f"a load of {load} busy processes" if load else "no load of its own"
    how = (
        f"{stops} presses in trains on the twin's line; median {np.median(took_ms):.1f} ms, worst {max(took_ms):.1f} ms"
    )
    what = f"99th percentile, F12 to the bytes of `ABOR` on the line, {about}"
    soak(what, f"{percentile_99(took_ms):.1f} ms", "-", how)
