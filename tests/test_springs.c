/* Springs against closed forms: buckling laws, homogenised constants, the heavy elastica. */
#include <stdlib.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/model/model.h"
#include "sim/model/spring_law.h"
#include "sim/sim.h"
#include "sim/step/explicit.h"
#include "sim/step/stepper.h"
#include "tests/support/check.h"
#include "tests/support/cloths.h"
#include "tests/support/strips.h"

static const BuckleLaw *const laws[] = {&buckle_elastica, &buckle_arc, &buckle_quartic,
                                        &buckle_chord, NULL};

/* each law: energy, force and slope belong together, also where series take over */
static void test_laws(void **unused) {
    (void)unused;
    const double places[] = {1e-8, 1e-6, 5e-5, 1e-3, 0.02, 0.1, 0.3, 0.6, 0.95};
    for (const BuckleLaw *const *law = laws; *law; law++) {
        print_message("  %s\n", (*law)->name);
        for (int k = 0; k < 9; k++) {
            double d = places[k], step = 1e-5 * fmax(d, 1e-3);
            step = fmin(step, 0.5 * d);
            double force = ((*law)->energy(d + step) - (*law)->energy(d - step)) / (2 * step);
            double slope = ((*law)->force(d + step) - (*law)->force(d - step)) / (2 * step);
            /* digits that the quotient itself loses */
            double loss = 1e-15 * fabs((*law)->energy(d)) / step;
            double loss_slope = 4e-14 * fabs((*law)->force(d)) / step;
            CHECK_NEAR((*law)->force(d), force, 1e-7 * fabs(force) + 20 * loss + 1e-14 / step);
            CHECK_NEAR((*law)->slope(d), slope, 1e-5 * fabs(slope) + loss_slope);
        }
    }
}

/* the pinned elastica by elliptic integrals, with end slope alpha and k = sin(alpha/2): end shortening
 * d = 2 (1 - E/K), P / Pcr = (2K/pi)^2; the fit is good to 0.1 % */
static void test_elastica_law(void **unused) {
    (void)unused;
    static const double exact[][2] = {
        {0.0001, 1.0000500028127}, {0.0005, 1.000250070333}, {0.001, 1.0005002814142},
        {0.002, 1.0010011263141},  {0.005, 1.0025070518186}, {0.01, 1.0050282900388},
        {0.02, 1.0101138282141},   {0.03, 1.0152576347217},  {0.05, 1.0257242579259},
        {0.075, 1.0391544589694},  {0.1, 1.0529868803193},   {0.15, 1.0819357740218},
        {0.2, 1.112738719881},     {0.25, 1.1455868399045},  {0.3, 1.1806988149061},
        {0.35, 1.2183260480864},   {0.4, 1.2587590298568},   {0.45, 1.3023352402921},
        {0.5, 1.3494490364366},    {0.6, 1.4562294325399},   {0.7, 1.5839608942823},
        {0.8, 1.739683654388},     {0.9, 1.9339689846845},   {1.0, 2.1833790461895}};
    for (size_t k = 0; k < sizeof exact / sizeof *exact; k++) {
        double force = exact[k][1] * 9.869604401089358;
        CHECK_AT_MOST(fabs(buckle_elastica.force(exact[k][0]) / force - 1.0), 1e-3);
    }
    /* an arc that closes to a circle: 4 pi^2; their fit is 1.6 % from its own arc */
    CHECK_NEAR(buckle_arc.force(1.0 - 1e-9), 4.0 * 9.869604401089358, 1e-4);
    double worst = 0.0;
    for (double d = 0.0; d < 0.95; d += 0.01) {
        worst = fmax(worst, fabs(buckle_quartic.force(d) / buckle_arc.force(d) - 1.0));
    }
    CHECK_AT_MOST(worst, 0.017);
}

