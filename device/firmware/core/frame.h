/* Bytes, lines and frames. Bounded: a line that is too long is left out and told. */
#ifndef RECOIL_FRAME_H
#define RECOIL_FRAME_H

#include "text.h"

struct frame {
    uint16_t number;
    struct slice body;
};

enum heard { HEARD_NOTHING, HEARD_LINE, HEARD_TOO_LONG };

/* Cuts the stream into lines; one byte more than a line may have, as a CR may end it. */
struct splitter {
    size_t length;
    bool too_long;
    char bytes[MAX_LINE + 1];
};

/* What this byte completes. The line stays until the next byte. */
enum heard splitter_feed(struct splitter *splitter, uint8_t byte, struct slice *line);

/* Whether a line is a frame of the host, and which; its number is never 0. */
bool frame_decode(struct slice line, struct frame *frame);
/* A frame of the gun as a line with its end. */
void frame_encode(uint16_t number, struct slice body, struct text *line);
/* Whether a sequence number comes after the last one: at most half of all numbers ahead. */
bool frame_is_newer(uint16_t number, uint16_t last);
/* CRC-32 as IEEE 802.3 and zip have it. */
uint32_t crc32(struct slice slice);

#endif
