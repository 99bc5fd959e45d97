/* The registers that are used, and no others; names, offsets and bits as in ST's reference manual RM0390 (STM32F446xx).
 *
 * Base addresses: RM0390, memory map, "STM32F446xx register boundary addresses"; the core's own (SysTick, NVIC, AIRCR):
 * ST's programming manual PM0214. USART, TIM2 and the core's are the same in the emulated STM32F405 (RM0090).
 */
#ifndef RECOIL_REGISTERS_H
#define RECOIL_REGISTERS_H

#include <stdbool.h>
#include <stdint.h>

typedef volatile uint32_t reg;

struct rcc {
    reg CR, PLLCFGR, CFGR, CIR, AHB1RSTR, AHB2RSTR, AHB3RSTR, unused_1c, APB1RSTR, APB2RSTR, unused_28, unused_2c;
    reg AHB1ENR, AHB2ENR, AHB3ENR, unused_3c, APB1ENR, APB2ENR;
};
struct pwr {
    reg CR, CSR;
};
struct gpio {
    reg MODER, OTYPER, OSPEEDR, PUPDR, IDR, ODR, BSRR, LCKR, AFRL, AFRH;
};
struct timer {
    reg CR1, CR2, SMCR, DIER, SR, EGR, CCMR1, CCMR2, CCER, CNT, PSC, ARR, RCR, CCR1, CCR2, CCR3, CCR4, BDTR;
};
struct usart {
    reg SR, DR, BRR, CR1, CR2, CR3, GTPR;
};
struct i2c {
    reg CR1, CR2, OAR1, OAR2, DR, SR1, SR2, CCR, TRISE, FLTR;
};
struct iwdg {
    reg KR, PR, RLR, SR;
};
struct systick {
    reg CTRL, LOAD, VAL;
};

#define RCC ((struct rcc *)0x40023800)
#define PWR ((struct pwr *)0x40007000)
#define FLASH_ACR ((reg *)0x40023C00)
#define GPIOA ((struct gpio *)0x40020000)
#define GPIOB ((struct gpio *)0x40020400)
#define GPIOC ((struct gpio *)0x40020800)
#define TIM1 ((struct timer *)0x40010000)
#define TIM2 ((struct timer *)0x40000000)
#define TIM3 ((struct timer *)0x40000400)
#define USART1 ((struct usart *)0x40011000)
#define USART2 ((struct usart *)0x40004400)
#define USART3 ((struct usart *)0x40004800)
#define I2C1 ((struct i2c *)0x40005400)
#define IWDG ((struct iwdg *)0x40003000)
#define UNIQUE_ID ((reg *)0x1FFF7A10)
#define SYSTICK ((struct systick *)0xE000E010)
#define NVIC_ISER ((reg *)0xE000E100)
#define AIRCR ((reg *)0xE000ED0C)

#define BIT(n) (1u << (n))

enum {
    USART_SR_ERRORS = 0xF, /* PE, FE, NF, ORE */
    USART_SR_RXNE = BIT(5),
    USART_SR_TXE = BIT(7),
    USART_CR1_RE = BIT(2),
    USART_CR1_TE = BIT(3),
    USART_CR1_RXNEIE = BIT(5),
    USART_CR1_UE = BIT(13),
    TIM_CR1_CEN = BIT(0),
    TIM_CR1_URS = BIT(2),
    TIM_CR1_OPM = BIT(3),
    TIM_EGR_UG = BIT(0),
    SYSTICK_ENABLE = BIT(0),
    SYSTICK_TICKINT = BIT(1),
    SYSTICK_CLKSOURCE = BIT(2),
};

/* The only two ways to a register: a load and a store on the chip, functions that see each access in fake/. */
#ifdef RECOIL_FAKE
uint32_t reg_read(const reg *place);
void reg_write(reg *place, uint32_t value);
#else
static inline uint32_t reg_read(const reg *place)
{
    return *place;
}

static inline void reg_write(reg *place, uint32_t value)
{
    *place = value;
}
#endif

static inline void reg_set(reg *place, uint32_t bits)
{
    reg_write(place, reg_read(place) | bits);
}

static inline void reg_clear(reg *place, uint32_t bits)
{
    reg_write(place, reg_read(place) & ~bits);
}

static inline void reg_field(reg *place, uint32_t mask, uint32_t value)
{
    reg_write(place, (reg_read(place) & ~mask) | value);
}

/* Looks at flags some milliseconds long. For the start alone, before the watchdog is fed by the main loop. */
static inline bool wait_for(const reg *flags, uint32_t mask, uint32_t wanted)
{
    for (unsigned looks = 0; looks < 20000; looks++)
        if ((reg_read(flags) & mask) == wanted)
            return true;
    return false;
}

#endif
