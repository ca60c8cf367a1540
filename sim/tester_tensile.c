#include <math.h>
#include <string.h>

#include "sim/step/implicit.h"
#include "sim/tester_strip.h"

#define LENGTH 0.2 /* [m] */
#define WIDTH 0.05
#define FORCE_MOST 500.0    /* [N/m] */
#define FIRST_STRAIN 2e-4   /* where E is read; larger: Green's strain bends the curve */
#define BALANCE 1e-9        /* residual / (E width); larger: E is read less exactly */
#define STRAIN_UNLIMITED 2. /* where neither 500 N/m nor a limit ends the test */
enum { ALONG = 41, ACROSS = 11, ITERATIONS = 60, CAREFUL = 400 };

/* equilibrium with the far end where it is in s->state */
static bool balance(Strip *s, Implicit *implicit, const unsigned char *held, double stiffness,
                    Error *error) {
    NewtonReport report = {.status = NEWTON_STOPPED};
    double *start = arena_push(&s->arena, double, 3 * s->system.place_count);
    size_t bytes = 3 * (size_t)s->system.place_count * sizeof *start;
    memcpy(start, s->state.x, bytes);
    for (int careful = 0; careful < 2 && report.status != NEWTON_CONVERGED; careful++) {
        NewtonParams params = newton_default();
        ImplicitTerms terms = {0};
        params.tolerance = BALANCE * stiffness * WIDTH;
        params.max_iterations = careful ? CAREFUL : ITERATIONS;
        params.plain = params.definite = params.descend = careful;
        memcpy(s->state.x, start, bytes);
        implicit_begin(implicit, held, &s->state);
        report = implicit_solve(implicit, &terms, &params, NULL, s->state.x);
    }
    return report.status == NEWTON_CONVERGED ||
           error_set(error, EXIT_DIFFERS,
                     "test: no equilibrium of the strip was found; forces of %.2g N are left",
                     report.residual);
}

/* mean over the width of what the section i has along x (0) */
static double section(const Strip *s, int i) {
    double mean = 0.0;
    for (int j = 0; j < s->across; j++) {
        mean += strip_share(s, j) * s->state.x[3 * strip_node(s, i, j)];
    }
    return mean;
}

static void read_row(Strip *s, TesterPull *pull, int row) {
    int n = s->along, quarter = (n - 1) / 4;
    double *g = arena_push(&s->arena, double, 3 * s->system.place_count), force = 0.0;
    memset(g, 0, 3 * (size_t)s->system.place_count * sizeof *g);
    system_add_gradient(&s->system, s->state.x, g);
    for (int j = 0; j < s->across; j++) {
        force += g[3 * strip_node(s, n - 1, j)];
    }
    const double *low = s->state.x + 3 * strip_node(s, n / 2, 0);
    const double *high = s->state.x + 3 * strip_node(s, n / 2, s->across - 1);
    double strain = (section(s, n - 1 - quarter) - section(s, quarter)) / (0.5 * LENGTH) - 1.0;
    pull->strain[row] = strain;
    pull->force[row] = force / WIDTH;
    pull->narrowing[row] = (1.0 - fabs(high[1] - low[1]) / WIDTH) / strain;
}

static void stretch(Strip *s, double strain) {
    double ratio = (1.0 + strain) * LENGTH / section(s, s->along - 1);
    for (int k = 0; k < s->system.place_count; k++) {
        s->state.x[3 * k] *= ratio;
    }
}

bool tester_pull(const Fabric *fabric, const char *model, StripWay way, int steps, Arena *arena,
                 TesterPull *pull, Error *error) {
    Strip s;
    double e = way == STRIP_WEFT ? fabric->stretch_weft.value : fabric->stretch_warp.value;
    if (!strip_create(&s, fabric, model, way, (double[2]){LENGTH, WIDTH}, (int[2]){ALONG, ACROSS},
                      true, error)) {
        return false;
    }
    double limit = fabric->stretch_limit.value;
    limit = isfinite(limit) ? sqrt(1.0 + 2.0 * limit) - 1.0 : STRAIN_UNLIMITED;
    double most = fmin(limit, FORCE_MOST / e);
    *pull = (TesterPull){.strain = arena_push(arena, double, steps + 1),
                         .force = arena_push(arena, double, steps + 1),
                         .narrowing = arena_push(arena, double, steps + 1)};
    unsigned char *held = arena_push(&s.arena, unsigned char, s.system.place_count);
    system_mark_held(&s.system, 0.0, held);
    Implicit *implicit = implicit_create(&s.system);
    bool ok = true;
    for (int k = 0; ok && k <= steps && (k == 0 || pull->force[k - 1] < FORCE_MOST); k++) {
        stretch(&s, k ? most * k / steps : fmin(FIRST_STRAIN, 0.5 * most / steps));
        ok = balance(&s, implicit, held, e, error);
        if (ok) {
            read_row(&s, pull, k);
            pull->count++;
        }
    }
    pull->stiffness = pull->force[0] / pull->strain[0];
    pull->poisson = pull->narrowing[0];
    implicit_destroy(implicit);
    strip_destroy(&s);
    return ok;
}
