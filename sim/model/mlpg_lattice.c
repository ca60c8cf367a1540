/* mlpg_lattice.c: sub-domains of a lattice: cells between nodes, and node cells. */
#include <string.h>

#include "sim/base/error.h"
#include "sim/model/mlpg.h"

/* ghost of border node `node` on `side`, as a node number; -1 when there is none */
static int ghost_of(const Cloth *cloth, int node, int side) {
    for (int g = 0; g < cloth->ghost_count; g++) {
        if (cloth->ghosts[g].border == node && cloth->ghosts[g].side == side) {
            return cloth->node_count + g;
        }
    }
    return -1;
}

static int cells_along(const Panel *p) { return p->wrap ? p->nu : p->nu - 1; }

void mlpg_lattice_membrane(const Cloth *cloth, StrainSamples *s, Arena *arena) {
    const Panel *p = &cloth->panel;
    int cells = cells_along(p), count = cells * (p->nv - 1);
    const Material *m = &cloth->material;
    *s = (StrainSamples){.kind = &strain_lattice,
                         .sample_count = count,
                         .start = arena_push(arena, int, count + 1),
                         .node = arena_push(arena, int, 4 * count),
                         .row = arena_push(arena, double, 12 * count),
                         .area = arena_push(arena, double, count),
                         .hourglass = arena_push(arena, double, 3 * count),
                         .c11 = m->c11,
                         .c12 = m->c12,
                         .c22 = m->c22,
                         .c66 = m->c66,
                         .corotational = cloth->def->kinematics == KINEMATICS_COROTATIONAL,
                         .node_limit = cloth->node_count};
    double a = 0.5 / p->h1, b = 0.5 / p->h2, k = 1.0 / (p->h1 * p->h2);
    double rows[12] = {-a, -b, k, a, -b, -k, -a, b, -k, a, b, k}; /* nodes 00, 10, 01, 11 */
    double glass = mlpg_hourglass(m, p->h1, p->h2, MLPG_HOURGLASS_LATTICE);
    for (int i = 0; i < count; i++) {
        int u = i % cells, v = i / cells, next = (u + 1) % p->nu;
        int nodes[4] = {v * p->nu + u, v * p->nu + next, (v + 1) * p->nu + u,
                        (v + 1) * p->nu + next};
        s->start[i + 1] = 4 * (i + 1);
        memcpy(s->node + 4 * i, nodes, sizeof nodes);
        memcpy(s->row + 12 * i, rows, sizeof rows);
        s->area[i] = p->h1 * p->h2;
        s->hourglass[3 * i] = glass * p->h1 * p->h2 / 12.0;
    }
}

/* three nodes and weights of a second difference along one direction */
typedef struct Stencil {
    int node[3];
    double weight;
} Stencil;

static int node_at(const Panel *p, int i, int j) {
    return j * p->nu + (p->wrap ? (i + p->nu) % p->nu : i);
}

/* curvature at node (i, j) along u (axis 0) or v (axis 1); free borders take that of the next
 * inner node, clamped ones measure against the ghost over half a spacing */
static Stencil curvature_stencil(const Cloth *cloth, int i, int j, int axis) {
    const Panel *p = &cloth->panel;
    double h = axis == 0 ? p->h1 : p->h2;
    int at = axis == 0 ? i : j, count = axis == 0 ? p->nu : p->nv;
    bool border = !(axis == 0 && p->wrap) && (at == 0 || at == count - 1);
    Stencil s = {.weight = 1.0 / (h * h)};
    int side = 2 * axis + (at != 0);
    if (border && cloth->clamp[side]) {
        int inward = at == 0 ? 1 : -1, node = node_at(p, i, j);
        s.node[0] = ghost_of(cloth, node, side);
        s.node[1] = node;
        s.node[2] = axis == 0 ? node_at(p, i + inward, j) : node_at(p, i, j + inward);
        s.weight *= 2.0;
        ASSERT(s.node[0] >= 0);
        return s;
    }
    int centre = border ? (at == 0 ? 1 : count - 2) : at;
    for (int k = -1; k <= 1; k++) {
        s.node[k + 1] = axis == 0 ? node_at(p, centre + k, j) : node_at(p, i, centre + k);
    }
    return s;
}

