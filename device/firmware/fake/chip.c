/* The chip without its bus: clocks, timers, watchdog, serial port, pins. After RM0390, chapters of the same names. */
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

#include "cpu.h"
#include "fake.h"
#include "startup.h"

enum { HSEON = BIT(16), HSERDY = BIT(17), HSEBYP = BIT(18), PLLON = BIT(24), PLLRDY = BIT(25) };
enum { VOS = 3 << 14, VOSRDY = BIT(14), LATENCY = 0xF, SWS_PLL = 2 << 2 };
enum { HSE_STARTS_NS = 2000000, PLL_LOCKS_NS = 200000, BYTE_NS = 21701, PRESCALER_NS = 300000 }; /* 10 bits, 460800 */
enum { USART_LINE = 38, TICK_NS = 1000000, GATE = 7 << 4, WATCHDOG_START = 0xCCCC, OPEN = 0x5555, FEED = 0xAAAA };

struct world world = {.watchdog_kHz = 47, .access_ns = 100};
uint64_t now_ns;

static struct {
    uint64_t hse_ns, pll_ns;
} rises;

static struct {
    uint64_t since_ns;
    uint32_t prescaler, stopped_at;
} clock2, clock3;

static struct {
    uint64_t on_ns, off_ns;
    bool on;
} gate = {UINT64_MAX, UINT64_MAX, false};

static struct {
    bool open;
    uint64_t started_ns, fed_ns, longest_ns, due_ns;
} watchdog = {.due_ns = UINT64_MAX};

static struct {
    bool full, overrun;
    uint8_t byte;
    uint64_t sent_ns;
    char line[512];
    size_t length;
} serial;

static struct {
    bool held, inside;
    uint64_t tick_ns;
} processor;

void tell(const char *format, ...)
{
    va_list words;
    printf("%llu ", (unsigned long long)(now_ns / 1000));
    va_start(words, format);
    vprintf(format, words);
    va_end(words);
    putchar('\n');
}

void rule(bool kept, const char *words)
{
    if (!kept)
        tell("broken rule: %s", words);
}

_Noreturn void finish(const char *words)
{
    tell("%s", words);
    tell("longest between two feeds of the watchdog: %llu us", (unsigned long long)(watchdog.longest_ns / 1000));
    exit(fflush(stdout) == 0 ? 0 : 2);
}

uint32_t *cell(const reg *place)
{
    static const struct {
        uintptr_t begin;
        size_t bytes;
    } PLACES[] = {{0x40000000, 0x24000}, {0xE000E000, 0x1000}, {0x1FFF7A10, 12}};
    static uint32_t contents[0x40000 / 4];
    uintptr_t address = (uintptr_t)place;
    size_t before = 0;
    for (size_t i = 0; i < sizeof PLACES / sizeof PLACES[0]; i++) {
        if (address >= PLACES[i].begin && address < PLACES[i].begin + PLACES[i].bytes)
            return &contents[(before + address - PLACES[i].begin) / 4];
        before += PLACES[i].bytes;
    }
    fprintf(stderr, "no such register: %#lx\n", (unsigned long)address);
    abort();
}

/* What RCC was told, in MHz: the source by M, by N, by P. */
static uint32_t pll_MHz(void)
{
    uint32_t set = *cell(&RCC->PLLCFGR);
    uint32_t source = (set & BIT(22)) != 0 ? 8 : 16;
    return source * (set >> 6 & 0x1FF) / (set & 0x3F) / (2 * (set >> 16 & 3) + 2);
}

static uint32_t processor_MHz(void)
{
    return (*cell(&RCC->CFGR) & SWS_PLL) != 0 ? pll_MHz() : 16;
}

/* A divider of the configuration: 0xx by 1, 100 by 2 to 111 by 16. */
static uint32_t divider(unsigned place)
{
    uint32_t set = *cell(&RCC->CFGR) >> place & 7;
    return set < 4 ? 1 : 2u << (set - 4);
}

uint32_t apb1_MHz(void)
{
    return processor_MHz() / divider(10);
}

static uint32_t timers_MHz(void)
{
    return apb1_MHz() * (divider(10) > 1 ? 2 : 1);
}

