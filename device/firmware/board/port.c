#include "port.h"

#include "board.h"
#include "clock.h"
#include "startup.h"

enum { IN_SIZE = 1024, OUT_SIZE = 2048 }; /* powers of two: places run round with the counters */

static struct {
    volatile uint32_t written, read;
    bool lost;
    uint8_t bytes[IN_SIZE];
    uint32_t stamps[IN_SIZE];
} in;

static struct {
    uint32_t written, read;
    char bytes[OUT_SIZE];
} out;

void port_start(void)
{
    BOARD.usart->BRR = BOARD.usart_divider;
    BOARD.usart->CR1 = USART_CR1_UE | USART_CR1_TE | USART_CR1_RE | USART_CR1_RXNEIE;
    NVIC_ISER[BOARD.usart_line / 32] = BIT(BOARD.usart_line % 32);
}

/* A byte that came broken, or after others that had no room, becomes a 0, which spoils its line. */
static void receive(void)
{
    bool broken = (BOARD.usart->SR & USART_SR_ERRORS) != 0;
    uint8_t byte = (uint8_t)BOARD.usart->DR;
    uint32_t place = in.written % IN_SIZE;
    if (in.written - in.read == IN_SIZE) {
        in.lost = true;
        return;
    }
    in.bytes[place] = broken || in.lost ? 0 : byte;
    in.stamps[place] = clock_stamp();
    in.lost = false;
    in.written++;
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
    return in.written != in.read;
}

bool port_read(struct received *received)
{
    received->count = 0;
    while (port_waits() && received->count < sizeof received->bytes) {
        uint8_t byte = in.bytes[in.read % IN_SIZE];
        received->stamp = in.stamps[in.read % IN_SIZE];
        received->bytes[received->count++] = byte;
        in.read++;
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
    while (out.written != out.read && (BOARD.usart->SR & USART_SR_TXE) != 0)
        BOARD.usart->DR = (uint8_t)out.bytes[out.read++ % OUT_SIZE];
    return out.written != out.read;
}
