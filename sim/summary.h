/* summary.h: what `toile sim` says when a run has ended. */
#ifndef TOILE_SUMMARY_H
#define TOILE_SUMMARY_H

#include "sim/sim.h"

/* Of the frames that this process made: what happened, whether it can be trusted, what it cost; one line a fact, for
 * someone who animates cloth. As JSON on one line also what the methods did, for those who know them. */
void summary_print(const Sim *sim, FILE *out, bool json);

#endif
