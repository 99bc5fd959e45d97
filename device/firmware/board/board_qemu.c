/* The emulated board: QEMU's netduinoplus2, an STM32F405 with USARTs and timers but no pins, no I2C, no watchdog.
 *
 * USART1 is the host's port. In place of a coil USART2 writes a record: every call of the core in the language of
 * tests/twin_scripts.py, and every drive with the times it was carried out and written down. A byte on USART3 is a
 * driver's fault or, from 128 on, makes the board late: by so many milliseconds as it is more.
 *
 * RECOIL_SPEED, a divisor of 1000, is how many times faster than the world this gun lives: for tests in a hurry.
 */
#include "board.h"
#include "clock.h"

#ifndef RECOIL_SPEED
#define RECOIL_SPEED 1
#endif

enum { LATE_BYTES = 128 };
static uint64_t late_us;

const struct board BOARD = {
    .usart = USART1,
    .usart_line = 37,
    .usart_divider = 182, /* 84 MHz; the emulator does not look at it */
    .timer_MHz = 1000 / RECOIL_SPEED, /* QEMU feeds its timers with 1 GHz, whatever the clock tree says */
    .processor_MHz = 168 / RECOIL_SPEED,
};

void board_start(void)
{
    reg_write(&USART2->CR1, USART_CR1_UE | USART_CR1_TE);
    reg_write(&USART3->CR1, USART_CR1_UE | USART_CR1_RE);
}

void board_connect(void)
{
}

const char *board_serial(void)
{
    return "QEMU-1";
}

static void put(const struct text *text)
{
    for (size_t i = 0; i < text->length; i++) {
        while ((reg_read(&USART2->SR) & USART_SR_TXE) == 0) {
        }
        reg_write(&USART2->DR, (uint8_t)text->bytes[i]);
    }
}

static struct text begun(const char *word, uint64_t time_us)
{
    struct text text = {0};
    text_add(&text, word);
    text_char(&text, ' ');
    text_number(&text, time_us);
    text_char(&text, ' ');
    return text;
}

static void ended(struct text *text)
{
    text_char(text, '\n');
    put(text);
}

/* The emulator's own lateness is none of the gun's: only what was ordered counts. */
struct carried board_drive(const struct drive *drive)
{
    static const char *const KINDS[] = {[DRIVE_PULS] = "PULS ", [DRIVE_EFF] = "EFF ", [DRIVE_OFF] = "OFF "};
    struct carried carried = {ERROR_NONE, drive->time_us + late_us};
    if (drive_is_over(drive, carried.at_us))
        return (struct carried){ERROR_TOO_LATE, carried.at_us};
    struct text text = begun("drive", carried.at_us);
    text_add(&text, KINDS[drive->kind]);
    text_number(&text, drive->amount);
    text_char(&text, ' ');
    text_number(&text, clock_us());
    ended(&text);
    return carried;
}

static void be_late(uint64_t time_us)
{
    struct text text = begun("late", clock_us());
    late_us = time_us;
    text_number(&text, late_us);
    ended(&text);
}

uint64_t board_fault(void)
{
    if ((reg_read(&USART3->SR) & USART_SR_RXNE) == 0)
        return FAULT_NONE;
    uint32_t byte = reg_read(&USART3->DR) & 0xFF;
    if (byte < LATE_BYTES)
        return byte;
    be_late(1000 * (byte - LATE_BYTES));
    return FAULT_NONE;
}

void board_alive(uint64_t now_us)
{
    (void)now_us;
}

void board_booted(uint64_t now_us)
{
    struct text text = begun("reset", now_us);
    ended(&text);
}

static void put_line(const uint8_t *bytes, size_t length, uint64_t now_us)
{
    struct text text = begun("in", now_us);
    for (size_t i = 0; i < length; i++)
        text_hex(&text, bytes[i], 2);
    ended(&text);
}

/* Kept until its line is complete: the bytes of a line mean nothing before. */
void board_heard(const uint8_t *bytes, size_t count, uint64_t now_us)
{
    static uint8_t begun_line[64];
    static size_t length;
    for (size_t i = 0; i < count; i++) {
        begun_line[length++] = bytes[i];
        if (bytes[i] != '\n' && length < sizeof begun_line)
            continue;
        put_line(begun_line, length, now_us);
        length = 0;
    }
}

void board_failed(uint64_t fault, uint64_t now_us)
{
    struct text text = begun("fault", now_us);
    text_number(&text, fault);
    ended(&text);
}
