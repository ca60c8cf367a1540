/* thread_units_create.c: the units of a lattice and their curves from the fabric. */
#include <math.h>
#include <string.h>

#include "sim/model/spring_net.h"
#include "sim/model/thread_units.h"

#define STIFFEST_SHEAR 4.0 /* of the moduli: tangent of a closed trellis */

static void add_bends(const Cloth *cloth, ThreadUnits *u, int axis) {
    const Panel *p = &cloth->panel;
    bool wraps = axis == 0 && p->wrap;
    double h = axis == 0 ? p->h1 : p->h2, cell = p->h1 * p->h2;
    int end_i = axis == 0 && !wraps ? p->nu - 2 : p->nu, end_j = axis == 1 ? p->nv - 2 : p->nv;
    for (int j = 0; j < end_j; j++) {
        for (int i = 0; i < end_i; i++) {
            BendUnit *unit = &u->bends[u->bend_count++];
            *unit = (BendUnit){.axis = axis, .length = h};
            unit->area = cell * (spring_net_on_border(p, i, j, axis) ? 0.5 : 1.0);
            for (int k = 0; k < 3; k++) {
                unit->node[k] = axis == 0 ? j * p->nu + (i + k) % p->nu : (j + k) * p->nu + i;
            }
        }
    }
}

/* a wall turns the first segment over half a length */
static void add_walls(const Cloth *cloth, ThreadUnits *u) {
    const Panel *p = &cloth->panel;
    for (int g = 0; g < cloth->ghost_count; g++) {
        const Ghost *ghost = &cloth->ghosts[g];
        int i = ghost->border % p->nu, j = ghost->border / p->nu, axis = ghost->side / 2;
        int inward = ghost->side % 2 == 0 ? 1 : -1, step = axis == 0 ? 1 : p->nu;
        double h = axis == 0 ? p->h1 : p->h2;
        double width = spring_net_on_border(p, i, j, axis) ? 0.5 : 1.0;
        u->bends[u->bend_count++] = (BendUnit){
            .node = {cloth->node_count + g, ghost->border, ghost->border + inward * step},
            .axis = axis,
            .length = 0.5 * h,
            .area = 0.5 * width * p->h1 * p->h2};
    }
}

static void add_cells(const Panel *p, ThreadUnits *u) {
    int cells = p->wrap ? p->nu : p->nu - 1;
    for (int j = 0; j + 1 < p->nv; j++) {
        for (int i = 0; i < cells; i++) {
            int a = j * p->nu + i, b = j * p->nu + (i + 1) % p->nu;
            int nodes[4] = {a, b, a + p->nu, b + p->nu};
            memcpy(u->cells[u->cell_count++], nodes, sizeof nodes);
        }
    }
}

/* 2HB of the fabric is the mean of warp and weft: each has its share by its rigidity */
static void create_curves(const Cloth *cloth, ThreadUnits *u) {
    const Fabric *f = &cloth->def->fabric;
    const Material *m = &cloth->material;
    double mean = 0.5 * (m->d11 + m->d22), rigidity[2] = {m->d11, m->d22};
    for (int axis = 0; axis < 2; axis++) {
        /* with hysteresis the friction of yarns is not in the curve */
        double share = cloth->def->hysteresis ? 0.0 : 0.5 * rigidity[axis] / mean;
        double step = share * f->bend_hysteresis.value;
        u->bend[axis] = (YarnCurve){rigidity[axis], step, f->bend_onset.value};
    }
    double shear_step = cloth->def->hysteresis ? 0.0 : 0.5 * f->shear_hysteresis.value;
    YarnCurve shear = {m->c66, shear_step, SHEAR_ONSET};
    u->trellis = trellis_curve(shear, STIFFEST_SHEAR * fmax(m->c11, m->c22));
}

ThreadUnits thread_units_create(const Cloth *cloth, Arena *arena) {
    const Panel *p = &cloth->panel;
    ThreadUnits u = {.node_limit = cloth->node_count,
                     .sine = cloth->bending == BENDING_SINE,
                     .cell_area = p->h1 * p->h2,
                     .spacing = {p->h1, p->h2}};
    u.bends = arena_push(arena, BendUnit, 2 * p->node_count + cloth->ghost_count);
    u.cells = (int(*)[4])arena_alloc(arena, sizeof(int[4]) * (size_t)p->node_count);
    for (int axis = 0; axis < 2; axis++) {
        add_bends(cloth, &u, axis);
    }
    u.wall_begin = u.bend_count;
    add_walls(cloth, &u);
    add_cells(p, &u);
    create_curves(cloth, &u);
    return u;
}
