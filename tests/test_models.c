/* All cloth models, in one loop: derivatives by differences, rigid motion, momentum, and the
 * explicit sweep against the model's own gradient. */
#include <stdlib.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/model/mlpg.h"
#include "sim/model/side_bound.h"
#include "tests/support/check.h"
#include "tests/support/cloths.h"

enum { MOST = 64 };

typedef struct Case {
    const char *name;
    ClothDef def;
    HandleDef handles[2];
    int handle_count;
} Case;

static Case cases[MOST];
static int case_count;

static void add_case(const char *name, ClothDef def, int clamps) {
    assert_true(case_count < MOST);
    Case *c = &cases[case_count++];
    c->name = name;
    c->def = def;
    c->handle_count = clamps;
    for (int h = 0; h < clamps; h++) {
        c->handles[h] = handle_default();
        c->handles[h].kind = HANDLE_CLAMP;
        c->handles[h].region = h == 0 ? REGION_LEFT : REGION_TOP;
    }
}

static void make_cases(void) {
    Fabric f = cloths_orthotropic();
    add_case("rectangle", cloths_rectangle(0.09, 0.1, 7, 6, f), 0);
    add_case("clamped", cloths_rectangle(0.09, 0.1, 7, 6, f), 2);
    add_case("sleeve", cloths_sleeve(0.02, 0.08, 8, 6, false, f), 0);
    add_case("sleeve, curved rest", cloths_sleeve(0.02, 0.08, 8, 6, true, f), 0);
    ClothDef corotational = cloths_rectangle(0.09, 0.1, 6, 5, f);
    corotational.kinematics = KINEMATICS_COROTATIONAL;
    add_case("corotational", corotational, 0);
    ClothDef scattered = cloths_rectangle(0.09, 0.1, 7, 6, f);
    scattered.scattered = true;
    scattered.spacing = 0.015;
    scattered.jitter = 0.25;
    add_case("scattered", scattered, 0);
    ClothDef triangles = cloths_rectangle(0.09, 0.1, 7, 6, f);
    triangles.membrane = MEMBRANE_TRIANGLES;
    add_case("strain of triangles", triangles, 1);
    ClothDef yarns = cloths_rectangle(0.09, 0.1, 7, 6, f);
    yarns.hysteresis = true;
    yarns.fabric.bend_hysteresis.value = 1e-3;
    add_case("hysteresis", yarns, 1);
    ClothDef bounded = cloths_rectangle(0.09, 0.1, 7, 6, f);
    bounded.sides = SIDES_BOUNDED;
    add_case("bounded sides", bounded, 1);
    bounded.hysteresis = true;
    add_case("bounded sides with hysteresis", bounded, 1);
    add_case("square cells", cloths_rectangle(0.09, 0.075, 7, 6, f), 0);
}

typedef struct Fixture {
    Arena arena;
    Cloth cloth;
    int places; /* nodes and ghosts */
    double *x;
} Fixture;

static Fixture fixture(const Case *c, const ClothModel *model, double shake) {
    Fixture f = {0};
    ClothDef *def = arena_push(&f.arena, ClothDef, 1);
    *def = c->def;
    def->model = model->name;
    Error error = {0};
    if (!cloth_create(&f.cloth, def, c->handles, c->handle_count, 7, &f.arena, &error)) {
        fail_msg("%s: %s", c->name, error.text);
    }
    f.places = f.cloth.node_count + f.cloth.ghost_count;
    f.x = arena_push(&f.arena, double, 3 * f.places);
    cloth_start(&f.cloth, f.x);
    cloths_shake(f.x, f.places, shake, 11);
    return f;
}

/* bends by springs between second neighbours */
static bool is_second(BendingKind bending) {
    return bending == BENDING_CHOI_KO || bending == BENDING_CHORD || bending == BENDING_PROVOT;
}

