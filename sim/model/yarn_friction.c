#include "sim/model/yarn_friction.h"

#include <math.h>
#include <string.h>

#include "sim/model/stable.h"
#include "sim/model/yarn.h"

enum { N = FRICTION_ELEMENTS };

/* three nodes of a thread and the cross threads' nodes beside the middle one */
typedef struct ThreadUnit {
    int node[5];     /* a, b, c along; s, n across (b itself on a border) */
    int axis;        /* 0 warp, 1 weft */
    double area, h2; /* [m2], [m2] the square that the second difference is divided by */
} ThreadUnit;

typedef struct YarnFriction {
    const ClothModel *inner; /* the elastic model */
    ClothModel both;
    int thread_count, cell_count, node_limit;
    ThreadUnit *threads;
    int (*cells)[4];
    double cell_area;
    FrictionLaw law[3]; /* of warp, of weft, of shear at 0.5 degrees */
    double widest;      /* 2HG5/2HG */
    BlockPlace (*thread_places)[6];
    BlockPlace (*cell_places)[10];
} YarnFriction;

/* ---- elements ---- */

double yarn_friction_force(FrictionLaw law, const double *slips, double q, double *potential,
                           double *tangent) {
    double k = 2.0 * law.step / (N * law.onset), force = 0.0;
    for (int a = 0; a < N; a++) {
        double limit = law.wide * law.step * (2 * a + 1) / (N * N);
        double e = q - slips[a], pull = k * e;
        bool slides = fabs(pull) > limit;
        pull = slides ? copysign(limit, e) : pull;
        force += pull;
        if (potential) {
            *potential += slides ? limit * fabs(e) - 0.5 * limit * limit / k : 0.5 * k * e * e;
        }
        if (tangent) {
            *tangent += slides ? 0.0 : k;
        }
    }
    return force;
}

void yarn_friction_slip(FrictionLaw law, double q, double *slips) {
    if (law.step <= 0.0) {
        return;
    }
    double k = 2.0 * law.step / (N * law.onset);
    for (int a = 0; a < N; a++) {
        double e = q - slips[a], most = law.wide * law.step * (2 * a + 1) / (N * N * k);
        slips[a] += e - fmax(-most, fmin(most, e));
    }
}

/* ---- signed curvature of a thread unit: kappa = n . (a - 2b + c)/h2, n the normal ---- */

typedef struct Curved {
    double kappa;
    Vec3 n, ga, gv; /* unit normal; d kappa / d(c - a), d kappa / d(north - south) */
} Curved;

static bool curved(const ThreadUnit *t, const double *x, Curved *c) {
    Vec3 a = vec3_load(x + 3 * t->node[0]), b = vec3_load(x + 3 * t->node[1]);
    Vec3 e = vec3_load(x + 3 * t->node[2]);
    Vec3 along = vec3_sub(e, a);
    Vec3 across = vec3_sub(vec3_load(x + 3 * t->node[4]), vec3_load(x + 3 * t->node[3]));
    Vec3 normal = vec3_cross(along, across);
    double size = vec3_length(normal);
    if (size <= 0.0) {
        return false;
    }
    c->n = vec3_scale(1.0 / size, normal);
    Vec3 d = vec3_scale(1.0 / t->h2, vec3_add(vec3_axpy(a, -2.0, b), e));
    c->kappa = vec3_dot(c->n, d);
    Vec3 r = vec3_scale(1.0 / size, vec3_axpy(d, -c->kappa, c->n));
    c->ga = vec3_cross(across, r);
    c->gv = vec3_cross(r, along);
    return true;
}

static void add(double *gradient, int node, double s, Vec3 g) {
    double *at = gradient + 3 * (size_t)node;
    at[0] += s * g.x, at[1] += s * g.y, at[2] += s * g.z;
}

