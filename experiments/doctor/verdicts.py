"""From figures and journals to findings: the bounds, and what to do when they are passed. Pure.

Step to screen: from a step's record to `shown_s` of its outcome, when the console had painted it.
Key to disk: from the key, which is the shot's `pulse_start_s` plus the answer's `response_time_s` (or its `key_time_s`,
where that is another), to the `synced_s` of the answer's record, which stands in the record after it.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from device.plugin.conformance import ConformanceFinding
from device.serial_gun.lines import IN_USE
from experiments.catalogues.catalogue import Language
from experiments.catalogues.fonts import Font
from experiments.doctor import figures
from experiments.record.journal import Record, read_as
from experiments.session.steps import OUTCOME, STEP, Answered, Fired, Outcome, Present


@dataclass(frozen=True, slots=True, kw_only=True)
class Latencies:
    """What consoles took, and in how many trials that were answered at one."""

    step_to_screen_ms: tuple[float, ...] = ()
    key_to_disk_ms: tuple[float, ...] = ()
    trials: int = 0


def pooled(some: Iterable[Latencies]) -> Latencies:
    """The latencies of several journals as one."""
    every = list(some)
    return Latencies(
        step_to_screen_ms=tuple(value for one in every for value in one.step_to_screen_ms),
        key_to_disk_ms=tuple(value for one in every for value in one.key_to_disk_ms),
        trials=sum(one.trials for one in every),
    )


def latencies(records: Sequence[Record]) -> Latencies:
    """What the console took in one journal; nothing in a journal of a run without one, or on a virtual clock.

    `JournalError`: a record holds no step or outcome of this version of Recoil.
    """
    if not records or records[0].clock == "virtual":
        return Latencies()
    return Latencies(
        step_to_screen_ms=tuple(_step_to_screen_ms(records)),
        key_to_disk_ms=tuple(_key_to_disk_ms(records)),
        trials=sum(record.shown_s is not None and _time_s(record) is not None for record in records),
    )


def _step_to_screen_ms(records: Sequence[Record]) -> Iterator[float]:
    step: Record | None = None
    for record in records:
        if record.kind in ("step", "resumed"):
            step = record if record.kind == "step" else None  # another process has another clock
        elif record.kind == "outcome" and step is not None:
            if record.shown_s is not None and _painted_once(step, record.shown_s):
                yield 1000 * (record.shown_s - step.monotonic_s)
            step = None


def _painted_once(step: Record, shown_s: float) -> bool:
    """Whether the stamp is the step's own first paint.

    A step that asks nothing of anybody keeps the stamp of the one before it, and a presentation is painted again with
    every shot.
    """
    return shown_s >= step.monotonic_s and not isinstance(read_as(STEP, step.body, f"record {step.n}"), Present)


def _key_to_disk_ms(records: Sequence[Record]) -> Iterator[float]:
    pulse_start_s: float | None = None
    for record, following in pairwise(records):
        match _outcome(record):
            case Fired() as fired:
                pulse_start_s = fired.pulse_start_s
            case Answered() as answered if record.shown_s is not None and following.synced_s is not None:
                key_s = answered.response_time_s if answered.key_time_s is None else answered.key_time_s
                if pulse_start_s is not None and key_s is not None:
                    yield 1000 * (following.synced_s - pulse_start_s - key_s)
            case None if record.kind == "resumed":
                pulse_start_s = None


def _time_s(record: Record) -> float | None:
    """How long the answer took that a record holds, if it holds one with a time."""
    outcome = _outcome(record)
    return outcome.response_time_s if isinstance(outcome, Answered) else None


def _outcome(record: Record) -> Outcome | None:
    return read_as(OUTCOME, record.body, f"record {record.n}") if record.kind == "outcome" else None


MAX_STEP_TO_SCREEN_MS = 50.0
MAX_KEY_TO_DISK_MS = 10.0
MAX_APPEND_MS = 10.0
MAX_ADAPTER_MS = 1
MAX_OVERSLEEP_MS = 5.0
"""Assumed: half of what a key may take to the disk."""
MAX_STEP_S = 0.001
"""Assumed: response times are read to the millisecond."""
MAX_KEY_MS = 10.0
"""Assumed: as long as the way on to the disk may take."""
MIN_FREE_BYTES = 100_000_000
"""Assumed: about a thousand runs."""
MIN_WIDTH_PX, MIN_HEIGHT_PX = 1024, 720
"""Assumed: what the console needs for its large type."""

INSTALL = (
    "install the screens: `make full` in Recoil's folder (without make: docs/install.md), on Python 3.11 or 3.12, as "
    "PsychoPy allows no later one"
)


def of_machine(found: figures.Machine) -> figures.DoctorFinding:
    """The machine itself; a warning if the packages of the screens are not installed."""
    versions = ", ".join(f"{name} {version or 'none'}" for name, version in found.versions.items())
    missing = [name for name, version in found.versions.items() if version is None]
    return _judged(
        "machine",
        f"{found.system}, Python {found.python}, {found.cores} cores; {versions}",
        f"{', '.join(missing)} not found; {INSTALL}" if missing else "",
        found,
    )


def of_clock(found: figures.Ticks) -> figures.DoctorFinding:
    """The clock that stamps the trials."""
    step_us, sleep = 1e6 * found.smallest_step_s, found.oversleep_ms
    advice = []
    if max(found.smallest_step_s, found.resolution_s) > MAX_STEP_S:
        advice.append("times are coarser than 1 ms: use another machine for response times")
    if sleep.p99 > MAX_OVERSLEEP_MS:
        advice.append(f"sleeps overrun by more than {MAX_OVERSLEEP_MS:g} ms: close other programs, leave power saving")
    measured = (
        f"resolution {1e9 * found.resolution_s:.0f} ns, smallest step {step_us:.2f} µs; "
        f"a sleep of 1 ms overruns by {sleep.median:.2f} ms, 99th percentile {sleep.p99:.2f} ms"
    )
    return _judged("clock", measured, "; ".join(advice), found)


def of_disk(found: figures.Appends) -> figures.DoctorFinding:
    """The disk under the results folder."""
    advice = []
    if found.append_ms.p95 > MAX_APPEND_MS:
        advice.append(
            f"syncs take more than {MAX_APPEND_MS:g} ms: keep results on a local disk, best a solid-state one"
        )
    if found.free_bytes < MIN_FREE_BYTES:
        advice.append(f"less than {MIN_FREE_BYTES / 1e6:g} MB free: make room")
    measured = f"synced append {_tail(found.append_ms)}; {found.free_bytes / 1e9:.1f} GB free"
    return _judged("disk", measured, "; ".join(advice), found)


def of_disk_failure(folder: str, reason: str) -> figures.DoctorFinding:
    """A results folder that takes no records."""
    advice = f"make {folder} a folder that you may write to, with room on its disk, or give another with --results"
    return figures.DoctorFinding(check="disk", verdict="fails", measured=f"{folder}: {reason}", advice=advice)


MOST_JUMPS = 1
"""A gun that is switched on anew does so; one of another speed at every word."""


def of_link(found: figures.GunLine, limit_s: float) -> figures.DoctorFinding:
    """The gun and the way to it, whose 95th percentile is to keep a limit."""
    measured, wrong = f"{found.gun}, {found.state}; round trip {_tail(found.round_trip_ms)}", list[str]()
    if found.fault is not None or found.state != "disarmed":
        wrong.append("switch off the gun's power, remove the cause, and look again before anybody holds it")
        measured += "" if found.fault is None else f"; fault: {found.fault}"
    if found.clock_jumps > MOST_JUMPS:
        measured += f"; its clock contradicted this machine's {found.clock_jumps} times"
        wrong.append(
            "its clock does not go as the address says, so no shot's time would be believed: leave ?speed out, unless "
            "a twin in a hurry answers there, and then give its speed"
        )
    if wrong:
        return figures.DoctorFinding(
            check="gun", verdict="fails", measured=measured, advice="; ".join(wrong), figures=found
        )
    advice = (
        f"95th percentile above the limit of {1000 * limit_s:g} ms (the gun's serial.round_trip_limit_s): close other "
        "programs; at a USB serial adapter set its latency timer to 1 ms, see below"
    )
    return _judged("gun", measured, advice if found.round_trip_ms.p95 > 1000 * limit_s else "", found)


def of_wrong_version(reason: str) -> figures.DoctorFinding:
    """A gun that answers in another version of the wire."""
    advice = "nothing can be said to this gun until its firmware is that of this Recoil: docs/howto/connect-a-gun.md"
    return figures.DoctorFinding(check="gun", verdict="fails", measured=reason, advice=advice)


def of_link_failure(reason: str) -> figures.DoctorFinding:
    """A gun that does not answer."""
    advice = "check power, cable and port; for a serial port you must be in the group dialout on Linux"
    if IN_USE in reason:
        advice = "close what has it open, then look again"
    return figures.DoctorFinding(check="gun", verdict="fails", measured=reason, advice=advice)


def not_fired() -> figures.DoctorFinding:
    """A gun that fails before a shot: it is not fired."""
    advice = "see to what “gun” says, then look again"
    return figures.DoctorFinding(
        check="shots", verdict="fails", measured="nothing was fired: the gun fails", advice=advice
    )


def of_conformance(found: Sequence[ConformanceFinding]) -> figures.DoctorFinding:
    """Whether the gun keeps what every gun keeps, by `device.plugin.conformance`."""
    measured = "; ".join(f"{one.check}: {one.said}" for one in found if not one.kept)
    advice = "nobody may hold this gun: it does not keep what every gun keeps; mend it, or the plug-in that brings it"
    if measured:
        return figures.DoctorFinding(check="shots", verdict="fails", measured=measured, advice=advice)
    measured = "; ".join(f"{one.check}: {one.said}" for one in found)
    return figures.DoctorFinding(check="shots", verdict="good", measured=measured, advice="")


SOON_SEEN = 3.0
"""In so many shots a damper that slips by a tenth is to be seen."""


def of_sensor(found: figures.SensorFigures) -> figures.DoctorFinding:
    """A sensor, and whether it sees a damper that slips."""
    measured = f"{found.sensor}: {found.rate_Hz:.0f} samples/s, noise {found.noise_m_s2:.3f} m/s² at rest"
    if found.noise_m_s2 == 0:
        still = "its value never changes, as no sensor's does: see that it measures, and in m/s² with enough digits"
        return figures.DoctorFinding(check="sensor", verdict="fails", measured=measured, advice=still, figures=found)
    if found.shots_to_see is None:
        return _judged("sensor", measured, "", found)
    measured += f"; a damper that slips by 10 % is seen in about {max(1.0, found.shots_to_see):.1f} shots"
    slow = f"its noise hides it for more than {SOON_SEEN:g} shots: take one of less noise or more samples"
    return _judged("sensor", measured, slow if found.shots_to_see > SOON_SEEN else "", found)


def of_adapters(found: Sequence[figures.Adapter]) -> figures.DoctorFinding:
    """The latency timers of USB serial adapters, where the system shows them."""
    if not found:
        measured = "this system shows no USB serial adapter with a latency timer"
        advice = "nothing, unless the gun is on a USB serial port"
        return figures.DoctorFinding(check="USB adapter", verdict="not there", measured=measured, advice=advice)
    slow = [adapter for adapter in found if adapter.latency_ms > MAX_ADAPTER_MS]
    measured = ", ".join(f"{adapter.name}: latency timer {adapter.latency_ms} ms" for adapter in found)
    advice = "; ".join(f"echo {MAX_ADAPTER_MS} | sudo tee {adapter.setting}" for adapter in slow)
    return _judged("USB adapter", measured, advice, figures.Adapters(adapters=tuple(found)))


def of_language(found: Language, font: Font) -> figures.DoctorFinding:
    """A language whose messages are all there, in a font that has all their letters."""
    measured = f"{found.code} ({found.name}): every message is there; {font.family} has all letters"
    advice = "" if found.checked_by else "have a native speaker check it; until then runs in it need --unchecked"
    return _judged("language", measured, advice, figures.NoFigures())


def of_seen(found: figures.ProgramFigures) -> figures.DoctorFinding:
    """What a program of its own saw."""
    match found:
        case figures.Display():
            return of_display(found)
        case figures.PsychoPyStage():
            return of_stage(found)
        case figures.Sound():
            return of_sound(found)
        case figures.Keys():
            return of_keys(found)
        case figures.MarkerStream():
            return of_streams(found)


def of_display(found: figures.Display) -> figures.DoctorFinding:
    """The screen that the console is seen on."""
    size = f"{found.width_px} x {found.height_px} at {found.refresh_Hz:.0f} Hz ({found.platform})"
    if found.opened_ms is None:
        advice = "see that the desktop shows windows, then look again"
        return figures.DoctorFinding(
            check="display", verdict="fails", measured=f"{size}; no window was seen", advice=advice, figures=found
        )
    advice = ""
    if found.platform in ("offscreen", "minimal"):
        advice = "nobody sees this display: unset QT_QPA_PLATFORM"
    elif found.width_px < MIN_WIDTH_PX or found.height_px < MIN_HEIGHT_PX:
        advice = f"the console needs {MIN_WIDTH_PX} x {MIN_HEIGHT_PX}: choose a larger resolution"
    return _judged("display", f"{size}; a window was seen after {found.opened_ms:.0f} ms", advice, found)


def of_stage(found: figures.PsychoPyStage) -> figures.DoctorFinding:
    """PsychoPy. How fast it draws is information only: without vertical sync it means nothing."""
    measured = (
        f"PsychoPy {found.version} imported in {found.import_s:.1f} s, a window in {found.opened_s:.1f} s; "
        f"{found.frames_Hz:.0f} frames/s (no verdict)"
    )
    return _judged("PsychoPy", measured, "", found)


def of_sound(found: figures.Sound) -> figures.DoctorFinding:
    """The device that plays the break's tone and the masking noise."""
    if not found.outputs:
        return no_sound("no output device")
    count = f"{len(found.outputs)} output device{'s' if len(found.outputs) > 1 else ''}"
    advice = "" if found.default else "none is the default: choose one in the system's sound settings"
    return _judged("sound", f"{count}, default: {found.default or 'none'}", advice, found)


