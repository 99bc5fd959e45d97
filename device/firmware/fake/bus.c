/* RM0390, "Inter-integrated circuit (I2C) interface": what the master's registers show of a bus with one DRV2605. */
#include "fake.h"

enum { PE = BIT(0), START = BIT(8), STOP = BIT(9), SWRST = BIT(15) };
enum { SB = BIT(0), ADDR = BIT(1), BTF = BIT(2), TXE = BIT(7), BERR = BIT(8), AF = BIT(10), BUSY = BIT(1) };
enum { SCL = BIT(8), SDA = BIT(9), ADDRESS = 0x5A };
enum { DRV_MODE = 0x01, DRV_LIBRARY = 0x03, DRV_EFFECT = 0x04, DRV_GO = 0x0C, DRV_FEEDBACK = 0x1A };
enum { STANDBY = 0x40, LRA_LIBRARY = 6, LRA = 0xB6, LEFT_IN_A_BYTE = 5 };

enum phase { IDLE, STARTING, STARTED, ADDRESSING, ADDRESSED, SENDING, STOPPING };

static struct {
    enum phase phase;
    uint32_t flags;
    uint64_t done_ns; /* what is on the lines */
    int shifting, waiting; /* bytes, or -1 */
    unsigned count;
} master = {.shifting = -1, .waiting = -1};

static struct {
    uint8_t place, registers[256];
} driver = {.registers = {[DRV_MODE] = STANDBY}};

void bus_lose_power(void)
{
    driver.registers[DRV_MODE] = STANDBY;
    driver.registers[DRV_LIBRARY] = 1;
    driver.registers[DRV_FEEDBACK] = 0x36;
}

static uint64_t bit_ns(void)
{
    return (uint64_t)3000 * (*cell(&I2C1->CCR) & 0xFFF) / apb1_MHz();
}

/* Two bits a pin, 1 an output. */
static bool is_output(unsigned pin)
{
    return (*cell(&GPIOB->MODER) >> (2 * pin) & 3) == 1;
}

uint32_t bus_lines(void)
{
    uint32_t lines = SCL | SDA;
    for (unsigned pin = 8; pin <= 9; pin++)
        if (is_output(pin) && (*cell(&GPIOB->ODR) & BIT(pin)) == 0)
            lines &= ~BIT(pin);
    if (world.bus == BUS_LOW)
        lines &= ~(uint32_t)SCL;
    if (world.held > 0)
        lines &= ~(uint32_t)SDA;
    return lines;
}

/* A falling clock by hand brings a driver that holds the data on. */
void bus_port_changed(void)
{
    static bool high = true;
    bool now_high = !is_output(8) || (*cell(&GPIOB->ODR) & SCL) != 0;
    rule(!is_output(9) || (*cell(&GPIOB->OTYPER) & (SCL | SDA)) == (SCL | SDA), "the bus's lines are open drains");
    if (high && !now_high && world.held > 0)
        world.held--;
    high = now_high;
}

static void begin_effect(void)
{
    const uint8_t *set = driver.registers;
    if (set[DRV_MODE] == 0 && set[DRV_LIBRARY] == LRA_LIBRARY && set[DRV_FEEDBACK] == LRA)
        tell("vibrates %u", set[DRV_EFFECT]);
    else
        tell("vibrates not, it is not set up");
}

/* The driver has a byte: after its address the register's, then what goes into it. */
static void driver_takes(uint8_t byte)
{
    if (master.count++ == 0) {
        driver.place = byte;
        return;
    }
    driver.registers[driver.place] = byte;
    if (driver.place == DRV_GO && byte == 1)
        begin_effect();
    else if (driver.place == DRV_GO)
        tell("is still");
    driver.place++;
}

static void answer_address(void)
{
    if (world.bus == BUS_ADDR)
        return;
    bool there = world.bus != BUS_ABSENT && master.shifting == ADDRESS << 1;
    master.flags |= world.bus == BUS_ERROR ? BERR : there ? ADDR : AF;
    master.phase = ADDRESSED;
    master.shifting = -1;
}

