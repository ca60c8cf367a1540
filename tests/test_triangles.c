/* Triangles against closed forms: uniform curvature, rolled sheets, plates. */
#include <lapacke.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/model/hinges.h"
#include "tests/support/check.h"
#include "tests/support/cloths.h"
#include "tests/support/strips.h"

typedef struct Mesh {
    Arena arena;
    ClothDef def;
    Cloth cloth;
    Hinges hinges;
    int *triangles, count;
} Mesh;

typedef enum MeshKind { ONE_DIAGONAL, ALTERNATING, EQUILATERAL, SCATTERED } MeshKind;
static const char *const mesh_names[] = {"one diagonal", "alternating", "equilateral", "scattered"};

/* rows of an equilateral mesh, on the nodes of a lattice that is sheared and widened for it */
static void make_equilateral(Mesh *m, double h) {
    Panel *p = &m->cloth.panel;
    for (int i = 0; i < p->node_count; i++) {
        int row = i / p->nu, column = i % p->nu;
        p->material[2 * i] = h * (column + 0.5 * row);
        p->material[2 * i + 1] = h * sqrt(0.75) * row;
    }
    /* shorter diagonals: down to the right */
    for (int k = 0; k < m->count / 2; k++) {
        int row = k / (p->nu - 1), a = row * p->nu + k % (p->nu - 1), b = a + 1;
        int quad[6] = {a, b, a + p->nu, b, b + p->nu, a + p->nu};
        memcpy(m->triangles + 6 * k, quad, sizeof quad);
    }
}

/* a square of n x n cells of side 1/n; D11 = D22 = 1, D12 = nu, D66 = (1 - nu)/2 */
static void make_mesh(Mesh *m, MeshKind kind, int n, double poisson, bool tensor) {
    Error error = {0};
    memset(m, 0, sizeof *m);
    m->def = cloths_rectangle(1.0, 1.0, n + 1, n + 1, cloths_fabric(1.0, 1e3, 0.3, 1.0, poisson));
    m->def.model = "triangles";
    m->def.scattered = kind == SCATTERED;
    m->def.spacing = kind == SCATTERED ? 1.0 / n : 0.0;
    assert_true(cloth_create(&m->cloth, &m->def, NULL, 0, 3, &m->arena, &error));
    Panel *p = &m->cloth.panel;
    m->count = p->triangle_count;
    m->triangles = arena_push(&m->arena, int, 3 * m->count);
    memcpy(m->triangles, p->triangles, 3 * (size_t)m->count * sizeof(int));
    for (int k = 0; kind == ONE_DIAGONAL && k < n * n; k++) {
        int a = k / n * (n + 1) + k % n, c = a + n + 1;
        int quad[6] = {a, a + 1, c + 1, a, c + 1, c};
        memcpy(m->triangles + 6 * k, quad, sizeof quad);
    }
    if (kind == EQUILATERAL) {
        make_equilateral(m, 1.0 / n);
    }
    m->hinges = hinges_create(&m->cloth, m->triangles, m->count, tensor, &m->arena);
}

static double element_area(const Mesh *m, int t) {
    double u[2], v[2];
    const int *n = m->triangles + 3 * t;
    hinges_difference(&m->cloth.panel, n[0], n[1], u);
    hinges_difference(&m->cloth.panel, n[0], n[2], v);
    return 0.5 * (u[0] * v[1] - u[1] * v[0]);
}

/* of element t, from the turns of the last call */
static void curvature(const Hinges *h, int t, double k[3]) {
    memset(k, 0, 3 * sizeof *k);
    for (int e = 0; e < h->elements[t].edge_count; e++) {
        for (int c = 0; c < 3; c++) {
            k[c] += h->elements[t].c[e][c] * h->turns[h->elements[t].edge[e]].angle;
        }
    }
}

/* Shallow surfaces of uniform curvature: inner elements see it. Exact where neighbours are
 * symmetric; 1e-7 is what slopes of 1e-4 and the rounding of angles leave. */
