/* search.h: level 2 of the lists, for lists.c. */
#ifndef TOILE_CONTACT_SEARCH_H
#define TOILE_CONTACT_SEARCH_H

#include "sim/contact/lists.h"

/* Searches the group pairs lists->searched (searched): each gets its near, apart, limit, count and
 * earliest, and its pairs stand in lists->found of the chunks, in the same order. Returns the number
 * of chunks. */
int search_pairs(Lists *lists, const Points *x, int searched, double dt);

/* Boxes of all groups at the positions of now. */
void search_bound_all(Lists *lists, const Points *x);

/* The bristle that a pair had before, if it is remembered. */
void lists_recall(const Lists *lists, Pair *pair);

#endif