/* what a model says it cannot do */
static bool refuses(const Cloth *cloth, const Case *c) {
    bool wide_clamp = cloth->bending == BENDING_RBF && cloth->panel.nu > 0 && c->handle_count > 0;
    bool flat_only = is_second(cloth->bending) || cloth->bending >= BENDING_ANGLE;
    bool swept = strcmp(c->def.model, "mlpg") == 0 && cloth->bending == BENDING_STENCIL &&
                 !c->def.hysteresis;
    return (c->def.sides == SIDES_BOUNDED && !swept) || wide_clamp ||
           (flat_only && c->def.shape.rest_curved);
}

static bool expect_refusal(const Case *c) {
    Arena arena = {0};
    Cloth cloth;
    Error error = {0};
    bool made = cloth_create(&cloth, &c->def, c->handles, c->handle_count, 7, &arena, &error);
    assert_int_equal(made, !refuses(&cloth, c));
    assert_true(made || error.code == EXIT_BAD_INPUT);
    arena_free(&arena);
    return !made;
}

typedef void TestBody(const Case *c, const ClothModel *model);

/* every model, with each of its forms of bending, on every case that it can have */
static void for_all(TestBody *body) {
    for (const ClothModel *const *model = cloth_models; *model; model++) {
        for (int i = 0; i < case_count; i++) {
            bool scattered = cases[i].def.scattered;
            unsigned known = scattered ? (*model)->scattered_bendings : (*model)->lattice_bendings;
            for (int k = 1; k < BENDING_COUNT; k++) {
                Case c = cases[i];
                c.def.bending = (BendingKind)k;
                c.def.model = (*model)->name;
                if (!(known & 1u << k) || expect_refusal(&c)) {
                    continue;
                }
                print_message("  %s %s, %s\n", (*model)->name, bending_words[k], c.name);
                body(&c, *model);
            }
        }
    }
}

static double norm(const double *a, int count) {
    double sum = 0.0;
    for (int i = 0; i < count; i++) {
        sum += a[i] * a[i];
    }
    return sqrt(sum);
}

/* |difference quotient - gradient . d| / (|gradient| |d|), the worst of a few directions */
static double gradient_error(const Fixture *f, Arena *arena, double step) {
    const ClothModel *model = f->cloth.model;
    int n = 3 * f->places;
    double *g = arena_push(arena, double, n), *d = arena_push(arena, double, n);
    double *y = arena_push(arena, double, n), worst = 0.0;
    model->add_gradient(&f->cloth, f->x, g);
    for (int trial = 0; trial < 6; trial++) {
        double along = 0.0, side[2];
        for (int i = 0; i < n; i++) {
            d[i] = hash_random((uint64_t)trial + 100, (uint64_t)i);
            along += d[i] * g[i];
        }
        for (int s = 0; s < 2; s++) {
            for (int i = 0; i < n; i++) {
                y[i] = f->x[i] + (s ? -step : step) * d[i];
            }
            side[s] = model->energy(&f->cloth, y);
        }
        double error = fabs((side[0] - side[1]) / (2 * step) - along);
        worst = fmax(worst, error / (norm(g, n) * norm(d, n)));
    }
    return worst;
}

/* two steps: springs have kinks in their force, which one step may meet and hardly both */
static void gradient_case(const Case *c, const ClothModel *model) {
    Fixture f = fixture(c, model, 2e-3);
    double coarse = gradient_error(&f, &f.arena, 1e-6);
    double fine = gradient_error(&f, &f.arena, 1e-7);
    CHECK_AT_MOST(fmin(coarse, fine), 1e-7);
    arena_free(&f.arena);
}

static void test_gradient(void **unused) {
    (void)unused;
    for_all(gradient_case);
}

/* Where the tangent is the exact Hessian. Corotation, deferred bending and springs with a kink have
 * none by design, nor has Morley's bending, which takes that of the tensor; what needs a second
 * derivative of a normal is exact at rest only. */
typedef enum Exact { EXACT, EXACT_AT_REST, NOT_EXACT } Exact;

