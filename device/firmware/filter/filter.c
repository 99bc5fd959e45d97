/* A filter: a script of calls comes in, the core's transcript goes out (tests/twin_scripts.py is the language).
 *
 * It exits with 0, or with 1 where a line is no call.
 */
#include "bytes.h"
#include "core.h"

enum { MAX_OUT = 32768, MAX_WORD = 8 };

struct filter {
    struct core core;
    uint64_t now_us;
    uint64_t late_us; /* the board's */
    bool dead;
    size_t out_count;
    char out[MAX_OUT];
    int next; /* the byte after the one that was read last */
};

static void put_words(const char *words)
{
    while (*words != '\0')
        bytes_put(*words++);
}

static void put_number(uint64_t number)
{
    struct text text = {0};
    text_char(&text, ' ');
    text_number(&text, number);
    for (size_t i = 0; i < text.length; i++)
        bytes_put(text.bytes[i]);
}

static void keep(void *owner, struct slice line)
{
    struct filter *filter = owner;
    for (size_t i = 0; i < line.length; i++) {
        if (filter->out_count == MAX_OUT)
            bytes_end(1);
        filter->out[filter->out_count++] = line.bytes[i];
    }
}

static struct carried carry_late(const struct filter *filter, const struct drive *drive)
{
    uint64_t at_us = drive->time_us + filter->late_us;
    if (filter->dead)
        return (struct carried){ERROR_FAULT, at_us};
    return (struct carried){drive_is_over(drive, at_us) ? ERROR_TOO_LATE : ERROR_NONE, at_us};
}

static struct carried tell_drive(void *owner, const struct drive *drive)
{
    static const char *const KINDS[] = {[DRIVE_PULS] = " PULS", [DRIVE_EFF] = " EFF", [DRIVE_OFF] = " OFF"};
    struct carried carried = carry_late(owner, drive);
    if (carried.error != ERROR_NONE)
        return carried;
    put_words("drive");
    put_number(carried.at_us);
    put_words(KINDS[drive->kind]);
    if (drive->kind != DRIVE_OFF)
        put_number(drive->amount);
    bytes_put('\n');
    return carried;
}

static void tell_out(struct filter *filter)
{
    if (filter->out_count == 0)
        return;
    put_words("out");
    put_number(filter->now_us);
    bytes_put(' ');
    for (size_t i = 0; i < filter->out_count; i++) {
        bytes_put("0123456789ABCDEF"[(uint8_t)filter->out[i] >> 4]);
        bytes_put("0123456789ABCDEF"[(uint8_t)filter->out[i] & 0xF]);
    }
    bytes_put('\n');
    filter->out_count = 0;
}

static int advance(struct filter *filter)
{
    int byte = filter->next;
    filter->next = bytes_get();
    return byte;
}

static struct slice read_word(struct filter *filter, char *room, size_t size)
{
    size_t length = 0;
    while (filter->next > ' ' && length < size)
        room[length++] = (char)advance(filter);
    if (filter->next == ' ')
        advance(filter);
    return (struct slice){room, length};
}

static uint64_t read_number(struct filter *filter)
{
    char room[16];
    uint64_t number;
    if (!slice_number(read_word(filter, room, sizeof room), &number))
        bytes_end(1);
    return number;
}

static unsigned read_digit(struct filter *filter)
{
    int digit = advance(filter);
    if (digit >= '0' && digit <= '9')
        return (unsigned)(digit - '0');
    if (digit < 'A' || digit > 'F')
        bytes_end(1);
    return (unsigned)(digit - 'A') + 10;
}

static void take_bytes(struct filter *filter)
{
    core_step(&filter->core, NULL, 0, filter->now_us);
    while (filter->next > ' ') {
        unsigned high = read_digit(filter);
        uint8_t byte = (uint8_t)(high << 4 | read_digit(filter));
        core_step(&filter->core, &byte, 1, filter->now_us);
    }
}

static void boot(struct filter *filter, uint64_t now_us)
{
    core_boot(&filter->core, "TWIN-1", (struct outlet){filter, keep, tell_drive}, now_us);
}

static void reset(struct filter *filter)
{
    boot(filter, filter->now_us);
    put_words("boot");
    put_number(filter->now_us);
    bytes_put('\n');
}

/* What is due happens before the board changes. */
static uint64_t read_change(struct filter *filter)
{
    core_step(&filter->core, NULL, 0, filter->now_us);
    return read_number(filter);
}

static void carry_out(struct filter *filter, struct slice word)
{
    if (slice_is(word, "in") || slice_is(word, "tick"))
        take_bytes(filter);
    else if (slice_is(word, "late"))
        filter->late_us = read_change(filter);
    else if (slice_is(word, "dead"))
        filter->dead = read_change(filter) == 1;
    else if (slice_is(word, "fault"))
        core_fail(&filter->core, read_number(filter), filter->now_us);
    else if (slice_is(word, "reset"))
        reset(filter);
    else
        bytes_end(1);
}

int main(void)
{
    static struct filter filter;
    char room[MAX_WORD];
    boot(&filter, 0);
    advance(&filter);
    while (filter.next >= 0) {
        struct slice word = read_word(&filter, room, sizeof room);
        filter.now_us = read_number(&filter);
        carry_out(&filter, word);
        tell_out(&filter);
        if (advance(&filter) != '\n')
            bytes_end(1);
    }
    bytes_end(0);
}
