/* The meshless model against exact solutions: the rows of the acceptance table in
 * sim/model/mlpg.md. TOLERANCES=1 prints every reached value. */
#include <lapacke.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/geom/rbf.h"
#include "sim/model/bending_rest.h"
#include "sim/model/mlpg.h"
#include "tests/support/check.h"
#include "tests/support/cloths.h"
#include "tests/support/strips.h"

/* a row reproduces polynomials of its degree, also at the border */
static void test_reproduction(void **unused) {
    (void)unused;
    enum { N = 13 };
    double points[2 * N * N], h = 0.01;
    const RbfKind kinds[] = {rbf_lattice_edge, rbf_scattered_edge, rbf_resample,
                             rbf_scattered_membrane};
    for (int i = 0; i < N * N; i++) {
        points[2 * i] = h * (i % N) + 0.25 * h * hash_random(1, (uint64_t)(2 * i));
        points[2 * i + 1] = h * (i / N) + 0.25 * h * hash_random(1, (uint64_t)(2 * i + 1));
    }
    Arena arena = {0};
    PointGrid grid = points_grid(points, N * N, h, &arena);
    double worst = 0.0;
    for (int k = 0; k < 4; k++) {
        for (int place = 0; place < 40; place++) {
            double at[2] = {h * (N - 1) * 0.5 * (1 + hash_random(2, (uint64_t)place)),
                            h * (N - 1) * 0.5 * (1 + hash_random(3, (uint64_t)place))};
            at[0] = place % 4 == 0 ? 0.0 : at[0];
            at[1] = place % 8 == 0 ? 0.0 : at[1];
            const RbfFunctional f[3] = {RBF_VALUE, RBF_D1, RBF_D2};
            double rows[3][STENCIL_CAPACITY];
            RbfStencil s = rbf_stencil(&grid, kinds[k], at, &arena);
            rbf_rows(&s, at, 3, f, rows);
            for (int total = 0; total <= kinds[k].degree; total++) {
                for (int j = 0; j <= total; j++) {
                    double sum[3] = {0};
                    for (int i = 0; i < s.count; i++) {
                        double u = (points[2 * s.nodes[i]] - at[0]) / h;
                        double v = (points[2 * s.nodes[i] + 1] - at[1]) / h;
                        for (int r = 0; r < 3; r++) {
                            sum[r] += rows[r][i] * (r > 0 ? h : 1) * pow(u, total - j) * pow(v, j);
                        }
                    }
                    double exact[3] = {total == 0, total == 1 && j == 0, total == 1 && j == 1};
                    for (int r = 0; r < 3; r++) {
                        worst = fmax(worst, fabs(sum[r] - exact[r]));
                    }
                }
            }
        }
    }
    CHECK_AT_MOST(worst, 1e-11);
    arena_free(&arena);
}

/* constant strain and constant curvature leave inner nodes without force */
static void patch(ClothDef def, const char *name) {
    Arena arena = {0};
    Cloth cloth;
    Error error = {0};
    assert_true(cloth_create(&cloth, &def, NULL, 0, 5, &arena, &error));
    const Panel *p = &cloth.panel;
    const Mlpg *mlpg = cloth.data;
    int n = p->node_count;
    double *x = arena_push(&arena, double, 3 * n), *g = arena_push(&arena, double, 3 * n);
    double *b = arena_push(&arena, double, 3 * n), worst_m = 0.0, worst_b = 0.0;
    double inside = 5.0 * p->h1;
    for (int i = 0; i < n; i++) {
        double u = p->material[2 * i], v = p->material[2 * i + 1];
        vec3_store(x + 3 * i, vec3(1.01 * u + 0.02 * v, 0.005 * u + 0.98 * v, 0.0));
    }
    strain_add_gradient(&mlpg->membrane, x, g);
    for (int i = 0; i < n; i++) {
        double u = p->material[2 * i], v = p->material[2 * i + 1];
        vec3_store(x + 3 * i, vec3(0, 0, 0.7 * u * u + 0.3 * u * v - 0.5 * v * v));
    }
    bending_add_gradient(&mlpg->bending, x, b);
    double scale_m = cloth.material.c11 * p->h1, scale_b = cloth.material.d11 / (p->h1 * p->h1);
    for (int i = 0; i < n; i++) {
        double u = p->material[2 * i], v = p->material[2 * i + 1];
        bool inner = u > inside && v > inside && u < def.shape.width - inside &&
                     v < def.shape.height - inside;
        for (int c = 0; c < 3 && inner; c++) {
            worst_m = fmax(worst_m, fabs(g[3 * i + c]) / scale_m);
            worst_b = fmax(worst_b, fabs(b[3 * i + c]) / (scale_b * p->h1 * p->h1));
        }
    }
    print_message("  %s\n", name);
    CHECK_AT_MOST(worst_m, 1e-10);
    CHECK_AT_MOST(worst_b, 1e-10);
    arena_free(&arena);
}