static Exact exactness(const Case *c, const ClothModel *model) {
    BendingKind bending = c->def.bending;
    bool deferred = bending == BENDING_RBF && !c->def.scattered;
    bool kink = bending == BENDING_CHOI_KO || bending == BENDING_CHORD;
    bool turns = bending >= BENDING_MORLEY;
    bool rests = c->def.shape.kind != SHAPE_SLEEVE || c->def.shape.rest_curved;
    bool strains = strcmp(model->name, "springs") != 0;
    if (deferred || kink || (turns && !rests) ||
        (strains && c->def.kinematics != KINEMATICS_GREEN) || bending == BENDING_MORLEY) {
        return NOT_EXACT;
    }
    return turns || c->def.hysteresis || c->def.shape.rest_curved ? EXACT_AT_REST : EXACT;
}

/* K d from the assembled matrix against differences of the gradient, for solved nodes */
static void hessian_case(const Case *c, const ClothModel *model) {
    Exact exact = exactness(c, model);
    if (exact == NOT_EXACT) {
        return;
    }
    Case straight = *c; /* the stiffness of yarns has a kink at rest */
    if (!c->def.hysteresis) {
        straight.def.fabric.bend_hysteresis.value = straight.def.fabric.shear_hysteresis.value = 0;
    }
    Fixture f = fixture(&straight, model, exact == EXACT_AT_REST ? 0.0 : 2e-3);
    model = f.cloth.model; /* with friction, if it has any */
    int n = 3 * f.places, pair_count = model->couple(&f.cloth, NULL);
    int *pairs = malloc(2 * (size_t)pair_count * sizeof *pairs);
    model->couple(&f.cloth, pairs);
    BlockMatrix matrix = block_matrix_create(f.places, pairs, pair_count, &f.arena);
    free(pairs);
    model->bind_hessian(&f.cloth, &matrix, 0, &f.arena);
    double *stress = arena_push(&f.arena, double, f.cloth.strain_count);
    model->stress(&f.cloth, f.x, stress);
    model->add_hessian(&f.cloth, f.x, stress, false, matrix.values);
    double *d = arena_push(&f.arena, double, n), *y = arena_push(&f.arena, double, n);
    double *kd = arena_push(&f.arena, double, n), *sides = arena_push(&f.arena, double, 2 * n);
    for (int i = 0; i < 3 * f.cloth.node_count; i++) {
        d[i] = hash_random(5, (uint64_t)i);
    }
    double step = 1e-7, error = 0.0; /* no side meets its bound within */
    for (int s = 0; s < 2; s++) {
        for (int i = 0; i < n; i++) {
            y[i] = f.x[i] + (s ? -step : step) * d[i];
        }
        model->add_gradient(&f.cloth, y, sides + s * n);
    }
    block_matrix_multiply(&matrix, d, kd);
    for (int i = 0; i < 3 * f.cloth.node_count; i++) {
        error = fmax(error, fabs((sides[i] - sides[n + i]) / (2 * step) - kd[i]));
    }
    CHECK_AT_MOST(error / norm(kd, n), 1e-7);
    arena_free(&f.arena);
}

static void test_hessian(void **unused) {
    (void)unused;
    for_all(hessian_case);
}

