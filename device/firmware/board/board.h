/* What a board is to the firmware's main loop. One file a board: board_f446.c, board_qemu.c. */
#ifndef RECOIL_BOARD_H
#define RECOIL_BOARD_H

#include "machine.h"
#include "registers.h"

/* Numbers that differ between boards. */
struct board {
    struct usart *usart;   /* the host's port */
    unsigned usart_line;   /* its interrupt */
    uint32_t usart_divider; /* BRR: its clock over 460800 */
    uint32_t timer_MHz;    /* what TIM2 is fed with */
    uint32_t processor_MHz;
};
extern const struct board BOARD;

/* Faults that a board can tell of; 1 and 2 are the F446 board's, the emulated board is told its own. */
enum { FAULT_NONE = 0, FAULT_COIL_DRIVER = 1, FAULT_VIBRATION_DRIVER = 2 };

/* Clocks and pins; nothing is driven from here on. */
void board_start(void);
/* The drivers behind the pins, when the clock runs. */
void board_connect(void);
/* At most 24 characters of [A-Za-z0-9._-], after board_start. */
const char *board_serial(void);
/* Drive, or stop. What is begun late still ends in time, what is over is not begun. */
struct carried board_drive(const struct drive *drive);
/* The driver's fault, or FAULT_NONE. */
uint64_t board_fault(void);
/* The main loop turns, and this is its time. If it does not, or the time stands still, the chip resets itself. */
void board_alive(uint64_t now_us);
/* The core booted, was given bytes, or a fault: for a board that keeps a record. */
void board_booted(uint64_t now_us);
void board_heard(const uint8_t *bytes, size_t count, uint64_t now_us);
void board_failed(uint64_t fault, uint64_t now_us);

#endif
