#include "sim/base/text.h"

#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#define TEXT_LONGEST_WORD 63 /* longer words are never "near" */

static int smallest(int a, int b, int c) {
    int m = a < b ? a : b;
    return m < c ? m : c;
}

int text_distance(const char *a, const char *b, int limit) {
    size_t a_length = strlen(a), b_length = strlen(b);
    if (a_length > TEXT_LONGEST_WORD || b_length > TEXT_LONGEST_WORD) {
        return limit + 1;
    }
    int rows[3][TEXT_LONGEST_WORD + 2];
    int *before = rows[0], *last = rows[1], *row = rows[2];
    for (size_t j = 0; j <= b_length; j++) {
        last[j] = (int)j;
    }
    for (size_t i = 1; i <= a_length; i++) {
        row[0] = (int)i;
        for (size_t j = 1; j <= b_length; j++) {
            int change = a[i - 1] != b[j - 1];
            row[j] = smallest(last[j] + 1, row[j - 1] + 1, last[j - 1] + change);
            int swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
            if (swapped && before[j - 2] + 1 < row[j]) {
                row[j] = before[j - 2] + 1;
            }
        }
        int *oldest = before;
        before = last, last = row, row = oldest;
    }
    return last[b_length] > limit ? limit + 1 : last[b_length];
}

const char *text_nearest(const char *word, const char *const *words) {
    int limit = strlen(word) < 5 ? 1 : 2;
    const char *nearest = NULL;
    for (; *words; words++) {
        int distance = text_distance(word, *words, limit);
        if (distance <= limit) {
            nearest = *words;
            limit = distance - 1;
        }
    }
    return nearest;
}
