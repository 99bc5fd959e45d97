/* The world around the chip, as a script has it: `TIME WORD ...` a line, in microseconds since power came on.
 *
 *     say LINE           the host sends a line at 460,800 baud
 *     bus WHAT           good, absent, error, low, or where a transfer hangs: sb, addr, txe, btf, stop
 *     held CLOCKS        the vibration driver holds SDA low for so many clocks more
 *     stall LENGTH       the main loop does nothing for so long
 *     coil-fault FLAG, no-outside-clock FLAG, no-pll FLAG, clock-stands-still FLAG
 *     access NS          how long the processor takes for a register, 100
 *     watchdog KHZ       its oscillator, 47: the least time
 *     end
 */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fake.h"
#include "startup.h"

#undef main /* the build calls the firmware's by another name */

enum { MAX_LINES = 2000, MAX_LINE = 256, BYTE_NS = 21701 };

static struct {
    char lines[MAX_LINES][MAX_LINE];
    size_t count, next;
} script;

static struct {
    char bytes[64 * 1024];
    size_t count, next;
    uint64_t due_ns;
} host;

static uint64_t time_ns(const char *line)
{
    return 1000 * strtoull(line, NULL, 10);
}

uint64_t script_due_ns(void)
{
    return script.next < script.count ? time_ns(script.lines[script.next]) : UINT64_MAX;
}

uint64_t host_due_ns(void)
{
    return host.next < host.count ? host.due_ns : UINT64_MAX;
}

uint8_t host_next(void)
{
    host.due_ns += BYTE_NS;
    return (uint8_t)host.bytes[host.next++];
}

static void say(const char *words)
{
    size_t length = strlen(words);
    if (host.count + length + 1 > sizeof host.bytes)
        abort();
    if (host.next == host.count)
        host.due_ns = now_ns + BYTE_NS;
    memcpy(host.bytes + host.count, words, length);
    host.count += length;
    host.bytes[host.count++] = '\n';
}

static void set_bus(const char *word)
{
    static const char *const WORDS[] = {"good", "absent", "error", "low", "sb", "addr", "txe", "btf", "stop"};
    for (size_t i = 0; i < sizeof WORDS / sizeof WORDS[0]; i++)
        if (strcmp(word, WORDS[i]) == 0)
            world.bus = (enum bus)i;
    if (world.bus == BUS_ABSENT)
        bus_lose_power();
}

static void set_number(const char *word, unsigned number)
{
    static const struct {
        const char *word;
        unsigned *place;
    } NUMBERS[] = {{"held", &world.held}, {"access", &world.access_ns}, {"watchdog", &world.watchdog_kHz}};
    static const struct {
        const char *word;
        bool *place;
    } FLAGS[] = {{"coil-fault", &world.coil_fault},
                 {"no-outside-clock", &world.no_outside_clock},
                 {"no-pll", &world.no_pll},
                 {"clock-stands-still", &world.still}};
    for (size_t i = 0; i < sizeof NUMBERS / sizeof NUMBERS[0]; i++)
        if (strcmp(word, NUMBERS[i].word) == 0)
            *NUMBERS[i].place = number;
    for (size_t i = 0; i < sizeof FLAGS / sizeof FLAGS[0]; i++)
        if (strcmp(word, FLAGS[i].word) == 0)
            *FLAGS[i].place = number == 1;
}

static void carry_out(const char *word, const char *rest)
{
    if (strcmp(word, "say") == 0)
        say(rest);
    else if (strcmp(word, "bus") == 0)
        set_bus(rest);
    else if (strcmp(word, "stall") == 0)
        pass(1000 * strtoull(rest, NULL, 10));
    else if (strcmp(word, "end") == 0)
        finish(word);
    else
        set_number(word, (unsigned)strtoul(rest, NULL, 10));
}

void script_happen(void)
{
    char word[32] = "";
    const char *line = script.lines[script.next++];
    const char *rest = line + strcspn(line, " ");
    rest += strspn(rest, " ");
    size_t length = strcspn(rest, " ");
    if (length < sizeof word)
        memcpy(word, rest, length);
    rest += length;
    carry_out(word, rest + strspn(rest, " "));
}

int main(void)
{
    while (script.count < MAX_LINES && fgets(script.lines[script.count], MAX_LINE, stdin) != NULL) {
        char *line = script.lines[script.count++];
        line[strcspn(line, "\n")] = '\0';
    }
    pass(0);
    return firmware_main();
}
