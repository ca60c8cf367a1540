/* factor_cholmod.c: the only file that knows CHOLMOD. */
#include "sim/solve/factor.h"

#include <cholmod.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/error.h"
#include "sim/base/memory.h"
#include "sim/base/parallel.h"
#include "sim/solve/triangular.h"

/* relaxed supernodes: 25..35 % faster than CHOLMOD's defaults on cloth */
static const size_t relax_columns[3] = {12, 32, 96};
static const double relax_zeros[3] = {0.8, 0.3, 0.1};

struct Factor {
    cholmod_common common;
    cholmod_factor *l;
    cholmod_dense *right, *solution, *y, *e;
};

static void start(cholmod_common *common) {
    cholmod_start(common);
    common->print = 0;
    common->quick_return_if_not_posdef = 1;
    for (int i = 0; i < 3; i++) {
        common->nrelax[i] = relax_columns[i];
        common->zrelax[i] = relax_zeros[i];
    }
}

static void use_only(cholmod_common *common, int ordering, int postorder) {
    common->nmethods = 1;
    common->method[0].ordering = ordering;
    common->postorder = postorder;
}

/* upper triangle of the node graph */
static cholmod_sparse *graph_of(int node_count, const int *pairs, int pair_count,
                                cholmod_common *common) {
    size_t n = (size_t)node_count, entries = n + (size_t)pair_count;
    cholmod_triplet *t = cholmod_allocate_triplet(n, n, entries, 1, CHOLMOD_PATTERN, common);
    ASSERT(t);
    int *i = t->i, *j = t->j;
    for (int k = 0; k < node_count; k++) {
        i[k] = j[k] = k;
    }
    for (int k = 0; k < pair_count; k++) {
        int a = pairs[2 * k], b = pairs[2 * k + 1];
        i[node_count + k] = a < b ? a : b;
        j[node_count + k] = a < b ? b : a;
    }
    t->nnz = entries;
    cholmod_sparse *graph = cholmod_triplet_to_sparse(t, entries, common);
    cholmod_free_triplet(&t, common);
    ASSERT(graph);
    return graph;
}

void factor_order(int node_count, const int *pairs, int pair_count, int *order) {
    cholmod_common common;
    start(&common);
    use_only(&common, CHOLMOD_METIS, 1);
    cholmod_sparse *graph = graph_of(node_count, pairs, pair_count, &common);
    cholmod_factor *l = cholmod_analyze(graph, &common);
    ASSERT(l);
    const int *permutation = l->Perm;
    for (int place = 0; place < node_count; place++) {
        order[permutation[place]] = place;
    }
    cholmod_free_factor(&l, &common);
    cholmod_free_sparse(&graph, &common);
    cholmod_finish(&common);
}

static cholmod_sparse view_of(const BlockMatrix *m) {
    size_t n = 3 * (size_t)m->node_count;
    return (cholmod_sparse){.nrow = n,
                            .ncol = n,
                            .nzmax = 9 * (size_t)block_matrix_block_count(m),
                            .p = m->scalar_start,
                            .i = m->scalar_row,
                            .x = m->values,
                            .stype = -1,
                            .itype = CHOLMOD_INT,
                            .xtype = CHOLMOD_REAL,
                            .dtype = CHOLMOD_DOUBLE,
                            .sorted = 1,
                            .packed = 1};
}

Factor *factor_create(const BlockMatrix *m) {
    Factor *factor = memory_zeroed(1, sizeof *factor);
    start(&factor->common);
    factor->common.supernodal = CHOLMOD_SUPERNODAL;
    use_only(&factor->common, CHOLMOD_NATURAL, 0);
    cholmod_sparse view = view_of(m);
    factor->l = cholmod_analyze(&view, &factor->common);
    ASSERT(factor->l);
    factor->right = cholmod_allocate_dense(view.nrow, 1, view.nrow, CHOLMOD_REAL, &factor->common);
    return factor;
}

FactorStatus factor_numeric(Factor *factor, const BlockMatrix *m) {
    cholmod_sparse view = view_of(m);
    int levels = parallel_hold(); /* its threads meet after every supernode: 2 to 3 times slower */
    cholmod_factorize(&view, factor->l, &factor->common);
    parallel_release(levels);
    if (factor->common.status == CHOLMOD_OUT_OF_MEMORY) {
        return FACTOR_OUT_OF_MEMORY;
    }
    return factor->common.status == CHOLMOD_OK && factor->l->minor == factor->l->n
               ? FACTOR_OK
               : FACTOR_NOT_POSITIVE_DEFINITE;
}

