#include "sim/tester.h"

#include <math.h>
#include <string.h>

#include "sim/model/model.h"

enum { SEGMENTS = 10, COUNT = 320 };
#define BEND_LENGTH 0.01 /* [m] between the walls */
#define BEND_WIDTH 0.002
#define SHEAR_LENGTH 0.2 /* [m] */
#define SHEAR_HEIGHT 0.05
#define BEND_MOST 250.0 /* [1/m] */
#define SHEAR_MOST (8.0 * PI / 180.0)

typedef struct Specimen {
    TesterKind kind;
    ClothDef def;
    Cloth cloth;
    double *x;
} Specimen;

static bool make_specimen(Specimen *s, const Fabric *fabric, const char *model, Arena *arena,
                          Error *error) {
    bool bending = s->kind == TESTER_BENDING;
    HandleDef walls[2] = {handle_default(), handle_default()};
    s->def = cloth_default();
    s->def.name = "specimen";
    s->def.fabric = *fabric;
    s->def.fabric.bend_poisson.value = 0.0; /* the machine sees strips */
    s->def.model = model;
    s->def.hysteresis = true;
    s->def.shape.kind = SHAPE_RECTANGLE;
    s->def.shape.width = bending ? BEND_LENGTH : SHEAR_LENGTH;
    s->def.shape.height = bending ? BEND_WIDTH : SHEAR_HEIGHT;
    s->def.nodes[0] = bending ? SEGMENTS + 1 : 21;
    s->def.nodes[1] = bending ? 3 : 6;
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

static void shear(Specimen *s, double phi) {
    for (int i = 0; i < s->cloth.node_count; i++) {
        const double *uv = s->cloth.panel.material + 2 * i;
        vec3_store(s->x + 3 * i, vec3(uv[0] + uv[1] * sin(phi), uv[1] * cos(phi), 0));
    }
}

static void pose(Specimen *s, double at) {
    if (s->kind == TESTER_BENDING) {
        bend(s, at);
    } else {
        shear(s, at);
    }
}

/* work per motion, per width, with the history as it is; then the pose is accepted */
static double drive(Specimen *s, double at) {
    bool bending = s->kind == TESTER_BENDING;
    const ClothModel *model = s->cloth.model;
    double step = bending ? 1e-2 : 1e-5, energy[2];
    ASSERT(model);
    for (int k = 0; k < 2; k++) {
        pose(s, at + (k ? step : -step));
        energy[k] = model->energy(&s->cloth, s->x);
    }
    pose(s, at);
    model->commit(&s->cloth, s->x);
    double work = (energy[1] - energy[0]) / (2 * step);
    return bending ? work / (BEND_LENGTH * BEND_WIDTH)
                   : work / (SHEAR_LENGTH * SHEAR_HEIGHT * cos(at));
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

bool tester_run(TesterKind kind, const Fabric *fabric, const char *model, int count, Arena *arena,
                TesterLoop *loop, Error *error) {
    Specimen s = {.kind = kind};
    if (!make_specimen(&s, fabric, model, arena, error)) {
        return false;
    }
    double most = kind == TESTER_BENDING ? BEND_MOST : SHEAR_MOST;
    const double ends[4] = {0.0, most, -most, most};
    *loop = (TesterLoop){.count = count,
                         .at = arena_push(arena, double, 3 * count),
                         .force = arena_push(arena, double, 3 * count)};
    for (int k = 0; k < 3 * count; k++) {
        int branch = k / count, step = k % count + 1;
        loop->at[k] = ends[branch] + (ends[branch + 1] - ends[branch]) * step / count;
        loop->force[k] = drive(&s, loop->at[k]);
    }
    evaluate(kind, most, loop);
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

static void print_numbers(TesterKind kind, const Fabric *f, const char *model, bool json,
                          const TesterLoop *l, FILE *out) {
    bool bending = kind == TESTER_BENDING;
    double mean = 0.5 * (f->bend_warp.value + f->bend_weft.value);
    double slope = bending ? f->bend_warp.value : f->shear.value;
    double width =
        bending ? f->bend_hysteresis.value * f->bend_warp.value / mean : f->shear_hysteresis.value;
    if (json) {
        fprintf(out,
                "{\"schema\": \"toile-test-1\", \"test\": \"%s\", \"fabric\": \"%s\", \"model\": "
                "\"%s\", \"stiffness\": %.9g, \"stiffness_fabric\": %.9g, \"hysteresis\": %.9g, "
                "\"hysteresis_fabric\": %.9g, \"residual\": %.9g",
                bending ? "bending" : "shear", f->name, model, l->slope, slope, l->width, width,
                l->residual);
        if (!bending) {
            fprintf(out, ", \"hysteresis_5\": %.9g, \"hysteresis_5_fabric\": %.9g", l->width5,
                    f->shear_hysteresis5.value);
        }
        fputs("}\n", out);
        return;
    }
    fprintf(stderr, "test: %s of %s by %s, along the warp\n", bending ? "bending" : "shear",
            f->name, model);
    fprintf(stderr, "test: %s %.4g %s (fabric: %.4g)\n", bending ? "B" : "G", l->slope,
            bending ? "N m" : "N/m", slope);
    fprintf(stderr, "test: %s %.4g %s (fabric: %.4g)\n", bending ? "2HB" : "2HG", l->width,
            bending ? "N" : "N/m", width);
    if (!bending) {
        fprintf(stderr, "test: 2HG5 %.4g N/m (fabric: %.4g)\n", l->width5,
                f->shear_hysteresis5.value);
    }
    double off = tester_curve_error(kind, f, l);
    if (!isnan(off)) {
        fprintf(stderr, "test: first loading within %.2g %% of the fabric's curve\n", 100.0 * off);
    }
    fprintf(stderr, "test: without force stays %.4g %s\n", l->residual, bending ? "1/m" : "rad");
}

bool tester_print(const char *test, const char *fabric, const char *model, bool json, FILE *out,
                  Error *error) {
    bool bending = strcmp(test, "bending") == 0;
    TesterKind kind = bending ? TESTER_BENDING : TESTER_SHEAR;
    Arena arena = {0};
    Fabric read;
    TesterLoop loop;
    if (!bending && strcmp(test, "shear") != 0) {
        return error_set(error, EXIT_USAGE, "toile: there are the tests bending and shear, not %s",
                         test);
    }
    bool ok = fabric_read(fabric, &arena, &read, error) &&
              tester_run(kind, &read, model, COUNT, &arena, &loop, error);
    if (ok && !json) {
        fprintf(out, bending ? "curvature [1/m],moment [N]\n" : "angle [rad],force [N/m]\n");
        for (int k = 0; k < 3 * loop.count; k++) {
            fprintf(out, "%.6g,%.6g\n", loop.at[k], loop.force[k]);
        }
    }
    if (ok) {
        print_numbers(kind, &read, model, json, &loop, out);
    }
    arena_free(&arena);
    return ok;
}
