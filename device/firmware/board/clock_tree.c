/* RM0390: "Power controller (PWR)", "Embedded flash memory interface", "Reset and clock control (RCC)", in their order.
 *
 * The over-drive is for more than 168 MHz and stays off. All registers are as a reset leaves them: HSI, PLL off.
 */
#include "clock_tree.h"

#include "registers.h"

enum { HSEON = BIT(16), HSERDY = BIT(17), HSEBYP = BIT(18), PLLON = BIT(24), PLLRDY = BIT(25), PWREN = BIT(28) };
enum { FROM_HSE = BIT(22), M_HSE = 4, M_HSI = 8, N = 168 << 6, P_2 = 0 << 16, Q = 7 << 24, R = 2 << 28 };
enum { VOS_SCALE_1 = 3 << 14, VOSRDY = BIT(14) };
enum { LATENCY = 0xF, WAIT_STATES = 5, PREFETCH_AND_CACHES = BIT(8) | BIT(9) | BIT(10) };
enum { APB1_BY_4 = 5 << 10, APB2_BY_2 = 4 << 13, SW_PLL = 2, SWS = 3 << 2, SWS_PLL = 2 << 2 };

/* The ST-LINK's 8 MHz. The bypass may be written only while the oscillator is off, so in a write of its own. */
static bool outside_comes(void)
{
    reg_set(&RCC->CR, HSEBYP);
    reg_set(&RCC->CR, HSEON);
    if (wait_for(&RCC->CR, HSERDY, HSERDY))
        return true;
    reg_clear(&RCC->CR, HSEON);
    return false;
}

/* The scale may be written only while the PLL is off; it takes effect with the PLL. */
static void raise_voltage(void)
{
    reg_set(&RCC->APB1ENR, PWREN);
    (void)reg_read(&RCC->APB1ENR); /* a clock is there two cycles after it is switched on */
    reg_set(&PWR->CR, VOS_SCALE_1);
}

/* 2 MHz, 336 MHz, halved: from outside or, if that does not come, from the chip's own 16 MHz, 1 % true. */
static void start_pll(void)
{
    uint32_t source = outside_comes() ? M_HSE | FROM_HSE : M_HSI;
    reg_write(&RCC->PLLCFGR, source | N | P_2 | Q | R);
    reg_set(&RCC->CR, PLLON);
}

bool clock_tree_start(void)
{
    raise_voltage();
    start_pll();
    reg_write(FLASH_ACR, WAIT_STATES | PREFETCH_AND_CACHES);
    reg_write(&RCC->CFGR, APB1_BY_4 | APB2_BY_2);
    if (!wait_for(FLASH_ACR, LATENCY, WAIT_STATES) || !wait_for(&RCC->CR, PLLRDY, PLLRDY)
        || !wait_for(&PWR->CSR, VOSRDY, VOSRDY))
        return false;
    reg_set(&RCC->CFGR, SW_PLL);
    return wait_for(&RCC->CFGR, SWS, SWS_PLL);
}
