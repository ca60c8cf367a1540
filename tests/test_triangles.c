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
    double slant; /* of its left and right borders: du/dv */
} Mesh;

typedef enum MeshKind {
    ONE_DIAGONAL,
    ALTERNATING,
    EQUILATERAL,
    RELAXED,
    JITTERED,
    CROSSED
} MeshKind;
static const char *const mesh_names[] = {"one diagonal", "alternating", "equilateral",
                                         "relaxed",      "jittered",    "crossed"};

/* rows of an equilateral mesh, on the nodes of a lattice that is sheared and widened for it */
static void make_equilateral(Mesh *m, double h) {
    Panel *p = &m->cloth.panel;
    m->slant = sqrt(1.0 / 3.0);
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

/* Four triangles in each of n x n cells, about a node in its middle. A lattice of n x 2n cells has as
 * many triangles and n nodes too many, which no triangle uses. */
static void make_crossed(Mesh *m, int n) {
    Panel *p = &m->cloth.panel;
    int corners = (n + 1) * (n + 1);
    memset(p->material, 0, 2 * (size_t)p->node_count * sizeof *p->material);
    for (int i = 0; i < corners; i++) {
        p->material[2 * i] = (double)(i % (n + 1)) / n;
        p->material[2 * i + 1] = (double)(i / (n + 1)) / n;
    }
    for (int k = 0; k < n * n; k++) {
        int a = k / n * (n + 1) + k % n, c = a + n + 1, o = corners + k;
        int cell[12] = {a, a + 1, o, a + 1, c + 1, o, c + 1, c, o, c, a, o};
        p->material[2 * o] = (k % n + 0.5) / n;
        p->material[2 * o + 1] = (k / n + 0.5) / n;
        memcpy(m->triangles + 12 * k, cell, sizeof cell);
    }
}

/* a square of n x n cells of side 1/n; D11 = D22 = 1, D12 = nu, D66 = (1 - nu)/2 */
static void make_mesh(Mesh *m, MeshKind kind, int n, double poisson, BendingKind bending) {
    Error error = {0};
    memset(m, 0, sizeof *m);
    m->def = cloths_rectangle(1.0, 1.0, n + 1, kind == CROSSED ? 2 * n + 1 : n + 1,
                              cloths_fabric(1.0, 1e3, 0.3, 1.0, poisson));
    m->def.model = "triangles";
    m->def.scattered = kind == RELAXED || kind == JITTERED;
    m->def.spacing = m->def.scattered ? 1.0 / n : 0.0;
    m->def.jitter = kind == JITTERED ? 0.35 : 0.0;
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
    if (kind == CROSSED) {
        make_crossed(m, n);
    }
    assert_true(hinges_create(&m->cloth, m->triangles, m->count, bending, &m->arena, &m->hinges));
}

/* x: surface of curvatures k = (k11, k22, 2 k12), scaled by `size` */
static void make_surface(const Mesh *m, const double k[3], double size, double *x) {
    for (int i = 0; i < m->cloth.node_count; i++) {
        double u = m->cloth.panel.material[2 * i], v = m->cloth.panel.material[2 * i + 1];
        double z = 0.5 * (k[0] * u * u + k[2] * u * v + k[1] * v * v);
        vec3_store(x + 3 * i, vec3(u, v, size * z));
    }
}

static double element_area(const Mesh *m, int t) {
    double u[2], v[2];
    const int *n = m->triangles + 3 * t;
    hinges_difference(&m->cloth.panel, n[0], n[1], u);
    hinges_difference(&m->cloth.panel, n[0], n[2], v);
    return 0.5 * (u[0] * v[1] - u[1] * v[0]);
}

/* from the border, where slopes are free and curvature across it is none */
static bool is_far(const Mesh *m, int t) {
    for (int c = 0; c < 3; c++) {
        const double *uv = m->cloth.panel.material + 2 * m->triangles[3 * t + c];
        double u = uv[0] - m->slant * uv[1];
        if (fmin(u, uv[1]) <= 0.3 || fmax(u, uv[1]) >= 0.7) {
            return false;
        }
    }
    return true;
}

/* of element t, from the turns of the last call */
static void curvature(const Hinges *h, int t, double k[3]) {
    memset(k, 0, 3 * sizeof *k);
    for (int e = 0; e < h->elements[t].edge_count; e++) {
        int edge = h->elements[t].edge[e], director = h->edges[edge].director;
        double turn = h->turns[edge].angle;
        turn += director >= 0 ? h->elements[t].side[e] * h->director[director] : 0.0;
        for (int c = 0; c < 3; c++) {
            k[c] += h->elements[t].c[e][c] * turn;
        }
    }
}

static const double patches[4][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0.7, -0.4, 0.6}};

