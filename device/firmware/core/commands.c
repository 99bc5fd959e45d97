#include "commands.h"

enum { MIN_WATCHDOG_MS = 100, MAX_WATCHDOG_MS = 60000, MAX_PARAMETERS = 3 };

/* A command's parameters, read as numbers; count may be more than there is room for. */
struct parameters {
    struct slice words;
    uint64_t numbers[MAX_PARAMETERS];
    size_t count;
};

typedef enum error carry_out(struct core *core, const struct parameters *parameters, uint64_t now_us);

struct command {
    const char *header;
    carry_out *carry_out;
    enum { TAKES_NONE, TAKES_NUMBERS, TAKES_WORDS } takes;
};

void core_identify(struct core *core)
{
    text_add(&core->answer, "Recoil,haptic-gun,");
    text_add(&core->answer, core->serial);
    text_add(&core->answer, ",wire " RECOIL_WIRE_VERSION " firmware " RECOIL_FIRMWARE);
}

static enum error identify(struct core *core, const struct parameters *parameters, uint64_t now_us)
{
    (void)parameters, (void)now_us;
    core_identify(core);
    return ERROR_NONE;
}

static enum error reset(struct core *core, const struct parameters *parameters, uint64_t now_us)
{
    (void)parameters;
    core_abort(core, now_us);
    machine_clear(&core->machine);
    return ERROR_NONE;
}

static enum error clear_errors(struct core *core, const struct parameters *parameters, uint64_t now_us)
{
    (void)parameters, (void)now_us;
    core->error_count = 0;
    core->events = 0;
    core->tells_complete = false;
    return ERROR_NONE;
}

static bool shot_is_on(const struct core *core)
{
    uint64_t due_us;
    return machine_due(&core->machine, &due_us);
}

static enum error tell_complete(struct core *core, const struct parameters *parameters, uint64_t now_us)
{
    (void)parameters, (void)now_us;
    core->tells_complete = shot_is_on(core);
    if (!core->tells_complete)
        core->events |= EVENT_COMPLETE;
    return ERROR_NONE;
}

/* 1, at once or when the shot that waits or is driven has ended. One question waits at a time. */
static enum error ask_complete(struct core *core, const struct parameters *parameters, uint64_t now_us)
{
    (void)parameters, (void)now_us;
    if (!shot_is_on(core)) {
        text_add(&core->answer, "1");
        return ERROR_NONE;
    }
    if (core->asks_complete)
        return ERROR_BUSY;
    core->asks_complete = true;
    core->asked_complete = core->number;
    return ERROR_NONE;
}

static enum error tell_events(struct core *core, const struct parameters *parameters, uint64_t now_us)
{
    (void)parameters, (void)now_us;
    text_number(&core->answer, core->events);
    core->events = 0;
    return ERROR_NONE;
}

/* Nothing is driven for it: what is known of the driver. */
static enum error test_itself(struct core *core, const struct parameters *parameters, uint64_t now_us)
{
    (void)parameters;
    text_number(&core->answer, machine_standing(&core->machine, now_us).fault);
    return ERROR_NONE;
}

static enum error tell_version(struct core *core, const struct parameters *parameters, uint64_t now_us)
{
    (void)parameters, (void)now_us;
    text_add(&core->answer, "1999.0");
    return ERROR_NONE;
}

static enum error abort_shot(struct core *core, const struct parameters *parameters, uint64_t now_us)
{
    (void)parameters;
    core_abort(core, now_us);
    return ERROR_NONE;
}

static enum error arm(struct core *core, const struct parameters *parameters, uint64_t now_us)
{
    (void)parameters, (void)now_us;
    return machine_arm(&core->machine);
}

static enum error configure(struct core *core, const struct parameters *parameters, uint64_t now_us)
{
    (void)now_us;
    struct setting setting;
    if (parameters->words.length == 0)
        return ERROR_MISSING;
    if (!setting_parse(parameters->words, &setting))
        return ERROR_BAD_TYPE;
    return machine_configure(&core->machine, &setting);
}

static enum error tell_setting(struct core *core, const struct parameters *parameters, uint64_t now_us)
{
    (void)parameters, (void)now_us;
    if (!core->machine.configured)
        return ERROR_NOT_CONFIGURED;
    text_add(&core->answer, "CONF ");
    setting_text(&core->machine.setting, &core->answer);
    return ERROR_NONE;
}

static enum error trigger(struct core *core, const struct parameters *parameters, uint64_t now_us)
{
    const uint64_t *numbers = parameters->numbers;
    if (parameters->count > 3)
        return ERROR_NOT_ALLOWED;
    return machine_trigger(&core->machine, (struct trigger){numbers[0], numbers[1], numbers[2]}, now_us);
}

