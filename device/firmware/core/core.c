#include "core.h"

#include "commands.h"

enum { BOOT_WATCHDOG_US = 30000000 };

static struct slice written(const struct text *text)
{
    return (struct slice){text->bytes, text->length};
}

static struct slice words_of(const char *words)
{
    size_t length = 0;
    while (words[length] != '\0')
        length++;
    return (struct slice){words, length};
}

static void send_frame(struct core *core, uint16_t number, struct slice body)
{
    frame_encode(number, body, &core->line);
    core->outlet.send(core->outlet.owner, written(&core->line));
}

static void send_error(struct core *core, uint16_t number, enum error error)
{
    text_clear(&core->answer);
    text_add(&core->answer, "ERR ");
    text_add(&core->answer, error_message(error));
    send_frame(core, number, written(&core->answer));
}

static void send_plain(struct core *core)
{
    text_char(&core->answer, '\n');
    core->outlet.send(core->outlet.owner, written(&core->answer));
}

static void queue(struct core *core, enum error error)
{
    core->events |= error_event(error);
    if (core->error_count < QUEUE_SIZE) {
        core->errors[core->error_count++] = error;
        return;
    }
    core->errors[QUEUE_SIZE - 1] = ERROR_QUEUE_OVERFLOW;
    core->events |= error_event(ERROR_QUEUE_OVERFLOW);
}

/* Tells what became of the shot, to the trigger that waits for it. */
static void answer_shot(struct core *core, uint16_t number)
{
    if (core->machine.shot.ending == ENDING_NONE) {
        send_error(core, number, core->machine.never);
        return;
    }
    text_clear(&core->answer);
    shot_text(&core->machine.shot, &core->answer);
    send_frame(core, number, written(&core->answer));
}

static void answer_complete(struct core *core)
{
    if (core->tells_complete)
        core->events |= EVENT_COMPLETE;
    core->tells_complete = false;
    if (!core->asks_complete)
        return;
    core->asks_complete = false;
    text_clear(&core->answer);
    text_add(&core->answer, "1");
    if (core->asked_complete == 0)
        send_plain(core);
    else
        send_frame(core, core->asked_complete, written(&core->answer));
}

/* A shot has ended: tells what became of it, and that it has. */
static void answer_trigger(struct core *core)
{
    uint16_t number = core->pending;
    core->pending = 0;
    if (number != 0)
        answer_shot(core, number);
    answer_complete(core);
}

/* A shot's time has come and is over; what kept it from being begun is queued in the plain mode. */
static void answer_ended(struct core *core)
{
    if (core->pending == 0 && core->machine.shot.ending == ENDING_NONE)
        queue(core, core->machine.never);
    answer_trigger(core);
}

void core_abort(struct core *core, uint64_t now_us)
{
    if (machine_abort(&core->machine, now_us))
        answer_trigger(core);
    text_clear(&core->answer);
}

static bool watchdog_due(const struct core *core, uint64_t *due_us)
{
    enum state state = core->machine.state;
    *due_us = core->heard_us + core->watchdog_us;
    return core->strict || (state != STATE_DISARMED && state != STATE_FAULT);
}

bool core_wake(const struct core *core, uint64_t *wake_us)
{
    uint64_t machine_us, watchdog_us;
    bool machine = machine_due(&core->machine, &machine_us);
    bool watchdog = watchdog_due(core, &watchdog_us);
    *wake_us = machine && (!watchdog || machine_us <= watchdog_us) ? machine_us : watchdog_us;
    return machine || watchdog;
}

/* At the same microsecond the gun's own event comes before the watchdog. */
static void run_next(struct core *core, uint64_t time_us)
{
    uint64_t machine_us;
    if (machine_due(&core->machine, &machine_us) && machine_us == time_us) {
        if (machine_run_due(&core->machine))
            answer_ended(core);
        return;
    }
    core_abort(core, time_us);
    queue(core, ERROR_WATCHDOG);
    core->strict = false;
}

static void run_due(struct core *core, uint64_t now_us)
{
    uint64_t time_us;
    while (core_wake(core, &time_us) && time_us <= now_us)
        run_next(core, time_us);
}

