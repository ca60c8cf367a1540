/* bench_auto.c: what `stepper: auto` picks, beside all steppers, over ten scenes: limp and stiff
 * cloth, with and without contact, falls, swings, a twist, a drape to rest, all models.
 *
 * Auto is right when its own run keeps the stated error and no stepper that keeps it, at any of its
 * steps, is cheaper by more than a tenth. Cloth has no damping inside, which only explicit steps
 * know, so that all solve the same equations. */
#include <math.h>
#include <signal.h>
#include <string.h>
#include <sys/time.h>

#include "tests/bench/bench.h"
#include "tests/support/play.h"

#define STATED_ERROR 0.02 /* of the size: rms over nodes and times, from short steps */
#define SAME_COST 1.1     /* CPU times of one run differ by so much */
#define HOPELESS 3.0      /* times the cheapest: such a run is stopped */
#define TIMES 5
#define FRAME_RATE 30.0

typedef struct Case {
    const char *name, *model;
    int nodes;
    double seconds;
    bool contact, rests; /* rests: the end alone is compared */
    const char *scene;   /* without film and solver */
} Case;

#define SHEET(width, nodes, model, stretch, bending)                                               \
    "cloth:\n  sheet:\n    shape: {rectangle: {width: " width ", height: " width "}}\n"            \
    "    nodes: " nodes "\n    model: " model "\n    bending_damping: 0 s\n"                       \
    "    membrane_damping: 0 s\n"                                                                  \
    "    fabric: {name: f, weight: 150 g/m2, thickness: 0.5 mm, isotropic: {stretch: " stretch     \
    " N/m, poisson: 0.2, bending: " bending " N m}}\n"
#define CORNERS "handles: [{hold: [sheet.top-left, sheet.top-right]}]\n"
#define ON_BALL                                                                                    \
    "    at: [0, 0, 2 cm]\n"                                                                       \
    "obstacles: {ball: {sphere: {radius: 15 cm}, at: [0, 0, -15 cm], friction: 0.3}}\n"
#define TILTED "    turn: {axis: x, by: 30 deg}\n"

static const Case cases[] = {
    {"swing; soft", "mlpg", 26, 0.8, false, false,
     SHEET("1 m", "26 x 26", "mlpg", "1000", "1e-3") TILTED CORNERS},
    {"swing; stiff springs", "springs", 26, 0.8, false, false,
     SHEET("1 m", "26 x 26", "springs", "3e5", "1e-3") TILTED CORNERS},
    {"swing; triangles", "triangles", 21, 0.8, false, false,
     SHEET("1 m", "21 x 21", "triangles", "1000", "1e-3") TILTED CORNERS},
    {"swing; scattered nodes", "mlpg", 0, 0.5, false, false,
     "cloth:\n  sheet:\n    shape: {disc: {radius: 20 cm}}\n    spacing: 2 cm\n"
     "    bending_damping: 0 s\n    membrane_damping: 0 s\n"
     "    fabric: {name: f, weight: 150 g/m2, thickness: 0.5 mm, isotropic: {stretch: 1000 N/m,"
     " poisson: 0.2, bending: 1e-4 N m}}\nhandles: [{hold: sheet, nearest: [0, 20 cm]}]\n"},
    {"fall on a ball; limp", "mlpg", 31, 0.5, true, false,
     SHEET("60 cm", "31 x 31", "mlpg", "1000", "1e-5") ON_BALL},
    {"fall on a ball; particles", "particles", 26, 0.5, true, false,
     SHEET("60 cm", "26 x 26", "particles", "2000", "3e-5") ON_BALL},
    {"fall on a cube; triangles", "triangles", 26, 0.4, true, false,
     SHEET("60 cm", "26 x 26", "triangles", "1000",
           "1e-4") "    at: [0, 0, 1 cm]\n"
                   "obstacles: {cube: {box: {size: [30 cm, 30 cm, 30 cm], rounding: 1 cm}, at: [0, "
                   "0, -15 cm],"
                   " friction: 0.3}}\n"},
    {"twist of a sleeve", "mlpg", 24, 1.5, true, false,
     "cloth:\n  sheet:\n    shape: {sleeve: {radius: 8 cm, length: 30 cm}}\n    nodes: 24 x 20\n"
     "    bending_damping: 0 s\n    membrane_damping: 0 s\n    damping: 2 1/s\n    noise: 0.3 mm\n"
     "    fabric: {name: f, weight: 150 g/m2, thickness: 0.5 mm, isotropic: {stretch: 1000 N/m,"
     " poisson: 0.2, bending: 1e-4 N m}}\nhandles:\n  - {hold: sheet.start}\n"
     "  - {hold: sheet.end, turn: {axis: z, by: 60 deg, from: 0 s, to: 1.5 s}}\n"},
    {"drape to rest", "springs", 21, 6.0, false, true,
     SHEET("40 cm", "21 x 21", "springs", "1000", "1e-4") "    damping: 4 1/s\n" CORNERS},
    {"slow turn of plastic film", "mlpg", 26, 2.0, false, false,
     SHEET("1 m", "26 x 26", "mlpg", "4e5",
           "3.3e-4") "    turn: {axis: x, by: 90 deg}\nhandles:\n  - hold: [sheet.top-left, "
                     "sheet.top-right]\n"
                     "    turn: {axis: z, by: 60 deg, from: 0 s, to: 2 s}\n"},
};

