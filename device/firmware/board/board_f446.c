/* A NUCLEO-F446RE as the gun's board: host's port on the ST-LINK's USB, coil driver, vibration driver.
 *
 * NEVER RUN: no board was at hand. Pins are assumed (README.md); the paper names the parts only. Registers after
 * RM0390, chapters of the same names; alternate functions after the STM32F446xC/E data sheet (DS10693).
 */
#include "board.h"
#include "clock.h"
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
enum { PULL_NONE = 0, PULL_UP = 1 };
enum { IWDG_START = 0xCCCC, IWDG_OPEN = 0x5555, IWDG_FEED = 0xAAAA };
enum { IWDG_TICKS = 425 }; /* of LSI / 4: 36 to 100 ms for 47 to 17 kHz */

/* 168 MHz from the ST-LINK's 8 MHz, or, if that does not come, from the chip's own, 1 % true: VCO 336 MHz, halved. */
static void start_clocks(void)
{
    enum { HSEON = BIT(16), HSERDY = BIT(17), HSEBYP = BIT(18), PLLON = BIT(24), PLLRDY = BIT(25) };
    RCC->CR |= HSEON | HSEBYP;
    bool outside = wait_for(&RCC->CR, HSERDY, HSERDY);
    RCC->PLLCFGR = (outside ? 4u | BIT(22) : 8u) | 168u << 6 | 7u << 24 | 2u << 28;
    RCC->CR |= PLLON;
    FLASH_ACR = 5u | BIT(8) | BIT(9) | BIT(10); /* wait states; prefetch and both caches */
    RCC->CFGR = 5u << 10 | 4u << 13;            /* APB1 42 MHz, APB2 84 MHz; their timers twice that */
    wait_for(&RCC->CR, PLLRDY, PLLRDY);
    RCC->CFGR |= 2u;
    wait_for(&RCC->CFGR, 3u << 2, 2u << 2);
    RCC->AHB1ENR |= BIT(0) | BIT(1) | BIT(2);            /* ports A, B, C */
    RCC->APB1ENR |= BIT(0) | BIT(1) | BIT(17) | BIT(21); /* TIM2, TIM3, USART2, I2C1 */
    RCC->APB2ENR |= BIT(0);                              /* TIM1 */
    (void)RCC->APB2ENR;
}

static void set_field(reg *place, unsigned pin, unsigned width, uint32_t value)
{
    uint32_t shift = pin * width;
    *place = (*place & ~((BIT(width) - 1) << shift)) | value << shift;
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
    GPIOB->OTYPER |= BIT(8) | BIT(9);
    set_field(&GPIOB->PUPDR, 8, 2, PULL_UP);
    set_field(&GPIOB->PUPDR, 9, 2, PULL_UP);
    alternate(GPIOB, 8, 4); /* I2C1 SCL and SDA */
    alternate(GPIOB, 9, 4);
    set_field(&GPIOC->MODER, 7, 2, PIN_IN); /* the coil driver's fault, low; not wired reads as none */
    set_field(&GPIOC->PUPDR, 7, 2, PULL_UP);
}

static void start_watchdog(void)
{
    IWDG->KR = IWDG_START;
    IWDG->KR = IWDG_OPEN;
    IWDG->PR = 0;
    IWDG->RLR = IWDG_TICKS;
    wait_for(&IWDG->SR, 3, 0);
    IWDG->KR = IWDG_FEED;
}

void board_start(void)
{
    start_clocks();
    coil_start();
    start_pins();
    vibration_start();
    start_watchdog();
}

/* The chip's unique identity as 24 hexadecimal digits. */
const char *board_serial(void)
{
    static struct text text;
    for (unsigned i = 0; i < 3; i++)
        text_hex(&text, UNIQUE_ID[i], 8);
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
    if ((GPIOC->IDR & BIT(7)) == 0)
        return FAULT_COIL_DRIVER;
    return vibration_failed() ? FAULT_VIBRATION_DRIVER : FAULT_NONE;
}

void board_alive(void)
{
    IWDG->KR = IWDG_FEED;
}

/* The processor has gone wrong: off, and boot anew, disarmed. */
void panic_handler(void)
{
    coil_off();
    AIRCR = 0x05FA0004;
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
