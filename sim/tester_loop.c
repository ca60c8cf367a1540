#include "sim/tester_loop.h"

#include <math.h>

#include "sim/model/model.h"
#include "sim/model/yarn.h"

enum { SEGMENTS = 10 };
#define BEND_LENGTH 0.01 /* [m] between the walls */
#define BEND_WIDTH 0.002
#define SHEAR_LENGTH 0.2 /* [m] */
#define SHEAR_HEIGHT 0.05

typedef struct Specimen {
    TesterKind kind;
    ClothDef def;
    Cloth cloth;
    double *x;
} Specimen;

/* What the three machines are. */
typedef struct Machine {
    double most; /* [1/m] or [rad] */
    int branches;
    double width, height; /* [m] */
    int nodes[2];
    double step; /* [1/m] or [rad] of differences */
} Machine;

static const Machine machines[] = {
    [TESTER_BENDING] = {250.0, 3, BEND_LENGTH, BEND_WIDTH, {SEGMENTS + 1, 3}, 1e-2},
    [TESTER_SHEAR] = {8.0 * PI / 180.0, 3, SHEAR_LENGTH, SHEAR_HEIGHT, {21, 6}, 1e-5},
    [TESTER_PICTURE] = {40.0 * PI / 180.0, 2, TESTER_FRAME_SIDE, TESTER_FRAME_SIDE, {11, 11}, 1e-5},
};

static bool make_specimen(Specimen *s, const Fabric *fabric, const char *model, Arena *arena,
                          Error *error) {
    const Machine *machine = &machines[s->kind];
    bool bending = s->kind == TESTER_BENDING;
    HandleDef walls[2] = {handle_default(), handle_default()};
    s->def = cloth_default();
    s->def.name = "specimen";
    s->def.fabric = *fabric;
    s->def.fabric.bend_poisson.value = 0.0; /* the machine sees strips */
    s->def.model = model;
    s->def.hysteresis = true;
    s->def.shape.kind = SHAPE_RECTANGLE;
    s->def.shape.width = machine->width;
    s->def.shape.height = machine->height;
    s->def.nodes[0] = machine->nodes[0];
    s->def.nodes[1] = machine->nodes[1];
    walls[0].kind = walls[1].kind = HANDLE_CLAMP;
    walls[0].region = REGION_LEFT, walls[1].region = REGION_RIGHT;
    if (!cloth_create(&s->cloth, &s->def, walls, bending ? 2 : 0, 1, arena, error)) {
        return false;
    }
    ASSERT(s->cloth.model && s->cloth.model->commit);
    s->x = arena_push(arena, double, 3 * (s->cloth.node_count + s->cloth.ghost_count));
    return true;
}

/* the ghost of row j on that side */
static int ghost_of(const Cloth *cloth, int j, int side) {
    for (int g = 0; g < cloth->ghost_count; g++) {
        if (cloth->ghosts[g].border / cloth->panel.nu == j && cloth->ghosts[g].side == side) {
            return cloth->node_count + g;
        }
    }
    ASSERT(false);
    return -1;
}

/* nodes on a polygon of uniform curvature; a wall turns half as much as a node */
static void bend(Specimen *s, double curvature) {
    const Panel *p = &s->cloth.panel;
    double turn = curvature * p->h1, at[2] = {0, 0};
    for (int i = -1; i <= p->nu; i++) {
        for (int j = 0; j < p->nv; j++) {
            int place = i < 0        ? ghost_of(&s->cloth, j, 0)
                        : i == p->nu ? ghost_of(&s->cloth, j, 1)
                                     : j * p->nu + i;
            vec3_store(s->x + 3 * place, vec3(at[0], p->h2 * j, at[1]));
        }
        double angle = turn * (i < 0 ? 0.0 : i >= SEGMENTS ? SEGMENTS : i + 0.5);
        at[0] += p->h1 * cos(angle), at[1] += p->h1 * sin(angle);
    }
}

