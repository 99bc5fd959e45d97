/* The gun's state machine: integers in, integers out, no bytes and no port. */
#ifndef RECOIL_MACHINE_H
#define RECOIL_MACHINE_H

#include "budget.h"

enum drive_kind { DRIVE_PULS, DRIVE_EFF, DRIVE_OFF };

/* What the board is told at a time: a pulse of so many mV, an effect by its number, or off. */
struct drive {
    uint64_t time_us;
    enum drive_kind kind;
    uint64_t amount;
    uint64_t end_us; /* when a pulse or an effect is to be over; of an OFF its own time */
};

/* Whether it is too late to begin: nothing would be driven. */
static inline bool drive_is_over(const struct drive *drive, uint64_t now_us)
{
    return drive->end_us > drive->time_us && now_us >= drive->end_us;
}

/* How the board carried a drive out: when, or the error for which it did not. */
struct carried {
    enum error error;
    uint64_t at_us;
};

/* Who is told to drive. */
struct driver {
    void *owner;
    struct carried (*drive)(void *owner, const struct drive *drive);
};

struct trigger {
    uint64_t mark, at_us, before_us;
};

struct machine {
    enum state state; /* never RESETTING: that is how ARMED is told */
    bool configured;
    struct setting setting;
    struct shot shot;
    enum error never; /* why the last shot was never begun, if it was not */
    uint64_t fault, ready_us;
    struct budget budget;
    struct driver driver;
};

void machine_boot(struct machine *machine, struct driver driver, uint64_t now_us);
/* Whether something happens by itself, and when: a pulse begins or ends. */
bool machine_due(const struct machine *machine, uint64_t *due_us);
/* Lets it happen; true if a shot ended by it, or could not be begun. */
bool machine_run_due(struct machine *machine);
enum error machine_configure(struct machine *machine, const struct setting *setting);
enum error machine_arm(struct machine *machine);
/* Accepts a shot: now if its time is over, else then. */
enum error machine_trigger(struct machine *machine, struct trigger trigger, uint64_t now_us);
/* Off and disarmed, from every state; true if a shot ended by it. */
bool machine_abort(struct machine *machine, uint64_t now_us);
/* Forgets setting and fault of a gun that was aborted; limits and shots stay. */
void machine_clear(struct machine *machine);
/* The driver reports a fault; true if a shot ended by it. */
bool machine_fail(struct machine *machine, uint64_t fault, uint64_t now_us);
struct standing machine_standing(const struct machine *machine, uint64_t now_us);

#endif