/* slope rows for the normal: central differences, one-sided on borders */
static void add_slope(BendingSamples *s, const Panel *p, int i, int j, int axis) {
    int at = axis == 0 ? i : j, count = axis == 0 ? p->nu : p->nv;
    double h = axis == 0 ? p->h1 : p->h2;
    bool wraps = axis == 0 && p->wrap;
    int low = wraps || at > 0 ? at - 1 : at, high = wraps || at + 1 < count ? at + 1 : at;
    for (int end = 0; end < 2; end++) {
        int k = end == 0 ? low : high;
        double w = (end == 0 ? -1.0 : 1.0) / (h * (high - low));
        BendingEntry *entry = &s->entries[s->entry_count++];
        entry->node = axis == 0 ? node_at(p, k, j) : node_at(p, i, k);
        entry->f1 = axis == 0 ? w : 0.0;
        entry->f2 = axis == 1 ? w : 0.0;
    }
}

static void add_node_sample(const Cloth *cloth, BendingSamples *s, int i, int j) {
    const Panel *p = &cloth->panel;
    const Material *m = &cloth->material;
    double second[3] = {1.0, -2.0, 1.0};
    for (int axis = 0; axis < 2; axis++) {
        Stencil stencil = curvature_stencil(cloth, i, j, axis);
        for (int k = 0; k < 3; k++) {
            BendingEntry *entry = &s->entries[s->entry_count++];
            entry->node = stencil.node[k];
            entry->g11 = axis == 0 ? second[k] * stencil.weight : 0.0;
            entry->g22 = axis == 1 ? second[k] * stencil.weight : 0.0;
        }
        if (p->rest_curvature[0] != 0.0 || p->rest_curvature[1] != 0.0) {
            add_slope(s, p, i, j, axis);
        }
    }
    double area = p->area[j * p->nu + i];
    double weight[4] = {area * m->d11, area * m->d12, area * m->d22, 0.0};
    memcpy(s->weight[s->sample_count], weight, sizeof weight);
    s->start[++s->sample_count] = s->entry_count;
}

static void add_cell_sample(const Cloth *cloth, BendingSamples *s, int i, int j) {
    const Panel *p = &cloth->panel;
    double area = p->h1 * p->h2, sign[4] = {1, -1, -1, 1};
    for (int k = 0; k < 4; k++) {
        BendingEntry *entry = &s->entries[s->entry_count++];
        entry->node = node_at(p, i + k % 2, j + k / 2);
        entry->g12 = sign[k] / area;
        entry->f1 = (k % 2 ? 0.5 : -0.5) / p->h1;
        entry->f2 = (k / 2 ? 0.5 : -0.5) / p->h2;
    }
    s->weight[s->sample_count][3] = 4.0 * area * cloth->material.d66;
    s->start[++s->sample_count] = s->entry_count;
}

void mlpg_lattice_bending(const Cloth *cloth, BendingSamples *s, Arena *arena) {
    const Panel *p = &cloth->panel;
    int cells = cells_along(p), samples = p->node_count + cells * (p->nv - 1);
    *s = (BendingSamples){0};
    s->start = arena_push(arena, int, samples + 1);
    s->entries = arena_push(arena, BendingEntry, 10 * p->node_count + 4 * cells * (p->nv - 1));
    s->weight = (double(*)[4])arena_alloc(arena, sizeof(double[4]) * (size_t)samples);
    for (int j = 0; j < p->nv; j++) {
        for (int i = 0; i < p->nu; i++) {
            add_node_sample(cloth, s, i, j);
        }
    }
    for (int j = 0; j + 1 < p->nv; j++) {
        for (int i = 0; i < cells; i++) {
            add_cell_sample(cloth, s, i, j);
        }
    }
}
