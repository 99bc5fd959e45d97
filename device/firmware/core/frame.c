#include "frame.h"

enum { HEAD = 6, TAIL = 9, LAST_NUMBER = 0xFFFF };

static enum heard line_ended(struct splitter *splitter, struct slice *line)
{
    size_t length = splitter->length;
    bool too_long = splitter->too_long;
    splitter->length = 0;
    splitter->too_long = false;
    if (length > 0 && splitter->bytes[length - 1] == '\r')
        length--;
    *line = (struct slice){splitter->bytes, length};
    if (too_long || length > MAX_LINE)
        return HEARD_TOO_LONG;
    return length > 0 ? HEARD_LINE : HEARD_NOTHING;
}

enum heard splitter_feed(struct splitter *splitter, uint8_t byte, struct slice *line)
{
    if (byte == '\n')
        return line_ended(splitter, line);
    if (splitter->length < sizeof splitter->bytes)
        splitter->bytes[splitter->length++] = (char)byte;
    else
        splitter->too_long = true;
    return HEARD_NOTHING;
}

/* A half byte at a time: the polynomial's table of sixteen. */
uint32_t crc32(struct slice slice)
{
    static const uint32_t table[16] = {
        0x00000000, 0x1DB71064, 0x3B6E20C8, 0x26D930AC, 0x76DC4190, 0x6B6B51F4, 0x4DB26158, 0x5005713C,
        0xEDB88320, 0xF00F9344, 0xD6D6A3E8, 0xCB61B38C, 0x9B64C2B0, 0x86D3D2D4, 0xA00AE278, 0xBDBDF21C,
    };
    uint32_t crc = 0xFFFFFFFF;
    for (size_t i = 0; i < slice.length; i++) {
        crc ^= (uint8_t)slice.bytes[i];
        crc = crc >> 4 ^ table[crc & 0xF];
        crc = crc >> 4 ^ table[crc & 0xF];
    }
    return ~crc;
}

static bool hex(const char *bytes, size_t digits, uint32_t *number)
{
    *number = 0;
    for (size_t i = 0; i < digits; i++) {
        char digit = bytes[i];
        bool letter = digit >= 'A' && digit <= 'F';
        if (!letter && (digit < '0' || digit > '9'))
            return false;
        *number = *number << 4 | (uint32_t)(letter ? digit - 'A' + 10 : digit - '0');
    }
    return true;
}

bool frame_decode(struct slice line, struct frame *frame)
{
    if (line.length < HEAD + 1 + TAIL || line.length > MAX_LINE)
        return false;
    const char *bytes = line.bytes;
    size_t end = line.length - TAIL;
    uint32_t number, checksum;
    if (bytes[0] != '>' || bytes[HEAD - 1] != ' ' || bytes[end] != '~')
        return false;
    if (!hex(bytes + 1, 4, &number) || !hex(bytes + end + 1, 8, &checksum))
        return false;
    frame->number = (uint16_t)number;
    frame->body = (struct slice){bytes + HEAD, end - HEAD};
    return number != 0 && slice_printable(frame->body) && crc32((struct slice){bytes, end}) == checksum;
}

void frame_encode(uint16_t number, struct slice body, struct text *line)
{
    text_clear(line);
    text_char(line, '<');
    text_hex(line, number, 4);
    text_char(line, ' ');
    text_slice(line, body);
    uint32_t checksum = crc32((struct slice){line->bytes, line->length});
    text_char(line, '~');
    text_hex(line, checksum, 8);
    text_char(line, '\n');
}

bool frame_is_newer(uint16_t number, uint16_t last)
{
    uint32_t ahead = ((uint32_t)number + LAST_NUMBER - last) % LAST_NUMBER;
    return ahead > 0 && ahead <= LAST_NUMBER / 2;
}
