#include "records.h"

static const char *const WAYS[] = {[WAY_FORW] = "FORW", [WAY_BACK] = "BACK"};
static const char *const KINDS[] = {[KIND_PULS] = "PULS", [KIND_EFF] = "EFF"};
static const char *const ENDINGS[] = {
    [ENDING_NONE] = "NONE", [ENDING_WAIT] = "WAIT", [ENDING_DRIV] = "DRIV",
    [ENDING_DONE] = "DONE", [ENDING_CUT] = "CUT",
};
static const char *const STATES[] = {
    [STATE_DISARMED] = "DISARMED", [STATE_ARMED] = "ARMED",   [STATE_RESETTING] = "RESETTING",
    [STATE_WAITING] = "WAITING",   [STATE_FIRING] = "FIRING", [STATE_FAULT] = "FAULT",
};

static bool method_byte(char byte)
{
    return (byte >= 'a' && byte <= 'z') || (byte >= '0' && byte <= '9') || byte == '-';
}

static bool parse_method(struct slice word, char *method)
{
    if (word.length < 1 || word.length > MAX_METHOD)
        return false;
    for (size_t i = 0; i < word.length; i++) {
        if (!method_byte(word.bytes[i]))
            return false;
        method[i] = word.bytes[i];
    }
    method[word.length] = '\0';
    return true;
}

static bool parse_way(struct slice word, enum way *way)
{
    *way = slice_is(word, WAYS[WAY_BACK]) ? WAY_BACK : WAY_FORW;
    return slice_is(word, WAYS[*way]);
}

static bool parse_kind(struct slice word, enum kind *kind)
{
    *kind = slice_is(word, KINDS[KIND_EFF]) ? KIND_EFF : KIND_PULS;
    return slice_is(word, KINDS[*kind]);
}

bool setting_parse(struct slice words, struct setting *setting)
{
    struct slice fields[6];
    if (slice_count(words, ',') != 5)
        return false;
    for (size_t i = 0; i < 6; i++)
        slice_cut(&words, ',', &fields[i]);
    return parse_method(fields[0], setting->method) && parse_way(fields[1], &setting->way)
        && parse_kind(fields[2], &setting->kind) && slice_number(fields[3], &setting->amount)
        && slice_number(fields[4], &setting->length_us) && slice_number(fields[5], &setting->rest_us);
}

static void then_word(struct text *text, const char *word)
{
    text_char(text, ',');
    text_add(text, word);
}

static void then_number(struct text *text, uint64_t number)
{
    text_char(text, ',');
    text_number(text, number);
}

void setting_text(const struct setting *setting, struct text *text)
{
    text_add(text, setting->method);
    then_word(text, WAYS[setting->way]);
    then_word(text, KINDS[setting->kind]);
    then_number(text, setting->amount);
    then_number(text, setting->length_us);
    then_number(text, setting->rest_us);
}

void shot_text(const struct shot *shot, struct text *text)
{
    text_add(text, "SHOT ");
    text_number(text, shot->count);
    then_number(text, shot->mark);
    then_word(text, ENDINGS[shot->ending]);
    then_number(text, shot->accepted_us);
    then_number(text, shot->start_us);
    then_number(text, shot->end_us);
    then_number(text, shot->home_predicted_us);
    text_char(text, ',');
    setting_text(&shot->setting, text);
}

void standing_text(const struct standing *standing, struct text *text)
{
    text_add(text, "STAT ");
    text_add(text, STATES[standing->state]);
    then_number(text, standing->count);
    then_number(text, standing->clock_us);
    then_number(text, standing->ready_us);
    then_number(text, standing->coil_mC);
    then_number(text, standing->fault);
}
