/* stress.c: abuse. Every run must stay finite, gain no more energy than its stepper allows, and come
 * to rest (short ones: no more than that), or stop with a clear reason; where cloth meets itself
 * nothing may cross in any frame, by the exact check. All steppers with the first model, the two
 * main ones with every model; contact by impulses (`+impulses`) with every model where there is
 * contact. Writes a table: case, model, stepper, frames done, taken back, kinetic energy left, crossings
 * of all frames, verdict. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/clock.h"
#include "sim/base/hash.h"
#include "sim/base/parallel.h"
#include "tests/support/cloths.h"
#include "tests/support/strips.h"

#define REST_SHARE 1e-3 /* kinetic energy / (weight * size) that counts as at rest */

typedef enum Abuse {
    ABUSE_NONE,
    ABUSE_RANDOM,
    ABUSE_PLANE,
    ABUSE_LINE,
    ABUSE_POINT,
    ABUSE_STRETCH,
    ABUSE_THROWN
} Abuse;

typedef struct StressCase {
    const char *name;
    Abuse abuse;
    double stiffer, lighter; /* factors on stretch stiffness and weight */
    double rate;             /* [1/s] output intervals */
    double seconds;
    double ball; /* [m/s] of one that goes up through the sheet and back; 0: none */
} StressCase;

static const StressCase cases[] = {
    {"calm", ABUSE_NONE, 1, 1, 30, 6, 0},
    {"random positions", ABUSE_RANDOM, 1, 1, 30, 6, 0},
    {"collapsed to a plane", ABUSE_PLANE, 1, 1, 30, 6, 0},
    {"collapsed to a line", ABUSE_LINE, 1, 1, 30, 6, 0},
    {"collapsed to a point", ABUSE_POINT, 1, 1, 30, 6, 0},
    {"stretched ten-fold", ABUSE_STRETCH, 1, 1, 30, 6, 0},
    {"thrown at 100 m/s", ABUSE_THROWN, 1, 1, 30, 6, 0},
    {"output step 1/24 s", ABUSE_NONE, 1, 1, 24, 6, 0},
    {"output step 0.1 s", ABUSE_NONE, 1, 1, 10, 6, 0},
    {"stiffness x 1e6", ABUSE_NONE, 1e6, 1, 300, 0.02, 0},
    {"density x 1e-3", ABUSE_NONE, 1, 1e-3, 30, 2, 0},
    {"ball at 1 m/s", ABUSE_NONE, 1, 1, 30, 6, 1.0},
    {"ball at 20 m/s", ABUSE_NONE, 1, 1, 30, 6, 20.0},
    {"random, stiffness x 1e6", ABUSE_RANDOM, 1e6, 1, 3000, 0.001, 0},
    {"stretched, density x 1e-3", ABUSE_STRETCH, 1, 1e-3, 300, 0.1, 0},
};

static void abuse(const StressCase *c, const System *system, State *s) {
    double centre[3] = {s->x[0], s->x[1], s->x[2]}, size = system->size;
    for (int i = 0; i < system->node_count; i++) {
        double *x = s->x + 3 * (size_t)i;
        switch (c->abuse) {
        case ABUSE_NONE:
            break;
        case ABUSE_RANDOM:
            for (int a = 0; a < 3; a++) {
                x[a] = size * hash_random(5, (uint64_t)(3 * i + a));
            }
            break;
        case ABUSE_PLANE:
            x[0] = centre[0] + 0.3 * size * hash_random(6, (uint64_t)i);
            x[1] = centre[1] + 0.3 * size * hash_random(7, (uint64_t)i);
            x[2] = centre[2];
            break;
        case ABUSE_LINE:
            x[0] = centre[0] + 0.3 * size * hash_random(6, (uint64_t)i);
            x[1] = centre[1], x[2] = centre[2];
            break;
        case ABUSE_POINT:
            x[0] = centre[0], x[1] = centre[1], x[2] = centre[2];
            break;
        case ABUSE_STRETCH:
            x[0] = centre[0] + 10.0 * (x[0] - centre[0]);
            break;
        case ABUSE_THROWN:
            s->v[3 * i + 2] = 100.0;
            break;
        }
    }
}

static bool all_finite(const System *system, const State *s) {
    for (int i = 0; i < 3 * system->place_count; i++) {
        if (!isfinite(s->x[i]) || !isfinite(s->v[i])) {
            return false;
        }
    }
    return true;
}

