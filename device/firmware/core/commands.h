/* The commands of both modes: a header, a blank, parameters. */
#ifndef RECOIL_COMMANDS_H
#define RECOIL_COMMANDS_H

#include "core.h"

/* Carries a command out. Its answer, if it has one, is in core->answer. */
enum error command_do(struct core *core, struct slice words, uint64_t now_us);
/* Off and disarmed; a trigger that waits for its answer gets it. */
void core_abort(struct core *core, uint64_t now_us);
void core_identify(struct core *core);

#endif