static const double implicit_steps[] = {1.0 / 60, 1.0 / 120, 1.0 / 240, 1.0 / 960};
enum { IMPLICIT_STEPS = 4, MOST_PLACES = 2000 };

typedef struct Outcome {
    double cpu, step, size; /* [s], [s], [m] of the scene */
    int places;
    char stepper[32];
    const char *failure; /* NULL: it came to the end */
} Outcome;

static void stop_trial(int signal) {
    (void)signal;
    step_interrupted = 1;
}

/* interrupts a trial after so much CPU time; INFINITY: never */
static void limit_trial(double seconds) {
    struct itimerval timer = {.it_value = {0, 0}};
    if (isfinite(seconds)) {
        timer.it_value.tv_sec = (time_t)seconds;
        timer.it_value.tv_usec = 1 + (suseconds_t)(1e6 * (seconds - floor(seconds)));
    }
    step_interrupted = 0;
    signal(SIGPROF, stop_trial);
    setitimer(ITIMER_PROF, &timer, NULL);
}

/* Plays the case with this solver; stops beyond `most` CPU seconds. Positions at TIMES instants. */
static Outcome run(const Case *c, const char *solver, double most, double (*x)[3 * MOST_PLACES]) {
    Outcome out = {0};
    Error error = {0};
    SimOptions options = sim_options_default();
    Play play;
    char text[3000];
    memset(&play, 0, sizeof play);
    double rate = c->rests ? 1.0 / c->seconds : FRAME_RATE;
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: %.17g, seconds: %.17g}\n%ssolver: {self_contact: %s, %s}\n",
             rate, c->seconds + 1.0 / rate, c->scene, c->contact ? "true" : "false", solver);
    if (!scene_parse("case", text, strlen(text), NULL, &play.arena, &play.scene, &error) ||
        !sim_create(&play.sim, &play.scene, &options, &error)) {
        out.failure = "refused";
        arena_free(&play.arena);
        return out;
    }
    snprintf(out.stepper, sizeof out.stepper, "%s", play.sim.stepper->name);
    size_t bytes = 3 * (size_t)play.sim.system.node_count * sizeof(double);
    bool good = play.sim.system.node_count <= MOST_PLACES;
    limit_trial(most);
    for (int k = 0; k < TIMES && good; k++) {
        double until = c->rests ? c->seconds : c->seconds * (k + 1) / TIMES;
        while (good && play.sim.state.time < until - 1e-9) {
            good = sim_advance(&play.sim, &error);
        }
        memcpy(x[k], play.sim.state.x, bytes);
    }
    limit_trial(INFINITY);
    if (!good) {
        out.failure = error.code == EXIT_INTERRUPTED ? "too dear" : "fails";
    }
    out.cpu = play.sim.total.cpu;
    out.step = play.sim.total.step_length;
    out.size = play.sim.system.size, out.places = play.sim.system.node_count;
    play_end(&play);
    return out;
}

static double distance(double (*a)[3 * MOST_PLACES], double (*b)[3 * MOST_PLACES], int places) {
    double sum = 0.0;
    for (int k = 0; k < TIMES; k++) {
        for (int i = 0; i < 3 * places; i++) {
            double d = a[k][i] - b[k][i];
            sum += d * d;
        }
    }
    return sqrt(sum / TIMES / places);
}

/* ---- a case: all steppers, then what auto is worth among them ---- */

enum { ROOM = 3 * MOST_PLACES, ROUNDS = 40 };
#define BRIEF 0.5 /* [CPU s] that any run may take */
#define TIMED 3.0 /* [CPU s] for which two runs are timed again and again */

