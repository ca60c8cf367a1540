/* quad.h: x, y, z and a free place as one vector, for loops over sparse rows.
 *
 * QUADS before a function compiles it for AVX2 too; the loader takes what the processor has. The bits
 * are the same: products and sums are not contracted. Quads are passed in memory, never as arguments. */
#ifndef TOILE_BASE_QUAD_H
#define TOILE_BASE_QUAD_H

typedef double Quad __attribute__((vector_size(32)));

#define QUADS __attribute__((target_clones("avx2", "default")))

#endif
