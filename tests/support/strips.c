#include "tests/support/strips.h"

#include <lapacke.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/step/explicit.h"
#include "tests/support/check.h"
#include "tests/support/cloths.h"

/* Gamma, x / L, y / L of the tip of the heavy elastica (the master curve of Romero et al. 2021), clamped level:
 * Chebyshev collocation, 200 points, checked against 140 */
static const double exact_tips[][3] = {
    {0.1, 0.999910732224, 0.012498437848}, {0.5, 0.997779000281, 0.062305768150},
    {1, 0.991246395347, 0.123471401983},   {2, 0.966892946897, 0.238506582871},
    {5, 0.846657179957, 0.495905044619},   {10, 0.656353761241, 0.700199715513},
    {20, 0.445232052242, 0.829881443438},  {50, 0.245014756323, 0.907917123477},
    {100, 0.159223382629, 0.937523935396}, {200, 0.107420436153, 0.956769196164},
    {500, 0.065890036616, 0.973117000266}, {1000, 0.045986454757, 0.981141269269}};

void strip_exact(double gamma, double tip[2]) {
    for (size_t i = 0; i < sizeof exact_tips / sizeof *exact_tips; i++) {
        if (exact_tips[i][0] == gamma) {
            tip[0] = exact_tips[i][1];
            tip[1] = exact_tips[i][2];
            return;
        }
    }
    fail_msg("no exact tip for gamma %g", gamma);
}

void bench_build(Bench *b, int handle_count) { bench_build_seeded(b, handle_count, 3); }

void bench_build_seeded(Bench *b, int handle_count, uint64_t seed) {
    Error error = {0};
    b->cloth.name = "cloth";
    b->scene.cloth_count = 1;
    b->scene.cloths = &b->cloth;
    b->scene.handle_count = handle_count;
    b->scene.handles = b->handles;
    if (!system_create(&b->system, &b->scene, seed, &b->arena, &error)) {
        fail_msg("%s", error.text);
    }
}

static void start_bench(Bench *b) {
    memset(b, 0, sizeof *b);
    b->cloth = cloth_default();
    b->cloth.bending_damping = b->cloth.membrane_damping = 0.0;
    b->scene = cloths_scene(&b->cloth);
    b->handles[0] = b->handles[1] = handle_default();
}

static void strip_build(const StripCase *strip, Bench *b) {
    start_bench(b);
    double rho_g = 1.0, d = rho_g / strip->gamma, h = 1.0 / (strip->nodes - 1);
    int across = strip->across ? strip->across : strip->layout == STRIP_LATTICE ? 5 : 9;
    Fabric fabric = cloths_fabric(rho_g / 9.81, strip->stiffness * d, 0.0, d, 0.0);
    fabric.bend_hysteresis.value = fabric.shear_hysteresis.value = 0.0;
    b->cloth = cloths_rectangle(1.0, h * (across - 1), strip->nodes, across, fabric);
    b->cloth.bending = strip->bending;
    b->cloth.model = strip->model ? strip->model : b->cloth.model;
    b->cloth.buckling = strip->buckling;
    b->cloth.scattered = strip->layout != STRIP_LATTICE;
    b->cloth.spacing = b->cloth.scattered ? h : 0.0;
    b->cloth.jitter = strip->layout == STRIP_JITTER ? 0.25 : 0.0;
    b->handles[0].kind = HANDLE_CLAMP;
    b->handles[0].region = REGION_LEFT;
    b->cloth.grid_turn = strip->layout == STRIP_TURNED ? PI / 8.0 : NAN;
    bench_build_seeded(b, 1, strip->seed ? strip->seed : 3);
}

static void strip_measure(Bench *b, const State *state, double gamma, StripResult *result) {
    const Panel *p = &b->system.cloths[0].panel;
    HandleDef tip = {.region = REGION_NEAREST, .point = {1.0, 0.5 * b->cloth.shape.height}};
    unsigned char *marks = arena_push(&b->arena, unsigned char, p->node_count);
    panel_select(p, &tip, marks);
    double exact[2];
    strip_exact(gamma, exact);
    for (int i = 0; i < p->node_count; i++) {
        if (marks[i]) {
            result->tip_x = state->x[3 * i] + 0.5;
            result->tip_drop = -state->x[3 * i + 2];
        }
    }
    result->error = hypot(result->tip_x - exact[0], result->tip_drop - exact[1]);
}