/* A session of the strict mode begins: disarmed, numbered from this frame on. It tells the token before. */
static void enter(struct core *core, const struct frame *frame, struct slice words, uint64_t now_us)
{
    uint64_t token;
    if (!slice_number(words, &token)) {
        send_error(core, frame->number, ERROR_BAD_TYPE);
        return;
    }
    core->pending = 0;
    core->asks_complete = false;
    core_abort(core, now_us);
    text_add(&core->answer, "STRI ");
    text_number(&core->answer, core->token);
    send_frame(core, frame->number, written(&core->answer));
    core->strict = true;
    core->token = token;
    core->last = frame->number;
    core->heard_us = now_us;
}

static void leave(struct core *core, uint16_t number, uint64_t now_us)
{
    core_abort(core, now_us);
    send_frame(core, number, words_of("OK"));
    core->strict = false;
}

static void answer(struct core *core, const struct frame *frame, uint64_t now_us)
{
    if (slice_is(frame->body, "SYST:PLAI")) {
        leave(core, frame->number, now_us);
        return;
    }
    core->number = frame->number;
    enum error error = command_do(core, frame->body, now_us);
    if (error != ERROR_NONE)
        send_error(core, frame->number, error);
    else if (slice_starts(frame->body, "TRIG"))
        core->pending = frame->number;
    else if (!core->asks_complete || core->asked_complete != frame->number)
        send_frame(core, frame->number, core->answer.length > 0 ? written(&core->answer) : words_of("OK"));
}

static void take_frame(struct core *core, const struct frame *frame, uint64_t now_us)
{
    const char *begin = "SYST:STRI ";
    if (slice_starts(frame->body, begin)) {
        enter(core, frame, slice_from(frame->body, words_of(begin).length), now_us);
    } else if (!core->strict) {
        send_error(core, frame->number, ERROR_NO_SESSION);
    } else if (frame_is_newer(frame->number, core->last)) {
        core->last = frame->number;
        core->heard_us = now_us;
        answer(core, frame, now_us);
    }
}

static void take_garbled(struct core *core, struct slice line)
{
    if (!slice_is(line, "*IDN?")) {
        send_frame(core, 0, words_of("NAK"));
        return;
    }
    text_clear(&core->answer);
    core_identify(core);
    send_plain(core);
}

/* In the plain mode questions are answered, errors queued, and everything else is silent. */
static void take_plain(struct core *core, struct slice line, uint64_t now_us)
{
    core->number = 0;
    enum error error = slice_printable(line) ? command_do(core, line, now_us) : ERROR_UNDEFINED;
    if (error != ERROR_NONE) {
        queue(core, error);
        return;
    }
    core->heard_us = now_us;
    if (core->answer.length > 0)
        send_plain(core);
}

static void take(struct core *core, enum heard heard, struct slice line, uint64_t now_us)
{
    struct frame frame;
    if (heard == HEARD_TOO_LONG && !core->strict)
        queue(core, ERROR_OVERRUN);
    else if (heard == HEARD_TOO_LONG)
        take_garbled(core, (struct slice){NULL, 0});
    else if (!core->strict && line.bytes[0] != '>')
        take_plain(core, line, now_us);
    else if (frame_decode(line, &frame))
        take_frame(core, &frame, now_us);
    else
        take_garbled(core, line);
}

void core_boot(struct core *core, const char *serial, struct outlet outlet, uint64_t now_us)
{
    *core = (struct core){.serial = serial, .outlet = outlet, .heard_us = now_us, .watchdog_us = BOOT_WATCHDOG_US};
    core->events = EVENT_POWER_ON;
    machine_boot(&core->machine, (struct driver){outlet.owner, outlet.drive}, now_us);
}

void core_step(struct core *core, const uint8_t *bytes, size_t count, uint64_t now_us)
{
    struct slice line;
    run_due(core, now_us);
    for (size_t i = 0; i < count; i++) {
        enum heard heard = splitter_feed(&core->splitter, bytes[i], &line);
        if (heard == HEARD_NOTHING)
            continue;
        take(core, heard, line, now_us);
        run_due(core, now_us);
    }
    budget_cool(&core->machine.budget, now_us);
}

void core_fail(struct core *core, uint64_t fault, uint64_t now_us)
{
    run_due(core, now_us);
    if (machine_fail(&core->machine, fault, now_us))
        answer_trigger(core);
    queue(core, ERROR_FAULT);
}
