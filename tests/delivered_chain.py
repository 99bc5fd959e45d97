"""Shots of a held gun as a sensor sees them, from the physics and noise, through measuring and marking."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np

from device.methods import Method, paper_methods
from device.parameters import GunParameters
from device.physics.hand import HandMechanics
from device.sensor.expected import FINE_S, expected_shot, modelled_acceleration
from device.sensor.measuring import BEFORE_S, DeliveredShot, ExpectedShot, SensorTrace, measured
from device.sensor.turn import MeasuredFriction
from experiments.delivered.marks import MethodLevels, ShotParts, judged_shot
from experiments.delivered.recorder import parts_of

RATE_HZ = 3200.0
NOISE_M_S2 = 0.1
LONG_S = 0.15
FINE = np.arange(-BEFORE_S, LONG_S, FINE_S)
DAMPED = paper_methods()["asymmetric-2"]
"""The paper's method with a damper."""
LIGHT = paper_methods()["asymmetric-1"]
"""The one without, whose friction scatters by 5 % a shot."""


def slipped(actuator: Method, part: float) -> Method:
    """The same gun whose friction fell by a part."""
    assert isinstance(actuator, GunParameters)
    return replace(actuator, friction_N=actuator.friction_N * (1 - part))


def course(actuator: Method, hand: HandMechanics | None = None) -> np.ndarray:
    """The acceleration at fine steps."""
    return modelled_acceleration(actuator, FINE, hand)


def seen(of: np.ndarray, random: np.random.Generator, noise: float = NOISE_M_S2) -> SensorTrace:
    """A course as a sensor samples it, at any place, with noise and gravity."""
    times = np.arange(random.uniform() / RATE_HZ - BEFORE_S, LONG_S, 1 / RATE_HZ)
    values = np.interp(times, FINE, of) + noise * random.standard_normal(len(times)) + 3.0
    return SensorTrace(time_s=times, acceleration_m_s2=values)


def measured_shot(
    of: np.ndarray, random: np.random.Generator, noise: float = NOISE_M_S2, actuator: Method = DAMPED
) -> DeliveredShot:
    """What is measured of a course; there must be something."""
    found = measured(seen(of, random, noise), 0.0, expected_of(actuator))
    assert found is not None
    return found


def measured_parts(
    random: np.random.Generator, actuator: Method, courses: Sequence[np.ndarray], noise: float = NOISE_M_S2
) -> list[ShotParts]:
    """Shots with these courses, as parts of what is expected."""
    expected = expected_of(actuator)
    return [parts_of(measured_shot(one, random, noise, actuator), expected) for one in courses]


def parts_with(
    friction: float, uncertain: float, *, peak: float = 1.0, scale: float = 1.0, pull: float = 0.0
) -> ShotParts:
    """A shot of this friction for the usual one by a sensor of a scale; with a pull the magnet rests at its turn."""
    moves_N, rests_N, u_N = (0.0 if pull else scale * friction), scale * (friction + pull), scale * uncertain
    found = MeasuredFriction(moves_N=moves_N, moves_u_N=u_N, rests_N=rests_N, rests_u_N=u_N, pull_N=pull)
    return ShotParts(peak=peak, peak_u=0.01, friction=found)


def expected_of(actuator: Method) -> ExpectedShot:
    """What is expected of a method's shot at the sensor's rate."""
    expected = expected_shot(actuator, RATE_HZ)
    assert expected is not None
    return expected


def marks_of(shots: Sequence[ShotParts]) -> list[str]:
    """The mark of each shot of a run of one method; empty for none."""
    levels, found = MethodLevels(), list[str]()
    for one in shots:
        levels, verdict = judged_shot(levels, one)
        found.append(verdict.mark)
    return found


def people(count: int, each: int, random: np.random.Generator) -> list[list[HandMechanics]]:
    """Hands of so many people, each several times: people differ by a quarter, a person's grip by a tenth (SD)."""
    usual = HandMechanics()

    def hand(of: HandMechanics, spread: float) -> HandMechanics:
        firm, soft = np.exp(spread * random.standard_normal(2))
        return HandMechanics(stiffness_N_m=of.stiffness_N_m * firm, damping_N_s_m=of.damping_N_s_m * soft)

    return [[hand(person, 0.1) for _ in range(each)] for person in (hand(usual, 0.25) for _ in range(count))]


_WRITER = """
import itertools, random, sys, time
path, course, pauses = sys.argv[1:]
values = [float(line) for line in open(course)]
rate, sent = len(values), time.monotonic() - 0.1
with open(path, "w", buffering=1 << 20) as file:
    for pause in itertools.cycle(map(float, pauses.split(","))):
        time.sleep(pause)
        now = time.monotonic()
        for n in range(int(sent * rate) + 1, int(now * rate) + 1):
            file.write(f"{n / rate - 1000:.6f},{values[n % rate] + random.gauss(0, 0.1):.3f}\\n")
        file.flush()
        sent = now
"""


@contextmanager
def stream_written(path: Path, pauses: str) -> Iterator[tuple[subprocess.Popen[bytes], Path]]:
    """A process that writes a sensor's lines into a file, after these pauses in turn: what was measured since the last.

    A shot of the damped gun begins at every full second of this machine's clock, from which its own is 1,000 s off.
    """
    values = np.interp(np.arange(round(RATE_HZ)) / RATE_HZ, FINE, course(DAMPED), right=0.0)
    values += np.interp(np.arange(round(RATE_HZ)) / RATE_HZ - 1, FINE, course(DAMPED), left=0.0)
    numbers = path.with_suffix(".numbers")
    numbers.write_text("\n".join(map(str, values.tolist())), encoding="ascii")
    path.touch()
    with subprocess.Popen([sys.executable, "-c", _WRITER, str(path), str(numbers), pauses]) as process:
        try:
            yield process, path
        finally:
            process.kill()