/* turns of the first order in the height of a surface, at the flat sheet */
static void find_linear_turns(Mesh *m, const double k[3], double *x) {
    Hinges *h = &m->hinges;
    make_surface(m, k, 0.0, x);
    hinges_energy(h, x);
    make_surface(m, k, 1.0, x);
    for (int e = 0; e < h->edge_count; e++) {
        HingeTurn *t = &h->turns[e];
        double z[4], up[2] = {t->up[0].z, t->up[1].z};
        for (int c = 0; c < 4; c++) {
            z[c] = x[3 * h->edges[e].node[c] + 2];
        }
        t->angle = 0.0;
        for (int side = 0; side < 2; side++) {
            double foot = (1.0 - t->foot[side]) * z[0] + t->foot[side] * z[1];
            t->angle += up[side] * (z[2 + side] - foot);
        }
    }
}

/* psi of the surface at x: twice what its slope across the middle of an edge is beyond that of the
 * triangle on the left, less the turn */
static void set_exact_directors(Mesh *m, const double k[3], const double *x) {
    const Hinges *h = &m->hinges;
    for (int e = 0; e < h->edge_count; e++) {
        const HingeEdge *edge = &h->edges[e];
        const double *n = edge->side[0].normal, *ends[2], *apex = x + 3 * edge->node[2];
        double foot = h->turns[e].foot[0], middle[2], to[3];
        for (int c = 0; c < 3; c++) {
            ends[0] = x + 3 * edge->node[0], ends[1] = x + 3 * edge->node[1];
            to[c] = (1.0 - foot) * ends[0][c] + foot * ends[1][c];
        }
        for (int c = 0; c < 2; c++) {
            middle[c] = 0.5 * (ends[0][c] + ends[1][c]);
        }
        double slope = n[0] * (k[0] * middle[0] + 0.5 * k[2] * middle[1]) +
                       n[1] * (k[1] * middle[1] + 0.5 * k[2] * middle[0]);
        double left = (to[2] - apex[2]) / hypot(to[0] - apex[0], to[1] - apex[1]);
        h->director[edge->director] = 2.0 * (slope - left) - h->turns[e].angle;
    }
}

/* Patch test to rounding, of the first order in the height. Tensors are exact where neighbours are
 * symmetric. Morley's are on any mesh: with the slopes of the surface at the edges all elements see its
 * curvature, and no moment pulls at a slope. */
static void check_patch(MeshKind kind, BendingKind bending) {
    Mesh m;
    make_mesh(&m, kind, 8, 0.3, bending);
    double *x = arena_push(&m.arena, double, 3 * m.cloth.node_count), worst = 0.0, pull = 0.0;
    double *moment = arena_push(&m.arena, double, m.hinges.edge_count);
    unsigned char *border = arena_push(&m.arena, unsigned char, m.hinges.edge_count);
    for (int p = 0; p < 4; p++) {
        find_linear_turns(&m, patches[p], x);
        if (bending == BENDING_MORLEY) {
            set_exact_directors(&m, patches[p], x);
        }
        memset(moment, 0, (size_t)m.hinges.edge_count * sizeof *moment);
        for (int t = 0; t < m.count; t++) {
            const HingeElement *el = &m.hinges.elements[t];
            double k[3];
            curvature(&m.hinges, t, k);
            for (int e = 0; e < el->edge_count; e++) {
                border[el->edge[e]] |= el->edge_count < 3;
            }
            for (int c = 0; c < 3 && el->edge_count == 3; c++) {
                const double *d = el->d, *q = el->c[c];
                worst = fmax(worst, fabs(k[c] - patches[p][c]));
                moment[el->edge[c]] +=
                    el->side[c] * (q[0] * (d[0] * k[0] + d[1] * k[1] + d[2] * k[2]) +
                                   q[1] * (d[1] * k[0] + d[3] * k[1] + d[4] * k[2]) +
                                   q[2] * (d[2] * k[0] + d[4] * k[1] + d[5] * k[2]));
            }
        }
        for (int e = 0; e < m.hinges.edge_count; e++) {
            pull = border[e] ? pull : fmax(pull, fabs(moment[e]));
        }
    }
    print_message("  %s, %s: %.2g, %.2g\n", bending_words[bending], mesh_names[kind], worst, pull);
    if (bending == BENDING_TENSOR && kind == ALTERNATING) { /* known: not exact */
        CHECK_AT_MOST(0.1, worst);
    } else {
        CHECK_AT_MOST(worst, 1e-12);
        CHECK_AT_MOST(pull, 1e-12);
    }
    arena_free(&m.arena);
}

