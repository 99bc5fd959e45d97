/* A NUCLEO-F446RE as the gun's board: host's port on the ST-LINK's USB, coil driver, vibration driver.
 *
 * NEVER RUN on a board: none was at hand; tests run it on fake/. Pins are assumed (README.md), the paper names the
 * parts only. Registers after RM0390, chapters of the same names; alternate functions after the STM32F446xC/E data
 * sheet (DS10693).
 */
#include "board.h"
#include "clock.h"
#include "clock_tree.h"
#include "coil.h"
#include "startup.h"
#include "vibration.h"

const struct board BOARD = {
    .usart = USART2,
    .usart_line = 38,
    .usart_divider = 91, /* 42 MHz / 460800 = 91.1: 0.2 % off */
    .timer_MHz = 84,
    .processor_MHz = 168,
};

enum { PIN_IN = 0, PIN_ALTERNATE = 2 };
enum { PULL_UP = 1 };
enum { IWDG_START = 0xCCCC, IWDG_OPEN = 0x5555, IWDG_FEED = 0xAAAA };
enum { IWDG_TICKS = 425 }; /* of LSI / 4: 36 to 100 ms for 47 to 17 kHz */

static void start_peripherals(void)
{
    reg_set(&RCC->AHB1ENR, BIT(0) | BIT(1) | BIT(2));            /* ports A, B, C */
    reg_set(&RCC->APB1ENR, BIT(0) | BIT(1) | BIT(17) | BIT(21)); /* TIM2, TIM3, USART2, I2C1 */
    reg_set(&RCC->APB2ENR, BIT(0));                              /* TIM1 */
    (void)reg_read(&RCC->APB2ENR);
}

static void set_field(reg *place, unsigned pin, unsigned width, uint32_t value)
{
    uint32_t shift = pin * width;
    reg_field(place, (BIT(width) - 1) << shift, value << shift);
}

static void alternate(struct gpio *port, unsigned pin, uint32_t function)
{
    set_field(pin < 8 ? &port->AFRL : &port->AFRH, pin % 8, 4, function);
    set_field(&port->MODER, pin, 2, PIN_ALTERNATE);
}

static void start_pins(void)
{
    alternate(GPIOA, 2, 7); /* USART2 TX and RX */
    alternate(GPIOA, 3, 7);
    alternate(GPIOA, 8, 1); /* TIM1_CH1: the coil driver's command, a duty of the supply */
    alternate(GPIOA, 6, 2); /* TIM3_CH1: its enable */
    set_field(&GPIOC->MODER, 7, 2, PIN_IN); /* the coil driver's fault, low; not wired reads as none */
    set_field(&GPIOC->PUPDR, 7, 2, PULL_UP);
}

static void start_watchdog(void)
{
    reg_write(&IWDG->KR, IWDG_START);
    reg_write(&IWDG->KR, IWDG_OPEN);
    reg_write(&IWDG->PR, 0);
    reg_write(&IWDG->RLR, IWDG_TICKS);
    wait_for(&IWDG->SR, 3, 0);
    reg_write(&IWDG->KR, IWDG_FEED);
}

/* Without its clocks every pulse would have a wrong length: rather none. */
void board_start(void)
{
    start_peripherals();
    if (!clock_tree_start())
        panic_handler();
    coil_start();
    start_pins();
    start_watchdog();
}

void board_connect(void)
{
    vibration_start();
}

/* The chip's unique identity as 24 hexadecimal digits. */
const char *board_serial(void)
{
    static struct text text;
    for (unsigned i = 0; i < 3; i++)
        text_hex(&text, reg_read(&UNIQUE_ID[i]), 8);
    return text.bytes;
}

static struct carried pulse(const struct drive *drive)
{
    uint64_t now_us = clock_us();
    if (drive_is_over(drive, now_us))
        return (struct carried){ERROR_TOO_LATE, now_us};
    coil_on((uint32_t)drive->amount, drive->end_us > now_us ? (uint32_t)(drive->end_us - now_us) : 0);
    return (struct carried){ERROR_NONE, now_us};
}

static struct carried effect(const struct drive *drive)
{
    if (drive_is_over(drive, clock_us()))
        return (struct carried){ERROR_TOO_LATE, clock_us()};
    bool begun = vibration_on((uint8_t)drive->amount);
    return (struct carried){begun ? ERROR_NONE : ERROR_FAULT, clock_us()};
}

static struct carried all_off(bool vibrating)
{
    coil_off();
    bool off = !vibrating || vibration_off();
    return (struct carried){off ? ERROR_NONE : ERROR_FAULT, clock_us()};
}

struct carried board_drive(const struct drive *drive)
{
    static bool vibrating;
    bool vibrated = vibrating;
    vibrating = drive->kind == DRIVE_EFF;
    if (drive->kind == DRIVE_OFF)
        return all_off(vibrated);
    return drive->kind == DRIVE_PULS ? pulse(drive) : effect(drive);
}

uint64_t board_fault(void)
{
    if ((reg_read(&GPIOC->IDR) & BIT(7)) == 0)
        return FAULT_COIL_DRIVER;
    return vibration_failed() ? FAULT_VIBRATION_DRIVER : FAULT_NONE;
}

void board_alive(uint64_t now_us)
{
    static uint64_t fed_us;
    if (now_us > fed_us)
        reg_write(&IWDG->KR, IWDG_FEED);
    fed_us = now_us;
}

/* The processor has gone wrong: off, and boot anew, disarmed. */
void panic_handler(void)
{
    coil_off();
    reg_write(AIRCR, 0x05FA0004);
    for (;;) {
    }
}

/* This board keeps no record. */
void board_booted(uint64_t now_us)
{
    (void)now_us;
}

void board_heard(const uint8_t *bytes, size_t count, uint64_t now_us)
{
    (void)bytes, (void)count, (void)now_us;
}

void board_failed(uint64_t fault, uint64_t now_us)
{
    (void)fault, (void)now_us;
}
