"""The simulated sensor: what the model says that an accelerometer would see of the simulated gun, with noise.

It needs no time. `simulated:slip=0.1,after=30` lets the friction of a damper fall by a tenth after 30 shots: a drill.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from device.methods import Method
from device.parameters import GunParameters
from device.physics.hand import Vector
from device.sensor.expected import FINE_S, expected_shot, modelled_acceleration
from device.sensor.measuring import BEFORE_S, SensorTrace, measured
from device.sensor.process import ShotReply
from device.sensor.streams import SensorError

RATE_HZ = 3200.0
NOISE_M_S2 = 0.1
"""Of an accelerometer of low noise, 10 mg (assumed)."""
_LONG_S = 0.15
"""Past the turn of every magnet, and what a shot may be late."""
_KEYS = ("slip", "after", "noise")


@dataclass(frozen=True, slots=True, kw_only=True)
class SensorDrill:
    """What the simulated sensor is to show: a friction less by a part after so many shots, and its noise in m/s2."""

    slip: float = 0.0
    after: float = 0.0
    noise: float = NOISE_M_S2


def drill_of(rest: str) -> SensorDrill:
    """The drill of `slip=0.1,after=30`. `SensorError` names what is none.

    >>> drill_of("slip=0.1,after=30")
    SensorDrill(slip=0.1, after=30.0, noise=0.1)
    """
    values = dict[str, float]()
    for word in filter(None, rest.split(",")):
        name, _, value = word.partition("=")
        try:
            if name not in _KEYS or not 0 <= float(value) < np.inf or (name == "slip" and float(value) > 1):
                raise ValueError
            values[name] = float(value)
        except ValueError:
            raise SensorError(
                f"simulated:{word}: give {', '.join(_KEYS)} as a number, as in slip=0.1,after=30"
            ) from None
    return SensorDrill(**values)


class SimulatedSensor:
    """Measures by the model; its noise, and where its samples lie, come from `random`."""

    immediate = True

    def __init__(self, address: str, random: np.random.Generator) -> None:
        self.address = address
        self._drill = drill_of(address.partition(":")[2])
        self._random, self._shots = random, 0
        self._courses: dict[Method, Vector] = {}
        self._fine = np.arange(-BEFORE_S, _LONG_S, FINE_S)

    def ask(self, pulse_start_s: float, actuator: Method) -> ShotReply:
        """What it would have measured of a shot."""
        self._shots += 1
        expected = expected_shot(actuator, RATE_HZ)
        if expected is None:
            return ShotReply(number=self._shots, because="nothing moves in this shot by the model")
        times = np.arange(self._random.uniform() / RATE_HZ - BEFORE_S, _LONG_S, 1 / RATE_HZ)
        course = np.interp(times, self._fine, self._course(self._slipped(actuator)))
        noise = self._drill.noise * self._random.standard_normal(len(times))
        trace = SensorTrace(time_s=times + pulse_start_s, acceleration_m_s2=course + noise)
        return ShotReply(number=self._shots, seen=measured(trace, pulse_start_s, expected), expected=expected)

    def close(self) -> None:
        """Nothing to let go of."""

    def _slipped(self, actuator: Method) -> Method:
        if not isinstance(actuator, GunParameters) or self._shots <= self._drill.after:
            return actuator
        return replace(actuator, friction_N=actuator.friction_N * (1 - self._drill.slip))

    def _course(self, actuator: Method) -> Vector:
        if actuator not in self._courses:
            self._courses[actuator] = modelled_acceleration(actuator, self._fine)
        return self._courses[actuator]
