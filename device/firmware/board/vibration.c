/* RM0390, "Inter-integrated circuit (I2C) interface"; the driver's registers: TI's data sheet SLOS825. */
#include "vibration.h"

#include "board.h"

enum { DRV_ADDRESS = 0x5A, DRV_MODE = 0x01, DRV_LIBRARY = 0x03, DRV_EFFECT = 0x04, DRV_NEXT = 0x05, DRV_GO = 0x0C };
enum { DRV_FEEDBACK = 0x1A, DRV_INTERNAL_TRIGGER = 0, DRV_LRA_LIBRARY = 6, DRV_LRA = 0xB6 }; /* default and N_ERM_LRA */

static bool failed;

static bool i2c_send(uint8_t byte, uint32_t flag)
{
    I2C1->DR = byte;
    return wait_for(&I2C1->SR1, flag, flag);
}

/* One register of the vibration driver: start, address, register, value, stop. */
static bool drv_try(uint8_t place, uint8_t value)
{
    enum { START = BIT(8), SB = BIT(0), ADDR = BIT(1), BTF = BIT(2), TXE = BIT(7) };
    I2C1->CR1 |= START;
    if (!wait_for(&I2C1->SR1, SB, SB) || !i2c_send(DRV_ADDRESS << 1, ADDR))
        return false;
    (void)I2C1->SR2; /* clears ADDR */
    return i2c_send(place, TXE) && i2c_send(value, BTF);
}

static bool drv_write(uint8_t place, uint8_t value)
{
    enum { STOP = BIT(9) };
    bool done = drv_try(place, value);
    failed = !done || failed;
    I2C1->CR1 |= STOP;
    wait_for(&I2C1->CR1, STOP, 0);
    return done;
}

void vibration_start(void)
{
    I2C1->CR2 = 42;            /* MHz of APB1 */
    I2C1->CCR = BIT(15) | 35u; /* fast mode: 42 MHz / (3 * 35) = 400 kHz */
    I2C1->TRISE = 13;          /* 300 ns */
    I2C1->CR1 = BIT(0);
    drv_write(DRV_MODE, DRV_INTERNAL_TRIGGER);
    drv_write(DRV_GO, 0);
    drv_write(DRV_FEEDBACK, DRV_LRA);
    drv_write(DRV_LIBRARY, DRV_LRA_LIBRARY);
    drv_write(DRV_NEXT, 0);
}

bool vibration_on(uint8_t effect)
{
    return drv_write(DRV_EFFECT, effect) && drv_write(DRV_GO, 1);
}

bool vibration_off(void)
{
    return drv_write(DRV_GO, 0);
}

bool vibration_failed(void)
{
    bool before = failed;
    failed = false;
    return before;
}