static void test_uniform_curvature(void **unused) {
    (void)unused;
    const double cases[4][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.7, -0.4, 0.6}};
    for (int kind = 0; kind < 3; kind++) {
        Mesh m;
        make_mesh(&m, (MeshKind)kind, 8, 0.0, true);
        double *x = arena_push(&m.arena, double, 3 * m.cloth.node_count), worst = 0.0;
        for (int k = 0; k < 4; k++) {
            for (int i = 0; i < m.cloth.node_count; i++) {
                double u = m.cloth.panel.material[2 * i], v = m.cloth.panel.material[2 * i + 1];
                double z = 0.5 * cases[k][0] * u * u + 0.5 * cases[k][2] * u * v +
                           0.5 * cases[k][1] * v * v;
                vec3_store(x + 3 * i, vec3(u, v, 1e-4 * z));
            }
            hinges_energy(&m.hinges, x);
            for (int t = 0; t < m.count; t++) {
                double found[3];
                curvature(&m.hinges, t, found);
                for (int c = 0; c < 3 && m.hinges.elements[t].edge_count == 3; c++) {
                    worst = fmax(worst, fabs(1e4 * found[c] - cases[k][c]));
                }
            }
        }
        print_message("  %s: %.2g\n", mesh_names[kind], worst);
        if (kind == ALTERNATING) { /* known: not exact */
            CHECK_AT_MOST(0.1, worst);
        } else {
            CHECK_AT_MOST(worst, 1e-7);
        }
        arena_free(&m.arena);
    }
}

/* energy of inner elements on a cylinder of curvature kappa across `angle`, over the exact one */
static double rolled_energy(Mesh *m, double kappa, double angle) {
    double c = cos(angle), s = sin(angle), energy = 0.0, area = 0.0;
    double *x = arena_push(&m->arena, double, 3 * m->cloth.node_count);
    for (int i = 0; i < m->cloth.node_count; i++) {
        const double *uv = m->cloth.panel.material + 2 * i;
        double along = c * uv[0] + s * uv[1], axis = c * uv[1] - s * uv[0];
        vec3_store(x + 3 * i,
                   vec3(sin(kappa * along) / kappa, axis, (1 - cos(kappa * along)) / kappa));
    }
    hinges_energy(&m->hinges, x);
    for (int t = 0; t < m->count; t++) {
        double q[3], a = element_area(m, t);
        if (m->hinges.elements[t].edge_count == 3) {
            curvature(&m->hinges, t, q);
            energy += 0.5 * a * (q[0] * q[0] + q[1] * q[1] + 0.5 * q[2] * q[2]);
            area += a;
        }
    }
    return energy / (0.5 * kappa * kappa * area);
}

/* a sheet rolled on a cylinder in six directions, kappa h = 0.3 */
static void test_rolled(void **unused) {
    (void)unused;
    const MeshKind kinds[2] = {ONE_DIAGONAL, EQUILATERAL};
    for (int k = 0; k < 2; k++) {
        Mesh m;
        make_mesh(&m, kinds[k], 12, 0.0, true);
        double low = INFINITY, high = 0.0;
        for (int direction = 0; direction < 6; direction++) {
            double ratio = rolled_energy(&m, 0.3 * 12, direction * PI / 6);
            low = fmin(low, ratio), high = fmax(high, ratio);
        }
        print_message("  %s: %.4f .. %.4f\n", mesh_names[kinds[k]], low, high);
        CHECK_AT_MOST(0.99, low);
        CHECK_AT_MOST(high, 1.01);
        arena_free(&m.arena);
    }
}

