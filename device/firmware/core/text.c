#include "text.h"

enum { MAX_DIGITS = 16 };

static size_t length_of(const char *words)
{
    size_t length = 0;
    while (words[length] != '\0')
        length++;
    return length;
}

bool slice_starts(struct slice slice, const char *words)
{
    size_t length = length_of(words);
    if (slice.length < length)
        return false;
    for (size_t i = 0; i < length; i++)
        if (slice.bytes[i] != words[i])
            return false;
    return true;
}

bool slice_is(struct slice slice, const char *words)
{
    return slice.length == length_of(words) && slice_starts(slice, words);
}

struct slice slice_from(struct slice slice, size_t begin)
{
    return (struct slice){slice.bytes + begin, slice.length - begin};
}

bool slice_cut(struct slice *rest, char mark, struct slice *before)
{
    for (size_t i = 0; i < rest->length; i++) {
        if (rest->bytes[i] != mark)
            continue;
        *before = (struct slice){rest->bytes, i};
        *rest = slice_from(*rest, i + 1);
        return true;
    }
    *before = *rest;
    *rest = slice_from(*rest, rest->length);
    return false;
}

bool slice_printable(struct slice slice)
{
    for (size_t i = 0; i < slice.length; i++)
        if (slice.bytes[i] < ' ' || slice.bytes[i] > '~')
            return false;
    return true;
}

size_t slice_count(struct slice slice, char mark)
{
    size_t count = 0;
    for (size_t i = 0; i < slice.length; i++)
        count += slice.bytes[i] == mark ? 1 : 0;
    return count;
}

bool slice_number(struct slice slice, uint64_t *number)
{
    if (slice.length < 1 || slice.length > MAX_DIGITS || (slice.length > 1 && slice.bytes[0] == '0'))
        return false;
    uint64_t found = 0;
    for (size_t i = 0; i < slice.length; i++) {
        char digit = slice.bytes[i];
        if (digit < '0' || digit > '9')
            return false;
        found = found * 10 + (uint64_t)(digit - '0');
    }
    *number = found;
    return true;
}

void text_clear(struct text *text)
{
    text->length = 0;
}

void text_char(struct text *text, char byte)
{
    if (text->length < sizeof text->bytes)
        text->bytes[text->length++] = byte;
}

void text_add(struct text *text, const char *words)
{
    while (*words != '\0')
        text_char(text, *words++);
}

void text_slice(struct text *text, struct slice slice)
{
    for (size_t i = 0; i < slice.length; i++)
        text_char(text, slice.bytes[i]);
}

void text_number(struct text *text, uint64_t number)
{
    char digits[20];
    size_t count = 0;
    do {
        digits[count++] = (char)('0' + number % 10);
        number /= 10;
    } while (number > 0);
    while (count > 0)
        text_char(text, digits[--count]);
}

void text_hex(struct text *text, uint32_t number, unsigned digits)
{
    while (digits > 0)
        text_char(text, "0123456789ABCDEF"[number >> (4 * --digits) & 0xF]);
}
