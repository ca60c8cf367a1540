/* json.h: the few words of JSON that results are written with. */
#ifndef TOILE_RENDER_JSON_H
#define TOILE_RENDER_JSON_H

#include <stdio.h>

/* A string in quotes. */
void json_string(FILE *out, const char *text);

/* A number with 9 digits; null when it is not finite. */
void json_number(FILE *out, double value);

#endif