/* rigid motion changes neither energy nor the size of forces; no net force, no net torque */
static void rigid_case(const Case *c, const ClothModel *model) {
    Fixture f = fixture(c, model, 2e-3);
    model = f.cloth.model;
    int n = 3 * f.places;
    double *g = arena_push(&f.arena, double, n), *h = arena_push(&f.arena, double, n);
    double *y = arena_push(&f.arena, double, n);
    Pose pose = {{0.3, -0.2, 0.9}, quat_from_axis_angle(vec3(1, 2, -1), 2.1)};
    for (int i = 0; i < f.places; i++) {
        vec3_store(y + 3 * i, pose_apply(pose, vec3_load(f.x + 3 * i)));
    }
    double energy = model->energy(&f.cloth, f.x), moved = model->energy(&f.cloth, y);
    CHECK_AT_MOST(fabs(energy - moved) / energy, 1e-11);
    model->add_gradient(&f.cloth, f.x, g);
    model->add_gradient(&f.cloth, y, h);
    double worst = 0.0, size = 0.0;
    Vec3 force = {0}, torque = {0};
    for (int i = 0; i < f.places; i++) {
        Vec3 turned = quat_rotate(pose.turn, vec3_load(g + 3 * i)), at = vec3_load(h + 3 * i);
        worst = fmax(worst, vec3_length(vec3_sub(turned, at)));
        size += vec3_length(at);
        force = vec3_add(force, vec3_load(g + 3 * i));
        torque = vec3_add(torque, vec3_cross(vec3_load(f.x + 3 * i), vec3_load(g + 3 * i)));
    }
    CHECK_AT_MOST(worst / size, 1e-12);
    CHECK_AT_MOST(vec3_length(force) / size, 1e-12);
    CHECK_AT_MOST(vec3_length(torque) / (size * 0.1), 1e-12);
    arena_free(&f.arena);
}

static void test_rigid(void **unused) {
    (void)unused;
    for_all(rigid_case);
}

/* the start is the rest state (not for a sleeve made of a flat panel, nor for RBF slopes, which see
 * another curvature in the inscribed polygon than the second difference that the panel states) */
static void rest_case(const Case *c, const ClothModel *model) {
    bool sleeve = c->def.shape.kind == SHAPE_SLEEVE;
    if (sleeve && (!c->def.shape.rest_curved || c->def.bending == BENDING_RBF)) {
        return;
    }
    Fixture f = fixture(c, model, 0.0);
    model = f.cloth.model;
    int n = 3 * f.places;
    double *g = arena_push(&f.arena, double, n);
    model->add_gradient(&f.cloth, f.x, g);
    double scale = f.cloth.material.c11 * f.cloth.panel.h1;
    CHECK_AT_MOST(norm(g, n) / scale, 1e-11);
    arena_free(&f.arena);
}

static void test_rest(void **unused) {
    (void)unused;
    for_all(rest_case);
}

/* uniform stretch and shear of a flat panel store 1/2 e'C e per area, with the C that the model
 * computes with (not where springs between second neighbours add to it); the mean of both signs
 * leaves out what is of third order */
static void membrane_case(const Case *c, const ClothModel *model) {
    if (c->def.shape.kind == SHAPE_SLEEVE || c->handle_count > 0 || is_second(c->def.bending)) {
        return;
    }
    Case straight = *c; /* curves of yarns start as lines */
    straight.def.fabric.shear_hysteresis.value = 0.0;
    Fixture f = fixture(&straight, model, 0.0);
    model = f.cloth.model;
    const Material *m = &f.cloth.material;
    double *y = arena_push(&f.arena, double, 3 * f.places), e = 1e-5;
    const double strains[5][3] = {{1, 0, 0}, {0, 1, 0}, {1, 1, 0}, {1, -1, 0}, {0, 0, 1}};
    double area = c->def.shape.width * c->def.shape.height;
    for (int k = 0; k < 5; k++) {
        const double *s = strains[k];
        double energy = 0.0, exact = 0.5 * e * e * area *
                                     (m->c11 * s[0] * s[0] + 2.0 * m->c12 * s[0] * s[1] +
                                      m->c22 * s[1] * s[1] + m->c66 * s[2] * s[2]);
        for (int side = -1; side <= 1; side += 2) {
            for (int i = 0; i < f.places; i++) {
                Vec3 x = vec3_load(f.x + 3 * i);
                vec3_store(y + 3 * i, vec3(x.x + side * e * (s[0] * x.x + s[2] * x.y),
                                           x.y + side * e * s[1] * x.y, 0.0));
            }
            energy += 0.5 * model->energy(&f.cloth, y);
        }
        CHECK_AT_MOST(fabs(energy / exact - 1.0), 1e-6);
    }
    arena_free(&f.arena);
}

