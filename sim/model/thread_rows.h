/* thread_rows.h: the forces of particles row by row, as vector code.
 *
 * All energies of the model are functions of the edges between neighbours along the threads: a
 * spring of one edge, a bend of two in line, the shear and twist of a cell of the four around it.
 * So each edge, its length and its direction are found once; every unit adds to dE/d(edge); a node
 * gets the difference of the edges that end and start there. For a bend with m = dE/dt+ = -dE/dt-,
 *
 *     dE/d(edge) = P (m of the node where it starts - m of the node where it ends),
 *     P = (I - t t') / length.
 *
 * The same formulas as thread_units.h, which has the energy and the walls. Loops are elementwise
 * along rows: the bits do not depend on the vector width. */
#ifndef TOILE_MODEL_THREAD_ROWS_H
#define TOILE_MODEL_THREAD_ROWS_H

#include "sim/model/thread_units.h"

typedef struct ThreadRows ThreadRows;

/* stiffness: [N/m] of the springs of inner threads along warp and weft; twist: [N m] 4 D66 */
ThreadRows *thread_rows_create(const Panel *panel, const ThreadUnits *units,
                               const double stiffness[2], double twist, Arena *arena);

/* gradient += dE/dx [N] of springs, bends without walls, shear and twist; (node_count x 3). Bends at
 * `bent`, all else at x; usually one array. */
void thread_rows_add_gradient(const ThreadRows *rows, const double *x, const double *bent,
                              double *gradient);

#endif