static void add_thread_gradient(const ThreadUnit *t, const Curved *c, double moment,
                                double *gradient) {
    double bend = moment / t->h2;
    add(gradient, t->node[0], bend, c->n), add(gradient, t->node[0], -moment, c->ga);
    add(gradient, t->node[1], -2.0 * bend, c->n);
    add(gradient, t->node[2], bend, c->n), add(gradient, t->node[2], moment, c->ga);
    add(gradient, t->node[3], -moment, c->gv);
    add(gradient, t->node[4], moment, c->gv);
}

/* ---- signed shear angle of a cell: sin(phi) = u . v ---- */

typedef struct Sheared {
    double phi;
    Vec3 row[4]; /* d phi / d node */
} Sheared;

#define SMALLEST_COSINE 1e-6

static bool sheared(const int *nodes, const double *x, Sheared *s) {
    static const double sign[4][2] = {{-0.5, -0.5}, {0.5, -0.5}, {-0.5, 0.5}, {0.5, 0.5}};
    Vec3 f[2] = {{0, 0, 0}, {0, 0, 0}}, d[2];
    double length[2];
    for (int axis = 0; axis < 2; axis++) {
        for (int k = 0; k < 4; k++) {
            f[axis] = vec3_axpy(f[axis], sign[k][axis], vec3_load(x + 3 * nodes[k]));
        }
        length[axis] = vec3_length(f[axis]);
        if (length[axis] <= 0.0) {
            return false;
        }
        f[axis] = vec3_scale(1.0 / length[axis], f[axis]);
    }
    double sine = fmax(-1.0, fmin(1.0, vec3_dot(f[0], f[1])));
    double cosine = fmax(sqrt(1.0 - sine * sine), SMALLEST_COSINE);
    s->phi = asin(sine);
    d[0] = vec3_scale(1.0 / (length[0] * cosine), vec3_axpy(f[1], -sine, f[0]));
    d[1] = vec3_scale(1.0 / (length[1] * cosine), vec3_axpy(f[0], -sine, f[1]));
    for (int k = 0; k < 4; k++) {
        s->row[k] = vec3_axpy(vec3_scale(sign[k][0], d[0]), sign[k][1], d[1]);
    }
    return true;
}

/* ---- the model that does both ---- */

/* History: N slips of each thread unit, then of each cell N slips and the angle committed last. */
enum { CELL_HISTORY = N + 1 };

static double *thread_slips(const Cloth *cloth, int i) { return cloth->history + (size_t)i * N; }

static double *cell_slips(const Cloth *cloth, int i) {
    return thread_slips(cloth, cloth->friction->thread_count) + (size_t)i * CELL_HISTORY;
}

#define NARROW 0.0087266463 /* [rad] 0.5 degrees, of 2HG */
#define WIDE 0.087266463    /* [rad] 5 degrees, of 2HG5 */

static double widening(double widest, double angle) {
    double share = (fabs(angle) - NARROW) / (WIDE - NARROW);
    return 1.0 + (widest - 1.0) * fmax(0.0, fmin(share, 1.0));
}

static FrictionLaw cell_law(const YarnFriction *f, const double *slips) {
    FrictionLaw law = f->law[2];
    law.wide = widening(f->widest, slips[N]);
    return law;
}

static double energy(const Cloth *cloth, const double *x) {
    const YarnFriction *f = cloth->friction;
    double sum = 0.0;
    for (int i = 0; i < f->thread_count; i++) {
        const ThreadUnit *t = &f->threads[i];
        double potential = 0.0;
        Curved c;
        if (curved(t, x, &c)) {
            yarn_friction_force(f->law[t->axis], thread_slips(cloth, i), c.kappa, &potential, NULL);
            sum += t->area * potential;
        }
    }
    for (int i = 0; i < f->cell_count; i++) {
        double potential = 0.0;
        Sheared s;
        if (sheared(f->cells[i], x, &s)) {
            const double *slips = cell_slips(cloth, i);
            yarn_friction_force(cell_law(f, slips), slips, s.phi, &potential, NULL);
            sum += f->cell_area * potential;
        }
    }
    return sum + f->inner->energy(cloth, x);
}