/* tension and energy of a spring belong together; the strip takes over without a jump */
static void test_spring(void **unused) {
    (void)unused;
    for (const BuckleLaw *const *law = laws; *law; law++) {
        for (int pushes = 0; pushes < 2; pushes++) {
            SpringKind kind = spring_kind(0.02, 40.0, *law, 1e-7);
            kind.pushes = pushes;
            kind.limit = 0.13, kind.stiffen = pushes ? 0.0 : 800.0;
            double onset = kind.rest * (1.0 - kind.onset), below, above;
            below = spring_tension(&kind, onset - 1e-12, NULL);
            above = spring_tension(&kind, onset + 1e-12, NULL);
            CHECK_AT_MOST(fabs(below / above - 1.0), 1e-6);
            for (double r = 0.1; r < 1.3; r += 0.1) {
                double length = r * kind.rest, step = 1e-8, slope;
                double force =
                    (spring_energy(&kind, length + step) - spring_energy(&kind, length - step)) /
                    (2 * step);
                double tension = spring_tension(&kind, length, &slope);
                double change = spring_tension(&kind, length + step, NULL) -
                                spring_tension(&kind, length - step, NULL);
                /* at r = 1 a pushing spring has a kink */
                if (fabs(r - 1.0) > 1e-6) {
                    CHECK_NEAR(tension, force, 1e-6 * fabs(force) + 1e-9);
                    CHECK_NEAR(slope, change / (2 * step), 1e-5 * fabs(slope) + 1e-7);
                }
            }
        }
    }
}

/* Young's moduli and shear of the fabric come back from the constants of the lattice */
static void test_moduli(void **unused) {
    (void)unused;
    for (int k = 0; k < 2; k++) {
        Arena arena = {0};
        Error error = {0};
        Cloth cloth;
        ClothDef def = cloths_rectangle(0.1, k ? 0.13 : 0.1, 11, 11, cloths_orthotropic());
        def.model = "springs";
        assert_true(cloth_create(&cloth, &def, NULL, 0, 1, &arena, &error));
        const Material *m = &cloth.material;
        CHECK_NEAR(m->c11 - m->c12 * m->c12 / m->c22, def.fabric.stretch_warp.value, 1e-9);
        CHECK_NEAR(m->c22 - m->c12 * m->c12 / m->c11, def.fabric.stretch_weft.value, 1e-9);
        CHECK_NEAR(m->c66, def.fabric.shear.value, 1e-12);
        assert_non_null(strstr(cloth.note, "Poisson"));
        assert_non_null(strstr(cloth.note, "D12"));
        arena_free(&arena);
    }
    Arena arena = {0};
    Error error = {0};
    Cloth cloth;
    ClothDef def = cloths_rectangle(0.1, 0.1, 11, 11, cloths_orthotropic());
    def.model = "springs";
    def.fabric.shear.value = 2000.0;
    assert_false(cloth_create(&cloth, &def, NULL, 0, 1, &arena, &error));
    assert_int_equal(error.code, EXIT_BAD_INPUT);
    assert_non_null(strstr(error.text, "shear stiffness"));
    arena_free(&arena);
}

/* tip errors of the heavy elastica, the segments doubled twice */
static void tip_errors(BendingKind bending, double gamma, int segments, double errors[3]) {
    bool smooth = bending == BENDING_STENCIL;
    for (int k = 0; k < 3; k++) {
        StripCase c = {.gamma = gamma,
                       .stiffness = smooth ? 1e8 : 1e6,
                       .nodes = 1 + (segments << k),
                       .across = 3,
                       .bending = bending,
                       .buckling = BUCKLE_ARC,
                       .model = "springs"};
        StripResult r = smooth ? strip_solve(&c) : strip_relax(&c, 3000000);
        errors[k] = r.error;
        print_message("  %s gamma %g, %d segments: %.3g %% (%d, status %d)\n",
                      bending_words[bending], gamma, segments << k, 100 * r.error, r.iterations,
                      (int)r.status);
    }
}

/* ---- the laws of bending in a chain that does not stretch ---- */

typedef struct Chain {
    const BuckleLaw *law;
    double wall; /* rigidity of the wall's spring / that of the others */
    int segments;
} Chain;

