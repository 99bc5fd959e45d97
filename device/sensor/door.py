"""How a sensor is opened: our own by its address, another package's by its entry point.

    [project.entry-points."recoil.sensors"]
    serial-accelerometer = "serial_accelerometer:open_sensor"

`--sensor serial-accelerometer:REST` calls `open_sensor(REST, clock)`, in the sensor's own process
(`device.sensor.link`): whatever it does there, the run goes on.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import cast

from device.messages import said_by
from device.plugin.door import SENSOR_PLUGINS, check_commands, entry_of
from device.sensor.streams import CsvSensor, Sensor, SensorError
from device.words import DeviceError

SENSOR_COMMANDS = {"read": 0, "close": 0}
"""What a sensor has, and how many parameters each is called with."""


def open_sensor(address: str, clock: Callable[[], float]) -> Sensor:
    """The sensor at `csv:PATH`, or `NAME:REST` of a plug-in. `DeviceError` and `ValueError` say why there is none."""
    name, _, rest = address.partition(":")
    if name == "csv":
        return CsvSensor(rest)
    point = entry_of(name, SENSOR_PLUGINS)
    who = f"{SENSOR_PLUGINS.name} {name}"
    try:
        make = point.load()
    except BaseException as error:  # SystemExit too
        raise SensorError(f"{who}: its import failed: {said_by(error)}") from error
    try:
        sensor: object = make(rest, clock)
    except DeviceError:
        raise
    except Exception as error:
        raise SensorError(f"{who} did not open {rest!r}: {said_by(error)}") from error
    check_commands(who, sensor, SENSOR_COMMANDS, "a sensor")
    return cast("Sensor", sensor)


def check_address(address: str) -> None:
    """Whether there is such a file or plug-in, which is not imported. Raises as `open_sensor`."""
    name, _, rest = address.partition(":")
    if name == "csv":
        CsvSensor(rest).close()
    else:
        entry_of(name, SENSOR_PLUGINS)
