/* The driver's registers: TI's data sheet SLOS825. */
#include "vibration.h"

#include <stddef.h>

#include "i2c.h"

enum { DRV_ADDRESS = 0x5A, DRV_MODE = 0x01, DRV_LIBRARY = 0x03, DRV_EFFECT = 0x04, DRV_NEXT = 0x05, DRV_GO = 0x0C };
enum { DRV_FEEDBACK = 0x1A, DRV_INTERNAL_TRIGGER = 0, DRV_LRA_LIBRARY = 6, DRV_LRA = 0xB6 }; /* default and N_ERM_LRA */

static bool ready; /* it answered last, and was set up before */
static bool failed;

static bool set_up(void)
{
    static const uint8_t SETTINGS[][2] = {
        {DRV_MODE, DRV_INTERNAL_TRIGGER}, {DRV_GO, 0},   {DRV_FEEDBACK, DRV_LRA},
        {DRV_LIBRARY, DRV_LRA_LIBRARY},   {DRV_NEXT, 0},
    };
    bool done = true;
    for (size_t i = 0; i < sizeof SETTINGS / sizeof SETTINGS[0] && done; i++)
        done = i2c_write(DRV_ADDRESS, SETTINGS[i][0], SETTINGS[i][1]);
    return done;
}

/* One that did not answer may have lost its supply, and what was set up with it. */
static bool told(bool done)
{
    ready = done;
    failed = failed || !done;
    return done;
}

void vibration_start(void)
{
    i2c_start();
    told(set_up());
}

bool vibration_on(uint8_t effect)
{
    return told((ready || set_up()) && i2c_write(DRV_ADDRESS, DRV_EFFECT, effect) && i2c_write(DRV_ADDRESS, DRV_GO, 1));
}

bool vibration_off(void)
{
    return told(i2c_write(DRV_ADDRESS, DRV_GO, 0) && ready);
}

bool vibration_failed(void)
{
    bool before = failed;
    failed = false;
    return before;
}