static void test_patch(void **unused) {
    (void)unused;
    ClothDef def = cloths_rectangle(0.2, 0.2, 21, 21, cloths_orthotropic());
    patch(def, "lattice, stencil");
    def.bending = BENDING_RBF;
    patch(def, "lattice, rbf");
    def.scattered = true;
    def.spacing = 0.01;
    def.jitter = 0.25;
    patch(def, "jittered");
    def.jitter = 0.0;
    patch(def, "relaxed");
}

/* eigenvalues of the flat membrane matrix: three zero modes, no spurious ones */
static void test_zero_modes(void **unused) {
    (void)unused;
    for (int layout = 0; layout < 2; layout++) {
        ClothDef def = cloths_rectangle(1.0, 1.0, 11, 11, cloths_fabric(1.0, 1.0, 0.3, 1.0, 0.3));
        def.scattered = layout == 1;
        def.spacing = layout == 1 ? 0.1 : 0.0;
        def.jitter = layout == 1 ? 0.25 : 0.0;
        Arena arena = {0};
        Cloth cloth;
        Error error = {0};
        assert_true(cloth_create(&cloth, &def, NULL, 0, 5, &arena, &error));
        int n = cloth.node_count, m = 2 * n;
        double *x = arena_push(&arena, double, 3 * n), *k = arena_push(&arena, double, m *m);
        double *w = arena_push(&arena, double, m), *g = arena_push(&arena, double, 6 * n);
        for (int j = 0; j < m; j++) {
            memset(g, 0, 6 * (size_t)n * sizeof *g);
            for (int side = 0; side < 2; side++) {
                cloth_start(&cloth, x);
                x[3 * (j / 2) + j % 2] += side ? -1e-6 : 1e-6;
                cloth.model->add_gradient(&cloth, x, g + side * 3 * n);
            }
            for (int i = 0; i < m; i++) {
                int at = 3 * (i / 2) + i % 2;
                k[i * m + j] =
                    (g[at] - g[3 * n + at]) / 2e-6 / sqrt(cloth.mass[i / 2] * cloth.mass[j / 2]);
            }
        }
        assert_int_equal(LAPACKE_dsyev(LAPACK_ROW_MAJOR, 'N', 'U', m, k, m, w), 0);
        /* first elastic in-plane frequency of a free square, nu = 0.3: 2.63 sqrt(C/rho)/L for
         * plane stress with C = 1 / (1 - nu^2); spurious modes would lie far below */
        double first = sqrt(w[3]);
        print_message("  %s: omega[2] = %.2e, omega[3] = %.4f\n", layout ? "scattered" : "lattice",
                      sqrt(fabs(w[2])), first);
        CHECK_AT_MOST(sqrt(fabs(w[2])) / first, 1e-3); /* the differences leave 1e-7 of w */
        assert_true(first > 0.5 * 2.3);
        arena_free(&arena);
    }
}