static void test_patch(void **unused) {
    (void)unused;
    for (int kind = ONE_DIAGONAL; kind <= CROSSED; kind++) {
        check_patch((MeshKind)kind, BENDING_MORLEY);
        if (kind <= EQUILATERAL) {
            check_patch((MeshKind)kind, BENDING_TENSOR);
        }
    }
}

/* Morley's tangent is that of the tensor on the same mesh, whose energy is never below its own: so
 * Newton's steps are never too long for it. */
static void test_tangent(void **unused) {
    (void)unused;
    Mesh m[2];
    BlockMatrix matrix[2];
    double energy[2], ratio = 1.0;
    for (int k = 0; k < 2; k++) {
        make_mesh(&m[k], JITTERED, 8, 0.3, k ? BENDING_TENSOR : BENDING_MORLEY);
        int count = hinges_couple(&m[k].hinges, NULL);
        int *pairs = arena_push(&m[k].arena, int, 2 * count);
        hinges_couple(&m[k].hinges, pairs);
        matrix[k] = block_matrix_create(m[k].cloth.node_count, pairs, count, &m[k].arena);
        hinges_bind(&m[k].hinges, &matrix[k], 0, &m[k].arena);
    }
    double *x = arena_push(&m[0].arena, double, 3 * m[0].cloth.node_count);
    for (int trial = 0; trial < 20; trial++) {
        make_surface(&m[0], patches[trial % 4], 1.0, x);
        cloths_shake(x, m[0].cloth.node_count, trial < 4 ? 0.0 : 0.02, (uint64_t)trial);
        for (int k = 0; k < 2; k++) {
            energy[k] = hinges_energy(&m[k].hinges, x);
        }
        CHECK_AT_MOST(energy[0], energy[1]);
        ratio = fmax(ratio, energy[1] / energy[0]);
    }
    for (int k = 0; k < 2; k++) {
        hinges_add_hessian(&m[k].hinges, x, matrix[k].values);
    }
    double worst = 0.0, size = 0.0;
    for (int k = 0; k < 9 * block_matrix_block_count(&matrix[0]); k++) {
        worst = fmax(worst, fabs(matrix[0].values[k] - matrix[1].values[k]));
        size = fmax(size, fabs(matrix[1].values[k]));
    }
    print_message("  energy of the tensor / Morley's: up to %.2f\n", ratio);
    CHECK_AT_MOST(worst / size, 1e-12);
    arena_free(&m[0].arena), arena_free(&m[1].arena);
}

/* energy of far elements on a cylinder of curvature kappa across `angle`, over the exact one */
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
        if (is_far(m, t)) {
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
    for (int kind = ONE_DIAGONAL; kind <= CROSSED; kind++) {
        for (int morley = kind == ONE_DIAGONAL || kind == EQUILATERAL ? 0 : 1; morley < 2;
             morley++) {
            Mesh m;
            BendingKind bending = morley ? BENDING_MORLEY : BENDING_TENSOR;
            make_mesh(&m, (MeshKind)kind, 24, 0.0, bending);
            double low = INFINITY, high = 0.0;
            for (int direction = 0; direction < 6; direction++) {
                double ratio = rolled_energy(&m, 0.3 * 24, direction * PI / 6);
                low = fmin(low, ratio), high = fmax(high, ratio);
            }
            print_message("  %s, %s: %.4f .. %.4f\n", bending_words[bending], mesh_names[kind], low,
                          high);
            CHECK_AT_MOST(0.99, low);
            CHECK_AT_MOST(high, 1.01);
            arena_free(&m.arena);
        }
    }
}

/* ---- the stiffness that a mesh really has: D = 1, nu = 0 asked for ---- */