static void test_membrane(void **unused) {
    (void)unused;
    for_all(membrane_case);
}

/* A sheet that is rolled with sides of their rest length turns by psi at every thread: each form of
 * bending stores 1/2 D11 K^2 per area with its own K(psi), on all but half a spacing at both free ends
 * (stencils continue K to there).
 * Finite stretch and shear store 1/2 E'C E with Green's strain, where a model has it. */
static double rolled_curvature(BendingKind bending, double psi, double h) {
    bool angle = bending == BENDING_TENSOR || bending == BENDING_HINGE || bending == BENDING_ANGLE;
    return angle ? psi / h : 2.0 * sin(0.5 * psi) / h;
}

static void uniform_case(const Case *c, const ClothModel *model) {
    BendingKind bending = c->def.bending;
    if (c->def.shape.kind == SHAPE_SLEEVE || c->handle_count > 0 || is_second(bending) ||
        c->def.scattered || bending == BENDING_RBF || c->def.hysteresis) {
        return;
    }
    Case straight = *c; /* curves of yarns start as lines; a free end takes D12 */
    straight.def.fabric = cloths_fabric(0.2, 300.0, 0.3, 1e-5, 0.0);
    straight.def.fabric.bend_hysteresis.value = straight.def.fabric.shear_hysteresis.value = 0.0;
    Fixture f = fixture(&straight, model, 0.0);
    model = f.cloth.model;
    const Panel *p = &f.cloth.panel;
    double psi = 0.4, h = p->h1, radius = 0.5 * h / sin(0.5 * psi);
    double *y = arena_push(&f.arena, double, 3 * f.places);
    for (int i = 0; i < f.places; i++) {
        double turn = psi * (i % p->nu);
        vec3_store(y + 3 * i, vec3(radius * sin(turn), f.x[3 * i + 1], radius * (1.0 - cos(turn))));
    }
    double k = rolled_curvature(bending, psi, h), area = c->def.shape.width * c->def.shape.height;
    double exact = 0.5 * f.cloth.material.d11 * k * k * area;
    exact *= bending == BENDING_STENCIL ? 1.0 : (p->nu - 2.0) / (p->nu - 1.0);
    CHECK_AT_MOST(fabs(model->energy(&f.cloth, y) / exact - 1.0), 1e-12);
    bool green = c->def.kinematics == KINEMATICS_GREEN &&
                 (strcmp(model->name, "mlpg") == 0 || strcmp(model->name, "triangles") == 0);
    if (green) {
        const Material *m = &f.cloth.material;
        double s[3][2] = {{1.2, 0.1}, {-0.2, 0.9}, {0.3, 0.4}}, e[3] = {-0.5, -0.5, 0.0};
        for (int r = 0; r < 3; r++) {
            e[0] += 0.5 * s[r][0] * s[r][0], e[1] += 0.5 * s[r][1] * s[r][1];
            e[2] += s[r][0] * s[r][1];
        }
        for (int i = 0; i < 3 * f.places; i++) {
            const double *x = f.x + i / 3 * 3;
            y[i] = s[i % 3][0] * x[0] + s[i % 3][1] * x[1];
        }
        exact = 0.5 * area *
                (m->c11 * e[0] * e[0] + 2.0 * m->c12 * e[0] * e[1] + m->c22 * e[1] * e[1] +
                 m->c66 * e[2] * e[2]);
        CHECK_AT_MOST(fabs(model->energy(&f.cloth, y) / exact - 1.0), 1e-12);
    }
    arena_free(&f.arena);
}

static void test_uniform(void **unused) {
    (void)unused;
    for_all(uniform_case);
}