/* Moment / (B w) of a turn psi, 1/m: - dE/dpsi of the chord L cos(psi/2), L = 2 h, for the strip of a
 * law with k = 8 B w / f(0). From the law itself: lengths would lose small turns. */
static double chain_moment(const Chain *c, double psi) {
    double length = 2.0 / c->segments, d = 2.0 * pow(sin(0.25 * psi), 2);
    double k = 8.0 / c->law->force(0.0);
    return 0.5 * length * sin(0.5 * psi) * c->law->force(d) * k / (length * length);
}

static double chain_turn(const Chain *c, double moment) {
    double low = 0.0, high = 3.1;
    for (int k = 0; k < 60; k++) {
        double middle = 0.5 * (low + high);
        *(chain_moment(c, middle) < moment ? &low : &high) = middle;
    }
    return 0.5 * (low + high);
}

/* Down to the wall from a last segment that hangs by `angle`; returns the angle at which the wall would
 * have to stand. Weights at the nodes, half at the end. */
static double chain_shoot(const Chain *c, double gamma, double angle, double tip[2]) {
    double h = 1.0 / c->segments, weight = 0.5 * gamma * h, moment = 0.0;
    tip[0] = tip[1] = 0.0;
    for (int k = c->segments - 1; k >= 0; k--) {
        tip[0] += h * cos(angle), tip[1] += h * sin(angle);
        moment += weight * h * cos(angle);
        angle -= chain_turn(c, moment / (k ? 1.0 : c->wall));
        weight += gamma * h;
    }
    return angle;
}

static double chain_error(const Chain *c, double gamma) {
    double low = 0.0, high = 0.5 * PI, tip[2], exact[2];
    for (int k = 0; k < 60; k++) {
        double middle = 0.5 * (low + high);
        *(chain_shoot(c, gamma, middle, tip) < 0.0 ? &low : &high) = middle;
    }
    strip_exact(gamma, exact);
    return hypot(tip[0] - exact[0], tip[1] - exact[1]);
}

/* Chords and arcs bend a chain as they should, with order 2; a wall over a whole length does not. */
static void test_chain(void **unused) {
    (void)unused;
    const double gammas[4] = {1, 10, 100, 1000}, bars[4] = {4e-4, 2e-3, 5e-3, 1.2e-2};
    const BuckleLaw *const forms[3] = {&buckle_chord, &buckle_arc, &buckle_elastica};
    for (int form = 0; form < 3; form++) {
        for (int g = 0; g < 4; g++) {
            double errors[4];
            for (int k = 0; k < 4; k++) {
                Chain c = {forms[form], 2.0, 10 << k};
                errors[k] = chain_error(&c, gammas[g]);
            }
            print_message("  %s gamma %g: %.3g %.3g %.3g %.3g %%\n", forms[form]->name, gammas[g],
                          100 * errors[0], 100 * errors[1], 100 * errors[2], 100 * errors[3]);
            CHECK_AT_MOST(errors[1], bars[g]);
            for (int k = 0; k < 3 && gammas[g] <= 100; k++) {
                CHECK_AT_MOST(1.9, log2(errors[k] / errors[k + 1]));
            }
        }
    }
    Chain whole = {&buckle_chord, 1.0, 20};
    CHECK_NEAR(chain_error(&whole, 10.0), 0.047, 1e-3);
}

/* forms of bending and nodes that springs cannot have are refused by name */
static void test_refusals(void **unused) {
    (void)unused;
    const char *messages[3] = {"knows no 'bending: rbf' on lattices; it knows stencil, choi_ko",
                               "does not work on scattered nodes", "know flat cloth only"};
    for (int k = 0; k < 3; k++) {
        Arena arena = {0};
        Error error = {0};
        Cloth cloth;
        ClothDef def = cloths_rectangle(0.1, 0.1, 11, 11, cloths_orthotropic());
        def.model = "springs";
        def.bending = k == 0 ? BENDING_RBF : k == 2 ? BENDING_CHORD : BENDING_AUTO;
        def.scattered = k == 1;
        def.spacing = k == 1 ? 0.01 : 0.0;
        def.shape.rest_curvature[0] = k == 2 ? 5.0 : 0.0;
        assert_false(cloth_create(&cloth, &def, NULL, 0, 1, &arena, &error));
        assert_int_equal(error.code, EXIT_BAD_INPUT);
        assert_non_null(strstr(error.text, messages[k]));
        arena_free(&arena);
    }
}

