/* decode.h: from the arrays of a record to what they mean, with every shape and index checked.
 * All functions return false and say why in a few words when something does not fit. */
#ifndef TOILE_STATE_DECODE_H
#define TOILE_STATE_DECODE_H

#include "sim/state/record.h"

bool decode_header(const StateArray *arrays, int count, Arena *arena, StateHeader *header,
                   const char **why);
bool decode_layout(const StateArray *arrays, int count, const StateHeader *header,
                   StateLayout *layout, const char **why);
bool decode_frame(const StateArray *arrays, int count, const StateHeader *header,
                  const StateLayout *layout, StateFrame *frame, const char **why);

/* A zero-terminated copy; "" for NULL. */
char *decode_text(const StateArray *array, Arena *arena);

#endif
