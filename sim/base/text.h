/* text.h: the nearest valid word, for error messages. */
#ifndef TOILE_BASE_TEXT_H
#define TOILE_BASE_TEXT_H

/* Damerau-Levenshtein distance (optimal string alignment), at most `limit` + 1. */
int text_distance(const char *a, const char *b, int limit);

/* The word of `words` (NULL-terminated) that is nearest to `word`: at most 2 edits away,
 * 1 for words under 5 letters. NULL when none is near. */
const char *text_nearest(const char *word, const char *const *words);

#endif