static void sweep_setup(const Fixture *f, Arena *arena, Lanes *lanes, SweepLattice *lattice,
                        int *slots) {
    *lattice = *f->cloth.lattice;
    lattice->first = lattice->stride + LANE_MARGIN;
    *lanes = lanes_create((lattice->nv + 2) * lattice->stride + LANE_MARGIN, arena);
    int outside[4] = {-1, 1, -lattice->stride, lattice->stride};
    for (int i = 0; i < f->places; i++) {
        if (i < f->cloth.node_count) {
            slots[i] = lattice->first + i / lattice->nu * lattice->stride + i % lattice->nu;
        } else {
            const Ghost *ghost = &f->cloth.ghosts[i - f->cloth.node_count];
            slots[i] = slots[ghost->border] + outside[ghost->side];
        }
        for (int a = 0; a < 3; a++) {
            lanes->x[a][slots[i]] = f->x[3 * i + a];
        }
        lanes->weight[slots[i]] = 1.0;
    }
    sweep_wrap_rows(lattice, lanes->x);
}

/* one kick of 1 s with unit masses gives the force: minus the gradient; same bits for every
 * kernel and however the rows are cut */
static void sweep_case(const Case *c, const ClothModel *model) {
    Fixture f = fixture(c, model, 2e-3);
    model = f.cloth.model;
    if (!f.cloth.lattice) {
        arena_free(&f.arena);
        return;
    }
    int n = 3 * f.places, *slots = arena_push(&f.arena, int, f.places);
    double *g = arena_push(&f.arena, double, n), *first = arena_push(&f.arena, double, n);
    model->add_gradient(&f.cloth, f.x, g);
    if (f.cloth.lattice->bounded) { /* which the sweep leaves to its caller */
        const Mlpg *mlpg = f.cloth.data;
        double *sides = arena_push(&f.arena, double, n);
        side_bound_add_gradient(f.cloth.lattice, &mlpg->membrane, f.x, sides);
        for (int i = 0; i < n; i++) {
            g[i] -= sides[i];
        }
    }
    if (model->add_rest_gradient && !f.cloth.lattice->rest) {
        double *rest = arena_push(&f.arena, double, n);
        model->add_rest_gradient(&f.cloth, f.x, rest);
        for (int i = 0; i < n; i++) {
            g[i] -= rest[i];
        }
    }
    for (const SweepKernel *const *kernel = sweep_kernels; *kernel; kernel++) {
        for (int cut = 0; cut < 3 && sweep_kernel_runs_here(*kernel); cut++) {
            Lanes lanes;
            SweepLattice lattice;
            sweep_setup(&f, &f.arena, &lanes, &lattice, slots);
            SweepKick kick = {1.0, {0, 0, 0}, 1.0, {NULL, NULL}, NULL};
            double *buffer =
                arena_push(&f.arena, double, SWEEP_BUFFER_ROWS *lattice.stride + LANE_MARGIN);
            int middle = cut == 0 ? lattice.nv : cut;
            (*kernel)->kick(&lattice, &lanes, &kick, 0, middle, buffer);
            if (middle < lattice.nv) {
                (*kernel)->kick(&lattice, &lanes, &kick, middle, lattice.nv, buffer);
            }
            double worst = 0.0;
            bool reference = kernel == sweep_kernels && cut == 0;
            for (int i = 0; i < 3 * f.cloth.node_count; i++) {
                double v = lanes.v[i % 3][slots[i / 3]];
                worst = fmax(worst, fabs(v + g[i]));
                first[i] = reference ? v : first[i];
                assert_true(memcmp(&v, &first[i], sizeof v) == 0);
            }
            CHECK_AT_MOST(worst / norm(g, n), 1e-12);
        }
    }
    arena_free(&f.arena);
}

static void test_sweep(void **unused) {
    (void)unused;
    for_all(sweep_case);
}

int main(void) {
    make_cases();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_gradient), cmocka_unit_test(test_hessian),
        cmocka_unit_test(test_rigid),    cmocka_unit_test(test_rest),
        cmocka_unit_test(test_membrane), cmocka_unit_test(test_uniform),
        cmocka_unit_test(test_sweep),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
