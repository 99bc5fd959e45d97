#include "errors.h"

const char *error_message(enum error error)
{
    switch (error) {
    case ERROR_NONE: return "0,\"No error\"";
    case ERROR_BAD_TYPE: return "-104,\"Data type error\"";
    case ERROR_NOT_ALLOWED: return "-108,\"Parameter not allowed\"";
    case ERROR_MISSING: return "-109,\"Missing parameter\"";
    case ERROR_UNDEFINED: return "-113,\"Undefined header\"";
    case ERROR_OUT_OF_RANGE: return "-222,\"Data out of range\"";
    case ERROR_QUEUE_OVERFLOW: return "-350,\"Queue overflow\"";
    case ERROR_OVERRUN: return "-363,\"Input buffer overrun\"";
    case ERROR_DISARMED: return "101,\"Disarmed\"";
    case ERROR_NOT_HOME: return "102,\"Magnet not home\"";
    case ERROR_DUTY: return "103,\"Duty limit\"";
    case ERROR_RATE: return "104,\"Shots per minute limit\"";
    case ERROR_HOT: return "105,\"Coil too hot\"";
    case ERROR_NOT_CONFIGURED: return "106,\"Not configured\"";
    case ERROR_TOO_LATE: return "107,\"Too late\"";
    case ERROR_BUSY: return "108,\"Busy\"";
    case ERROR_WATCHDOG: return "109,\"Watchdog\"";
    case ERROR_FAULT: return "110,\"Driver fault\"";
    case ERROR_NO_SESSION: return "111,\"No session\"";
    case ERROR_CANCELLED: return "112,\"Cancelled\"";
    case ERROR_ALREADY_FIRED: return "113,\"Already fired\"";
    case ERROR_JUST_BOOTED: return "114,\"Just booted\"";
    }
    return "0,\"No error\"";
}

uint8_t error_event(enum error error)
{
    if (error <= -100 && error > -200)
        return EVENT_COMMAND_ERROR;
    return error <= -200 && error > -300 ? EVENT_EXECUTION_ERROR : EVENT_DEVICE_ERROR;
}
