/* Microseconds since boot: TIM2 counts 32 bits, the rest is counted here. Called from the main loop only. */
#ifndef RECOIL_CLOCK_H
#define RECOIL_CLOCK_H

#include <stdint.h>

void clock_start(void);
/* Must be called once in 71 minutes; the main loop does it all the time. */
uint64_t clock_us(void);
/* The lower half, also for interrupts. */
uint32_t clock_stamp(void);
/* When a stamp was taken, if that is less than 71 minutes ago. */
uint64_t clock_of(uint32_t stamp);

#endif