/* A sheet hung by its whole upper edge is as many chains: each spring carries the rows below. What
 * would be twice as long ends a little beyond the limit, as the law says. */
static void test_stiffening(void **unused) {
    (void)unused;
    const double modulus = 20.0, weight = 0.2, gravity = 50.0, green = 0.105;
    Bench b = {0};
    Error error = {0};
    b.cloth = cloths_rectangle(0.1, 0.4, 6, 21, cloths_fabric(weight, modulus, 0.0, 1e-6, 0.0));
    b.cloth.fabric.shear.value = 1e-5;
    b.cloth.fabric.stretch_limit.value = green;
    b.cloth.model = "springs";
    b.cloth.stiffening = 20.0;
    b.scene = cloths_scene(&b.cloth);
    b.scene.gravity = vec3(0, -gravity, 0);
    b.scene.solver.self_contact = false;
    b.handles[0] = handle_default();
    b.handles[0].region = REGION_TOP;
    bench_build(&b, 1);
    const Stepper *stepper = stepper_find("static");
    void *data;
    assert_true(stepper->create(&b.system, &data, &error));
    State state = state_allocate(&b.system, &b.arena);
    state_start(&b.system, &state);
    Statistics statistics = {.smallest_gap = INFINITY};
    if (!stepper->advance(&b.system, data, &state, 1.0, &statistics, &error)) {
        fail_msg("%s", error.text);
    }
    double h = 0.4 / 20, limit = sqrt(1.0 + 2.0 * green) - 1.0, most = 0.0;
    for (int j = 0; j < 20; j++) {
        int low = 6 * j + 2;
        double length = state.x[3 * (low + 6) + 1] - state.x[3 * low + 1];
        double load = weight * gravity * h * (j + 0.5); /* [N/m] of the rows up to this one */
        double strain = load / modulus;
        if (strain > limit) {
            strain = limit + (load - modulus * limit) / (21.0 * modulus);
        }
        CHECK_NEAR(length / h - 1.0, strain, 1e-5);
        most = fmax(most, length / h - 1.0);
    }
    CHECK_AT_MOST(0.19, weight * gravity * 0.4 / modulus); /* unlimited */
    CHECK_AT_MOST(most, limit + 0.01);
    stepper->destroy(data);
    arena_free(&b.arena);
}

/* ---- Provot's limit ---- */

/* the swing by springs, 26 x 26, whose stretch limit is 10 % */
static void make_limited(Bench *b, double modulus, int rounds, int handles) {
    memset(b, 0, sizeof *b);
    b->cloth = cloths_rectangle(1.0, 1.0, 26, 26, cloths_fabric(0.2, modulus, 0.0, 1e-5, 0.0));
    b->cloth.fabric.shear.value = 0.3 * modulus;
    b->cloth.fabric.stretch_limit.value = 0.105; /* Green's strain of 10 % */
    b->cloth.model = "springs";
    b->cloth.limit_rounds = rounds;
    b->cloth.noise = handles ? 0.0 : 1e-3;
    b->cloth.pose.turn = quat_from_axis_angle(vec3(1, 0, 0), 60.0 * PI / 180.0);
    b->scene = cloths_scene(&b->cloth);
    b->scene.solver.self_contact = false;
    b->handles[0] = b->handles[1] = handle_default();
    b->handles[0].region = REGION_TOP_LEFT;
    b->handles[1].region = REGION_TOP_RIGHT;
    bench_build(b, handles);
}

