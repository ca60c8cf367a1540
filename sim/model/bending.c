#include "sim/model/bending.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/error.h"
#include "sim/base/memory.h"
#include "sim/base/parallel.h"
#include "sim/base/quad.h"
#include "sim/model/bending_rest.h"

#define ENERGY_GRAIN 256 /* nodes a thread takes at once, some 10 us */

typedef struct Term {
    uint64_t key; /* row << 32 | column */
    double value;
} Term;

static int compare_terms(const void *a, const void *b) {
    const Term *x = a, *y = b;
    return (x->key > y->key) - (x->key < y->key);
}

static double pair_value(const BendingEntry *a, const BendingEntry *b, const double w[4]) {
    return w[0] * a->g11 * b->g11 + w[2] * a->g22 * b->g22 +
           w[1] * (a->g11 * b->g22 + a->g22 * b->g11) + w[3] * a->g12 * b->g12;
}

static size_t count_terms(const BendingSamples *s) {
    size_t count = 0;
    for (int i = 0; i < s->sample_count; i++) {
        size_t n = (size_t)(s->start[i + 1] - s->start[i]);
        count += n * n;
    }
    return count;
}

static void fill_terms(const BendingSamples *s, Term *terms) {
    for (int i = 0; i < s->sample_count; i++) {
        for (int a = s->start[i]; a < s->start[i + 1]; a++) {
            for (int b = s->start[i]; b < s->start[i + 1]; b++, terms++) {
                const BendingEntry *ea = &s->entries[a], *eb = &s->entries[b];
                terms->key = (uint64_t)ea->node << 32 | (uint32_t)eb->node;
                terms->value = pair_value(ea, eb, s->weight[i]);
            }
        }
    }
}

/* K by rows from sorted terms */
static void compress(Bending *b, Term *terms, size_t count, Arena *arena) {
    size_t entries = 0;
    for (size_t t = 0; t < count; t++) {
        entries += t == 0 || terms[t].key != terms[t - 1].key;
    }
    b->start = arena_push(arena, int, b->node_count + 1);
    b->column = arena_push(arena, int, entries);
    b->value = arena_push(arena, double, entries);
    size_t at = 0;
    for (size_t t = 0; t < count; t++) {
        if (t == 0 || terms[t].key != terms[t - 1].key) {
            b->column[at++] = (int)(terms[t].key & 0xffffffffu);
            b->start[(terms[t].key >> 32) + 1]++;
        }
        b->value[at - 1] += terms[t].value;
    }
    for (int i = 0; i < b->node_count; i++) {
        b->start[i + 1] += b->start[i];
    }
}

Bending bending_create(const BendingSamples *samples, int node_count, int solved_count,
                       const double rest_curvature[2], Arena *arena) {
    Bending b = {.node_count = node_count, .solved_count = solved_count};
    size_t count = count_terms(samples);
    Term *terms = memory_new((count + 1) * sizeof *terms);
    fill_terms(samples, terms);
    qsort(terms, count, sizeof *terms, compare_terms);
    compress(&b, terms, count, arena);
    free(terms);
    if (rest_curvature && (rest_curvature[0] != 0.0 || rest_curvature[1] != 0.0)) {
        double k0[3] = {rest_curvature[0], rest_curvature[1], 0.0};
        b.rest = bending_rest_create(samples, solved_count, k0, arena);
    }
    return b;
}

typedef struct EnergyJob {
    const Bending *bending;
    const double *x;
} EnergyJob;

/* [J] of nodes */
QUADS static void energy_terms(int first, int end, const void *context, double *out) {
    const EnergyJob *job = context;
    const Bending *b = job->bending;
    for (int i = first; i < end; i++) {
        Quad sum = {0};
        for (int e = b->start[i]; e < b->start[i + 1]; e++) {
            const double *xj = job->x + 3 * (size_t)b->column[e];
            Quad at = {xj[0], xj[1], xj[2], 0.0};
            sum += b->value[e] * at;
        }
        const double *xi = job->x + 3 * (size_t)i;
        out[i - first] = 0.5 * (xi[0] * sum[0] + xi[1] * sum[1] + xi[2] * sum[2]);
    }
}

double bending_energy(const Bending *b, const double *x) {
    EnergyJob job = {b, x};
    double rest = b->rest ? bending_rest_energy(b->rest, x) : 0.0;
    return parallel_sum(rest, b->node_count, ENERGY_GRAIN, energy_terms, &job);
}

/* gradient += K x, of the nodes from `first` on */
QUADS static void add_product(const Bending *b, const double *x, int first, double *gradient) {
    for (int i = first; i < b->node_count; i++) {
        Quad sum = {0};
        for (int e = b->start[i]; e < b->start[i + 1]; e++) {
            const double *xj = x + 3 * (size_t)b->column[e];
            Quad at = {xj[0], xj[1], xj[2], 0.0};
            sum += b->value[e] * at;
        }
        double *out = gradient + 3 * (size_t)i;
        out[0] += sum[0], out[1] += sum[1], out[2] += sum[2];
    }
}

void bending_add_gradient(const Bending *b, const double *x, double *gradient) {
    add_product(b, x, 0, gradient);
    bending_add_rest_gradient(b, x, gradient);
}

void bending_add_border_gradient(const Bending *b, const double *x, double *gradient) {
    add_product(b, x, b->solved_count, gradient);
    if (b->rest) {
        bending_rest_add_border_gradient(b->rest, x, gradient);
    }
}

void bending_add_rest_gradient(const Bending *b, const double *x, double *gradient) {
    if (b->rest) {
        bending_rest_add_gradient(b->rest, x, gradient);
    }
}

static bool solved_lower(const Bending *b, int i, int e) {
    return b->column[e] <= i && i < b->solved_count;
}

int bending_couple(const Bending *b, int *pairs) {
    int count = 0;
    for (int i = 0; i < b->solved_count; i++) {
        for (int e = b->start[i]; e < b->start[i + 1]; e++) {
            if (!solved_lower(b, i, e) || b->column[e] == i) {
                continue;
            }
            if (pairs) {
                pairs[2 * count] = i;
                pairs[2 * count + 1] = b->column[e];
            }
            count++;
        }
    }
    if (b->rest) {
        count += bending_rest_couple(b->rest, pairs ? pairs + 2 * count : NULL);
    }
    return count;
}

void bending_bind(Bending *b, const BlockMatrix *matrix, int first, Arena *arena) {
    b->places = arena_push(arena, BlockPlace, b->start[b->node_count]);
    for (int i = 0; i < b->solved_count; i++) {
        for (int e = b->start[i]; e < b->start[i + 1]; e++) {
            if (solved_lower(b, i, e)) {
                b->places[e] = block_matrix_place(matrix, first + i, first + b->column[e]);
            }
        }
    }
    if (b->rest) {
        bending_rest_bind(b->rest, matrix, first, arena);
    }
}

void bending_add_hessian(const Bending *b, const double *x, double *values) {
    for (int i = 0; i < b->solved_count; i++) {
        for (int e = b->start[i]; e < b->start[i + 1]; e++) {
            if (solved_lower(b, i, e)) {
                block_add_diagonal(values, b->places[e], b->value[e]);
            }
        }
    }
    if (b->rest) {
        bending_rest_add_hessian(b->rest, x, values);
    }
}