/* [N m] twice the energy per area of a shallow surface, of triangles far from the border */
static double stored(Mesh *m, const double k[3], double *x) {
    const Hinges *h = &m->hinges;
    bool each = h->elements[0].edge_count == 1; /* hinges */
    double energy = 0.0, area = 0.0, *part = arena_push(&m->arena, double, m->count), size = 1e-4;
    make_surface(m, k, size, x);
    hinges_energy(h, x);
    for (int i = 0; i < h->element_count; i++) {
        const HingeElement *el = &h->elements[i];
        double q[3];
        curvature(h, i, q);
        double half = 0.5 * (q[0] * (el->d[0] * q[0] + 2.0 * el->d[1] * q[1]) +
                             q[1] * el->d[3] * q[1] + q[2] * el->d[5] * q[2]);
        const int *sides = h->edges[el->edge[0]].triangle;
        if (each) {
            double a = element_area(m, sides[0]), b = element_area(m, sides[1]);
            part[sides[0]] += half * a / (a + b), part[sides[1]] += half * b / (a + b);
        } else {
            part[i] += half;
        }
    }
    for (int t = 0; t < m->count; t++) {
        bool far = is_far(m, t);
        energy += far ? part[t] : 0.0, area += far ? element_area(m, t) : 0.0;
    }
    return 2.0 * energy / (area * size * size);
}

typedef struct Stiffness {
    double d11, d22, d12, d66, low, high; /* low, high: of B by direction */
} Stiffness;

static Stiffness measure(MeshKind kind, BendingKind bending) {
    Mesh m;
    make_mesh(&m, kind, 24, 0.0, bending);
    double *x = arena_push(&m.arena, double, 3 * m.cloth.node_count);
    Stiffness s = {.low = INFINITY};
    s.d11 = stored(&m, (double[3]){1, 0, 0}, x), s.d22 = stored(&m, (double[3]){0, 1, 0}, x);
    s.d12 = 0.5 * (stored(&m, (double[3]){1, 1, 0}, x) - s.d11 - s.d22);
    s.d66 = 0.25 * stored(&m, (double[3]){0, 0, 2}, x);
    for (int degree = 0; degree < 180; degree += 5) {
        double c = cos(degree * PI / 180), n = sin(degree * PI / 180);
        double b = stored(&m, (double[3]){c * c, n * n, 2.0 * c * n}, x);
        s.low = fmin(s.low, b), s.high = fmax(s.high, b);
    }
    print_message("  %s, %s: D11 %.3f D22 %.3f D12 %.3f D66 %.3f, B %.3f .. %.3f, by twist %.1f\n",
                  bending_words[bending], mesh_names[kind], s.d11, s.d22, s.d12, s.d66, s.low,
                  s.high, 12.854 * sqrt(4.0 * s.d66 / s.d11));
    arena_free(&m.arena);
    return s;
}

/* Hinges and tensors by mesh as derived for endless ones; Morley's are a plate on all. */
static void test_stiffness(void **unused) {
    (void)unused;
    static const struct {
        MeshKind mesh;
        BendingKind bending;
        double d11, d12, d66, low, high;
    } exact[] = {
        {ONE_DIAGONAL, BENDING_HINGE, 1, 0, 1.5, 0.75, 3.0},
        {ONE_DIAGONAL, BENDING_TENSOR, 1, 0, 0.5, 1, 1},
        {ONE_DIAGONAL, BENDING_MORLEY, 1, 0, 0.5, 1, 1},
        {EQUILATERAL, BENDING_HINGE, 1, -1.0 / 3, 2.0 / 3, 1, 1},
        {EQUILATERAL, BENDING_TENSOR, 1, 0, 0.5, 1, 1},
        {ALTERNATING, BENDING_HINGE, 1, 0, 1.0, 1, 1.5},
        {ALTERNATING, BENDING_TENSOR, 1, 0, 1.0, 1, 1.5},
        {ALTERNATING, BENDING_MORLEY, 1, 0, 0.5, 1, 1},
        {CROSSED, BENDING_HINGE, 1.5, -0.5, 0.5, 1, 1.5},
        {CROSSED, BENDING_TENSOR, 1.5, -0.5, 0.5, 1, 1.5},
        {CROSSED, BENDING_MORLEY, 1, 0, 0.5, 1, 1},
        {RELAXED, BENDING_MORLEY, 1, 0, 0.5, 1, 1},
        {JITTERED, BENDING_MORLEY, 1, 0, 0.5, 1, 1},
    };
    for (size_t i = 0; i < sizeof exact / sizeof *exact; i++) {
        Stiffness s = measure(exact[i].mesh, exact[i].bending);
        CHECK_NEAR(s.d11, exact[i].d11, 0.02);
        CHECK_NEAR(s.d22, exact[i].d11, 0.02);
        CHECK_NEAR(s.d12, exact[i].d12, 0.02);
        CHECK_NEAR(s.d66, exact[i].d66, 0.02 * exact[i].d66);
        CHECK_NEAR(s.low, exact[i].low, 0.02 * exact[i].low);
        CHECK_NEAR(s.high, exact[i].high, 0.02 * exact[i].high);
    }
    for (int k = 0; k < 2; k++) { /* by the mesh that it is; no bar */
        measure(k ? JITTERED : RELAXED, BENDING_TENSOR);
        measure(k ? JITTERED : RELAXED, BENDING_HINGE);
    }
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
    /* scattered nodes, by Morley */
    for (int k = 0; k < 2; k++) {
        StripCase c = {.gamma = 10,
                       .stiffness = 1e6,
                       .nodes = 21 << k,
                       .layout = STRIP_LLOYD,
                       .model = "triangles"};
        StripResult r = strip_solve(&c);
        print_message("  scattered, gamma 10, %d nodes: %.3g %% (%d, status %d)\n", c.nodes,
                      100 * r.error, r.iterations, (int)r.status);
        CHECK_AT_MOST(r.error, k ? 5e-4 : 2e-3);
    }
    /* hinges couple bending and twist on this mesh, and stay as wrong as they are */
    for (int k = 0; k < 2; k++) {
        CHECK_AT_MOST(0.02, tip_error(BENDING_HINGE, 1, 20 << k));
    }
}