/* largest strain of threads and diagonals */
static double largest_stretch(const Cloth *cloth, const double *x) {
    const Panel *p = &cloth->panel;
    double most = 0.0;
    for (int i = 0; i < p->node_count; i++) {
        static const int reach[4][2] = {{1, 0}, {0, 1}, {1, 1}, {1, -1}};
        for (int k = 0; k < 4; k++) {
            int u = i % p->nu + reach[k][0], v = i / p->nu + reach[k][1];
            if (u < p->nu && v >= 0 && v < p->nv) {
                int other = v * p->nu + u;
                double rest = hypot(reach[k][0] * p->h1, reach[k][1] * p->h2);
                Vec3 d = vec3_sub(vec3_load(x + 3 * other), vec3_load(x + 3 * i));
                most = fmax(most, vec3_length(d) / rest - 1.0);
            }
        }
    }
    return most;
}

/* the largest strain after 1 s by steps of 1 ms */
static double limited_stretch(double modulus, int rounds) {
    Bench b;
    make_limited(&b, modulus, rounds, 2);
    State state = state_allocate(&b.system, &b.arena);
    state_start(&b.system, &state);
    Explicit *engine = explicit_create(&b.system);
    ExplicitRun run = {.steps = 10, .dt = 1e-3};
    double now = 0.0, most = 0.0;
    for (int k = 0; k < 100; k++) {
        ExplicitResult result = explicit_interval(engine, &run, &state);
        assert_true(result.finite);
        now = largest_stretch(&b.system.cloths[0], state.x);
        most = fmax(most, now);
    }
    print_message("  E %g N/m, %d rounds: %.2f %%, on the way up to %.2f %%\n", modulus, rounds,
                  100 * now, 100 * most);
    arena_free(&b.arena);
    return now;
}

static void test_limit(void **unused) {
    (void)unused;
    const int rounds[3] = {1, 3, 10};
    const double bars[3] = {0.15, 0.12, 0.106}, moduli[2] = {1, 20};
    for (int m = 0; m < 2; m++) {
        CHECK_AT_MOST(1.0, limited_stretch(moduli[m], 0));
        for (int k = 0; k < 3; k++) {
            CHECK_AT_MOST(limited_stretch(moduli[m], rounds[k]), bars[k]);
        }
    }
}

/* steppers that move cloth without it say so */
static void test_limit_refused(void **unused) {
    (void)unused;
    static const char text[] =
        "toile: 1\ncloth:\n  s:\n    shape: {rectangle: {width: 10 cm, height: 10 cm}}\n"
        "    fabric: wool-tropical\n    model: springs\n    nodes: 8 x 8\n    limit_rounds: 10\n"
        "solver: {stepper: %s}\n";
    static const char *const names[3] = {"central", "bdf2", "rk4"};
    for (int k = 0; k < 3; k++) {
        Arena arena = {0};
        Scene scene;
        Sim sim;
        Error error = {0};
        char scene_text[400];
        SimOptions options = sim_options_default();
        snprintf(scene_text, sizeof scene_text, text, names[k]);
        assert_true(
            scene_parse("test.yaml", scene_text, strlen(scene_text), NULL, &arena, &scene, &error));
        assert_int_equal(sim_create(&sim, &scene, &options, &error), k == 0);
        if (k == 0) {
            sim_destroy(&sim);
        } else {
            assert_int_equal(error.code, EXIT_BAD_INPUT);
            assert_string_equal(strstr(error.text, ", not"), k == 1 ? ", not bdf2" : ", not rk4");
            assert_ptr_equal(
                strstr(error.text,
                       "test.yaml:9:19: error: 'limit_rounds' needs the stepper central"),
                error.text);
        }
        arena_free(&arena);
    }
}

