/* The loop: bytes and time into the core, lines and drives out of it, rest when nothing is due. */
#include "board.h"
#include "clock.h"
#include "core.h"
#include "cpu.h"
#include "port.h"
#include "startup.h"

enum { SPIN_US = 2000 }; /* nearer events are waited for awake; SysTick wakes each 1000 */

static struct core core;
static uint64_t stepped_us;

static void send(void *owner, struct slice line)
{
    (void)owner;
    port_write(line);
}

static struct carried drive(void *owner, const struct drive *drive)
{
    (void)owner;
    return board_drive(drive);
}

/* The core's times never run back, though a byte's stamp may be older than the last step. */
static uint64_t forward(uint64_t time_us)
{
    if (time_us > stepped_us)
        stepped_us = time_us;
    return stepped_us;
}

static void take_bytes(void)
{
    struct received received;
    if (!port_read(&received))
        return;
    uint64_t now_us = forward(clock_of(received.stamp));
    board_heard(received.bytes, received.count, now_us);
    core_step(&core, received.bytes, received.count, now_us);
}

static void take_fault(void)
{
    uint64_t fault = board_fault();
    if (fault == FAULT_NONE || core.machine.state == STATE_FAULT)
        return;
    uint64_t now_us = forward(clock_us());
    board_failed(fault, now_us);
    core_fail(&core, fault, now_us);
}

/* Interrupts are held back between the look and the sleep; a pending one still ends the sleep. */
static void rest(void)
{
    uint64_t wake_us;
    bool soon = core_wake(&core, &wake_us) && wake_us < stepped_us + SPIN_US;
    if (port_pump() || soon)
        return;
    cpu_hold();
    if (!port_waits())
        cpu_sleep();
    cpu_release();
}

int main(void)
{
    board_start();
    clock_start();
    board_connect();
    port_start();
    core_boot(&core, board_serial(), (struct outlet){NULL, send, drive}, forward(clock_us()));
    board_booted(stepped_us);
    for (;;) {
        take_bytes();
        take_fault();
        core_step(&core, NULL, 0, forward(clock_us()));
        board_alive(stepped_us);
        rest();
    }
}