/* cantilever on lattices */
static void test_cantilever(void **unused) {
    (void)unused;
    const double gammas[4] = {1, 10, 100, 1000}, limits[4] = {5e-4, 3e-3, 7e-3, 2e-2};
    for (int i = 0; i < 4; i++) {
        double errors[2];
        for (int s = 0; s < 2; s++) {
            StripCase c = {.gamma = gammas[i], .stiffness = s ? 1e8 : 1e6, .nodes = 21};
            StripResult r = strip_solve(&c);
            print_message("  gamma %g, S %g: tip %.6f %.6f, error %.4f %%, %d iterations\n",
                          gammas[i], c.stiffness, r.tip_x, r.tip_drop, 100 * r.error, r.iterations);
            assert_int_equal(r.status, NEWTON_CONVERGED);
            CHECK_AT_MOST(r.error, limits[i]);
            CHECK_AT_MOST(r.iterations, 15);
            errors[s] = r.error;
        }
        CHECK_AT_MOST(errors[1] / errors[0], 1.1);
    }
}

static void test_cantilever_order(void **unused) {
    (void)unused;
    const int nodes[4] = {11, 21, 41, 81};
    for (double gamma = 1; gamma <= 100; gamma *= 10) {
        double errors[4];
        for (int k = 0; k < 4; k++) {
            StripCase c = {.gamma = gamma, .stiffness = 1e8, .nodes = nodes[k]};
            errors[k] = strip_solve(&c).error;
        }
        double order = log(errors[2] / errors[3]) / log(2.0); /* the two finest */
        print_message("  gamma %g: %.4f %.4f %.4f %.4f %%, order %.2f\n", gamma, 100 * errors[0],
                      100 * errors[1], 100 * errors[2], 100 * errors[3], order);
        CHECK_AT_MOST(1.9, order);
    }
}

/* `accuracy`: the true error stays below the promised one */
static void test_accuracy(void **unused) {
    (void)unused;
    const double promises[2] = {0.01, 0.003};
    for (int k = 0; k < 2; k++) {
        for (double gamma = 1; gamma <= 1000; gamma *= 10) {
            ClothDef def = cloths_rectangle(1.0, 0.1, 3, 3,
                                            cloths_fabric(1.0 / 9.80665, 1e6, 0, 1.0 / gamma, 0));
            def.accuracy = promises[k];
            int nodes = 1 + (int)ceil(1.0 / panel_accurate_spacing(&def));
            StripCase c = {.gamma = gamma, .stiffness = 1e8, .nodes = nodes < 4 ? 4 : nodes};
            StripResult r = strip_solve(&c);
            print_message("  promised %g %%, gamma %g: %d nodes, true error %.3f %%\n",
                          100 * promises[k], gamma, c.nodes, 100 * r.error);
            CHECK_AT_MOST(r.error, promises[k]);
        }
    }
}

/* three widths of a turned lattice, three seeds of random nodes */
static void scattered_errors(StripNodes layout, double stiffness, double gamma, double limit) {
    static const char *const names[] = {"lattice", "jitter", "turned lattice", "relaxed"};
    for (int k = 0; k < 3; k++) {
        StripCase c = {.gamma = gamma,
                       .stiffness = stiffness,
                       .nodes = 21,
                       .layout = layout,
                       .across = layout == STRIP_TURNED ? 7 + 2 * k : 9,
                       .seed = (uint64_t)(3 + k)};
        StripResult r = strip_solve(&c);
        print_message("  %s (%d), gamma %g, S %g: error %.3f %%, %d iterations\n", names[layout], k,
                      gamma, stiffness, 100 * r.error, r.iterations);
        CHECK_AT_MOST(r.error, limit);
    }
}

/* cantilever on scattered nodes */
static void test_cantilever_scattered(void **unused) {
    (void)unused;
    const double gammas[3] = {10, 100, 1000};
    const double limits[2][3] = {{2e-3, 5e-3, 2e-2}, {1e-2, 1.2e-2, 2e-2}};
    for (int layout = STRIP_JITTER; layout <= STRIP_LLOYD; layout++) {
        for (int s = 0; s < 2; s++) {
            for (int i = 0; i < 3; i++) {
                scattered_errors((StripNodes)layout, s ? 1e8 : 1e6, gammas[i], limits[s][i]);
            }
        }
    }
}

