"""Is Lab Streaming Layer there, and do markers come back on this machine's own network?"""

from __future__ import annotations

from uuid import uuid4

from device.machine_clock import machine_s
from experiments.doctor.figures import MarkerStream
from experiments.doctor.programs import Absent

_MARKERS = 50
_SECONDS = 3.0
"""How long anything is waited for."""


def look() -> MarkerStream:
    """Make a stream, find it as a recorder would, and send markers through it."""
    try:
        import pylsl  # noqa: PLC0415 - an extra; raises where it finds no library
    except ModuleNotFoundError:
        raise
    except (ImportError, OSError, RuntimeError) as error:
        raise Absent(f"pylsl finds no library of Lab Streaming Layer: {' '.join(str(error).split())}") from error
    source, version = f"recoil-doctor-{uuid4().hex}", f"{pylsl.library_version() / 100:.2f}"
    outlet = pylsl.StreamOutlet(pylsl.StreamInfo("Recoil doctor", "Markers", 1, pylsl.IRREGULAR_RATE, "string", source))
    found = pylsl.resolve_byprop("source_id", source, 1, _SECONDS)
    if not found:
        return MarkerStream(version=version, sent=0, to_reader_ms=[])
    inlet = pylsl.StreamInlet(found[0])
    inlet.open_stream(_SECONDS)
    took_ms = list[float]()
    for number in range(_MARKERS):
        sent_s = machine_s()
        outlet.push_sample([str(number)], pylsl.local_clock())
        if inlet.pull_sample(_SECONDS)[0] != [str(number)]:
            break
        took_ms.append(1000 * (machine_s() - sent_s))
    return MarkerStream(version=version, sent=_MARKERS, to_reader_ms=took_ms)