/* threads along u and v turn towards each other; each by half, in a frame */
static void shear(Specimen *s, double along_u, double along_v) {
    for (int i = 0; i < s->cloth.node_count; i++) {
        const double *uv = s->cloth.panel.material + 2 * i;
        vec3_store(s->x + 3 * i, vec3(uv[0] * cos(along_u) + uv[1] * sin(along_v),
                                      uv[0] * sin(along_u) + uv[1] * cos(along_v), 0));
    }
}

static void pose(Specimen *s, double at) {
    if (s->kind == TESTER_BENDING) {
        bend(s, at);
    } else if (s->kind == TESTER_SHEAR) {
        shear(s, 0.0, at);
    } else {
        shear(s, 0.5 * at, 0.5 * at);
    }
}

/* work per motion, per width, with the history as it is; then the pose is accepted */
static double drive(Specimen *s, double at) {
    const Machine *machine = &machines[s->kind];
    const ClothModel *model = s->cloth.model;
    double energy[2];
    ASSERT(model);
    for (int k = 0; k < 2; k++) {
        pose(s, at + (k ? machine->step : -machine->step));
        energy[k] = model->energy(&s->cloth, s->x);
    }
    pose(s, at);
    model->commit(&s->cloth, s->x);
    double work = (energy[1] - energy[0]) / (2 * machine->step * machine->width * machine->height);
    return s->kind == TESTER_BENDING ? work : work / cos(at);
}

/* What the machine reads: branches 2 (falling) and 3 (rising) have `at` at most (1 - 2 k/count). */
static void evaluate(TesterKind kind, double most, TesterLoop *l) {
    int n = l->count;
    const double *down = l->force + n - 1, *up = l->force + 2 * n - 1; /* index k = 0 .. n */
    bool bending = kind == TESTER_BENDING;
    /* in steps from the middle: 50, 150, 100 /m of 250; 0.5, 2.5, 0.5 degrees of 8 */
    int low = bending ? n / 10 : n / 32, high = bending ? n * 3 / 10 : n * 5 / 32;
    int at = bending ? n / 5 : n / 32, middle = n / 2;
    double rise = up[middle + high] + down[middle - high] - up[middle + low] - down[middle - low];
    l->slope = 0.5 * rise / (2.0 * most * (high - low) / n);
    l->width = up[middle + at] - down[middle - at];
    l->width5 = bending ? 0.0 : up[middle + n * 5 / 16] - down[middle - n * 5 / 16];
    for (int k = 0; k < n; k++) {
        if (down[k] > 0.0 && down[k + 1] <= 0.0) {
            double share = down[k] / (down[k] - down[k + 1]);
            l->residual = most * (1.0 - 2.0 * (k + share) / n);
        }
    }
}

/* The frame goes there and back: index k - 1 loading, 2 n - k - 1 unloading. */
static void evaluate_frame(double most, TesterLoop *l) {
    int n = l->count, low = n / 80, high = n / 16, five = n / 8; /* 0.5, 2.5, 5 degrees of 40 */
    const double *up = l->force - 1, *down = l->force + 2 * n - 1;
    l->slope = 0.5 * (up[high] + down[-high] - up[low] - down[-low]) * n / (most * (high - low));
    l->width = up[low] - down[-low];
    l->width5 = up[five] - down[-five];
    for (int k = 1; k < n; k++) {
        if (down[-k] > 0.0 && down[1 - k] <= 0.0) {
            double share = down[-k] / (down[-k] - down[1 - k]);
            l->residual = most * (k - share) / n;
        }
    }
}