void factor_solve(Factor *factor, const BlockMatrix *m, const double *b, double *x) {
    double *right = factor->right->x;
    for (int node = 0; node < m->node_count; node++) {
        memcpy(right + 3 * m->order[node], b + 3 * (size_t)node, 3 * sizeof *b);
    }
    int ok = cholmod_solve2(CHOLMOD_A, factor->l, factor->right, NULL, &factor->solution, NULL,
                            &factor->y, &factor->e, &factor->common);
    ASSERT(ok);
    const double *solution = factor->solution->x;
    for (int node = 0; node < m->node_count; node++) {
        memcpy(x + 3 * (size_t)node, solution + 3 * m->order[node], 3 * sizeof *x);
    }
}

void factor_free(Factor *factor) {
    if (!factor) {
        return;
    }
    cholmod_free_factor(&factor->l, &factor->common);
    cholmod_free_dense(&factor->right, &factor->common);
    cholmod_free_dense(&factor->solution, &factor->common);
    cholmod_free_dense(&factor->y, &factor->common);
    cholmod_free_dense(&factor->e, &factor->common);
    cholmod_finish(&factor->common);
    free(factor);
}

static cholmod_sparse *sparse_of(int count, const TriangularEntry *entries, int entry_count,
                                 cholmod_common *common) {
    size_t n = (size_t)count, most = (size_t)entry_count;
    cholmod_triplet *t = cholmod_allocate_triplet(n, n, most, -1, CHOLMOD_REAL, common);
    ASSERT(t);
    for (int k = 0; k < entry_count; k++) {
        ((int *)t->i)[k] = entries[k].row;
        ((int *)t->j)[k] = entries[k].column;
        ((double *)t->x)[k] = entries[k].value;
    }
    t->nnz = most;
    cholmod_sparse *matrix = cholmod_triplet_to_sparse(t, most, common);
    cholmod_free_triplet(&t, common);
    ASSERT(matrix);
    return matrix;
}

bool triangular_create(int count, const TriangularEntry *entries, int entry_count, Arena *arena,
                       Triangular *out) {
    cholmod_common common;
    start(&common);
    common.supernodal = CHOLMOD_SIMPLICIAL;
    common.final_ll = common.final_pack = common.final_monotonic = 1;
    cholmod_sparse *matrix = sparse_of(count, entries, entry_count, &common);
    cholmod_factor *l = cholmod_analyze(matrix, &common);
    ASSERT(l);
    cholmod_factorize(matrix, l, &common);
    ASSERT(common.status != CHOLMOD_OUT_OF_MEMORY);
    bool definite = common.status == CHOLMOD_OK && l->minor == l->n;
    if (definite) {
        const int *columns = l->p;
        int size = columns[count];
        *out = (Triangular){.count = count,
                            .order = arena_push(arena, int, count),
                            .start = arena_push(arena, int, count + 1),
                            .row = arena_push(arena, int, size),
                            .value = arena_push(arena, double, size),
                            .work = arena_push(arena, double, count)};
        memcpy(out->order, l->Perm, (size_t)count * sizeof *out->order);
        memcpy(out->start, l->p, (size_t)(count + 1) * sizeof *out->start);
        memcpy(out->row, l->i, (size_t)size * sizeof *out->row);
        memcpy(out->value, l->x, (size_t)size * sizeof *out->value);
    }
    cholmod_free_factor(&l, &common);
    cholmod_free_sparse(&matrix, &common);
    cholmod_finish(&common);
    return definite;
}

double factor_nonzeros(const Factor *factor) {
    return factor->l->is_super ? (double)factor->l->xsize : factor->common.lnz;
}

const char *factor_version(void) {
    static char text[64];
    snprintf(text, sizeof text, "SuiteSparse %d.%d.%d, CHOLMOD %d.%d.%d", SUITESPARSE_MAIN_VERSION,
             SUITESPARSE_SUB_VERSION, SUITESPARSE_SUBSUB_VERSION, CHOLMOD_MAIN_VERSION,
             CHOLMOD_SUB_VERSION, CHOLMOD_SUBSUB_VERSION);
    return text;
}
