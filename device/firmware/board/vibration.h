/* The vibration driver, a DRV2605 on I2C1 that plays an effect of its library by itself. */
#ifndef RECOIL_VIBRATION_H
#define RECOIL_VIBRATION_H

#include <stdbool.h>
#include <stdint.h>

void vibration_start(void);
/* Whether the driver took the command. It is given up after 1.2 ms, and tried anew by the next. */
bool vibration_on(uint8_t effect);
bool vibration_off(void);
/* Whether it did not answer since this was asked last. */
bool vibration_failed(void);

#endif