def no_sound(reason: str) -> figures.DoctorFinding:
    """A machine that cannot be heard."""
    advice = (
        "the break's tone and masking noise stay silent: connect headphones or loudspeakers "
        "and see that the system lists them"
    )
    return figures.DoctorFinding(check="sound", verdict="not there", measured=reason, advice=advice)


def of_keys(found: figures.Keys) -> figures.DoctorFinding:
    """The way of a key to a Qt window. It begins at the display's server: the keyboard's own delay is not in it."""
    came = len(found.to_event_ms)
    if came == 0:
        measured = f"none of {found.injected} injected keys came to the window"
        advice = "leave the doctor's window in front, keep your hands off, and look again"
        return _judged("keyboard", measured, advice, found)
    event, painted = figures.spread(found.to_event_ms), figures.spread(found.to_painted_ms)
    measured = f"{came} of {found.injected} keys; to the event {_short(event)}; until painted {_short(painted)}"
    advice = "" if came == found.injected else "some keys went elsewhere: leave the doctor's window in front"
    if event.p99 > MAX_KEY_MS:
        advice = f"keys take more than {MAX_KEY_MS:g} ms: close other programs and desktop effects"
    return _judged("keyboard", measured, advice, found)


def of_streams(found: figures.MarkerStream) -> figures.DoctorFinding:
    """Markers through Lab Streaming Layer."""
    name = f"Lab Streaming Layer {found.version}"
    came = len(found.to_reader_ms)
    if came == 0 or came < found.sent:
        lost = f"{came} of {found.sent} markers came back" if found.sent else "a stream was not found on this machine"
        advice = (
            "runs go on without it; for markers look at network and firewall (multicast, ports 16571 to 16604), or at "
            "the library's lsl_api.cfg"
        )
        return _judged("streams", f"{name}; {lost}", advice, found)
    took = figures.spread(found.to_reader_ms)
    return _judged("streams", f"{name}; {came} markers came back, {_short(took)}", "", found)


