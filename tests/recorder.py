"""LabRecorder, as labs record with it, in a process of its own: streams of Lab Streaming Layer into an XDF file."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pyxdf

from experiments.watch.lsl import DETAILS_NAME, MARKERS_NAME
from tests.conftest import RECOIL
from tests.waiting import PATIENCE_S

SCRIPT = """
import sys, time, labrecorder
recording = labrecorder.Recording(sys.argv[1], [], [sys.argv[2]])
sys.stdin.read()
time.sleep(3.0)
recording.stop()
"""
"""It takes in what came every half second, and not when it is stopped; its file is whole when it is gone."""
STREAMS = MARKERS_NAME, DETAILS_NAME
Row = dict[str, str]


@contextmanager
def recording(xdf: Path, source: str) -> Iterator[None]:
    """Both streams of a source, which are there, are recorded from here on, and the file is whole afterwards."""
    command = [sys.executable, "-c", SCRIPT, str(xdf), f"starts-with(source_id,'{source}')"]
    ours, nowhere = subprocess.PIPE, subprocess.DEVNULL
    with subprocess.Popen(command, stdin=ours, stdout=ours, stderr=nowhere, text=True) as recorder:
        try:
            begun = 0
            while begun < 2:  # what is in the file is not on the disk before there is much of it
                line = recorder.stdout.readline()
                assert line, "the recorder ended"
                begun += "Started data collection" in line
            yield
        finally:
            recorder.communicate(timeout=PATIENCE_S)


@contextmanager
def markers_process(results: Path) -> Iterator[int]:
    """`recoil markers` of a folder, whose streams are there; its process."""
    command = [str(RECOIL), "markers", str(results), "--json"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
        try:
            assert program.stdout.readline() == "{\n"
            yield program.pid
        finally:
            program.send_signal(signal.SIGCONT)
            program.send_signal(signal.SIGINT)
            program.communicate(timeout=PATIENCE_S)


def recorded(xdf: Path) -> tuple[list[tuple[float, str]], list[tuple[float, Row]]]:
    """The two streams as they were taken down: times with markers, and times with details by column."""
    streams, _ = pyxdf.load_xdf(str(xdf), synchronize_clocks=False, dejitter_timestamps=False)
    of = {stream["info"]["name"][0]: stream for stream in streams}
    labels = of[DETAILS_NAME]["info"]["desc"][0]["channels"][0]["channel"]
    columns = [label["label"][0] for label in labels]
    names, rows = (zip(map(float, of[name]["time_stamps"]), of[name]["time_series"], strict=True) for name in STREAMS)
    return [(at_s, name) for at_s, (name,) in names], [
        (at_s, dict(zip(columns, row, strict=True))) for at_s, row in rows
    ]
