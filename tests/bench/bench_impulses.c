/* bench_impulses.c: the two contacts side by side, penalty and impulses (sim/contact/impulses.h), with
 * every frame judged by the exact check. */
#include <math.h>

#include "tests/bench/bench.h"
#include "tests/support/play.h"

typedef struct Meeting {
    const char *name, *sheet, *obstacles; /* keys of the cloth, of the obstacles */
    int nodes;
    double seconds;
} Meeting;

#define METRE                                                                                      \
    "shape: {rectangle: {width: 1 m, height: 1 m}}\n    at: [0, 0, 2 cm]\n    sides: bounded"
static const Meeting meetings[] = {
    {"cube", METRE, "cube: {box: {size: [50 cm, 50 cm, 50 cm], rounding: 5 mm}, at: [0, 0, -25 cm]",
     51, 2},
    {"sphere", METRE, "ball: {sphere: {radius: 25 cm}, at: [0, 0, -25 cm]", 51, 1},
    {"pile",
     "shape: {rectangle: {width: 60 cm, height: 60 cm}}\n    at: [0, 0, 31 cm]\n"
     "    turn: {axis: x, by: 90 deg}",
     "floor: {plane: {}", 31, 2},
    {"thrown at 20 m/s",
     "shape: {rectangle: {width: 40 cm, height: 40 cm}}\n    at: [0, 0, 5 cm]\n"
     "    velocity: [0, 0, -20 m/s]",
     "ball: {sphere: {radius: 6 cm}, at: [0.4 cm, 0.3 cm, -6 cm]", 21, 0.2},
};

typedef struct Outcome {
    long crossings;
    double lost, balance, fall, start; /* [J] */
} Outcome;

/* [J] all that the books know */
static double booked(const Statistics *s, Outcome *out) {
    out->lost += s->friction + s->damping + s->guard + s->sides;
    return s->kinetic + s->elastic + s->gravity + s->contact + out->lost;
}

static Outcome follow(Play *play, double seconds) {
    Outcome out = {.start = NAN};
    double first = NAN, top = NAN;
    int frames = (int)(60 * seconds + 0.5);
    for (int f = 1; f <= frames; f++) {
        play_to(play, f / 60.0);
        const Statistics *s = &play->sim.statistics;
        double now = booked(s, &out);
        first = f == 1 ? now : first;
        top = f == 1 ? s->gravity + s->kinetic + s->elastic : top;
        out.balance = fmax(out.balance, fabs(now - first));
        out.fall = fmax(out.fall, top - s->gravity);
        out.crossings += play_crossings(play);
    }
    return out;
}

static void write_row(const char *name, const Meeting *m, const Play *play, const char *quantity,
                      double value, const char *note) {
    const Statistics *total = &play->sim.total;
    bench_write((BenchRow){"impulses", name, "central", quantity, m->nodes, total->step_length,
                           value, NAN, NAN, total->cpu, note, NULL});
}

static void run_one(const Meeting *m, const char *contact) {
    char text[2000], name[80], note[200];
    Play play;
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: 60, seconds: 9}\ncloth:\n  sheet:\n    %s\n"
             "    fabric: {name: f, weight: 150 g/m2, isotropic: {stretch: 1000 N/m, poisson: 0.3,"
             " bending: 1e-5 N m}}\n    nodes: %d x %d\n    noise: 0.2 mm\n"
             "    bending_damping: 0 s\n    membrane_damping: 0 s\n"
             "obstacles:\n  %s, friction: 0.3}\nsolver: {stepper: central, contact: %s}\n",
             m->sheet, m->nodes, m->nodes, m->obstacles, contact);
    snprintf(name, sizeof name, "%s; %s", m->name, contact);
    play_start(&play, text);
    Outcome out = follow(&play, m->seconds);
    const Statistics *t = &play.sim.total;
    snprintf(note, sizeof note,
             "%.0f steps; %.0f taken back; %.0f impulses; %.0f rounds; %.0f zones of %.0f vertices",
             t->steps, t->retries, t->impulses, t->rounds, t->zones, t->zone_vertices);
    write_row(name, m, &play, "cpu_per_second", t->cpu / m->seconds, note);
    write_row(name, m, &play, "crossings", (double)out.crossings, "all frames");
    write_row(name, m, &play, "stretch", t->stretch, "largest of a cell along its threads");
    write_row(name, m, &play, "smallest_gap_mm", 1e3 * fmin(t->smallest_gap, t->smallest_self_gap),
              "to obstacles and cloth");
    write_row(name, m, &play, "balance", out.balance / out.fall,
              "largest error of the books over what fell");
    write_row(name, m, &play, "contact_took", (t->friction + t->damping + t->guard) / out.fall,
              "friction, damping and guard over what fell");
    write_row(name, m, &play, "kinetic_at_end_J", play.sim.statistics.kinetic, "what still moves");
    play_end(&play);
}

static void run(void) {
    for (size_t i = 0; i < sizeof meetings / sizeof meetings[0]; i++) {
        run_one(&meetings[i], "penalty");
        run_one(&meetings[i], "impulses");
    }
}

const BenchSuite bench_impulses = {"impulses", "contact by a force law and by impulses", run};