def no_streams(reason: str) -> figures.DoctorFinding:
    """A machine without Lab Streaming Layer."""
    advice = "only `recoil markers` and `recoil run --lsl` need it: the extra `lsl` (docs/howto/markers.md)"
    return figures.DoctorFinding(check="streams", verdict="not there", measured=reason, advice=advice)


def of_latencies(found: Latencies) -> tuple[figures.DoctorFinding, figures.DoctorFinding]:
    """What the console took in the runs of a results folder."""
    return (
        _latency("step to screen", found.step_to_screen_ms, MAX_STEP_TO_SCREEN_MS, "steps", found.trials),
        _latency("key to disk", found.key_to_disk_ms, MAX_KEY_TO_DISK_MS, "answers", found.trials),
    )


def _latency(check: str, values: Sequence[float], bound: float, what: str, trials: int) -> figures.DoctorFinding:
    if not values:
        advice = "look again after a run with --screen console, with the same --results"
        return figures.DoctorFinding(check=check, verdict="not there", measured="no console runs here", advice=advice)
    found = figures.spread(values)
    measured = f"{_short(found)}, worst {_ms(found.worst)}; {found.n} {what} in {trials} trials"
    advice = f"more than {bound:g} ms: close other programs; see the disk and display above"
    latency = figures.ConsoleLatency(ms=found, bound_ms=bound, trials=trials)
    return _judged(check, measured, advice if found.p99 > bound else "", latency)


