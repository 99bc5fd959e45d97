#include "clock.h"

#include "board.h"

/* TIM2 runs free at 1 MHz; SysTick wakes the main loop each millisecond. */
void clock_start(void)
{
    reg_write(&TIM2->PSC, BOARD.timer_MHz - 1);
    reg_write(&TIM2->ARR, UINT32_MAX);
    reg_write(&TIM2->EGR, TIM_EGR_UG);
    reg_write(&TIM2->CNT, 0);
    reg_write(&TIM2->CR1, TIM_CR1_CEN);
    reg_write(&SYSTICK->LOAD, BOARD.processor_MHz * 1000 - 1);
    reg_write(&SYSTICK->VAL, 0);
    reg_write(&SYSTICK->CTRL, SYSTICK_ENABLE | SYSTICK_TICKINT | SYSTICK_CLKSOURCE);
}

uint32_t clock_stamp(void)
{
    return reg_read(&TIM2->CNT);
}

uint64_t clock_us(void)
{
    static uint32_t last, turns;
    uint32_t stamp = clock_stamp();
    if (stamp < last)
        turns++;
    last = stamp;
    return (uint64_t)turns << 32 | stamp;
}

uint64_t clock_of(uint32_t stamp)
{
    uint64_t now_us = clock_us();
    return now_us - ((uint32_t)now_us - stamp);
}