/* exact zero-energy shape: slope angle sin(2 pi s / lam) along s */
static Vec3 fold_point(double s, double t, double lam) {
    enum { STEPS = 400 };
    double x = 0.0, z = 0.0, ds = s / STEPS;
    for (int i = 0; i < STEPS; i++) {
        double phi = sin(2.0 * PI * (i + 0.5) * ds / lam);
        x += ds * cos(phi), z += ds * sin(phi);
    }
    return vec3(x, t, z);
}

/* gives every bending sample the rest curvature of the fold, K cos(2 pi s / lam) across theta */
static void set_fold(const Mlpg *mlpg, const Panel *p, double theta, double lam) {
    BendingRest *rest = mlpg->bending.rest;
    for (int i = 0; i < rest->samples.sample_count; i++) {
        int cells = p->nu - 1, c = i - p->node_count;
        double u = i < p->node_count ? p->material[2 * i] : p->h1 * (c % cells + 0.5);
        double v = i < p->node_count ? p->material[2 * i + 1] : p->h2 * (c / cells + 0.5);
        double s = u * cos(theta) + v * sin(theta);
        double k = 2.0 * PI / lam * cos(2.0 * PI * s / lam);
        double k0[3] = {k * cos(theta) * cos(theta), k * sin(theta) * sin(theta),
                        k * sin(theta) * cos(theta)};
        bending_rest_set(rest, i, mlpg->samples.weight[i], k0);
    }
}

/* (membrane + bending) / energy of the flat sheet, after minimising from the exact shape */
static double fold_residual(double theta, double waves_nodes, int n, double stiffness,
                            StripNodes layout) {
    Bench b = {0};
    double h = 1.0 / (n - 1), lam = waves_nodes * h;
    b.cloth = cloths_rectangle(1.0, 1.0, n, n, cloths_fabric(1.0, stiffness, 0.3, 1.0, 0.0));
    b.cloth.scattered = layout != STRIP_LATTICE;
    b.cloth.spacing = b.cloth.scattered ? h : 0.0;
    b.cloth.jitter = layout == STRIP_JITTER ? 0.25 : 0.0;
    b.cloth.shape.rest_curvature[0] = 1.0; /* replaced sample by sample */
    b.scene = cloths_scene(&b.cloth);
    b.scene.gravity = vec3(0, 0, 0);
    bench_build(&b, 0);
    const Cloth *cloth = &b.system.cloths[0];
    const Panel *p = &cloth->panel;
    set_fold(cloth->data, p, theta, lam);
    State state = state_allocate(&b.system, &b.arena);
    state_start(&b.system, &state);
    double flat = system_elastic_energy(&b.system, state.x);
    for (int i = 0; i < p->node_count; i++) {
        double u = p->material[2 * i], v = p->material[2 * i + 1];
        vec3_store(state.x + 3 * i, fold_point(u * cos(theta) + v * sin(theta),
                                               v * cos(theta) - u * sin(theta), lam));
    }
    Implicit *implicit = implicit_create(&b.system);
    unsigned char *held = arena_push(&b.arena, unsigned char, b.system.place_count);
    double *anchor = arena_push(&b.arena, double, 3 * b.system.place_count);
    for (double a = 1e6; a >= 1.0; a /= 10.0) { /* pseudo-time: the sheet is free */
        memcpy(anchor, state.x, 3 * (size_t)b.system.place_count * sizeof *anchor);
        ImplicitTerms terms = {.acceleration = a, .x_hat = anchor};
        NewtonParams params = newton_default();
        params.max_iterations = 30;
        params.tolerance = 1e-4;
        implicit_begin(implicit, held, &state);
        implicit_solve(implicit, &terms, &params, NULL, state.x);
    }
    double residual = system_elastic_energy(&b.system, state.x) / flat;
    implicit_destroy(implicit);
    arena_free(&b.arena);
    return residual;
}