def of_absent(check: str, reason: str) -> figures.DoctorFinding:
    """Something that this machine does not have."""
    advice = INSTALL if reason.endswith("not installed") else _ABSENT[check]
    return figures.DoctorFinding(check=check, verdict="not there", measured=reason, advice=advice)


def of_failure(check: str, reason: str) -> figures.DoctorFinding:
    """A check that broke off."""
    return figures.DoctorFinding(check=check, verdict="fails", measured=reason, advice=_BROKEN.get(check, _REPORT))


_ABSENT = {
    "display": "start it from a desktop session, or set DISPLAY; until then --screen terminal and synthetic work",
    "PsychoPy": "the participant's screen needs a display: see above",
    "keyboard": "key times are measured under X with its extension XTEST alone; the console works without",
}
_REPORT = "look again with other programs closed; if it stays so, report it with this line"
_WINDOWLESS = (
    "see that DISPLAY names a display that you may use, and that Qt's libraries are there; on Debian and Ubuntu: "
    "sudo apt install libegl1 libxcb-cursor0 libxcb-icccm4 libxcb-image0 libxcb-keysyms1 libxcb-render-util0 "
    "libxcb-xkb1 libxkbcommon-x11-0"
)
_BROKEN = {
    "gun": "see what the plug-in's own pages say; mend, update or uninstall it",
    "sensor": "check its power, cable and address; the run goes without it",
    "display": _WINDOWLESS,
    "keyboard": _WINDOWLESS,
    "PsychoPy": "see that a display with OpenGL is there, and that the system libraries of PsychoPy are installed",
    "language": "mend that, and look again; docs/howto/languages.md says how",
}


def overall(verdicts: Sequence[figures.DoctorVerdict]) -> Literal["good", "warning", "fails"]:
    """The worst of the verdicts; what is not there does no harm."""
    return "fails" if "fails" in verdicts else "warning" if "warning" in verdicts else "good"


def _judged(check: str, measured: str, advice: str, found: figures.Figures) -> figures.DoctorFinding:
    """Good if there is nothing to advise, else a warning."""
    verdict: figures.DoctorVerdict = "warning" if advice else "good"
    return figures.DoctorFinding(check=check, verdict=verdict, measured=measured, advice=advice, figures=found)


def _tail(of: figures.Percentiles) -> str:
    return f"median {_ms(of.median)}, 95th percentile {_ms(of.p95)}, worst {_ms(of.worst)} (n = {of.n})"


def _short(of: figures.Percentiles) -> str:
    return f"median {_ms(of.median)}, 99th percentile {_ms(of.p99)}"


def _ms(value: float) -> str:
    """Hundredths of a millisecond; thousandths where there is nothing else."""
    return f"{value:.2f} ms" if value >= 0.1 else f"{value:.3f} ms"