static void add_gradient(const Cloth *cloth, const double *x, double *gradient) {
    const YarnFriction *f = cloth->friction;
    f->inner->add_gradient(cloth, x, gradient);
    for (int i = 0; i < f->thread_count; i++) {
        const ThreadUnit *t = &f->threads[i];
        Curved c;
        if (curved(t, x, &c)) {
            double moment =
                yarn_friction_force(f->law[t->axis], thread_slips(cloth, i), c.kappa, NULL, NULL);
            add_thread_gradient(t, &c, t->area * moment, gradient);
        }
    }
    for (int i = 0; i < f->cell_count; i++) {
        Sheared s;
        if (sheared(f->cells[i], x, &s)) {
            const double *slips = cell_slips(cloth, i);
            double force = yarn_friction_force(cell_law(f, slips), slips, s.phi, NULL, NULL);
            for (int k = 0; k < 4; k++) {
                add(gradient, f->cells[i][k], f->cell_area * force, s.row[k]);
            }
        }
    }
}

static int couple(const Cloth *cloth, int *pairs) {
    const YarnFriction *f = cloth->friction;
    int count = f->inner->couple(cloth, pairs);
    for (int i = 0; i < f->thread_count; i++) {
        count +=
            block_pairs(f->threads[i].node, 3, f->node_limit, pairs ? pairs + 2 * count : NULL);
    }
    for (int i = 0; i < f->cell_count; i++) {
        count += block_pairs(f->cells[i], 4, f->node_limit, pairs ? pairs + 2 * count : NULL);
    }
    return count;
}

static void bind_hessian(Cloth *cloth, const BlockMatrix *matrix, int first, Arena *arena) {
    YarnFriction *f = cloth->friction;
    f->inner->bind_hessian(cloth, matrix, first, arena);
    f->thread_places =
        (BlockPlace(*)[6])arena_alloc(arena, sizeof(BlockPlace[6]) * (size_t)f->thread_count);
    f->cell_places =
        (BlockPlace(*)[10])arena_alloc(arena, sizeof(BlockPlace[10]) * (size_t)f->cell_count);
    for (int i = 0; i < f->thread_count; i++) {
        block_places(matrix, f->threads[i].node, 3, f->node_limit, first, f->thread_places[i]);
    }
    for (int i = 0; i < f->cell_count; i++) {
        block_places(matrix, f->cells[i], 4, f->node_limit, first, f->cell_places[i]);
    }
}

/* values += stiffness row row' for `count` nodes */
static void add_rows(const Vec3 *rows, int count, double stiffness, const BlockPlace *places,
                     double *values) {
    for (int p = 0; p < count; p++) {
        const double left[3] = {rows[p].x, rows[p].y, rows[p].z};
        for (int q = 0; q <= p; q++, places++) {
            const double right[3] = {rows[q].x, rows[q].y, rows[q].z};
            double block[9];
            for (int k = 0; k < 9; k++) {
                block[k] = stiffness * left[k / 3] * right[k % 3];
            }
            if (places->base >= 0) {
                block_add(values, *places, block);
            }
        }
    }
}

/* positive semidefinite; the turning normal and second derivatives of angles are left out */
static void add_hessian(const Cloth *cloth, const double *x, const double *stress, bool definite,
                        double *values) {
    const YarnFriction *f = cloth->friction;
    f->inner->add_hessian(cloth, x, stress, definite, values);
    for (int i = 0; i < f->thread_count; i++) {
        const ThreadUnit *t = &f->threads[i];
        double tangent = 0.0;
        Curved c;
        if (curved(t, x, &c)) {
            yarn_friction_force(f->law[t->axis], thread_slips(cloth, i), c.kappa, NULL, &tangent);
            Vec3 rows[3] = {c.n, vec3_scale(-2.0, c.n), c.n};
            add_rows(rows, 3, t->area * tangent / (t->h2 * t->h2), f->thread_places[i], values);
        }
    }
    for (int i = 0; i < f->cell_count; i++) {
        double tangent = 0.0;
        Sheared s;
        if (sheared(f->cells[i], x, &s)) {
            const double *slips = cell_slips(cloth, i);
            yarn_friction_force(cell_law(f, slips), slips, s.phi, NULL, &tangent);
            add_rows(s.row, 4, f->cell_area * tangent, f->cell_places[i], values);
        }
    }
}

