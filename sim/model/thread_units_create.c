/* thread_units_create.c: the units of a lattice and their curves from the fabric. */
#include <math.h>
#include <string.h>

#include "sim/model/spring_net.h"
#include "sim/model/thread_units.h"
#include "sim/model/yarn_friction.h"

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

/* ---- curves ---- */

static const char *const curve_names[] = {"bending along the warp", "bending along the weft",
                                          "shear"};

/* The table of a measured curve; with hysteresis without the friction of yarns, whose first loading
 * is in the measurement and in the elements beside it. */
static bool create_table(const Cloth *cloth, FabricCurveKind kind, YarnCurve *curve, Arena *arena,
                         Error *error) {
    const FabricCurve *measured = &cloth->def->fabric.curves[kind];
    YarnTable *table = arena_push(arena, YarnTable, 1);
    double value[FABRIC_CURVE_MOST];
    for (int k = 0; k < measured->count; k++) {
        double at = measured->at[k];
        const double unslipped[FRICTION_ELEMENTS] = {0.0};
        FrictionLaw law = yarn_friction_law(&cloth->def->fabric, kind, at);
        double friction = yarn_friction_force(law, unslipped, at, NULL, NULL);
        friction /= kind == FABRIC_CURVE_SHEAR ? cos(at) : 1.0;
        value[k] = measured->value[k] - (cloth->def->hysteresis ? friction : 0.0);
    }
    int bad = yarn_table_create(measured->count, measured->at, value, table);
    if (bad >= 0) {
        return error_set(error, EXIT_BAD_INPUT,
                         "cloth '%s': the curve of %s does not rise to its point %d without the "
                         "hysteresis of the fabric; is that, or its onset, of another cloth?",
                         cloth->def->name, curve_names[kind], bad + 1);
    }
    *curve = (YarnCurve){curve->slope, 0.0, 1.0, table};
    return true;
}

/* 2HB of the fabric is the mean of warp and weft: each has its share by its rigidity */
static bool create_curves(const Cloth *cloth, ThreadUnits *u, Arena *arena, Error *error) {
    const Fabric *f = &cloth->def->fabric;
    const Material *m = &cloth->material;
    double mean = 0.5 * (m->d11 + m->d22), rigidity[2] = {m->d11, m->d22};
    /* with hysteresis the friction of yarns is not in the curve */
    double half = cloth->def->hysteresis ? 0.0 : 0.5;
    YarnCurve curves[FABRIC_CURVES];
    for (int axis = 0; axis < 2; axis++) {
        double step = half * rigidity[axis] / mean * f->bend_hysteresis.value;
        curves[axis] = (YarnCurve){rigidity[axis], step, f->bend_onset.value, NULL};
    }
    curves[FABRIC_CURVE_SHEAR] =
        (YarnCurve){m->c66, half * f->shear_hysteresis.value, SHEAR_ONSET, NULL};
    for (int k = 0; k < FABRIC_CURVES; k++) {
        if (f->curves[k].count > 0 && !create_table(cloth, k, &curves[k], arena, error)) {
            return false;
        }
    }
    u->bend[0] = curves[FABRIC_CURVE_WARP], u->bend[1] = curves[FABRIC_CURVE_WEFT];
    u->trellis = trellis_curve(curves[FABRIC_CURVE_SHEAR], STIFFEST_SHEAR * fmax(m->c11, m->c22));
    return u->trellis.end[1] > 0.0 ||
           error_set(error, EXIT_BAD_INPUT,
                     "cloth '%s': the curve of shear is too flat at its end: its moment "
                     "F cos(angle) falls there",
                     cloth->def->name);
}

bool thread_units_create(const Cloth *cloth, ThreadUnits *u, Arena *arena, Error *error) {
    const Panel *p = &cloth->panel;
    *u = (ThreadUnits){.node_limit = cloth->node_count,
                       .sine = cloth->bending == BENDING_SINE,
                       .cell_area = p->h1 * p->h2,
                       .spacing = {p->h1, p->h2}};
    u->bends = arena_push(arena, BendUnit, 2 * p->node_count + cloth->ghost_count);
    u->cells = (int(*)[4])arena_alloc(arena, sizeof(int[4]) * (size_t)p->node_count);
    for (int axis = 0; axis < 2; axis++) {
        add_bends(cloth, u, axis);
    }
    u->wall_begin = u->bend_count;
    add_walls(cloth, u);
    add_cells(p, u);
    return create_curves(cloth, u, arena, error);
}