/* errors of the first six frequencies of a free square plate, nu = 0.3; the largest one */
static double plate_error(MeshKind kind, BendingKind bending, int n) {
    static const double exact[6] = {13.468197, 19.596137, 24.270201, 34.80089, 34.80089, 61.093};
    Mesh m;
    make_mesh(&m, kind, n, 0.3, bending);
    int count = m.cloth.node_count;
    double *x = arena_push(&m.arena, double, 3 * count),
           *g = arena_push(&m.arena, double, 3 * count);
    double *k = arena_push(&m.arena, double, count *count),
           *w = arena_push(&m.arena, double, count);
    const double *area = m.cloth.panel.area, step = 1e-7;
    cloth_start(&m.cloth, x);
    for (int j = 0; j < count; j++) {
        memset(g, 0, 3 * (size_t)count * sizeof *g);
        x[3 * j + 2] = step;
        hinges_add_gradient(&m.hinges, x, g);
        x[3 * j + 2] = 0.0;
        for (int i = 0; i < count; i++) {
            k[i * count + j] = g[3 * i + 2] / (step * sqrt(area[i] * area[j]));
        }
    }
    assert_int_equal(LAPACKE_dsyev(LAPACK_ROW_MAJOR, 'N', 'U', count, k, count, w), 0);
    double low = INFINITY, high = -INFINITY;
    for (int i = 0; i < 6; i++) { /* after three rigid modes */
        double error = sqrt(fmax(w[3 + i], 0.0)) / exact[i] - 1.0;
        low = fmin(low, error), high = fmax(high, error);
    }
    print_message("  %s, %s, n %d: %.2f .. %.2f %%\n", bending_words[bending], mesh_names[kind], n,
                  100 * low, 100 * high);
    arena_free(&m.arena);
    return fmax(high, -low);
}

static void test_plate(void **unused) {
    (void)unused;
    static const MeshKind kinds[4] = {ONE_DIAGONAL, ALTERNATING, RELAXED, JITTERED};
    for (int k = 0; k < 4; k++) {
        double coarse = plate_error(kinds[k], BENDING_MORLEY, 10);
        double fine = plate_error(kinds[k], BENDING_MORLEY, 20);
        CHECK_AT_MOST(fine, 0.036);
        CHECK_AT_MOST(1.75, log2(coarse / fine));
    }
    double coarse = plate_error(ONE_DIAGONAL, BENDING_TENSOR, 20);
    double fine = plate_error(ONE_DIAGONAL, BENDING_TENSOR, 40);
    CHECK_AT_MOST(coarse, 0.025);
    CHECK_AT_MOST(1.75, log2(coarse / fine));
    /* hinges do not come nearer */
    coarse = plate_error(JITTERED, BENDING_HINGE, 10);
    fine = plate_error(JITTERED, BENDING_HINGE, 20);
    CHECK_AT_MOST(0.3, fmin(coarse, fine));
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_patch),      cmocka_unit_test(test_tangent),
        cmocka_unit_test(test_rolled),     cmocka_unit_test(test_stiffness),
        cmocka_unit_test(test_cantilever), cmocka_unit_test(test_plate),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
