#include "machine.h"

enum { BOOT_REST_US = 1000000, MAX_AHEAD_US = 2000000 };
/* A pulse is on time if it loses at most 2 %, at most one turn of the main loop; an effect waits for its driver. */
enum { LATE_PULSE_US = 200, LATE_PULSE_PARTS = 50, LATE_EFFECT_US = 1000 };
static const uint64_t MAX_MARK = 0xFFFFFFFF;

enum guarded { GUARD_CONF, GUARD_ARM, GUARD_TRIG };

/* What is refused in which state; everything else is taken. */
static const enum error REFUSED[][STATE_FAULT + 1] = {
    [GUARD_CONF] = {[STATE_WAITING] = ERROR_BUSY, [STATE_FIRING] = ERROR_BUSY},
    [GUARD_ARM] = {[STATE_WAITING] = ERROR_BUSY, [STATE_FIRING] = ERROR_BUSY, [STATE_FAULT] = ERROR_FAULT},
    [GUARD_TRIG] = {[STATE_DISARMED] = ERROR_DISARMED,
                    [STATE_WAITING] = ERROR_BUSY,
                    [STATE_FIRING] = ERROR_BUSY,
                    [STATE_FAULT] = ERROR_FAULT},
};

static const struct setting UNSET = {.method = "none", .way = WAY_FORW, .kind = KIND_EFF, .amount = 1};

void machine_boot(struct machine *machine, struct driver driver, uint64_t now_us)
{
    *machine = (struct machine){.state = STATE_DISARMED, .driver = driver, .ready_us = now_us + BOOT_REST_US};
    machine->shot.setting = UNSET;
}

bool machine_due(const struct machine *machine, uint64_t *due_us)
{
    *due_us = machine->state == STATE_WAITING ? machine->shot.start_us : machine->shot.end_us;
    return machine->state == STATE_WAITING || machine->state == STATE_FIRING;
}

/* How late a drive may be, and still be told as on time. */
static uint64_t allowed_us(const struct setting *setting)
{
    uint64_t part_us = setting->length_us / LATE_PULSE_PARTS;
    if (setting->kind == KIND_EFF)
        return LATE_EFFECT_US;
    return part_us < LATE_PULSE_US ? part_us : LATE_PULSE_US;
}

static struct carried tell(struct machine *machine, const struct drive *drive)
{
    return machine->driver.drive(machine->driver.owner, drive);
}

/* The shot that waits is never begun. */
static void call_off(struct machine *machine, enum error error)
{
    machine->never = error;
    machine->shot.ending = ENDING_NONE;
}

/* Whether the board could begin the shot; how late it was is told by START, if that is too late. */
static bool begin(struct machine *machine)
{
    struct shot *shot = &machine->shot;
    bool pulse = shot->setting.kind == KIND_PULS;
    struct drive drive = {shot->start_us, pulse ? DRIVE_PULS : DRIVE_EFF, shot->setting.amount, shot->end_us};
    struct carried carried = tell(machine, &drive);
    if (carried.error != ERROR_NONE) {
        call_off(machine, carried.error);
        machine->state = STATE_ARMED;
        return false;
    }
    if (carried.at_us > shot->start_us + allowed_us(&shot->setting))
        shot->start_us = carried.at_us;
    shot->count++;
    shot->ending = ENDING_DRIV;
    shot->home_predicted_us = shot->start_us + shot->setting.rest_us;
    machine->state = STATE_FIRING;
    machine->ready_us = shot->home_predicted_us;
    budget_spend(&machine->budget, &shot->setting, shot->start_us);
    return true;
}

/* When it was truly off, if that was noticeably later than the core's time for it; a pulse never outlasts its END. */
static uint64_t off_at(const struct shot *shot, const struct carried *carried, uint64_t time_us)
{
    uint64_t off_us = carried->error == ERROR_NONE ? carried->at_us : time_us;
    if (shot->setting.kind == KIND_PULS && off_us > shot->end_us)
        off_us = shot->end_us;
    if (off_us <= time_us + allowed_us(&shot->setting))
        off_us = time_us;
    return off_us > shot->start_us ? off_us : shot->start_us;
}

