/* Text in fixed buffers: a slice of a line that came, a line that is being written. */
#ifndef RECOIL_TEXT_H
#define RECOIL_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum { MAX_LINE = 200, MAX_BODY = MAX_LINE - 15 };

/* Bytes that belong to somebody else. */
struct slice {
    const char *bytes;
    size_t length;
};

/* A line that grows; what is beyond its room is left out. */
struct text {
    size_t length;
    char bytes[MAX_LINE + 1];
};

bool slice_is(struct slice slice, const char *words);
bool slice_starts(struct slice slice, const char *words);
struct slice slice_from(struct slice slice, size_t begin);
/* Cuts what is before the mark off the rest; false, and the rest is empty, where there is no mark. */
bool slice_cut(struct slice *rest, char mark, struct slice *before);
bool slice_printable(struct slice slice);
size_t slice_count(struct slice slice, char mark);
/* A whole number of at most 16 digits, without sign and leading zeros. */
bool slice_number(struct slice slice, uint64_t *number);

void text_clear(struct text *text);
void text_char(struct text *text, char byte);
void text_add(struct text *text, const char *words);
void text_slice(struct text *text, struct slice slice);
void text_number(struct text *text, uint64_t number);
void text_hex(struct text *text, uint32_t number, unsigned digits);

#endif
