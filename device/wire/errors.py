"""What a gun may say is wrong: SCPI's numbers below zero, the gun's own above."""

from __future__ import annotations

from typing import Final

NO_DEVICE_ERROR: Final = 0
BAD_TYPE: Final = -104
NOT_ALLOWED: Final = -108
MISSING_PARAMETER: Final = -109
UNDEFINED: Final = -113
OUT_OF_RANGE: Final = -222
QUEUE_OVERFLOW: Final = -350
OVERRUN: Final = -363
DISARMED: Final = 101
MAGNET_NOT_HOME: Final = 102
DUTY: Final = 103
RATE: Final = 104
HOT: Final = 105
NOT_CONFIGURED: Final = 106
TOO_LATE: Final = 107
BUSY: Final = 108
WATCHDOG: Final = 109
FAULT: Final = 110
NO_SESSION: Final = 111
CANCELLED: Final = 112
ALREADY_FIRED: Final = 113
JUST_BOOTED: Final = 114

TEXTS: Final = {
    NO_DEVICE_ERROR: "No error",
    BAD_TYPE: "Data type error",
    NOT_ALLOWED: "Parameter not allowed",
    MISSING_PARAMETER: "Missing parameter",
    UNDEFINED: "Undefined header",
    OUT_OF_RANGE: "Data out of range",
    QUEUE_OVERFLOW: "Queue overflow",
    OVERRUN: "Input buffer overrun",
    DISARMED: "Disarmed",
    MAGNET_NOT_HOME: "Magnet not home",
    DUTY: "Duty limit",
    RATE: "Shots per minute limit",
    HOT: "Coil too hot",
    NOT_CONFIGURED: "Not configured",
    TOO_LATE: "Too late",
    BUSY: "Busy",
    WATCHDOG: "Watchdog",
    FAULT: "Driver fault",
    NO_SESSION: "No session",
    CANCELLED: "Cancelled",
    ALREADY_FIRED: "Already fired",
    JUST_BOOTED: "Just booted",
}


def message(code: int) -> str:
    """An error as it stands on the wire.

    >>> message(DISARMED)
    '101,"Disarmed"'
    """
    return f'{code},"{TEXTS[code]}"'
