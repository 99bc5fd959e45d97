/* The host's port: bytes come by interrupt, each with its time, and go out when the USART has room. */
#ifndef RECOIL_PORT_H
#define RECOIL_PORT_H

#include "text.h"

struct received {
    uint8_t bytes[64];
    size_t count;
    uint32_t stamp; /* when the last of them came */
};

void port_start(void);
/* Bytes that came, up to the end of a line; false if there are none. */
bool port_read(struct received *received);
bool port_waits(void);
/* A line is sent whole or, where there is no room, not at all. */
void port_write(struct slice line);
/* Sends what the USART takes now; true while something is left. */
bool port_pump(void);

#endif
