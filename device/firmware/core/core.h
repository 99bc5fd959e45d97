/* The firmware's core: bytes and the time go in, bytes and drive events come out. It waits for nothing.
 *
 * device/wire/PROTOCOL.md says what it does; device/twin/core.py says the same, byte for byte, for the same calls.
 */
#ifndef RECOIL_CORE_H
#define RECOIL_CORE_H

#include "frame.h"
#include "machine.h"

enum { QUEUE_SIZE = 16 };

/* Where lines go, and who is told to drive. */
struct outlet {
    void *owner;
    void (*send)(void *owner, struct slice line);
    struct carried (*drive)(void *owner, const struct drive *drive);
};

struct core {
    struct machine machine;
    struct splitter splitter;
    struct outlet outlet;
    const char *serial;
    struct text answer, line;
    enum error errors[QUEUE_SIZE];
    unsigned error_count;
    bool strict;
    uint16_t last;    /* sequence number taken */
    uint16_t pending; /* of the trigger that waits for its answer, 0 if none does */
    uint16_t number;  /* of the frame that is being carried out, 0 in the plain mode */
    uint8_t events;   /* the standard event status register */
    bool tells_complete;      /* *OPC waits for the end of the shot */
    bool asks_complete;       /* *OPC? does, by this number */
    uint16_t asked_complete;
    uint64_t token, heard_us, watchdog_us;
};

void core_boot(struct core *core, const char *serial, struct outlet outlet, uint64_t now_us);
/* What is due by now happens, each at its own time; then the bytes are taken. Times never run back. */
void core_step(struct core *core, const uint8_t *bytes, size_t count, uint64_t now_us);
/* The board's driver reports a fault, by its number above 0. */
void core_fail(struct core *core, uint64_t fault, uint64_t now_us);
/* Whether a step is due even if no byte comes, and when. */
bool core_wake(const struct core *core, uint64_t *wake_us);

#endif