bool tester_run(TesterKind kind, const Fabric *fabric, const char *model, int count, Arena *arena,
                TesterLoop *loop, Error *error) {
    Specimen s = {.kind = kind};
    if (!make_specimen(&s, fabric, model, arena, error)) {
        return false;
    }
    const Machine *machine = &machines[kind];
    double most = machine->most;
    bool frame = kind == TESTER_PICTURE;
    const double ends[4] = {0.0, most, frame ? 0.0 : -most, most};
    int steps = machine->branches * count;
    *loop = (TesterLoop){.count = count,
                         .branches = machine->branches,
                         .at = arena_push(arena, double, steps),
                         .force = arena_push(arena, double, steps)};
    for (int k = 0; k < steps; k++) {
        int branch = k / count, step = k % count + 1;
        loop->at[k] = ends[branch] + (ends[branch + 1] - ends[branch]) * step / count;
        loop->force[k] = drive(&s, loop->at[k]);
    }
    if (frame) {
        evaluate_frame(most, loop);
    } else {
        evaluate(kind, most, loop);
    }
    return true;
}

double tester_curve_error(TesterKind kind, const Fabric *fabric, const TesterLoop *l) {
    FabricCurveKind which = kind == TESTER_BENDING ? FABRIC_CURVE_WARP : FABRIC_CURVE_SHEAR;
    const FabricCurve *curve = &fabric->curves[which];
    double worst = NAN;
    for (int k = 0, i = 0; k < curve->count; k++) {
        double at = curve->at[k];
        while (i < l->count && l->at[i] < at) {
            i++;
        }
        if (i == l->count) {
            break;
        }
        double before = i > 0 ? l->at[i - 1] : 0.0, low = i > 0 ? l->force[i - 1] : 0.0;
        double force = low + (l->force[i] - low) * (at - before) / (l->at[i] - before);
        worst = fmax(worst, fabs(force / curve->value[k] - 1.0));
    }
    return worst;
}

/* ---- what the fabric says ---- */

/* share of the yarns that slip after a motion so far from where all stuck */
static double slipping(double way, double onset) {
    double t = fmin(way / onset, 1.0);
    return t * (2.0 - t);
}

/* the curve, straight between its points */
static double interpolate(const FabricCurve *c, double at) {
    int k = 0;
    while (k < c->count - 1 && c->at[k] < at) {
        k++;
    }
    double before = k ? c->at[k - 1] : 0.0, low = k ? c->value[k - 1] : 0.0;
    return low + (c->value[k] - low) * (at - before) / (c->at[k] - before);
}

double tester_expected(TesterKind kind, const Fabric *f, int branch, double at) {
    bool bending = kind == TESTER_BENDING;
    const FabricCurve *c = &f->curves[bending ? FABRIC_CURVE_WARP : FABRIC_CURVE_SHEAR];
    double mean = 0.5 * (f->bend_warp.value + f->bend_weft.value), size = fabs(at);
    double slope = bending ? f->bend_warp.value : f->shear.value;
    double width = f->bend_hysteresis.value * f->bend_warp.value / mean;
    double onset = bending ? f->bend_onset.value : SHEAR_ONSET;
    if (!bending) { /* from 2HG at 0.5 to 2HG5 at 5 degrees; what sticks is as stiff everywhere */
        double narrow = f->shear_hysteresis.value, wide = f->shear_hysteresis5.value;
        double share = (size - 0.5 * PI / 180.0) / (4.5 * PI / 180.0);
        width = narrow + (wide - narrow) * fmin(fmax(share, 0.0), 1.0);
        onset *= narrow > 0.0 ? width / narrow : 1.0;
    }
    double measured = c->count  ? c->at[c->count - 1]
                      : bending ? machines[kind].most
                                : SHEAR_MEASURED;
    if (size > measured * (1.0 + 1e-6)) {
        return NAN;
    }
    double first = 0.5 * width * slipping(size, onset);
    double elastic = c->count ? interpolate(c, size) - first : slope * size;
    if (branch == 0) {
        return copysign(elastic + first, at);
    }
    /* all turn round where the last branch ended; sticking needs twice the way to turn over */
    double most = machines[kind].most, from = branch == 1 ? most : -most;
    double turned = 1.0 - 2.0 * slipping(0.5 * fabs(at - from), onset);
    return copysign(elastic, at) + 0.5 * width * (branch == 1 ? turned : -turned);
}