static uint64_t tick_ns(uint32_t prescaler)
{
    return (uint64_t)1000 * (prescaler + 1) / timers_MHz();
}

static uint32_t counted(void)
{
    if ((*cell(&TIM2->CR1) & TIM_CR1_CEN) == 0 || world.still)
        return clock2.stopped_at;
    clock2.stopped_at = (uint32_t)((now_ns - clock2.since_ns) / tick_ns(clock2.prescaler));
    return clock2.stopped_at;
}

/* A peripheral without its clock takes nothing. */
static void check_clock(const reg *place)
{
    static const struct {
        uintptr_t begin;
        const reg *switches;
        unsigned bit;
    } PARTS[] = {
        {0x40000000, &RCC->APB1ENR, 0},  {0x40000400, &RCC->APB1ENR, 1},  {0x40004400, &RCC->APB1ENR, 17},
        {0x40005400, &RCC->APB1ENR, 21}, {0x40007000, &RCC->APB1ENR, 28}, {0x40010000, &RCC->APB2ENR, 0},
        {0x40020000, &RCC->AHB1ENR, 0},  {0x40020400, &RCC->AHB1ENR, 1},  {0x40020800, &RCC->AHB1ENR, 2},
    };
    for (size_t i = 0; i < sizeof PARTS / sizeof PARTS[0]; i++)
        if (((uintptr_t)place & ~(uintptr_t)0x3FF) == PARTS[i].begin)
            rule((*cell(PARTS[i].switches) & BIT(PARTS[i].bit)) != 0, "a part is used when its clock is on");
}

static uint32_t read_rcc(void)
{
    uint32_t set = *cell(&RCC->CR);
    bool outside = (set & HSEON) != 0 && !world.no_outside_clock && now_ns >= rises.hse_ns;
    bool locked = (set & PLLON) != 0 && !world.no_pll && now_ns >= rises.pll_ns;
    return set | (outside ? HSERDY : 0) | (locked ? PLLRDY : 0);
}

static void write_rcc(uint32_t value)
{
    uint32_t before = read_rcc();
    uint32_t changed = (before ^ value) & ~(uint32_t)(HSERDY | PLLRDY);
    bool from_outside = (*cell(&RCC->PLLCFGR) & BIT(22)) != 0;
    rule((changed & HSEBYP) == 0 || ((before | value) & HSEON) == 0, "HSEBYP is written while HSE is off");
    rule((changed & PLLON) == 0 || !from_outside || (before & HSERDY) != 0, "the PLL's source is there before it");
    if ((changed & value & HSEON) != 0)
        rises.hse_ns = now_ns + HSE_STARTS_NS;
    if ((changed & value & PLLON) != 0)
        rises.pll_ns = now_ns + PLL_LOCKS_NS;
    *cell(&RCC->CR) = value & ~(uint32_t)(HSERDY | PLLRDY);
}

/* The switch to the PLL: what must have been done by then for its frequency. */
static void write_configuration(uint32_t value)
{
    uint32_t MHz = pll_MHz();
    *cell(&RCC->CFGR) = value & ~(uint32_t)(3 << 2);
    if ((value & 3) != 2)
        return;
    rule((read_rcc() & PLLRDY) != 0, "the PLL is locked before the switch to it");
    rule((*cell(FLASH_ACR) & LATENCY) >= (MHz - 1) / 30, "the flash has its wait states before the switch");
    rule((*cell(&PWR->CR) & VOS) == VOS && MHz <= 168, "above 144 MHz scale 1, above 168 MHz over-drive");
    rule(MHz / divider(10) <= 45 && MHz / divider(13) <= 90, "APB1 is at most 45 MHz, APB2 90 MHz");
    if ((read_rcc() & PLLRDY) != 0)
        *cell(&RCC->CFGR) |= SWS_PLL;
}

static void write_pll(uint32_t value)
{
    uint32_t source = ((value & BIT(22)) != 0 ? 8000 : 16000) / (value & 0x3F);
    rule((read_rcc() & PLLON) == 0, "PLLCFGR is written while the PLL is off");
    rule(source >= 1000 && source <= 2000, "the PLL's input is 1 to 2 MHz");
    *cell(&RCC->PLLCFGR) = value;
}

