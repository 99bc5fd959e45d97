/* I2C1 on PB8 (SCL) and PB9 (SDA) as its bus's only master: 400 kHz, writes of one register. */
#ifndef RECOIL_I2C_H
#define RECOIL_I2C_H

#include <stdbool.h>
#include <stdint.h>

/* Pins, bus and registers from whatever they are in: a line that a device holds low is clocked free. Takes 0.2 ms. */
void i2c_start(void);
/* Start, address, register, value, stop. What has not come about in 1 ms has failed; then the bus is started anew. */
bool i2c_write(uint8_t address, uint8_t place, uint8_t value);

#endif
