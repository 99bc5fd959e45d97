/* The records on the wire: what a shot is made of, what it came to, how the gun stands. */
#ifndef RECOIL_RECORDS_H
#define RECOIL_RECORDS_H

#include "text.h"

#define RECOIL_WIRE_VERSION "1"
#define RECOIL_FIRMWARE "1.1.0"

enum { MAX_METHOD = 24 };

enum way { WAY_FORW, WAY_BACK };
enum kind { KIND_PULS, KIND_EFF };
enum ending { ENDING_NONE, ENDING_WAIT, ENDING_DRIV, ENDING_DONE, ENDING_CUT };
enum state { STATE_DISARMED, STATE_ARMED, STATE_RESETTING, STATE_WAITING, STATE_FIRING, STATE_FAULT };

/* What the next shots are made of. The amount is mV of a pulse or the number of an effect. */
struct setting {
    char method[MAX_METHOD + 1];
    enum way way;
    enum kind kind;
    uint64_t amount, length_us, rest_us;
};

/* What became of the last shot that was accepted. Home is predicted, not measured. */
struct shot {
    uint64_t count, mark;
    enum ending ending;
    uint64_t accepted_us, start_us, end_us, home_predicted_us;
    struct setting setting;
};

struct standing {
    enum state state;
    uint64_t count, clock_us, ready_us, coil_mC, fault;
};

/* From the parameters of CONF; their ranges are the machine's to judge. */
bool setting_parse(struct slice words, struct setting *setting);
void setting_text(const struct setting *setting, struct text *text);
void shot_text(const struct shot *shot, struct text *text);
void standing_text(const struct standing *standing, struct text *text);

#endif