static void commit(Cloth *cloth, const double *x) {
    const YarnFriction *f = cloth->friction;
    for (int i = 0; i < f->thread_count; i++) {
        const ThreadUnit *t = &f->threads[i];
        Curved c;
        if (curved(t, x, &c)) {
            yarn_friction_slip(f->law[t->axis], c.kappa, thread_slips(cloth, i));
        }
    }
    for (int i = 0; i < f->cell_count; i++) {
        Sheared s;
        if (sheared(f->cells[i], x, &s)) {
            double *slips = cell_slips(cloth, i);
            slips[N] = s.phi; /* the limits of this angle hold from here on */
            yarn_friction_slip(cell_law(f, slips), s.phi, slips);
        }
    }
}

/* ---- units of a lattice ---- */

static int node_at(const Panel *p, int i, int j) {
    return j * p->nu + (p->wrap ? (i + p->nu) % p->nu : i);
}

/* nodes beside (i, j) across `axis`; one-sided on a border */
static void find_across(const Panel *p, int axis, int i, int j, int out[2]) {
    for (int side = 0; side < 2; side++) {
        int step = side ? 1 : -1, u = axis == 0 ? i : i + step, v = axis == 0 ? j + step : j;
        bool inside = v >= 0 && v < p->nv && (p->wrap || (u >= 0 && u < p->nu));
        out[side] = inside ? node_at(p, u, v) : node_at(p, i, j);
    }
}

static bool on_border(const Panel *p, int axis, int i, int j) {
    return axis == 0 ? j == 0 || j == p->nv - 1 : !p->wrap && (i == 0 || i == p->nu - 1);
}

static void add_threads(const Panel *p, int axis, YarnFriction *f) {
    double h = axis == 0 ? p->h1 : p->h2;
    for (int j = 0; j < p->nv; j++) {
        for (int i = 0; i < p->nu; i++) {
            bool wraps = axis == 0 && p->wrap;
            int at = axis == 0 ? i : j, count = axis == 0 ? p->nu : p->nv;
            if (!wraps && (at == 0 || at == count - 1)) {
                continue;
            }
            int u = axis == 0, v = axis == 1;
            ThreadUnit *t = &f->threads[f->thread_count++];
            *t = (ThreadUnit){
                .node = {node_at(p, i - u, j - v), node_at(p, i, j), node_at(p, i + u, j + v)},
                .axis = axis,
                .area = p->h1 * p->h2 * (on_border(p, axis, i, j) ? 0.5 : 1.0),
                .h2 = h * h};
            find_across(p, axis, i, j, t->node + 3);
        }
    }
}

/* a wall turns the first segment over half a length */
static void add_walls(const Cloth *cloth, YarnFriction *f) {
    const Panel *p = &cloth->panel;
    for (int g = 0; g < cloth->ghost_count; g++) {
        const Ghost *ghost = &cloth->ghosts[g];
        int i = ghost->border % p->nu, j = ghost->border / p->nu, axis = ghost->side / 2;
        bool low = ghost->side % 2 == 0;
        int step = low ? 1 : -1, outer = cloth->node_count + g;
        int inner = axis == 0 ? node_at(p, i + step, j) : node_at(p, i, j + step);
        double h = axis == 0 ? p->h1 : p->h2, width = on_border(p, axis, i, j) ? 0.5 : 1.0;
        ThreadUnit *t = &f->threads[f->thread_count++];
        *t = (ThreadUnit){.node = {low ? outer : inner, ghost->border, low ? inner : outer},
                          .axis = axis,
                          .area = 0.5 * width * p->h1 * p->h2,
                          .h2 = 0.5 * h * h};
        find_across(p, axis, i, j, t->node + 3);
    }
}