static bool driven(const struct gpio *port, unsigned pin, uint32_t function)
{
    return (*cell(&port->MODER) >> (2 * pin) & 3) == 2
        && (*cell(pin < 8 ? &port->AFRL : &port->AFRH) >> (4 * (pin % 8)) & 0xF) == function;
}

static void close_gate(void)
{
    if (gate.on)
        tell("coil off");
    gate.on = false;
    gate.on_ns = gate.off_ns = UINT64_MAX;
    *cell(&TIM3->CR1) &= ~(uint32_t)TIM_CR1_CEN;
}

/* PWM mode 2 in one pulse: off below CCR1, on to ARR, then over. */
static void run_pulse(void)
{
    uint64_t one_ns = tick_ns(clock3.prescaler);
    if ((*cell(&TIM3->CCMR1) & 0x70) != GATE || (*cell(&TIM3->CCER) & 1) == 0 || !driven(GPIOA, 6, 2))
        return;
    gate.on_ns = now_ns + *cell(&TIM3->CCR1) * one_ns;
    gate.off_ns = now_ns + (*cell(&TIM3->ARR) + 1) * one_ns;
}

static void open_gate(void)
{
    uint32_t whole = *cell(&TIM1->ARR) + 1;
    gate.on = true;
    gate.on_ns = UINT64_MAX;
    tell("coil on %u mV of PWM", driven(GPIOA, 8, 1) ? 24000 * *cell(&TIM1->CCR1) / whole : 0);
}

static void feed(void)
{
    uint64_t ticks = (uint64_t)4 << *cell(&IWDG->PR);
    if (watchdog.fed_ns > 0 && now_ns - watchdog.fed_ns > watchdog.longest_ns)
        watchdog.longest_ns = now_ns - watchdog.fed_ns;
    watchdog.fed_ns = now_ns;
    watchdog.due_ns = now_ns + *cell(&IWDG->RLR) * ticks * 1000000 / world.watchdog_kHz;
}

static void write_key(uint32_t value)
{
    watchdog.open = value == OPEN;
    if (value == WATCHDOG_START) {
        *cell(&IWDG->RLR) = 0xFFF;
        watchdog.started_ns = now_ns;
    }
    if (value == WATCHDOG_START || value == FEED)
        feed();
}

static void write_timer(const reg *place, uint32_t value)
{
    if (place == &TIM2->EGR)
        clock2.prescaler = *cell(&TIM2->PSC);
    else if (place == &TIM3->EGR)
        clock3.prescaler = *cell(&TIM3->PSC);
    else if (place == &TIM2->CR1)
        clock2.since_ns = now_ns;
    else if (place == &TIM3->CR1 && (value & TIM_CR1_CEN) != 0)
        run_pulse();
    else if (place == &TIM3->CCMR1 && (value & 0x70) != GATE)
        close_gate();
}

/* The receiver: a byte that nobody has read when the next is there is an overrun. */
static void receive(void)
{
    serial.overrun = serial.overrun || serial.full;
    serial.byte = host_next();
    serial.full = true;
}

static void transmit(char byte)
{
    rule(now_ns >= serial.sent_ns, "a byte is written when TXE is set");
    serial.sent_ns = now_ns + BYTE_NS;
    if (byte == '\n')
        tell("says %.*s", (int)serial.length, serial.line);
    else if (serial.length < sizeof serial.line)
        serial.line[serial.length++] = byte;
    if (byte == '\n')
        serial.length = 0;
}

static bool interrupted(void)
{
    bool asked = (*cell(&USART2->CR1) & USART_CR1_RXNEIE) != 0;
    return asked && serial.full && (*cell(&NVIC_ISER[USART_LINE / 32]) & BIT(USART_LINE % 32)) != 0;
}

static void interrupt(void)
{
    if (!interrupted() || processor.held || processor.inside)
        return;
    processor.inside = true;
    usart2_handler();
    processor.inside = false;
}

static uint64_t sooner(uint64_t one, uint64_t other)
{
    return one < other ? one : other;
}

static uint64_t due_ns(void)
{
    uint64_t own = sooner(sooner(gate.on_ns, gate.off_ns), watchdog.due_ns);
    return sooner(own, sooner(script_due_ns(), host_due_ns()));
}

