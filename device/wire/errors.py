"""What a gun may say is wrong: SCPI's numbers below zero, the gun's own above."""

from __future__ import annotations

from enum import IntEnum
from typing import Self


class WireError(IntEnum):
    """An error by its number, with the `text` that stands behind it on the wire."""

    text: str

    NO_DEVICE_ERROR = 0, "No error"
    BAD_TYPE = -104, "Data type error"
    NOT_ALLOWED = -108, "Parameter not allowed"
    MISSING_PARAMETER = -109, "Missing parameter"
    UNDEFINED = -113, "Undefined header"
    OUT_OF_RANGE = -222, "Data out of range"
    QUEUE_OVERFLOW = -350, "Queue overflow"
    OVERRUN = -363, "Input buffer overrun"
    DISARMED = 101, "Disarmed"
    MAGNET_NOT_HOME = 102, "Magnet not home"
    DUTY = 103, "Duty limit"
    RATE = 104, "Shots per minute limit"
    HOT = 105, "Coil too hot"
    NOT_CONFIGURED = 106, "Not configured"
    TOO_LATE = 107, "Too late"
    BUSY = 108, "Busy"
    WATCHDOG = 109, "Watchdog"
    FAULT = 110, "Driver fault"
    NO_SESSION = 111, "No session"
    CANCELLED = 112, "Cancelled"
    ALREADY_FIRED = 113, "Already fired"
    JUST_BOOTED = 114, "Just booted"

    def __new__(cls, code: int, text: str = "") -> Self:
        """A number with its text."""
        one = int.__new__(cls, code)
        one._value_, one.text = code, text
        return one


def message(code: int) -> str:
    """An error as it stands on the wire.

    >>> message(WireError.DISARMED)
    '101,"Disarmed"'
    """
    return f'{code},"{WireError(code).text}"'
