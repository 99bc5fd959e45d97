"""Is there a device that plays sound?"""

from __future__ import annotations

from typing import Any

from experiments.doctor.figures import Sound
from experiments.doctor.programs import Absent


def look() -> Sound:
    """Ask the sound library for its output devices. Nothing is played."""
    try:
        import sounddevice  # type: ignore[import-untyped, unused-ignore]  # noqa: PLC0415 - raises without PortAudio
    except OSError as error:
        raise Absent(f"{error}: install the system's PortAudio library (libportaudio2)") from error
    devices: list[dict[str, Any]] = list(sounddevice.query_devices())
    outputs = [str(device["name"]) for device in devices if device["max_output_channels"] > 0]
    number = int(sounddevice.default.device[1])
    return Sound(outputs=outputs, default=str(devices[number]["name"]) if 0 <= number < len(devices) else "")