static void happen(void)
{
    if (now_ns >= watchdog.due_ns)
        finish("reset by the watchdog");
    else if (now_ns >= gate.on_ns)
        open_gate();
    else if (now_ns >= gate.off_ns)
        close_gate();
    else if (now_ns >= host_due_ns())
        receive();
    else
        script_happen();
}

void pass(uint64_t length_ns)
{
    uint64_t until_ns = now_ns + length_ns;
    while (due_ns() <= until_ns) {
        if (due_ns() > now_ns)
            now_ns = due_ns();
        happen();
        interrupt();
    }
    if (now_ns < until_ns)
        now_ns = until_ns;
}

static uint32_t port_status(void)
{
    uint32_t room = now_ns >= serial.sent_ns ? USART_SR_TXE : 0;
    return room | (serial.full ? USART_SR_RXNE : 0) | (serial.overrun ? BIT(3) : 0);
}

static uint32_t taken(void)
{
    serial.full = serial.overrun = false;
    return serial.byte;
}

uint32_t reg_read(const reg *place)
{
    pass(world.access_ns);
    interrupt();
    check_clock(place);
    if (bus_has(place))
        return bus_read(place);
    if (place == &RCC->CR)
        return read_rcc();
    if (place == &PWR->CSR)
        return (read_rcc() & PLLRDY) != 0 ? VOSRDY : 0;
    if (place == &TIM2->CNT)
        return counted();
    if (place == &USART2->SR)
        return port_status();
    if (place == &USART2->DR)
        return taken();
    if (place == &GPIOB->IDR)
        return bus_lines();
    if (place == &GPIOC->IDR)
        return world.coil_fault ? 0 : BIT(7);
    if (place == &IWDG->SR)
        return now_ns < watchdog.started_ns + PRESCALER_NS ? 3 : 0;
    return *cell(place);
}

/* The registers that mean more than their contents; the rest are kept before this. */
static void take_effect(reg *place, uint32_t value)
{
    if (place == &IWDG->KR)
        write_key(value);
    else if (place == &IWDG->PR || place == &IWDG->RLR)
        rule(watchdog.open, "the watchdog is unlocked before it is set");
    else if (place == &USART2->DR)
        transmit((char)value);
    else if (place == &GPIOB->BSRR)
        *cell(&GPIOB->ODR) = (*cell(&GPIOB->ODR) & ~(value >> 16)) | (value & 0xFFFF);
    else if (place == AIRCR && value == 0x05FA0004)
        finish("reset by itself");
    else
        write_timer(place, value);
    if (place == &GPIOB->BSRR || place == &GPIOB->MODER)
        bus_port_changed();
}

static void check_order(const reg *place, uint32_t value)
{
    bool on = (read_rcc() & PLLON) != 0;
    rule(place != &PWR->CR || !on || ((value ^ *cell(place)) & VOS) == 0, "VOS is written while the PLL is off");
    if (place == &USART2->BRR)
        rule(apb1_MHz() * 1000000 / value / 10000 == 46, "the baud rate is 460,800");
}

void reg_write(reg *place, uint32_t value)
{
    pass(world.access_ns);
    interrupt();
    check_clock(place);
    check_order(place, value);
    if (bus_has(place)) {
        bus_write(place, value);
    } else if (place == &RCC->CR) {
        write_rcc(value);
    } else if (place == &RCC->CFGR) {
        write_configuration(value);
    } else if (place == &RCC->PLLCFGR) {
        write_pll(value);
    } else {
        *cell(place) = value;
        take_effect(place, value);
    }
}

void cpu_hold(void)
{
    processor.held = true;
}

void cpu_release(void)
{
    processor.held = false;
    interrupt();
}

/* Until a byte comes, or SysTick. */
void cpu_sleep(void)
{
    bool ticks = (*cell(&SYSTICK->CTRL) & SYSTICK_TICKINT) != 0;
    uint64_t woken_ns = ticks ? now_ns / TICK_NS * TICK_NS + TICK_NS : UINT64_MAX;
    while (!interrupted() && now_ns < woken_ns)
        pass(sooner(due_ns(), woken_ns) - now_ns);
}
