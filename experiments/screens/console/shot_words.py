"""What came of a test shot, in words: what the gun reported of it, and of itself."""

from __future__ import annotations

from collections.abc import Iterator

from device import GunStatus, ShotReport
from device.words import Drive, Effect
from experiments.screens.phrases import phrase

SWITCH_OFF = phrase("SWITCH OFF ITS POWER.")


def report_text(label: str, report: ShotReport, drive: Drive) -> str:
    """What the gun reported of a shot, in words."""
    return f"{label}: {' '.join(_report_sentences(report, drive))}"


def _report_sentences(report: ShotReport, drive: Drive) -> Iterator[str]:
    duration_ms = 1000 * (report.pulse_end_s - report.pulse_start_s)
    if isinstance(drive, Effect):
        yield phrase("the gun vibrated for {duration_ms:.0f} ms.", duration_ms=duration_ms)
    else:
        yield phrase(
            "the coil was driven at {voltage_V:g} V for {duration_ms:.1f} ms.",
            voltage_V=drive.voltage_V,
            duration_ms=duration_ms,
        )
        yield _motion(report)
    if report.timing is not None:
        began_ms = 1000 * (report.pulse_start_s - report.timing.requested_s)
        yield (
            phrase(
                (
                    "The pulse began {began_ms:.1f} ms after the request, by the gun's clock (to within "
                    "{uncertainty_s:.1f} ms)."
                ),
                began_ms=began_ms,
                uncertainty_s=1000 * report.timing.uncertainty_s,
            )
        )


def _motion(report: ShotReport) -> str:
    """What the magnet did by the model: there is no sensor that sees it."""
    if report.motion == "no-break-away":
        return phrase("By the model the magnet did not move.")
    if report.motion == "home":
        home_ms = 1000 * (report.home_predicted_s - report.pulse_start_s)
        return phrase("By the model the magnet moved, and was home after {home_ms:.0f} ms.", home_ms=home_ms)
    return phrase("By the model the magnet is not home ({motion}).", motion=report.motion)


def state_text(status: GunStatus | None) -> tuple[str, bool]:
    """What the gun reports of itself, and whether it is safe to take."""
    if status is None:
        return phrase("The gun's state cannot be read: {switch_off}", switch_off=SWITCH_OFF), False
    if status.fault is not None:
        return phrase(
            "The gun reports a fault ({fault}): {switch_off}", fault=status.fault, switch_off=SWITCH_OFF
        ), False
    if status.state != "disarmed":
        return phrase("The gun reports: {state}. {switch_off}", state=status.state, switch_off=SWITCH_OFF), False
    return phrase("The gun reports: disarmed."), True
