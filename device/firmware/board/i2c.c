/* RM0390, "Inter-integrated circuit (I2C) interface", master mode; NXP's UM10204, "Bus clear". Its times are TIM2's. */
#include "i2c.h"

#include "clock.h"
#include "registers.h"

enum { PE = BIT(0), START = BIT(8), STOP = BIT(9), SWRST = BIT(15) };
enum { SB = BIT(0), ADDR = BIT(1), BTF = BIT(2), TXE = BIT(7), BERR = BIT(8), ARLO = BIT(9), AF = BIT(10) };
enum { APB1_MHZ = 42, FAST = BIT(15), PERIODS_BY_3 = 35, RISE_TICKS = 13 }; /* 42 MHz / (3 * 35) = 400 kHz; 300 ns */
enum { SCL = BIT(8), SDA = BIT(9), RESET = 16, CLOCKS = 9, HALF_BIT_US = 5, LIMIT_US = 1000 };
enum { BOTH = 0xF << 16, OUTPUTS = 0x5 << 16, ALTERNATES = 0xA << 16, PULLED_UP = 0x5 << 16 }; /* two bits a pin */
enum { BOTH_FUNCTIONS = 0xFF, I2C1_FUNCTIONS = 0x44 };

static uint32_t begun; /* the transfer, on the clock */

static void pause(void)
{
    uint32_t from = clock_stamp();
    while (clock_stamp() - from <= HALF_BIT_US) {
    }
}

static void set_lines(uint32_t lines)
{
    reg_write(&GPIOB->BSRR, lines);
    pause();
}

/* A device left in the middle of a byte lets go within nine clocks; a stop ends what it takes for a transfer. */
static void clear_bus(void)
{
    reg_write(&GPIOB->BSRR, SCL | SDA);
    reg_set(&GPIOB->OTYPER, SCL | SDA);
    reg_field(&GPIOB->PUPDR, BOTH, PULLED_UP);
    reg_field(&GPIOB->MODER, BOTH, OUTPUTS);
    for (unsigned i = 0; i < CLOCKS && (reg_read(&GPIOB->IDR) & SDA) == 0; i++) {
        set_lines(SCL << RESET);
        set_lines(SCL);
    }
    set_lines(SCL << RESET);
    set_lines(SDA << RESET);
    set_lines(SCL);
    set_lines(SDA);
    reg_field(&GPIOB->AFRH, BOTH_FUNCTIONS, I2C1_FUNCTIONS);
    reg_field(&GPIOB->MODER, BOTH, ALTERNATES);
}

/* The reset takes all flags along, AF and a BUSY that is locked among them; it may end when the lines are free. */
void i2c_start(void)
{
    reg_write(&I2C1->CR1, SWRST);
    clear_bus();
    reg_write(&I2C1->CR1, 0);
    reg_write(&I2C1->CR2, APB1_MHZ);
    reg_write(&I2C1->CCR, FAST | PERIODS_BY_3);
    reg_write(&I2C1->TRISE, RISE_TICKS);
    reg_write(&I2C1->CR1, PE);
}

static bool in_time(void)
{
    return clock_stamp() - begun <= LIMIT_US;
}

/* Whether a flag comes before an error does, or the time is over. */
static bool came(uint32_t flag)
{
    while (in_time()) {
        uint32_t flags = reg_read(&I2C1->SR1);
        if ((flags & (BERR | ARLO | AF)) != 0)
            return false;
        if ((flags & flag) != 0)
            return true;
    }
    return false;
}

static bool sent(uint8_t byte, uint32_t flag)
{
    reg_write(&I2C1->DR, byte);
    return came(flag);
}

/* The next transfer may begin only when the stop is on the lines. */
static bool stopped(void)
{
    reg_set(&I2C1->CR1, STOP);
    while ((reg_read(&I2C1->CR1) & STOP) != 0)
        if (!in_time())
            return false;
    return true;
}

static bool transfer(uint8_t address, uint8_t place, uint8_t value)
{
    begun = clock_stamp();
    reg_set(&I2C1->CR1, START);
    if (!came(SB) || !sent((uint8_t)(address << 1), ADDR))
        return false;
    (void)reg_read(&I2C1->SR2); /* clears ADDR */
    return sent(place, TXE) && sent(value, BTF) && stopped();
}

bool i2c_write(uint8_t address, uint8_t place, uint8_t value)
{
    bool done = transfer(address, place, value);
    if (!done)
        i2c_start();
    return done;
}