static void add_cells(const Panel *p, YarnFriction *f) {
    int cells = p->wrap ? p->nu : p->nu - 1;
    f->cell_area = p->h1 * p->h2;
    for (int j = 0; j + 1 < p->nv; j++) {
        for (int i = 0; i < cells; i++) {
            int nodes[4] = {node_at(p, i, j), node_at(p, i + 1, j), node_at(p, i, j + 1),
                            node_at(p, i + 1, j + 1)};
            memcpy(f->cells[f->cell_count++], nodes, sizeof nodes);
        }
    }
}

/* 2HG5/2HG; the machine measures moment / cos(angle) */
static double widest_of(const Fabric *fabric) {
    double narrow = fabric->shear_hysteresis.value, wide = fabric->shear_hysteresis5.value;
    return narrow > 0.0 ? wide * cos(WIDE) / (narrow * cos(NARROW)) : 1.0;
}

/* 2HB of the fabric is the mean of warp and weft: each has its share by its rigidity */
FrictionLaw yarn_friction_law(const Fabric *fabric, FabricCurveKind kind, double angle) {
    if (kind == FABRIC_CURVE_SHEAR) {
        double wide = widening(widest_of(fabric), angle);
        return (FrictionLaw){0.5 * fabric->shear_hysteresis.value, SHEAR_ONSET, wide};
    }
    double b[2] = {fabric->bend_warp.value, fabric->bend_weft.value};
    double step = fabric->bend_hysteresis.value * b[kind] / (b[0] + b[1]);
    return (FrictionLaw){step, fabric->bend_onset.value, 1.0};
}

static void set_limits(const Cloth *cloth, YarnFriction *f) {
    const Fabric *fabric = &cloth->def->fabric;
    for (int kind = 0; kind < FABRIC_CURVES; kind++) {
        f->law[kind] = yarn_friction_law(fabric, kind, 0.0);
    }
    f->widest = widest_of(fabric);
}

bool yarn_friction_attach(Cloth *cloth, Arena *arena, Error *error) {
    const Panel *p = &cloth->panel;
    if (p->nu == 0) {
        return error_set(error, EXIT_BAD_INPUT,
                         "cloth '%s': 'hysteresis: true' needs a lattice; this cloth has scattered "
                         "nodes",
                         cloth->def->name);
    }
    YarnFriction *f = arena_push(arena, YarnFriction, 1);
    *f = (YarnFriction){
        .inner = cloth->model, .both = *cloth->model, .node_limit = cloth->node_count};
    f->threads = arena_push(arena, ThreadUnit, 2 * p->node_count + cloth->ghost_count);
    f->cells = (int(*)[4])arena_alloc(arena, sizeof(int[4]) * (size_t)p->node_count);
    add_threads(p, 0, f), add_threads(p, 1, f);
    add_walls(cloth, f);
    add_cells(p, f);
    set_limits(cloth, f);
    f->both.energy = energy, f->both.add_gradient = add_gradient;
    f->both.couple = couple, f->both.bind_hessian = bind_hessian;
    f->both.add_hessian = add_hessian, f->both.commit = commit;
    f->both.stable_step = stable_step_by_power;
    cloth->friction = f;
    cloth->model = &f->both;
    cloth->lattice = NULL;              /* the sweep knows no history */
    f->both.add_damped_gradient = NULL; /* friction damps */
    f->both.fastest = NULL;
    cloth->history_count = N * f->thread_count + CELL_HISTORY * f->cell_count;
    cloth->history = arena_push(arena, double, cloth->history_count);
    return true;
}