/* a crumpled sheet that flies apart: the limit keeps both momenta, and takes the energy that it says */
static void test_limit_momentum(void **unused) {
    (void)unused;
    Bench b;
    make_limited(&b, 1e-6, 10, 0); /* nothing else takes energy */
    const System *s = &b.system;
    b.scene.gravity = vec3(0, 0, 0);
    State state = state_allocate(s, &b.arena);
    state_start(s, &state);
    for (int i = 0; i < 3 * s->place_count; i++) {
        state.v[i] = 20.0 * state.x[i] + hash_random(2, (uint64_t)i);
    }
    unsigned char *held = arena_push(&b.arena, unsigned char, s->place_count);
    double size = 0.0;
    Vec3 p[2] = {{0}}, q[2] = {{0}};
    Explicit *engine = explicit_create(s);
    ExplicitRun run = {.steps = 1000, .dt = 1e-3};
    double before = system_kinetic_energy(s, state.v, held) + system_elastic_energy(s, state.x);
    for (int k = 0; k < 2; k++) {
        for (int i = 0; i < s->place_count; i++) {
            Vec3 v = vec3_scale(s->mass[i], vec3_load(state.v + 3 * i));
            p[k] = vec3_add(p[k], v);
            q[k] = vec3_add(q[k], vec3_cross(vec3_load(state.x + 3 * i), v));
            size += vec3_length(v);
        }
        if (k == 0) {
            ExplicitResult result = explicit_interval(engine, &run, &state);
            double after =
                system_kinetic_energy(s, state.v, held) + system_elastic_energy(s, state.x);
            print_message("  %.4g J, then %.4g; the limit took %.4g\n", before, after,
                          result.sides);
            CHECK_AT_MOST(0.1 * before, result.sides);
            CHECK_AT_MOST(fabs(before - after - result.sides), 1e-3 * before);
        }
    }
    CHECK_AT_MOST(vec3_length(vec3_sub(p[1], p[0])) / size, 1e-12);
    CHECK_AT_MOST(vec3_length(vec3_sub(q[1], q[0])) / size, 1e-12);
    arena_free(&b.arena);
}

/* the curvature stencil: as accurate as that of mlpg, which is the same */
static void test_cantilever(void **unused) {
    (void)unused;
    const double gammas[4] = {1, 10, 100, 1000}, bars[4] = {5e-4, 3e-3, 7e-3, 2e-2};
    for (int g = 0; g < 4; g++) {
        double errors[3];
        tip_errors(BENDING_STENCIL, gammas[g], 20, errors);
        CHECK_AT_MOST(errors[0], bars[g]);
        if (gammas[g] < 1000) {
            CHECK_AT_MOST(1.9, log2(errors[1] / errors[2]));
        }
    }
}

/* Springs between second neighbours see a turn psi by a chord that is shorter by psi^2/8: they are
 * right where turns are large, and blind below the turn from which they push with full force.
 * Provot's, calibrated at one turn, get worse with every refinement. */
static void test_second_neighbours(void **unused) {
    (void)unused;
    double errors[3];
    for (int form = 0; form < 2; form++) {
        tip_errors(form ? BENDING_CHORD : BENDING_CHOI_KO, 1000, 10, errors);
        CHECK_AT_MOST(errors[1], 1.2e-2);
        CHECK_AT_MOST(1.3, 0.5 * log2(errors[0] / errors[2]));
    }
    tip_errors(BENDING_PROVOT, 10, 10, errors);
    CHECK_AT_MOST(0.05, errors[0]);
    CHECK_AT_MOST(errors[0], errors[1]);
    CHECK_AT_MOST(errors[1], errors[2]);
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_laws),          cmocka_unit_test(test_elastica_law),
        cmocka_unit_test(test_spring),        cmocka_unit_test(test_moduli),
        cmocka_unit_test(test_refusals),      cmocka_unit_test(test_stiffening),
        cmocka_unit_test(test_limit),         cmocka_unit_test(test_limit_momentum),
        cmocka_unit_test(test_limit_refused), cmocka_unit_test(test_chain),
        cmocka_unit_test(test_cantilever),    cmocka_unit_test(test_second_neighbours),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
