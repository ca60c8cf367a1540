/* film_record.h: the arrays of a header that say more about the film than its 18 numbers. */
#ifndef TOILE_STATE_FILM_RECORD_H
#define TOILE_STATE_FILM_RECORD_H

#include "sim/state/record.h"

#define FILM_ARRAYS 6

/* Fills `arrays` (FILM_ARRAYS) from a film; what they point to lives in arena. */
void film_record_encode(const Film *film, Arena *arena, StateArray *arrays);

/* Adds what the arrays say to a film that holds the defaults, which stand where an array is missing. False:
 * impossible values. */
bool film_record_decode(const StateArray *arrays, int count, Film *film);

#endif
