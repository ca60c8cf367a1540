/* vector.h: the widths of vector code that row loops are compiled for (see the Makefile). Every width
 * gives the same bits. */
#ifndef TOILE_BASE_VECTOR_H
#define TOILE_BASE_VECTOR_H

#include <stdbool.h>

typedef enum VectorWidth {
    VECTOR_SCALAR,
    VECTOR_SSE2,
    VECTOR_AVX2,
    VECTOR_AVX512,
    VECTOR_WIDTHS
} VectorWidth;

bool vector_runs_here(VectorWidth width);

/* The widest that runs here, or the one that TOILE_VECTORS names: scalar, sse2, avx2, avx512. */
VectorWidth vector_best(void);

/* ---- for the files that are compiled once per width, of which VECTOR_VARIANT is the name ---- */

#ifdef VECTOR_SIMD
#define VECTOR_LOOP _Pragma("omp simd")
#else
#define VECTOR_LOOP
#endif
#define VECTOR_JOIN_(a, b) a##b
#define VECTOR_JOIN(a, b) VECTOR_JOIN_(a, b)
#define VECTOR_TEXT_(a) #a
#define VECTOR_TEXT(a) VECTOR_TEXT_(a)

#endif
