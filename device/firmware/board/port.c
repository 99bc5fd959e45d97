#include "port.h"

#include <stdatomic.h>

#include "board.h"
#include "clock.h"
#include "startup.h"

enum { IN_SIZE = 1024, OUT_SIZE = 2048 }; /* powers of two: places run round with the counters */

/* Shared with the interrupt, which alone changes `written`, as the main loop alone changes `read`. Each stores its own
 * after it is done with a place and loads the other's before it begins with one, in release and acquire order: so a
 * place is never both's, and neither bytes nor stamps need be volatile or atomic (C11, 5.1.2.4).
 */
static struct {
    _Atomic uint32_t written, read;
    bool lost; /* the interrupt's own */
    uint8_t bytes[IN_SIZE];
    uint32_t stamps[IN_SIZE];
} in;

/* The main loop's own. */
static struct {
    uint32_t written, read;
    char bytes[OUT_SIZE];
} out;

void port_start(void)
{
    reg_write(&BOARD.usart->BRR, BOARD.usart_divider);
    reg_write(&BOARD.usart->CR1, USART_CR1_UE | USART_CR1_TE | USART_CR1_RE | USART_CR1_RXNEIE);
    reg_write(&NVIC_ISER[BOARD.usart_line / 32], BIT(BOARD.usart_line % 32));
}

/* A byte that came broken, or after others that had no room, becomes a 0, which spoils its line. */
static void receive(void)
{
    bool broken = (reg_read(&BOARD.usart->SR) & USART_SR_ERRORS) != 0;
    uint8_t byte = (uint8_t)reg_read(&BOARD.usart->DR);
    uint32_t written = atomic_load_explicit(&in.written, memory_order_relaxed);
    if (written - atomic_load_explicit(&in.read, memory_order_acquire) == IN_SIZE) {
        in.lost = true;
        return;
    }
    in.bytes[written % IN_SIZE] = broken || in.lost ? 0 : byte;
    in.stamps[written % IN_SIZE] = clock_stamp();
    in.lost = false;
    atomic_store_explicit(&in.written, written + 1, memory_order_release);
}

void usart1_handler(void)
{
    receive();
}

void usart2_handler(void)
{
    receive();
}

bool port_waits(void)
{
    uint32_t read = atomic_load_explicit(&in.read, memory_order_relaxed);
    return atomic_load_explicit(&in.written, memory_order_acquire) != read;
}

bool port_read(struct received *received)
{
    uint32_t read = atomic_load_explicit(&in.read, memory_order_relaxed);
    received->count = 0;
    while (port_waits() && received->count < sizeof received->bytes) {
        uint8_t byte = in.bytes[read % IN_SIZE];
        received->stamp = in.stamps[read % IN_SIZE];
        received->bytes[received->count++] = byte;
        atomic_store_explicit(&in.read, ++read, memory_order_release);
        if (byte == '\n')
            break;
    }
    return received->count > 0;
}

void port_write(struct slice line)
{
    if (line.length > OUT_SIZE - (out.written - out.read))
        return;
    for (size_t i = 0; i < line.length; i++)
        out.bytes[out.written++ % OUT_SIZE] = line.bytes[i];
}

bool port_pump(void)
{
    while (out.written != out.read && (reg_read(&BOARD.usart->SR) & USART_SR_TXE) != 0)
        reg_write(&BOARD.usart->DR, (uint8_t)out.bytes[out.read++ % OUT_SIZE]);
    return out.written != out.read;
}
