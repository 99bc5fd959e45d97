/* The coil driver: its command is a duty of the supply, its enable a timer's pulse. Wiring assumed (README.md). */
#ifndef RECOIL_COIL_H
#define RECOIL_COIL_H

#include <stdint.h>

void coil_start(void);
/* The chip ends the pulse by itself, whatever becomes of the processor. */
void coil_on(uint32_t millivolts, uint32_t length_us);
void coil_off(void);

#endif