#define SHORT 0.2 /* [s] for steppers that know no contact */

typedef struct Pace {
    double seconds, rate; /* rate: [1/s] output intervals */
} Pace;

/* What forward Euler and midpoint gain hangs on the length of an interval more than on their step, rk45
 * follows every mode, and three_phase sweeps in every step: a frame may take them millions of gradients,
 * so they get intervals of some stable steps of `central`. `stochastic` looks for an equilibrium in every interval. */
#define SEARCHES 2
#define TINY_INTERVALS 20
#define TINY_STEPS 10
static Pace pace_of(const StressCase *c, const Stepper *stepper, const System *system,
                    bool contact) {
    static const char *const tiny[] = {"forward_euler", "midpoint", "rk45", "three_phase"};
    for (size_t i = 0; i < sizeof tiny / sizeof *tiny; i++) {
        if (strcmp(stepper->name, tiny[i]) == 0) {
            double interval = TINY_STEPS * system_stable_step(system);
            return (Pace){TINY_INTERVALS * interval, 1.0 / interval};
        }
    }
    if (strcmp(stepper->name, "stochastic") == 0) {
        return (Pace){SEARCHES / c->rate, c->rate};
    }
    return (Pace){contact ? c->seconds : fmin(c->seconds, SHORT), c->rate};
}

/* A case of one model and stepper. */
typedef struct Trial {
    const StressCase *c;
    const Stepper *stepper;
    const char *model;
    bool impulses;
} Trial;

#define BALL_RADIUS 0.05 /* [m] */
#define BALL_WAY 0.3     /* [m] */

/* lives as long as the scene */
typedef struct Ball {
    ObstacleDef def;
    MotionPiece pieces[2];
} Ball;

/* from below up through where the sheet starts to fall, and back */
static void add_ball(Scene *scene, Ball *ball, double speed) {
    double time = BALL_WAY / speed;
    for (int k = 0; k < 2; k++) {
        ball->pieces[k] = (MotionPiece){.kind = MOTION_MOVE,
                                        .by = vec3(0, 0, k ? -BALL_WAY : BALL_WAY),
                                        .from = k * time,
                                        .to = (k + 1) * time};
    }
    ball->def = obstacle_default();
    ball->def.solid = (Solid){.kind = SOLID_SPHERE, .radius = BALL_RADIUS};
    ball->def.pose.shift = vec3(0.02, 0, -0.2);
    ball->def.motion = (Motion){2, ball->pieces};
    scene->obstacle_count = 1;
    scene->obstacles = &ball->def;
}

/* the sheet of a case and its stepper; without contact where the stepper refuses it */
static bool start_case(Bench *b, const Trial *t, Ball *ball, void **data) {
    const StressCase *c = t->c;
    const Stepper *stepper = t->stepper;
    Error error = {0};
    memset(b, 0, sizeof *b);
    Fabric fabric = cloths_fabric(0.15 * c->lighter, 1000.0 * c->stiffer, 0.2, 1e-5, 0.0);
    b->cloth = cloths_rectangle(0.3, 0.3, 16, 16, fabric);
    b->cloth.damping = 5.0;
    b->cloth.model = t->model;
    b->scene = cloths_scene(&b->cloth);
    /* positions that no cloth can have: contact would refuse them */
    b->scene.solver.self_contact = c->abuse == ABUSE_NONE || c->abuse == ABUSE_THROWN;
    b->scene.solver.stepper = stepper->name;
    b->scene.solver.impulses = t->impulses;
    if (c->ball > 0.0) {
        add_ball(&b->scene, ball, c->ball);
    }
    b->handles[0] = b->handles[1] = handle_default();
    b->handles[0].region = REGION_TOP_LEFT;
    b->handles[1].region = REGION_TOP_RIGHT;
    bench_build(b, 2);
    if (stepper->create(&b->system, data, &error)) {
        return true;
    }
    arena_free(&b->arena);
    b->arena = (Arena){0};
    b->scene.solver.self_contact = false;
    b->scene.obstacle_count = 0;
    bench_build(b, 2);
    stepper->create(&b->system, data, &error);
    return false;
}

static double total_energy(const System *system, const State *s, const unsigned char *held) {
    return system_kinetic_energy(system, s->v, held) + system_elastic_energy(system, s->x) +
           system_gravity_energy(system, s->x, held);
}