static void shift(int byte)
{
    master.shifting = byte;
    master.waiting = -1;
    master.done_ns = now_ns + 9 * bit_ns();
}

static void byte_sent(void)
{
    if (master.shifting < 0 || world.bus == BUS_TXE || world.bus == BUS_BTF)
        return;
    driver_takes((uint8_t)master.shifting);
    master.shifting = -1;
    if (master.waiting >= 0)
        shift(master.waiting);
    else
        master.flags |= BTF;
    master.flags |= TXE;
}

static void start_seen(void)
{
    if (world.bus == BUS_SB || bus_lines() != (SCL | SDA))
        return;
    *cell(&I2C1->CR1) &= ~(uint32_t)START;
    master.flags = SB;
    master.phase = STARTED;
    master.count = 0;
}

static void stop_seen(void)
{
    if (world.bus == BUS_STOP)
        return;
    *cell(&I2C1->CR1) &= ~(uint32_t)STOP;
    master.flags = 0;
    master.phase = IDLE;
}

/* What was on the lines is done. */
static void settle(void)
{
    if (now_ns < master.done_ns)
        return;
    switch (master.phase) {
    case STARTING: start_seen(); break;
    case ADDRESSING: answer_address(); break;
    case SENDING: byte_sent(); break;
    case STOPPING: stop_seen(); break;
    default: break;
    }
}

/* A driver that is left in the middle of a byte goes on holding its data. */
static void reset(void)
{
    if (master.phase == SENDING && master.shifting >= 0 && world.bus != BUS_ABSENT)
        world.held = LEFT_IN_A_BYTE;
    master.phase = IDLE;
    master.flags = 0;
    master.shifting = master.waiting = -1;
}

static void control(uint32_t value)
{
    uint32_t before = *cell(&I2C1->CR1);
    rule((before & (START | STOP)) == 0 || (value & SWRST) != 0, "I2C CR1 is not written while START or STOP is set");
    rule((before & SWRST) == 0 || (value & SWRST) != 0 || world.bus == BUS_LOW || world.held > 0
             || bus_lines() == (SCL | SDA),
         "I2C's SWRST ends when the lines are free");
    *cell(&I2C1->CR1) = value;
    if ((value & SWRST) != 0)
        reset();
    if ((value & PE) == 0 || (value & (START | STOP)) == 0)
        return;
    master.phase = (value & START) != 0 ? STARTING : STOPPING;
    master.done_ns = now_ns + 2 * bit_ns();
}

static void data(uint8_t byte)
{
    if (master.phase == STARTED) {
        master.flags = 0;
        master.phase = ADDRESSING;
        shift(byte);
    } else if (master.phase == SENDING) {
        master.flags &= ~(uint32_t)(TXE | BTF);
        if (master.shifting >= 0)
            master.waiting = byte;
        else
            shift(byte);
        if (master.waiting < 0 && world.bus != BUS_TXE)
            master.flags |= TXE;
    }
}

bool bus_has(const reg *place)
{
    return place >= &I2C1->CR1 && place <= &I2C1->FLTR;
}

uint32_t bus_read(const reg *place)
{
    settle();
    if (place == &I2C1->SR1)
        return master.flags;
    if (place != &I2C1->SR2)
        return *cell(place);
    if ((master.flags & ADDR) != 0) {
        master.flags = TXE;
        master.phase = SENDING;
    }
    return master.phase == IDLE && bus_lines() == (SCL | SDA) ? 0 : BUSY;
}

void bus_write(const reg *place, uint32_t value)
{
    bool enabled = (*cell(&I2C1->CR1) & PE) != 0;
    settle();
    if (place == &I2C1->CR1) {
        control(value);
        return;
    }
    *cell(place) = value;
    if (place == &I2C1->DR)
        data((uint8_t)value);
    rule((place != &I2C1->CCR && place != &I2C1->TRISE) || !enabled, "I2C's CCR and TRISE are written while PE is 0");
    rule(place != &I2C1->CR2 || value == apb1_MHz(), "I2C's FREQ is APB1's");
}
