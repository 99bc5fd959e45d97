/* RM0390, "Advanced-control timers" and "General-purpose timers": PWM mode 1, one-pulse mode, forced output. */
#include "coil.h"

#include "board.h"

enum { SUPPLY_MV = 24000, PWM_TICKS = 8400, LONGEST_US = 20000 };  /* 168 MHz / 8400: 20 kHz */
enum { COMMAND = 6 << 4, GATE_OFF = 4 << 4, GATE_PULSE = 7 << 4 }; /* OC1M: PWM mode 1, forced low, PWM mode 2 */

void coil_off(void)
{
    reg_write(&TIM3->CCMR1, GATE_OFF);
    reg_write(&TIM3->CR1, 0);
    reg_write(&TIM1->CCR1, 0);
}

/* The command runs all the time, at 0; the enable is a one-pulse timer's. */
void coil_start(void)
{
    reg_write(&TIM1->ARR, PWM_TICKS - 1);
    reg_write(&TIM1->CCR1, 0);
    reg_write(&TIM1->CCMR1, COMMAND);
    reg_write(&TIM1->CCER, BIT(0));
    reg_write(&TIM1->BDTR, BIT(15));
    reg_write(&TIM1->CR1, TIM_CR1_CEN);
    reg_write(&TIM3->CCMR1, GATE_OFF);
    reg_write(&TIM3->PSC, BOARD.timer_MHz - 1);
    reg_write(&TIM3->CR1, TIM_CR1_URS);
    reg_write(&TIM3->EGR, TIM_EGR_UG);
    reg_write(&TIM3->CCR1, 1);
    reg_write(&TIM3->CCER, BIT(0));
}

void coil_on(uint32_t millivolts, uint32_t length_us)
{
    if (length_us == 0 || length_us > LONGEST_US || millivolts > SUPPLY_MV)
        return;
    reg_write(&TIM1->CCR1, millivolts * (PWM_TICKS / 1200) / (SUPPLY_MV / 1200));
    reg_write(&TIM3->CNT, 0);
    reg_write(&TIM3->ARR, length_us);
    reg_write(&TIM3->CCMR1, GATE_PULSE); /* off at 0, on from 1 to the end, then stopped at 0 again */
    reg_write(&TIM3->CR1, TIM_CR1_OPM | TIM_CR1_URS | TIM_CR1_CEN);
}
