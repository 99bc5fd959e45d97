"""The simulated sensor: what the model says that an accelerometer would see of the simulated gun, with noise.

It needs no time. `simulated:slip=0.1,after=30` lets the friction of a damper fall by a tenth after 30 shots: a drill.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from device.methods import Method
from device.parameters import GunParameters
from device.physics.hand import Vector
from device.sensor.expected import FINE_S, NO_COURSE, expected_shot, modelled_acceleration
from device.sensor.measuring import BEFORE_S, SensorTrace, measured
from device.sensor.process import SensorReady, ShotReply
from device.sensor.streams import SensorError

RATE_HZ = 3200.0
NOISE_M_S2 = 0.1
"""Of an accelerometer of low noise, 10 mg (assumed)."""
_LONG_S = 0.15
"""Past the turn of every magnet, and what a shot may be late."""
_RULES = {
    "slip": (1.0, "from 0 to 1, the part of the friction that is lost"),
    "after": (1e6, "a number of shots, from 0 to 1000000"),
    "noise": (1e3, "from 0 to 1000, in m/s²"),
}
"""The most of each key, and the rule."""
_EXAMPLE = "simulated:slip=0.1,after=30"


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
        if name not in _RULES:
            raise SensorError(f"simulated:{word}: there is no {name!r}; give {', '.join(_RULES)}, as in {_EXAMPLE}")
        if name in values:
            raise SensorError(f"simulated:{rest}: {name} is given twice; give it once, as in {_EXAMPLE}")
        try:
            values[name] = float(value)
        except ValueError:
            raise SensorError(f"simulated:{word}: {value!r} is no number; give one, as in {_EXAMPLE}") from None
        most, rule = _RULES[name]
        if not 0 <= values[name] <= most:
            raise SensorError(f"simulated:{word}: {name} is {value}; it must be {rule}")
    return SensorDrill(**values)


def measures_by_model(address: str) -> bool:
    """Whether an address is the simulated sensor's."""
    return address.partition(":")[0] == "simulated"


def checked_drill(address: str, gun: str) -> SensorDrill:
    """The drill of an address. `SensorError`: it is none, or the gun is one that the model cannot measure."""
    if gun != "simulated":
        raise SensorError(f"{address}: goes with a simulated gun; it would measure nothing of {gun}")
    return drill_of(address.partition(":")[2])


def ready_of(address: str, gun: str) -> SensorReady:
    """Its rate and noise. Raises as `checked_drill`."""
    return SensorReady(rate_Hz=RATE_HZ, noise_m_s2=checked_drill(address, gun).noise)


class SimulatedSensor:
    """Measures by the model; its noise, and where its samples lie, come from `random`."""

    silent, dropped, ended = False, 0, ""

    def __init__(self, address: str, gun: str, random: np.random.Generator) -> None:
        self.address = address
        self._drill = checked_drill(address, gun)
        self._random, self._shots = random, 0
        self._courses: dict[Method, Vector] = {}
        self._fine = np.arange(-BEFORE_S, _LONG_S, FINE_S)

    def ask(self, pulse_start_s: float, actuator: Method) -> ShotReply:
        """What it would have measured of a shot."""
        self._shots += 1
        expected, course = expected_shot(actuator, RATE_HZ), self._course(self._slipped(actuator))
        if expected is None or course is None:
            return ShotReply(number=self._shots, because=NO_COURSE)
        times = np.arange(self._random.uniform() / RATE_HZ - BEFORE_S, _LONG_S, 1 / RATE_HZ)
        noise = self._drill.noise * self._random.standard_normal(len(times))
        trace = SensorTrace(
            time_s=times + pulse_start_s, acceleration_m_s2=np.interp(times, self._fine, course) + noise
        )
        return ShotReply(number=self._shots, seen=measured(trace, pulse_start_s, expected), expected=expected)

    def close(self) -> None:
        """Nothing to let go of."""

    def _slipped(self, actuator: Method) -> Method:
        if not isinstance(actuator, GunParameters) or self._shots <= self._drill.after:
            return actuator
        return replace(actuator, friction_N=actuator.friction_N * (1 - self._drill.slip))

    def _course(self, actuator: Method) -> Vector | None:
        """`None` where the model gives none."""
        if actuator not in self._courses:
            with suppress(RuntimeError):
                self._courses[actuator] = modelled_acceleration(actuator, self._fine)
        return self._courses.get(actuator)
