#include "sim/solve/block_matrix.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/error.h"
#include "sim/base/memory.h"
#include "sim/solve/factor.h"

static int compare_keys(const void *a, const void *b) {
    uint64_t x = *(const uint64_t *)a, y = *(const uint64_t *)b;
    return (x > y) - (x < y);
}

/* sorted, unique (column, row) keys of the lower triangle in elimination order */
static int lower_keys(const int *order, int node_count, const int *pairs, int pair_count,
                      uint64_t *keys) {
    int count = 0;
    for (int i = 0; i < node_count; i++) {
        keys[count++] = (uint64_t)i << 32 | (uint32_t)i;
    }
    for (int k = 0; k < pair_count; k++) {
        int a = order[pairs[2 * k]], b = order[pairs[2 * k + 1]];
        uint64_t column = (uint64_t)(a < b ? a : b), row = (uint64_t)(a < b ? b : a);
        keys[count++] = column << 32 | row;
    }
    qsort(keys, (size_t)count, sizeof *keys, compare_keys);
    int unique = 0;
    for (int k = 0; k < count; k++) {
        if (unique == 0 || keys[k] != keys[unique - 1]) {
            keys[unique++] = keys[k];
        }
    }
    return unique;
}

static void fill_scalar_pattern(BlockMatrix *m) {
    int at = 0;
    for (int j = 0; j < m->node_count; j++) {
        for (int c = 0; c < 3; c++) {
            m->scalar_start[3 * j + c] = at;
            for (int k = m->column_start[j]; k < m->column_start[j + 1]; k++) {
                for (int r = 0; r < 3; r++) {
                    m->scalar_row[at++] = 3 * m->row[k] + r;
                }
            }
        }
    }
    m->scalar_start[3 * m->node_count] = at;
}

BlockMatrix block_matrix_create(int node_count, const int *pairs, int pair_count, Arena *arena) {
    BlockMatrix m = {.node_count = node_count};
    m.order = arena_push(arena, int, node_count);
    factor_order(node_count, pairs, pair_count, m.order);
    uint64_t *keys = memory_new(((size_t)node_count + (size_t)pair_count) * sizeof *keys);
    int block_count = lower_keys(m.order, node_count, pairs, pair_count, keys);
    m.column_start = arena_push(arena, int, node_count + 1);
    m.row = arena_push(arena, int, block_count);
    for (int k = 0; k < block_count; k++) {
        m.row[k] = (int)(keys[k] & 0xffffffffu);
        m.column_start[(keys[k] >> 32) + 1]++;
    }
    free(keys);
    for (int j = 0; j < node_count; j++) {
        m.column_start[j + 1] += m.column_start[j];
    }
    m.scalar_start = arena_push(arena, int, 3 * node_count + 1);
    m.scalar_row = arena_push(arena, int, 9 * block_count);
    m.values = arena_push(arena, double, 9 * block_count);
    fill_scalar_pattern(&m);
    return m;
}

int block_pairs(const int *nodes, int count, int limit, int *pairs) {
    int found = 0;
    for (int a = 1; a < count; a++) {
        for (int b = 0; b < a; b++) {
            if (nodes[a] < limit && nodes[b] < limit) {
                if (pairs) {
                    pairs[2 * found] = nodes[a], pairs[2 * found + 1] = nodes[b];
                }
                found++;
            }
        }
    }
    return found;
}

int block_places(const BlockMatrix *matrix, const int *nodes, int count, int limit, int first,
                 BlockPlace *places) {
    int found = 0;
    for (int a = 0; a < count; a++) {
        for (int b = 0; b <= a; b++) {
            bool solved = nodes[a] < limit && nodes[b] < limit;
            places[found++] = solved
                                  ? block_matrix_place(matrix, first + nodes[a], first + nodes[b])
                                  : (BlockPlace){-1, 0};
        }
    }
    return found;
}

int block_matrix_block_count(const BlockMatrix *m) { return m->column_start[m->node_count]; }

bool block_matrix_find(const BlockMatrix *m, int row, int column, BlockPlace *place) {
    int r = m->order[row], c = m->order[column];
    int low = r < c ? r : c, high = r < c ? c : r;
    int first = m->column_start[low], end = m->column_start[low + 1];
    int begin = first, stop = end;
    while (begin < stop) {
        int middle = (begin + stop) / 2;
        if (m->row[middle] < high) {
            begin = middle + 1;
        } else {
            stop = middle;
        }
    }
    if (begin == end || m->row[begin] != high) {
        return false;
    }
    int stride = 3 * (end - first);
    int base = 9 * first + 3 * (begin - first);
    *place = (BlockPlace){base, r < c ? -stride : stride};
    return true;
}

BlockPlace block_matrix_place(const BlockMatrix *m, int row, int column) {
    BlockPlace place = {0, 0};
    ASSERT(block_matrix_find(m, row, column, &place));
    return place;
}

void block_matrix_multiply(const BlockMatrix *m, const double *x, double *y) {
    int *node = memory_new((size_t)m->node_count * sizeof *node);
    for (int i = 0; i < m->node_count; i++) {
        node[m->order[i]] = i;
    }
    memset(y, 0, (size_t)m->node_count * 3 * sizeof *y);
    for (int j = 0; j < m->node_count; j++) {
        for (int c = 0; c < 3; c++) {
            const double *column = m->values + m->scalar_start[3 * j + c];
            int nj = 3 * node[j] + c;
            for (int k = m->column_start[j]; k < m->column_start[j + 1]; k++) {
                int ni = 3 * node[m->row[k]];
                for (int r = 0; r < 3; r++, column++) {
                    y[ni + r] += *column * x[nj];
                    y[nj] += m->row[k] != j ? *column * x[ni + r] : 0.0;
                }
            }
        }
    }
    free(node);
}