static enum error tell_shot(struct core *core, const struct parameters *parameters, uint64_t now_us)
{
    (void)parameters, (void)now_us;
    shot_text(&core->machine.shot, &core->answer);
    return ERROR_NONE;
}

static enum error tell_standing(struct core *core, const struct parameters *parameters, uint64_t now_us)
{
    (void)parameters;
    struct standing standing = machine_standing(&core->machine, now_us);
    standing_text(&standing, &core->answer);
    return ERROR_NONE;
}

static enum error tell_time(struct core *core, const struct parameters *parameters, uint64_t now_us)
{
    (void)parameters;
    text_add(&core->answer, "TIME ");
    text_number(&core->answer, now_us);
    return ERROR_NONE;
}

static enum error set_watchdog(struct core *core, const struct parameters *parameters, uint64_t now_us)
{
    (void)now_us;
    uint64_t time_ms = parameters->numbers[0];
    if (parameters->count != 1)
        return parameters->count == 0 ? ERROR_MISSING : ERROR_NOT_ALLOWED;
    if (time_ms < MIN_WATCHDOG_MS || time_ms > MAX_WATCHDOG_MS)
        return ERROR_OUT_OF_RANGE;
    core->watchdog_us = 1000 * time_ms;
    return ERROR_NONE;
}

static enum error tell_watchdog(struct core *core, const struct parameters *parameters, uint64_t now_us)
{
    (void)parameters, (void)now_us;
    text_add(&core->answer, "WATC ");
    text_number(&core->answer, core->watchdog_us / 1000);
    return ERROR_NONE;
}

static enum error tell_error(struct core *core, const struct parameters *parameters, uint64_t now_us)
{
    (void)parameters, (void)now_us;
    enum error oldest = core->error_count > 0 ? core->errors[0] : ERROR_NONE;
    for (unsigned i = 1; i < core->error_count; i++)
        core->errors[i - 1] = core->errors[i];
    if (core->error_count > 0)
        core->error_count--;
    text_add(&core->answer, error_message(oldest));
    return ERROR_NONE;
}

static const struct command COMMANDS[] = {
    {"*IDN?", identify, TAKES_NONE},
    {"*RST", reset, TAKES_NONE},
    {"*CLS", clear_errors, TAKES_NONE},
    {"*OPC", tell_complete, TAKES_NONE},
    {"*OPC?", ask_complete, TAKES_NONE},
    {"*ESR?", tell_events, TAKES_NONE},
    {"*TST?", test_itself, TAKES_NONE},
    {"ABOR", abort_shot, TAKES_NONE},
    {"ARM", arm, TAKES_NONE},
    {"CONF", configure, TAKES_WORDS},
    {"CONF?", tell_setting, TAKES_NONE},
    {"TRIG", trigger, TAKES_NUMBERS},
    {"SHOT?", tell_shot, TAKES_NONE},
    {"STAT?", tell_standing, TAKES_NONE},
    {"TIME?", tell_time, TAKES_NONE},
    {"SYST:WATC", set_watchdog, TAKES_NUMBERS},
    {"SYST:WATC?", tell_watchdog, TAKES_NONE},
    {"SYST:ERR?", tell_error, TAKES_NONE},
    {"SYST:VERS?", tell_version, TAKES_NONE},
};

static const struct command *find(struct slice header)
{
    for (size_t i = 0; i < sizeof COMMANDS / sizeof COMMANDS[0]; i++)
        if (slice_is(header, COMMANDS[i].header))
            return &COMMANDS[i];
    return NULL;
}

/* Every parameter must be a number, also those that are too many. */
static bool read_numbers(struct parameters *parameters)
{
    struct slice word, rest = parameters->words;
    bool more = true;
    while (more) {
        uint64_t number;
        more = slice_cut(&rest, ',', &word);
        if (!slice_number(word, &number))
            return false;
        if (parameters->count < MAX_PARAMETERS)
            parameters->numbers[parameters->count] = number;
        parameters->count++;
    }
    return true;
}

enum error command_do(struct core *core, struct slice words, uint64_t now_us)
{
    struct slice header;
    struct parameters parameters = {0};
    text_clear(&core->answer);
    bool blank = slice_cut(&words, ' ', &header);
    const struct command *command = find(header);
    parameters.words = words;
    if (command == NULL)
        return ERROR_UNDEFINED;
    if (blank && command->takes == TAKES_NONE)
        return ERROR_NOT_ALLOWED;
    if (blank && command->takes == TAKES_NUMBERS && !read_numbers(&parameters))
        return ERROR_BAD_TYPE;
    return command->carry_out(core, &parameters, now_us);
}