/* the locking test, a sheet whose rest shape is a wave in any direction */
static void test_fold(void **unused) {
    (void)unused;
    for (int k = 0; k < 3; k++) {
        double theta = 22.5 * k * PI / 180.0;
        double coarse = fold_residual(theta, 10.0, 41, 1e8, STRIP_LATTICE);
        double fine = fold_residual(theta, 20.0, 41, 1e8, STRIP_LATTICE);
        print_message("  theta %.1f: %.3f %% at 10 nodes a wave, %.3f %% at 20\n", 22.5 * k,
                      100 * coarse, 100 * fine);
        CHECK_AT_MOST(coarse, 0.025);
        CHECK_AT_MOST(fine, 0.003);
    }
    const StripNodes layouts[2] = {STRIP_JITTER, STRIP_LLOYD};
    for (int layout = 0; layout < 2; layout++) {
        double soft = fold_residual(PI / 8, 10.0, 31, 1e6, layouts[layout]);
        double stiff = fold_residual(PI / 8, 10.0, 31, 1e8, layouts[layout]);
        print_message("  scattered (%d): %.2f %% at S = 1e6, %.2f %% at 1e8\n", layout, 100 * soft,
                      100 * stiff);
        CHECK_AT_MOST(soft, 0.04);
        CHECK_AT_MOST(stiff, 0.12);
    }
}

/* a clamped strip with rest curvature 2 pi / L rolls up to a closed circle */
static void test_roll_up(void **unused) {
    (void)unused;
    const int nodes[2] = {21, 41};
    const double limits[2] = {0.005, 0.0012};
    for (int k = 0; k < 2; k++) {
        Bench b = {0};
        double length = 0.2, h = length / (nodes[k] - 1);
        b.cloth =
            cloths_rectangle(length, 4 * h, nodes[k], 5, cloths_fabric(0.15, 1e3, 0, 1e-5, 0));
        b.cloth.shape.rest_curvature[0] = 2.0 * PI / length;
        b.scene = cloths_scene(&b.cloth);
        b.scene.gravity = vec3(0, 0, 0);
        b.scene.solver.self_contact = false; /* its ends lie on each other */
        b.handles[0] = handle_default();
        b.handles[0].kind = HANDLE_CLAMP;
        b.handles[0].region = REGION_LEFT;
        bench_build(&b, 1);
        void *data;
        Error error = {0};
        Statistics statistics = {.smallest_gap = INFINITY};
        assert_true(stepper_static.create(&b.system, &data, &error));
        State s = state_allocate(&b.system, &b.arena);
        state_start(&b.system, &s);
        if (!stepper_static.advance(&b.system, data, &s, 1.0, &statistics, &error)) {
            fail_msg("%s", error.text);
        }
        int first = 2 * nodes[k], last = first + nodes[k] - 1;
        Vec3 gap = vec3_sub(vec3_load(s.x + 3 * first), vec3_load(s.x + 3 * last));
        print_message("  n = %d: gap %.4f %%, %.0f factorisations\n", nodes[k],
                      100 * vec3_length(gap) / length, statistics.factorisations);
        CHECK_AT_MOST(vec3_length(gap) / length, limits[k]);
        stepper_static.destroy(data);
        arena_free(&b.arena);
    }
}

/* free plate, nu = 0.3 */
static void test_plate(void **unused) {
    (void)unused;
    const double exact[6] = {13.468197, 19.596137, 24.270201, 34.80089, 34.80089, 61.093};
    double f[2][6], worst[2] = {0};
    for (int k = 0; k < 2; k++) {
        plate_frequencies("mlpg", k == 0 ? 21 : 41, 6, f[k]);
        for (int i = 0; i < 6; i++) {
            worst[k] = fmax(worst[k], fabs(f[k][i] / exact[i] - 1.0));
        }
    }
    double order = log(worst[0] / worst[1]) / log(2.0);
    print_message("  errors %.3f, %.3f %%, order %.2f\n", 100 * worst[0], 100 * worst[1], order);
    CHECK_AT_MOST(worst[0], 0.025);
    CHECK_AT_MOST(worst[1], 0.007);
    CHECK_AT_MOST(1.75, order);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_reproduction),
        cmocka_unit_test(test_patch),
        cmocka_unit_test(test_zero_modes),
        cmocka_unit_test(test_cantilever),
        cmocka_unit_test(test_cantilever_order),
        cmocka_unit_test(test_cantilever_scattered),
        cmocka_unit_test(test_plate),
        cmocka_unit_test(test_accuracy),
        cmocka_unit_test(test_roll_up),
        cmocka_unit_test(test_fold),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