/* hinges by direction, on a lattice with one diagonal: 0.75 to 3 times the rigidity */
static void test_hinge_directions(void **unused) {
    (void)unused;
    enum { N = 24 };
    Mesh m;
    make_mesh(&m, ONE_DIAGONAL, N, 0.0, false);
    double *x = arena_push(&m.arena, double, 3 * m.cloth.node_count), low = INFINITY, high = 0.0;
    for (int degree = 0; degree < 180; degree += 5) {
        double c = cos(degree * PI / 180), s = sin(degree * PI / 180);
        for (int i = 0; i < m.cloth.node_count; i++) {
            const double *uv = m.cloth.panel.material + 2 * i;
            double along = c * uv[0] + s * uv[1];
            vec3_store(x + 3 * i, vec3(uv[0], uv[1], 0.5e-4 * along * along));
        }
        double energy = hinges_energy(&m.hinges, x) / 0.5e-8 * N / (N - 1.0);
        low = fmin(low, energy), high = fmax(high, energy);
    }
    print_message("  rigidity by direction %.3f .. %.3f\n", low, high);
    CHECK_NEAR(low, 0.75, 0.03);
    CHECK_NEAR(high, 3.0, 0.1);
    arena_free(&m.arena);
}

/* tip error of the heavy elastica. At gamma 1000 Newton from flat may fold the strip over to another
 * equilibrium: there kinetic damping leads to the hanging one. */
static double tip_error(BendingKind bending, double gamma, int segments) {
    bool far = gamma > 100;
    StripCase c = {.gamma = gamma,
                   .stiffness = far ? 1e6 : 1e8,
                   .nodes = 1 + segments,
                   .bending = bending,
                   .model = "triangles"};
    StripResult r = far ? strip_relax(&c, 300000) : strip_solve(&c);
    print_message("  %s gamma %g, %d segments: %.3g %% (%d, status %d)\n", bending_words[bending],
                  gamma, segments, 100 * r.error, r.iterations, (int)r.status);
    return r.error;
}

static void test_cantilever(void **unused) {
    (void)unused;
    const double gammas[4] = {1, 10, 100, 1000}, bars[4] = {4e-4, 2e-3, 5e-3, 1.2e-2};
    for (int g = 0; g < 4; g++) {
        double errors[3];
        for (int k = 0; k < 3; k++) {
            errors[k] = tip_error(BENDING_TENSOR, gammas[g], 20 << k);
        }
        CHECK_AT_MOST(errors[0], bars[g]);
        if (gammas[g] <= 100) {
            CHECK_AT_MOST(1.9, log2(errors[1] / errors[2]));
        }
    }
    /* scattered nodes: the tensor is not exact there */
    for (int k = 0; k < 2; k++) {
        StripCase c = {.gamma = 10,
                       .stiffness = 1e6,
                       .nodes = 21 << k,
                       .layout = STRIP_LLOYD,
                       .model = "triangles"};
        StripResult r = strip_solve(&c);
        print_message("  scattered, gamma 10, %d nodes: %.3g %% (%d, status %d)\n", c.nodes,
                      100 * r.error, r.iterations, (int)r.status);
        CHECK_AT_MOST(r.error, k ? 5e-3 : 1.5e-2);
    }
    /* hinges couple bending and twist on this mesh, and stay as wrong as they are */
    for (int k = 0; k < 2; k++) {
        CHECK_AT_MOST(0.02, tip_error(BENDING_HINGE, 1, 20 << k));
    }
}

/* first six frequencies of a free plate */
static void test_plate(void **unused) {
    (void)unused;
    const double exact[6] = {13.468197, 19.596137, 24.270201, 34.80089, 34.80089, 61.093};
    double f[6], worst[2] = {0};
    for (int k = 0; k < 2; k++) {
        plate_frequencies("triangles", k == 0 ? 21 : 41, 6, f);
        for (int i = 0; i < 6; i++) {
            worst[k] = fmax(worst[k], fabs(f[i] / exact[i] - 1.0));
        }
    }
    double order = log2(worst[0] / worst[1]);
    print_message("  errors %.3f, %.3f %%, order %.2f\n", 100 * worst[0], 100 * worst[1], order);
    CHECK_AT_MOST(worst[0], 0.025);
    CHECK_AT_MOST(1.75, order);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_uniform_curvature),
        cmocka_unit_test(test_rolled),
        cmocka_unit_test(test_hinge_directions),
        cmocka_unit_test(test_cantilever),
        cmocka_unit_test(test_plate),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
