/* The serial port with its interrupt in a thread of its own: less than that no interrupt can be in order.
 *
 * Under the thread sanitizer, which exits with an error of its own where two threads are at one place without order.
 * Prints how many bytes came through; exits with 1 where one is not what was received at its stamp.
 */
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>

#include "board.h"
#include "port.h"
#include "startup.h"

#undef main

enum { BYTES = 300000 };

const struct board BOARD = {
    .usart = USART2, .usart_line = 38, .usart_divider = 91, .timer_MHz = 84, .processor_MHz = 168,
};

static uint32_t received; /* the interrupt's own; also its time */
static atomic_bool over;

/* Never 0, which stands for a byte that was lost, and never the end of a line. */
static uint8_t byte_at(uint32_t stamp)
{
    return (uint8_t)(stamp * 7 % 100 + 100);
}

uint32_t reg_read(const reg *place)
{
    if (place == &USART2->DR)
        return byte_at(++received);
    return place == &TIM2->CNT ? received : 0;
}

void reg_write(reg *place, uint32_t value)
{
    (void)place, (void)value;
}

static void *interrupts(void *nothing)
{
    for (unsigned i = 0; i < BYTES; i++)
        usart2_handler();
    atomic_store(&over, true);
    return nothing;
}

/* Bytes came one after the other; before one that stands for lost ones there is a gap. */
static unsigned right_bytes(const struct received *read)
{
    for (size_t i = read->count; i-- > 0;) {
        uint8_t byte = read->bytes[i];
        if (byte == 0)
            return (unsigned)(read->count - i - 1);
        if (byte != byte_at(read->stamp - (uint32_t)(read->count - 1 - i)))
            exit(1);
    }
    return (unsigned)read->count;
}

int main(void)
{
    pthread_t thread;
    struct received read;
    unsigned right = 0;
    port_start();
    if (pthread_create(&thread, NULL, interrupts, NULL) != 0)
        return 2;
    for (bool last = false; !last;) {
        last = atomic_load(&over);
        while (port_read(&read))
            right += right_bytes(&read);
    }
    pthread_join(thread, NULL);
    printf("%u of %u\n", right, BYTES);
    return 0;
}