/* true when the run behaved */
static bool run_case(const Trial *t, FILE *table) {
    const StressCase *c = t->c;
    const Stepper *stepper = t->stepper;
    const char *model = t->model;
    char name[40];
    Ball ball;
    Bench b;
    void *data;
    Error error = {0};
    Statistics statistics = {.smallest_gap = INFINITY};
    bool contact = start_case(&b, t, &ball, &data);
    Pace pace = pace_of(c, stepper, &b.system, contact);
    State s = state_allocate(&b.system, &b.arena);
    unsigned char *held = arena_push(&b.arena, unsigned char, b.system.place_count);
    state_start(&b.system, &s);
    system_mark_held(&b.system, 0, held);
    abuse(c, &b.system, &s);
    double before = total_energy(&b.system, &s, held), size = b.system.weight * b.system.size;
    int frames = (int)lround(pace.seconds * pace.rate), done = 0;
    double cpu = 0.0;
    long crossings = 0;
    bool ok = true;
    for (; ok && done < frames; done += ok) {
        double start = clock_process_seconds();
        ok = stepper->advance(&b.system, data, &s, (done + 1) / pace.rate, &statistics, &error);
        cpu += clock_process_seconds() - start;
        if (b.scene.solver.self_contact && all_finite(&b.system, &s)) {
            crossings += system_crossings(&b.system, &s);
        }
    }
    double kinetic = system_kinetic_energy(&b.system, s.v, held) / size;
    double gain = total_energy(&b.system, &s, held) - before - statistics.work;
    double allowed = pow(1.0 + STEP_ENERGY_TOLERANCE, done) - 1.0; /* by every stepper */
    bool gains = gain > allowed * fmax(fabs(before) + fabs(statistics.work), size);
    bool finite = all_finite(&b.system, &s), rests = kinetic < REST_SHARE;
    bool long_enough = pace.seconds >= 2.0;
    bool good = finite && crossings == 0 && !gains && (!ok || rests || !long_enough);
    const char *verdict = !finite        ? "NOT FINITE"
                          : crossings    ? "CROSSES"
                          : gains        ? "GAINS ENERGY"
                          : !ok          ? "stopped"
                          : !long_enough ? "bounded"
                          : rests        ? "at rest"
                                         : "STILL MOVING";
    snprintf(name, sizeof name, "%s%s", stepper->name, t->impulses ? "+impulses" : "");
    fprintf(table, "%s,%s,%s,%d,%d,%.0f,%.3g,%ld,%.3g,%s,\"%s\"\n", c->name, model, name, done,
            frames, statistics.retries, kinetic, crossings, cpu, verdict, error.text);
    printf("%-26s %-9s %-17s frames %3d/%-3d taken back %4.0f  kinetic %-9.2g cpu %-8.3g %s %s\n",
           c->name, model, name, done, frames, statistics.retries, kinetic, cpu, verdict,
           error.text);
    fflush(stdout);
    if (stepper->destroy) {
        stepper->destroy(data);
    }
    arena_free(&b.arena);
    return good;
}

int main(int argc, char **argv) {
    parallel_fix_environment(argv);
    FILE *table = fopen(argc > 1 ? argv[1] : "stress.csv", "w");
    if (!table) {
        perror("stress");
        return 74;
    }
    fprintf(
        table,
        "case,model,stepper,frames,of,taken_back,kinetic_share,crossings,cpu_s,verdict,reason\n");
    int bad = 0, count = 0;
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        if (argc > 2 && strcmp(argv[2], cases[c].name) != 0) {
            continue;
        }
        for (const Stepper *const *stepper = steppers; *stepper; stepper++) {
            for (const ClothModel *const *model = cloth_models; *model; model++) {
                bool main_one = strcmp((*stepper)->name, "central") == 0 ||
                                strcmp((*stepper)->name, "bdf2") == 0;
                bool meets = cases[c].abuse == ABUSE_NONE || cases[c].abuse == ABUSE_THROWN;
                Trial t = {&cases[c], *stepper, (*model)->name, false};
                if (model == cloth_models || main_one) {
                    count++;
                    bad += !run_case(&t, table);
                }
                t.impulses = true;
                if (meets && strcmp((*stepper)->name, "central") == 0) {
                    count++;
                    bad += !run_case(&t, table);
                }
            }
        }
    }
    fclose(table);
    printf("%d passed, %d failed\n", count - bad, bad);
    return bad > 0;
}
