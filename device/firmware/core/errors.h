/* What the gun may say is wrong: SCPI's numbers below zero, the gun's own above (device/wire/PROTOCOL.md). */
#ifndef RECOIL_ERRORS_H
#define RECOIL_ERRORS_H

#include <stdint.h>

enum error {
    ERROR_NONE = 0,
    ERROR_BAD_TYPE = -104,
    ERROR_NOT_ALLOWED = -108,
    ERROR_MISSING = -109,
    ERROR_UNDEFINED = -113,
    ERROR_OUT_OF_RANGE = -222,
    ERROR_QUEUE_OVERFLOW = -350,
    ERROR_OVERRUN = -363,
    ERROR_DISARMED = 101,
    ERROR_NOT_HOME = 102,
    ERROR_DUTY = 103,
    ERROR_RATE = 104,
    ERROR_HOT = 105,
    ERROR_NOT_CONFIGURED = 106,
    ERROR_TOO_LATE = 107,
    ERROR_BUSY = 108,
    ERROR_WATCHDOG = 109,
    ERROR_FAULT = 110,
    ERROR_NO_SESSION = 111,
    ERROR_CANCELLED = 112,
    ERROR_ALREADY_FIRED = 113,
    ERROR_JUST_BOOTED = 114,
};

/* An error as it stands on the wire: 101,"Disarmed" */
const char *error_message(enum error error);

/* The bits of the standard event status register (IEEE 488.2, 11.5.1) that a gun sets. */
enum {
    EVENT_COMPLETE = 1,
    EVENT_DEVICE_ERROR = 8,
    EVENT_EXECUTION_ERROR = 16,
    EVENT_COMMAND_ERROR = 32,
    EVENT_POWER_ON = 128,
};

/* The bit of an error by its number: -1xx a command's, -2xx its execution's, all others the device's. */
uint8_t error_event(enum error error);

#endif
