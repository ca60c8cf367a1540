/* mlpg_scattered.c: strain and curvature of a cell as boundary integrals of RBF edge values and
 * slopes (mlpg.md). Both cells of an edge use the same values, so the edge terms
 * telescope and the patch tests are exact whatever the smoothness of the trial functions. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/error.h"
#include "sim/base/memory.h"
#include "sim/geom/rbf.h"
#include "sim/model/cells.h"
#include "sim/model/mlpg.h"

enum { GAUSS = 2 };
static const double gauss_point[GAUSS] = {-0.28867513459481287, 0.28867513459481287};

/* growing rows of one cell: node -> weights of up to five slopes */
typedef struct CellRows {
    int count, capacity;
    BendingEntry *entries;
} CellRows;

static BendingEntry *row_entry(CellRows *rows, int node) {
    for (int k = 0; k < rows->count; k++) {
        if (rows->entries[k].node == node) {
            return &rows->entries[k];
        }
    }
    if (rows->count == rows->capacity) {
        rows->capacity = rows->capacity ? 2 * rows->capacity : 32;
        rows->entries =
            memory_resize(rows->entries, (size_t)rows->capacity * sizeof *rows->entries);
    }
    rows->entries[rows->count] = (BendingEntry){.node = node};
    return &rows->entries[rows->count++];
}

/* ghost that prescribes the slope on a border edge of `node`, or -1 */
static int border_ghost(const Cloth *cloth, int node, const CellEdge *edge) {
    for (int g = 0; edge->right < 0 && g < cloth->ghost_count; g++) {
        const Ghost *ghost = &cloth->ghosts[g];
        double aligned = ghost->out[0] * edge->normal[0] + ghost->out[1] * edge->normal[1];
        if (ghost->border == node && aligned > 0.7) {
            return cloth->node_count + g;
        }
    }
    return -1;
}

/* adds the slope row (d1, d2) of `node` at an edge to the curvature rows of both cells */
static void add_curvature(CellRows *rows, const CellEdge *edge, const double *area, int node,
                          double weight, double d1, double d2) {
    for (int side = 0; side < 2; side++) {
        int cell = side == 0 ? edge->left : edge->right;
        if (cell < 0) {
            continue;
        }
        double w = (side == 0 ? 1.0 : -1.0) * weight * edge->length / area[cell];
        BendingEntry *entry = row_entry(&rows[cell], node);
        entry->g11 += w * d1 * edge->normal[0];
        entry->g22 += w * d2 * edge->normal[1];
        entry->g12 += 0.5 * w * (d1 * edge->normal[1] + d2 * edge->normal[0]);
    }
}

static void edge_slopes(const Cloth *cloth, const PointGrid *grid, const CellEdge *edge,
                        RbfKind kind, const double *area, CellRows *rows, Arena *scratch) {
    static const RbfFunctional slopes[2] = {RBF_D1, RBF_D2};
    ArenaMark mark = arena_mark(scratch);
    RbfStencil stencil = rbf_stencil(grid, kind, edge->middle, scratch);
    int ghost = border_ghost(cloth, edge->left, edge);
    const double *n = edge->normal;
    for (int g = 0; g < GAUSS; g++) {
        double weights[2][STENCIL_CAPACITY];
        double at[2] = {edge->middle[0] + gauss_point[g] * edge->along[0],
                        edge->middle[1] + gauss_point[g] * edge->along[1]};
        rbf_rows(&stencil, at, 2, slopes, weights);
        for (int k = 0; k < stencil.count; k++) {
            double d1 = weights[0][k], d2 = weights[1][k];
            if (ghost >= 0) { /* keep the tangential slope, the normal one is prescribed */
                double normal = d1 * n[0] + d2 * n[1];
                d1 -= normal * n[0], d2 -= normal * n[1];
            }
            add_curvature(rows, edge, area, stencil.nodes[k], 1.0 / GAUSS, d1, d2);
        }
    }
    if (ghost >= 0) {
        double inverse = 1.0 / cloth->panel.h1;
        add_curvature(rows, edge, area, ghost, 1.0, inverse * n[0], inverse * n[1]);
        add_curvature(rows, edge, area, edge->left, 1.0, -inverse * n[0], -inverse * n[1]);
    }
    arena_rewind(scratch, mark);
}

/* a wrapped lattice is unrolled three times, so that stencils see across the seam */
static PointGrid make_grid(const Panel *p, Arena *arena) {
    if (!p->wrap) {
        return points_grid(p->material, p->node_count, p->h1, arena);
    }
    double *points = arena_push(arena, double, 6 * p->node_count);
    double width = p->h1 * p->nu;
    for (int copy = 0; copy < 3; copy++) {
        for (int i = 0; i < p->node_count; i++) {
            double *to = points + 2 * (copy * p->node_count + i);
            to[0] = p->material[2 * i] + (copy - 1) * width;
            to[1] = p->material[2 * i + 1];
        }
    }
    return points_grid(points, 3 * p->node_count, p->h1, arena);
}

/* all curvature rows; the caller frees rows[i].entries and rows */
static CellRows *curvature_rows(const Cloth *cloth, const Cells *cells, RbfKind kind) {
    const Panel *p = &cloth->panel;
    CellRows *rows = memory_zeroed((size_t)p->node_count, sizeof *rows);
    CellRows *folded = rows;
    Arena scratch = {0};
    PointGrid grid = make_grid(p, &scratch);
    for (int e = 0; e < cells->edge_count; e++) {
        edge_slopes(cloth, &grid, &cells->edges[e], kind, cells->area, rows, &scratch);
    }
    for (int i = 0; p->wrap && i < p->node_count; i++) {
        CellRows merged = {0};
        for (int k = 0; k < rows[i].count; k++) {
            const BendingEntry *from = &rows[i].entries[k];
            BendingEntry *to = row_entry(&merged, from->node % p->node_count);
            to->g11 += from->g11, to->g22 += from->g22, to->g12 += from->g12;
        }
        free(rows[i].entries);
        folded[i] = merged;
    }
    arena_free(&scratch);
    return rows;
}