/* It is over, whole or cut short. */
static void end(struct machine *machine, uint64_t time_us)
{
    struct shot *shot = &machine->shot;
    struct drive off = {time_us, DRIVE_OFF, 0, time_us};
    struct carried carried = tell(machine, &off);
    shot->end_us = off_at(shot, &carried, time_us);
    shot->ending = shot->end_us - shot->start_us < shot->setting.length_us ? ENDING_CUT : ENDING_DONE;
}

bool machine_run_due(struct machine *machine)
{
    if (machine->state == STATE_WAITING)
        return !begin(machine);
    end(machine, machine->shot.end_us);
    machine->state = STATE_ARMED;
    return true;
}

enum error machine_configure(struct machine *machine, const struct setting *setting)
{
    enum error error = REFUSED[GUARD_CONF][machine->state];
    if (error != ERROR_NONE)
        return error;
    if (budget_out_of_range(setting))
        return ERROR_OUT_OF_RANGE;
    machine->setting = *setting;
    machine->configured = true;
    return ERROR_NONE;
}

enum error machine_arm(struct machine *machine)
{
    enum error error = REFUSED[GUARD_ARM][machine->state];
    if (error == ERROR_NONE)
        machine->state = STATE_ARMED;
    return error;
}

/* The first rule that a trigger breaks, in the protocol's order. */
static enum error forbidden(const struct machine *machine, struct trigger trigger, uint64_t start_us, uint64_t now_us)
{
    enum error error = REFUSED[GUARD_TRIG][machine->state];
    if (error != ERROR_NONE)
        return error;
    if (!machine->configured)
        return ERROR_NOT_CONFIGURED;
    if (trigger.mark > MAX_MARK || start_us - now_us > MAX_AHEAD_US)
        return ERROR_OUT_OF_RANGE;
    if (trigger.mark != 0 && trigger.mark == machine->shot.mark && machine->shot.ending != ENDING_NONE)
        return ERROR_ALREADY_FIRED;
    if (trigger.before_us != 0 && start_us > trigger.before_us)
        return ERROR_TOO_LATE;
    if (start_us < machine->ready_us)
        return machine->shot.count == 0 ? ERROR_JUST_BOOTED : ERROR_NOT_HOME;
    return budget_refusal(&machine->budget, &machine->setting, start_us);
}

enum error machine_trigger(struct machine *machine, struct trigger trigger, uint64_t now_us)
{
    uint64_t start_us = trigger.at_us > now_us ? trigger.at_us : now_us;
    enum error error = forbidden(machine, trigger, start_us, now_us);
    if (error != ERROR_NONE)
        return error;
    machine->shot = (struct shot){
        .count = machine->shot.count,
        .mark = trigger.mark,
        .ending = ENDING_WAIT,
        .accepted_us = now_us,
        .start_us = start_us,
        .end_us = start_us + machine->setting.length_us,
        .home_predicted_us = start_us + machine->setting.rest_us,
        .setting = machine->setting,
    };
    machine->state = STATE_WAITING;
    return ERROR_NONE;
}

bool machine_abort(struct machine *machine, uint64_t now_us)
{
    enum state state = machine->state;
    if (state == STATE_FIRING)
        end(machine, now_us);
    else if (state == STATE_WAITING)
        call_off(machine, ERROR_CANCELLED);
    if (state != STATE_FAULT)
        machine->state = STATE_DISARMED;
    return state == STATE_FIRING || state == STATE_WAITING;
}

void machine_clear(struct machine *machine)
{
    machine->configured = false;
    machine->fault = 0;
    machine->state = STATE_DISARMED;
}

bool machine_fail(struct machine *machine, uint64_t fault, uint64_t now_us)
{
    bool ended = machine_abort(machine, now_us);
    machine->fault = fault;
    machine->state = STATE_FAULT;
    return ended;
}

struct standing machine_standing(const struct machine *machine, uint64_t now_us)
{
    bool resetting = machine->state == STATE_ARMED && now_us < machine->ready_us;
    return (struct standing){
        .state = resetting ? STATE_RESETTING : machine->state,
        .count = machine->shot.count,
        .clock_us = now_us,
        .ready_us = machine->ready_us,
        .coil_mC = budget_coil_mC(&machine->budget, now_us),
        .fault = machine->fault,
    };
}