typedef struct Trial {
    Outcome out;
    double error; /* of the size; NAN: it did not run */
    char solver[80];
} Trial;

static Trial judge(const Case *c, const char *solver, double most, double (*reference)[ROOM]) {
    static double x[TIMES][ROOM];
    Trial t = {.out = run(c, solver, most, x)};
    snprintf(t.solver, sizeof t.solver, "%s", solver);
    t.error = !t.out.failure ? distance(x, reference, t.out.places) / t.out.size : NAN;
    return t;
}

static void write_trial(const Case *c, const char *stepper, const Trial *t) {
    bench_write((BenchRow){"auto", c->name, stepper, "rms_error", c->nodes, t->out.step, t->error,
                           STATED_ERROR, t->error, t->out.failure ? NAN : t->out.cpu,
                           t->out.failure, c->model});
}

/* the cheapest run of all steppers that keeps the error */
static Trial find_cheapest(const Case *c, double (*reference)[ROOM]) {
    Trial best = {.out = {.cpu = INFINITY}};
    for (const Stepper *const *stepper = steppers; *stepper; stepper++) {
        const char *name = (*stepper)->name;
        bool in_time = (*stepper)->implicit && strcmp(name, "static") != 0;
        bool follows = strcmp(name, "static") != 0 && strcmp(name, "relaxation") != 0 &&
                       strcmp(name, "stochastic") != 0;
        if (!follows && !c->rests) {
            continue; /* equilibria are no motion */
        }
        for (int k = 0; k < (in_time ? IMPLICIT_STEPS : 1); k++) {
            char solver[80];
            int at = snprintf(solver, sizeof solver, "stepper: %s", name);
            if (in_time) {
                snprintf(solver + at, sizeof solver - (size_t)at, ", step: %.9g s",
                         implicit_steps[k]);
            }
            Trial t = judge(c, solver, fmax(BRIEF, HOPELESS * best.out.cpu), reference);
            write_trial(c, name, &t);
            if (t.error <= STATED_ERROR && t.out.cpu < best.out.cpu) {
                best = t;
            }
            if (t.error <= STATED_ERROR || t.out.failure) {
                break; /* shorter steps cost more */
            }
        }
    }
    return best;
}

/* in turn, so that a machine that slows down slows both */
static void time_again(const Case *c, Trial *a, Trial *b) {
    static double x[TIMES][ROOM];
    double spent = 0.0;
    a->out.cpu = b->out.cpu = INFINITY; /* what was measured at another time does not compare */
    for (int k = 0; k < ROUNDS && spent < TIMED; k++) {
        Outcome first = run(c, a->solver, INFINITY, x), second = run(c, b->solver, INFINITY, x);
        a->out.cpu = fmin(a->out.cpu, first.cpu);
        b->out.cpu = fmin(b->out.cpu, second.cpu);
        spent += first.cpu + second.cpu;
    }
}

static bool run_case(const Case *c) {
    static double reference[TIMES][ROOM];
    char note[160];
    Outcome fine = run(c, "stepper: central, courant: 0.2", INFINITY, reference);
    if (fine.failure) {
        printf("%s: %s\n", c->name, fine.failure);
        return false;
    }
    Trial best = find_cheapest(c, reference), own = judge(c, "stepper: auto", INFINITY, reference);
    time_again(c, &own, &best);
    double over = own.out.cpu / best.out.cpu;
    bool right = own.error <= STATED_ERROR && over <= SAME_COST;
    snprintf(note, sizeof note, "picks %s: %s; cheapest %s at %.3g s for %.3g CPU s",
             own.out.stepper, right ? "right" : "wrong", best.out.stepper, best.out.step,
             best.out.cpu);
    bench_write((BenchRow){"auto", c->name, "auto", "cost_over_cheapest", c->nodes, own.out.step,
                           over, SAME_COST, own.error, own.out.cpu, note, c->model});
    return right;
}

static void run_all(void) {
    int right = 0, count = (int)(sizeof cases / sizeof *cases);
    for (int k = 0; k < count; k++) {
        right += run_case(&cases[k]);
    }
    bench_write((BenchRow){"auto", "all", "auto", "cases_right", count, NAN, right, 9, NAN, NAN,
                           "of ten", "all"});
}

const BenchSuite bench_auto = {"auto", "what auto picks, beside all steppers, over ten scenes",
                               run_all};
