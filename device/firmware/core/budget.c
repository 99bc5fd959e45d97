#include "budget.h"

enum {
    MAX_MILLIVOLTS = 24000,
    MAX_PULSE_US = 20000,
    MAX_EFFECT = 123,
    MAX_EFFECT_US = 1000000,
    MAX_REST_US = 10000000,
    PULSE_FLOOR_US = 50000, /* least time from onset to onset; assumed */
    EFFECT_FLOOR_US = 10000,
    SECOND_US = 1000000,
    MINUTE_US = 60 * SECOND_US,
    DUTY_US = 100000,
    COIL_MILLIOHMS = 2900,
    COIL_NJ_MK = 20000000, /* heat capacity, 20 J/K; assumed */
    ROOM_MC = 25000,
    HOTTEST_MK = 55000, /* above the room: 80 degC */
    COOLING_US = 100000,
    COOLING_PARTS = 2001, /* each 100 ms this part goes: 200 s, erring on the warm side */
    COLD_STEPS = 60000,   /* after so many the coil is taken for cold */
};
static const uint64_t MAX_WARMTH_NJ = (uint64_t)HOTTEST_MK * COIL_NJ_MK;

bool budget_out_of_range(const struct setting *setting)
{
    bool pulse = setting->kind == KIND_PULS;
    uint64_t least_us = pulse ? PULSE_FLOOR_US : EFFECT_FLOOR_US;
    if (setting->length_us > least_us)
        least_us = setting->length_us;
    if (setting->amount > (pulse ? MAX_MILLIVOLTS : MAX_EFFECT) || (!pulse && setting->amount < 1))
        return true;
    if (setting->length_us > (pulse ? MAX_PULSE_US : MAX_EFFECT_US))
        return true;
    return setting->rest_us < least_us || setting->rest_us > MAX_REST_US;
}

/* How long the coil is driven; a vibration does not use it. */
static uint64_t driven_us(const struct setting *setting)
{
    return setting->kind == KIND_PULS ? setting->length_us : 0;
}

/* V^2/R t, rounded up: mV^2 us / mOhm is nJ. */
static uint64_t heat_nJ(const struct setting *setting)
{
    if (setting->kind == KIND_EFF)
        return 0;
    return (setting->amount * setting->amount * setting->length_us + COIL_MILLIOHMS - 1) / COIL_MILLIOHMS;
}

static uint64_t warmth_at(const struct budget *budget, uint64_t now_us)
{
    uint64_t warmth_nJ = budget->warmth_nJ;
    uint64_t now_step = now_us / COOLING_US;
    if (now_step > budget->spent_step + COLD_STEPS)
        return 0;
    for (uint64_t step = budget->cooled_step; step < now_step && warmth_nJ >= COOLING_PARTS; step++)
        warmth_nJ -= warmth_nJ / COOLING_PARTS;
    return warmth_nJ;
}

/* What of an older shot lies in the second that begins here. */
static uint64_t inside_us(const struct driven *shot, uint64_t begin_us)
{
    uint64_t end_us = shot->start_us + shot->driven_us;
    if (end_us <= begin_us)
        return 0;
    return shot->start_us >= begin_us ? shot->driven_us : end_us - begin_us;
}

/* A second is fullest when it ends with the new pulse. */
static bool driven_too_long(const struct budget *budget, uint64_t on_us, uint64_t start_us)
{
    uint64_t end_us = start_us + on_us;
    uint64_t begin_us = end_us > SECOND_US ? end_us - SECOND_US : 0;
    for (unsigned i = 0; i < budget->count; i++)
        on_us += inside_us(&budget->shots[i], begin_us);
    return on_us > DUTY_US;
}

enum error budget_refusal(const struct budget *budget, const struct setting *setting, uint64_t start_us)
{
    if (budget->count == MAX_SHOTS && start_us < budget->shots[budget->next].start_us + MINUTE_US)
        return ERROR_RATE;
    if (driven_too_long(budget, driven_us(setting), start_us))
        return ERROR_DUTY;
    if (warmth_at(budget, start_us) + heat_nJ(setting) > MAX_WARMTH_NJ)
        return ERROR_HOT;
    return ERROR_NONE;
}

void budget_spend(struct budget *budget, const struct setting *setting, uint64_t start_us)
{
    budget_cool(budget, start_us);
    budget->warmth_nJ += heat_nJ(setting);
    budget->spent_step = budget->cooled_step;
    budget->shots[budget->next] = (struct driven){start_us, driven_us(setting)};
    budget->next = (budget->next + 1) % MAX_SHOTS;
    if (budget->count < MAX_SHOTS)
        budget->count++;
}

void budget_cool(struct budget *budget, uint64_t now_us)
{
    uint64_t now_step = now_us / COOLING_US;
    if (now_step <= budget->cooled_step) /* a shot that was begun late is ahead of the core's time */
        return;
    budget->warmth_nJ = warmth_at(budget, now_us);
    budget->cooled_step = now_step;
}

uint64_t budget_coil_mC(const struct budget *budget, uint64_t now_us)
{
    return ROOM_MC + warmth_at(budget, now_us) / COIL_NJ_MK;
}