static void free_rows(CellRows *rows, int count) {
    for (int i = 0; i < count; i++) {
        free(rows[i].entries);
    }
    free(rows);
}

/* slopes F1, F2 of a cell from RBF edge values: F_a = 1/A sum s l Phi n_a x */
static void add_values(const Cloth *cloth, const Cells *cells, CellRows *rows) {
    static const RbfFunctional value[1] = {RBF_VALUE};
    Arena scratch = {0};
    PointGrid grid = make_grid(&cloth->panel, &scratch);
    for (int e = 0; e < cells->edge_count; e++) {
        const CellEdge *edge = &cells->edges[e];
        ArenaMark mark = arena_mark(&scratch);
        RbfStencil stencil = rbf_stencil(&grid, rbf_scattered_membrane, edge->middle, &scratch);
        for (int g = 0; g < GAUSS; g++) {
            double weights[1][STENCIL_CAPACITY];
            double at[2] = {edge->middle[0] + gauss_point[g] * edge->along[0],
                            edge->middle[1] + gauss_point[g] * edge->along[1]};
            rbf_rows(&stencil, at, 1, value, weights);
            for (int k = 0; k < stencil.count; k++) {
                for (int side = 0; side < 2; side++) {
                    int cell = side == 0 ? edge->left : edge->right;
                    if (cell < 0) {
                        continue;
                    }
                    double w = (side == 0 ? 1.0 : -1.0) * edge->length * weights[0][k] /
                               (GAUSS * cells->area[cell]);
                    int node = stencil.nodes[k] % cloth->panel.node_count;
                    BendingEntry *entry = row_entry(&rows[cell], node);
                    entry->f1 += w * edge->normal[0];
                    entry->f2 += w * edge->normal[1];
                }
            }
        }
        arena_rewind(&scratch, mark);
    }
    arena_free(&scratch);
}

static int count_entries(const CellRows *rows, int cells) {
    int count = 0;
    for (int i = 0; i < cells; i++) {
        count += rows[i].count;
    }
    return count;
}

void mlpg_rbf_bending(const Cloth *cloth, BendingSamples *s, Arena *arena) {
    const Panel *p = &cloth->panel;
    const Material *m = &cloth->material;
    Cells cells = cells_create(p, arena);
    CellRows *rows =
        curvature_rows(cloth, &cells, p->nu > 0 ? rbf_lattice_edge : rbf_scattered_edge);
    if (p->rest_curvature[0] != 0.0 || p->rest_curvature[1] != 0.0) {
        add_values(cloth, &cells, rows);
    }
    *s = (BendingSamples){.sample_count = p->node_count};
    s->start = arena_push(arena, int, p->node_count + 1);
    s->entries = arena_push(arena, BendingEntry, count_entries(rows, p->node_count));
    s->weight = (double(*)[4])arena_alloc(arena, sizeof(double[4]) * (size_t)p->node_count);
    for (int i = 0; i < p->node_count; i++) {
        double area = cells.area[i];
        double weight[4] = {area * m->d11, area * m->d12, area * m->d22, 4.0 * area * m->d66};
        memcpy(s->weight[i], weight, sizeof weight);
        memcpy(s->entries + s->entry_count, rows[i].entries,
               (size_t)rows[i].count * sizeof *rows[i].entries);
        s->entry_count += rows[i].count;
        s->start[i + 1] = s->entry_count;
    }
    free_rows(rows, p->node_count);
}

void mlpg_scattered_membrane(const Cloth *cloth, StrainSamples *s, Arena *arena) {
    const Panel *p = &cloth->panel;
    const Material *m = &cloth->material;
    Cells cells = cells_create(p, arena);
    CellRows *rows = curvature_rows(cloth, &cells, rbf_scattered_edge);
    add_values(cloth, &cells, rows);
    int count = p->node_count, entries = count_entries(rows, count);
    *s = (StrainSamples){.kind = &strain_scattered,
                         .sample_count = count,
                         .start = arena_push(arena, int, count + 1),
                         .node = arena_push(arena, int, entries),
                         .row = arena_push(arena, double, 5 * entries),
                         .area = cells.area,
                         .hourglass = arena_push(arena, double, 3 * count),
                         .c11 = m->c11,
                         .c12 = m->c12,
                         .c22 = m->c22,
                         .c66 = m->c66,
                         .corotational = cloth->def->kinematics == KINEMATICS_COROTATIONAL,
                         .node_limit = cloth->node_count};
    double glass = mlpg_hourglass(m, p->h1, p->h2, MLPG_HOURGLASS_SCATTERED);
    int at = 0;
    for (int i = 0; i < count; i++) {
        for (int k = 0; k < rows[i].count; k++, at++) {
            const BendingEntry *e = &rows[i].entries[k];
            double row[5] = {e->f1, e->f2, e->g11, e->g12, e->g22};
            s->node[at] = e->node;
            memcpy(s->row + 5 * (size_t)at, row, sizeof row);
        }
        s->start[i + 1] = at;
        for (int c = 0; c < 3; c++) {
            s->hourglass[3 * i + c] = glass * cells.moment[i][c];
        }
    }
    free_rows(rows, count);
}
