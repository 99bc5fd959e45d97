/* From reset to main: the stack, the vector table, memory. Also what a compiler may call and a library would hold. */
#include <stddef.h>
#include <stdint.h>

#include "startup.h"

extern uint32_t data_source[], data_begin[], data_end[], bss_begin[], bss_end[], stack_top[];

/* GCC calls these two of its own accord; keep it from making them call themselves. */
#define NO_LOOP_CALLS __attribute__((optimize("no-tree-loop-distribute-patterns"), used))
void *memset(void *to, int byte, size_t count);
void *memcpy(void *restrict to, const void *restrict from, size_t count);

NO_LOOP_CALLS void *memset(void *to, int byte, size_t count)
{
    for (size_t i = 0; i < count; i++)
        ((uint8_t *)to)[i] = (uint8_t)byte;
    return to;
}

NO_LOOP_CALLS void *memcpy(void *restrict to, const void *restrict from, size_t count)
{
    for (size_t i = 0; i < count; i++)
        ((uint8_t *)to)[i] = ((const uint8_t *)from)[i];
    return to;
}

_Noreturn void reset_handler(void)
{
    for (size_t i = 0; &data_begin[i] < data_end; i++)
        data_begin[i] = data_source[i];
    for (size_t i = 0; &bss_begin[i] < bss_end; i++)
        bss_begin[i] = 0;
    main();
    for (;;) {
    }
}

/* Image without an operating board: nothing can be switched off, so only stop. */
__attribute__((weak)) void panic_handler(void)
{
    for (;;) {
    }
}

__attribute__((weak)) void tick_handler(void)
{
}

__attribute__((weak)) void usart1_handler(void)
{
    panic_handler();
}

__attribute__((weak)) void usart2_handler(void)
{
    panic_handler();
}

/* Places in the table, the stack not counted: SysTick is exception 15, interrupt n is exception 16 + n. */
enum { SYSTICK = 14, USART1 = 15 + 37, USART2 = 15 + 38, PLACES = 15 + 97 };

/* RM0390, "Vector table for STM32F446xx"; the two lines used are the same on the STM32F405 (RM0090). */
__attribute__((section(".vectors"), used)) static const struct {
    uint32_t *stack;
    void (*handlers[PLACES])(void);
} VECTORS = {
    stack_top,
    {
        [0] = reset_handler,
        [1 ... SYSTICK - 1] = panic_handler,
        [SYSTICK] = tick_handler,
        [SYSTICK + 1 ... USART1 - 1] = panic_handler,
        [USART1] = usart1_handler,
        [USART2] = usart2_handler,
        [USART2 + 1 ... PLACES - 1] = panic_handler,
    },
};
