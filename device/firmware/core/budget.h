/* The firmware's own limits, whatever the host says: ranges, shots a minute, duty, warmth of the coil. */
#ifndef RECOIL_BUDGET_H
#define RECOIL_BUDGET_H

#include "errors.h"
#include "records.h"

enum { MAX_SHOTS = 300 };

struct driven {
    uint64_t start_us, driven_us;
};

/* The last MAX_SHOTS shots in a ring, and the coil's warmth as it was at a whole 100 ms of the clock. */
struct budget {
    struct driven shots[MAX_SHOTS];
    unsigned count, next;
    uint64_t warmth_nJ, cooled_step, spent_step;
};

/* Whether a setting is beyond what any shot may be made of. */
bool budget_out_of_range(const struct setting *setting);
/* The error that forbids a shot at this time. */
enum error budget_refusal(const struct budget *budget, const struct setting *setting, uint64_t start_us);
/* Takes a shot into account. A pulse that is cut short counts in full. */
void budget_spend(struct budget *budget, const struct setting *setting, uint64_t start_us);
/* Carries the warmth on to a time before which no shot will begin, so that no later question is long to answer. */
void budget_cool(struct budget *budget, uint64_t now_us);
uint64_t budget_coil_mC(const struct budget *budget, uint64_t now_us);

#endif