StripResult strip_solve(const StripCase *strip) {
    Bench b;
    strip_build(strip, &b);
    State state = state_allocate(&b.system, &b.arena);
    state_start(&b.system, &state);
    unsigned char *held = arena_push(&b.arena, unsigned char, b.system.place_count);
    system_mark_held(&b.system, 0.0, held);
    Implicit *implicit = implicit_create(&b.system);
    NewtonParams params = newton_default();
    params.max_iterations = strip->plain_newton ? 400 : 60;
    params.plain = strip->plain_newton;
    params.tolerance = 1e-6 * b.system.weight;
    ImplicitTerms terms = {0};
    implicit_begin(implicit, held, &state);
    NewtonReport report = implicit_solve(implicit, &terms, &params, NULL, state.x);
    StripResult result = {.iterations = report.iterations, .status = report.status};
    strip_measure(&b, &state, strip->gamma, &result);
    implicit_destroy(implicit);
    arena_free(&b.arena);
    return result;
}

StripResult strip_relax(const StripCase *strip, int steps) {
    Bench b;
    strip_build(strip, &b);
    State state = state_allocate(&b.system, &b.arena);
    state_start(&b.system, &state);
    Explicit *engine = explicit_create(&b.system);
    ExplicitRun run = {.steps = steps,
                       .dt = 0.8 * explicit_limit(engine, false),
                       .kinetic_damping = true,
                       .kinetic_target = 1e-13 * b.system.weight};
    ExplicitResult relaxed = explicit_interval(engine, &run, &state);
    bool rests = relaxed.finite && relaxed.steps < steps;
    StripResult result = {.iterations = relaxed.steps,
                          .status = rests ? NEWTON_CONVERGED : NEWTON_STOPPED};
    strip_measure(&b, &state, strip->gamma, &result);
    arena_free(&b.arena);
    return result;
}

void swing_make(Bench *b, int nodes, SidesKind sides) {
    start_bench(b);
    b->cloth = cloths_rectangle(1.0, 1.0, nodes, nodes, cloths_fabric(0.2, 1e3, 0.3, 1e-3, 0.3));
    b->cloth.pose.turn = quat_from_axis_angle(vec3(1, 0, 0), 60.0 * PI / 180.0);
    b->cloth.sides = sides;
    b->handles[0].region = REGION_TOP_LEFT;
    b->handles[1].region = REGION_TOP_RIGHT;
    bench_build(b, 2);
}

/* dense generalised eigenproblem K w = omega^2 M w of the bending matrix, one component */
void plate_frequencies(const char *model, int nodes, int count, double *frequencies) {
    Bench b;
    start_bench(&b);
    b.cloth = cloths_rectangle(1.0, 1.0, nodes, nodes, cloths_fabric(1.0, 1e3, 0.3, 1.0, 0.3));
    b.cloth.model = model;
    bench_build(&b, 0);
    const Cloth *cloth = &b.system.cloths[0];
    int n = cloth->node_count;
    double *k = calloc((size_t)n * (size_t)n, sizeof *k), *x = calloc(3 * (size_t)n, sizeof *x);
    double *g = calloc(3 * (size_t)n, sizeof *g), *w = calloc((size_t)n, sizeof *w);
    /* flat at rest: the z part of the gradient is linear in z with slope K_b to first order */
    for (int j = 0; j < n; j++) {
        double step = 1e-7;
        cloth_start(cloth, x);
        memset(g, 0, 3 * (size_t)n * sizeof *g);
        x[3 * j + 2] += step;
        cloth->model->add_gradient(cloth, x, g);
        for (int i = 0; i < n; i++) {
            k[(size_t)i * (size_t)n + (size_t)j] =
                g[3 * i + 2] / (step * sqrt(cloth->mass[i] * cloth->mass[j]));
        }
    }
    int info = LAPACKE_dsyev(LAPACK_ROW_MAJOR, 'N', 'U', n, k, n, w);
    assert_int_equal(info, 0);
    for (int i = 0; i < count; i++) {
        frequencies[i] = sqrt(fmax(w[3 + i], 0.0)); /* after three rigid modes */
    }
    free(k), free(x), free(g), free(w);
    arena_free(&b.arena);
}
