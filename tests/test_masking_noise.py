"""Masking noise: it goes on for as long as it is on, with no gap where its few seconds begin again."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from experiments.screens.participant.noise import NOISE_ROUND, NoiseLoop, Silence
from tests.waiting import wait_for


@pytest.mark.parametrize("frames", [1, 64, 441, 1000])
def test_blocks_of_any_length_join_without_a_gap_from_round_to_round(frames: int) -> None:
    loop, whole = NoiseLoop(0.5), NoiseLoop(0.5).block(NOISE_ROUND)
    count = (NOISE_ROUND + 5000) // frames if frames > 1 else 10
    joined = np.concatenate([loop.block(frames) for _ in range(count)])
    assert np.array_equal(joined, np.resize(whole, joined.shape))
    assert 0.49 < np.abs(whole).max() <= 0.5


def test_a_device_that_takes_nothing_any_more_is_silent_but_not_after_a_standstill_of_this_program() -> None:
    now_s, blocks = 100.0, 0
    silence = Silence(lambda: now_s)
    for _ in range(100):
        now_s, blocks = now_s + 1.0, blocks + 1
        assert not silence.lasts(blocks)
    now_s += 60.0  # all stood still, and this is asked before the device has taken the next block
    assert not silence.lasts(blocks)
    looks = 0
    while not silence.lasts(blocks):
        now_s, looks = now_s + 1.0, looks + 1
    assert looks == 2  # of a second each, beside what the standstill counts for


_PLAYS = """
import sys
from experiments.screens.participant.messages import Noise
from experiments.screens.participant.noise import MaskingNoise
noise = MaskingNoise()
print(noise.turn(Noise(on=True, level=0.5)).message or "plays", flush=True)
sys.stdin.read()
"""


@pytest.mark.slow
def test_a_device_is_given_noise_for_longer_than_one_round(tmp_path: Path) -> None:
    played = tmp_path / "played.raw"
    (tmp_path / ".asoundrc").write_text(
        f'pcm.!default {{ type file slave.pcm {{ type null }} file "{played}" format raw }}\n'
    )
    environment = os.environ | {"HOME": str(tmp_path)}
    program = subprocess.Popen(
        [sys.executable, "-c", _PLAYS], env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert program.stdin is not None
    assert program.stdout is not None
    try:
        if program.stdout.readline() != "plays\n":
            pytest.skip("the sound library does not take its devices from ALSA")
        frame_bytes = 2 * np.dtype(np.float32).itemsize
        enough = int(1.3 * NOISE_ROUND) * frame_bytes
        wait_for(lambda: played.exists() and played.stat().st_size > enough, "it is not played on", look_s=0.1)
    finally:
        program.stdin.close()
        program.wait(30)
        program.stdout.close()
    samples = np.frombuffer(played.read_bytes()[:enough], dtype=np.float32).reshape(-1, 2)
    begins = int(np.flatnonzero(samples[:, 0])[0])
    parts = np.array_split(samples[begins:], 100)
    assert min(np.abs(part).mean() for part in parts) > 0.2
