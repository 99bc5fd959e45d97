/* A fake STM32F446 and what is wired to it, for this machine: board/ and core/ run on it as they are, to the register.
 *
 * Time passes with each access of a register, and while the processor sleeps; nothing else takes time. What happens
 * outside is a script's doing (script.c), what is seen outside is told as lines; so is a broken rule of the manual's.
 */
#ifndef RECOIL_FAKE_H
#define RECOIL_FAKE_H

#include <stdbool.h>
#include <stdint.h>

#include "registers.h"

/* What is the matter with the bus: where a transfer hangs, or what the driver does. */
enum bus { BUS_GOOD, BUS_ABSENT, BUS_ERROR, BUS_LOW, BUS_SB, BUS_ADDR, BUS_TXE, BUS_BTF, BUS_STOP };

/* The world around the chip. */
struct world {
    bool no_outside_clock, no_pll, still; /* still: TIM2 counts no more */
    bool coil_fault;
    unsigned watchdog_kHz; /* 17 to 47 (DS10693) */
    unsigned access_ns;    /* how long a register takes */
    enum bus bus;
    unsigned held; /* clocks until the vibration driver lets go of SDA */
};
extern struct world world;

extern uint64_t now_ns; /* since power came on */

/* Time passes, and what it brings happens. */
void pass(uint64_t length_ns);
/* A line of what was seen: the time in microseconds, a blank, and these words. */
void tell(const char *format, ...) __attribute__((format(printf, 1, 2)));
/* The last line, and nothing more happens. */
_Noreturn void finish(const char *words);
/* A line of its own if a rule of the manual is broken. */
void rule(bool kept, const char *words);

/* A register's contents, where no fake part thinks otherwise. */
uint32_t *cell(const reg *place);
uint32_t apb1_MHz(void);

/* I2C1, its lines and the vibration driver (bus.c). */
bool bus_has(const reg *place);
uint32_t bus_read(const reg *place);
void bus_write(const reg *place, uint32_t value);
uint32_t bus_lines(void); /* as the port's input bits, under what the port itself pulls low */
void bus_port_changed(void);
void bus_lose_power(void);

/* When the script has something, and let it happen (script.c). */
uint64_t script_due_ns(void);
void script_happen(void);
/* The host's line, byte by byte. */
uint64_t host_due_ns(void);
uint8_t host_next(void);

#endif
