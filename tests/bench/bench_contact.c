/* bench_contact.c: what contact costs, with every frame judged by the exact check. */
#include <math.h>
#include <string.h>

#include "tests/bench/bench.h"
#include "tests/support/play.h"

#define MESHES TOILE_SOURCE_DIR "/assets/meshes/"

typedef struct Drape {
    const char *name;
    int nodes;
    double stretch;    /* [N/m] */
    double most;       /* [CPU s / s] demanded */
    const char *at;    /* of the sheet */
    const char *below; /* obstacles */
    double seconds;
} Drape;

#define CUBE "cube: {box: {size: [50 cm, 50 cm, 50 cm], rounding: 5 mm}, at: [0, 0, -25 cm]"
#define BALL "ball: {sphere: {radius: 25 cm}, at: [0, 0, -25 cm]"
#define MESH(file, at) "mesh: {mesh: {file: " MESHES file "}, at: " at

static const Drape drapes[] = {
    {"cube; Eh=1000", 26, 1000, NAN, "[0, 0, 2 cm]", CUBE, 2},
    {"cube; Eh=100", 51, 100, 1.2, "[0, 0, 2 cm]", CUBE, 2},
    {"cube; Eh=1000", 51, 1000, 1.2, "[0, 0, 2 cm]", CUBE, 2},
    {"cube; Eh=3000", 51, 3000, 1.2, "[0, 0, 2 cm]", CUBE, 2},
    {"cube; Eh=1000", 101, 1000, 7, "[0, 0, 2 cm]", CUBE, 2},
    {"cube; Eh=1000", 201, 1000, 50, "[0, 0, 2 cm]", CUBE, 2},
    {"sphere", 51, 1000, 2.2, "[0, 0, 2 cm]", BALL, 1},
    {"ball of 1280 triangles", 51, 1000, 3, "[0, 0, 2 cm]",
     MESH("icosphere.obj, scale: 25 cm", "[0, 0, -25 cm]"), 1},
    {"ring of 6400 triangles", 51, 1000, 4, "[0, 0, -10 cm]", MESH("torus.ply", "[0, 0, -25 cm]"),
     1},
};

static const char twist[] =
    "toile: 1\nfilm: {rate: 30, seconds: 4}\ncloth:\n  tube:\n"
    "    shape: {sleeve: {radius: 25 cm, length: 1 m, rest: curved}}\n"
    "    fabric: {name: f, weight: 150 g/m2, thickness: 2.5 mm, isotropic: {stretch: %g N/m,"
    " poisson: 0.3, bending: 1e-5 N m}}\n"
    "    nodes: %d x %d\n    noise: 0.2 mm\n    damping: 2 1/s\nhandles:\n"
    "  - hold: tube.start\n    motion: [{turn: {axis: z, by: -288 deg, from: 0 s, to: 4 s}},"
    " {move: {by: [0, 0, 2 cm], from: 0 s, to: 4 s}}]\n"
    "  - hold: tube.end\n    motion: [{turn: {axis: z, by: 288 deg, from: 0 s, to: 4 s}},"
    " {move: {by: [0, 0, -2 cm], from: 0 s, to: 4 s}}]\n"
    "gravity: 0 m/s2\nsolver: {stepper: central}\n";

/* [1] largest strain of a side of a lattice of n x n nodes over 1 m */
static double side_strain(const Play *play, int n) {
    double worst = 0.0, h = 1.0 / (n - 1);
    for (int j = 0; j < n; j++) {
        for (int i = 0; i < n; i++) {
            Vec3 here = play_x(play, j * n + i);
            int along = i + 1 < n ? j * n + i + 1 : -1, up = j + 1 < n ? (j + 1) * n + i : -1;
            double a = along < 0 ? h : vec3_length(vec3_sub(play_x(play, along), here));
            double b = up < 0 ? h : vec3_length(vec3_sub(play_x(play, up), here));
            worst = fmax(worst, fmax(fabs(a / h - 1.0), fabs(b / h - 1.0)));
        }
    }
    return worst;
}

/* [1] largest stretch of a cell of that lattice along its threads, and how much one is pressed (*pressed) */
static double cell_strain(const Play *play, int n, double *pressed) {
    double worst = 0.0, h = 1.0 / (n - 1);
    *pressed = 0.0;
    for (int k = 0; k < (n - 1) * (n - 1); k++) {
        int at = k / (n - 1) * n + k % (n - 1);
        Vec3 up = vec3_sub(play_x(play, at + n + 1), play_x(play, at));
        Vec3 down = vec3_sub(play_x(play, at + 1), play_x(play, at + n));
        double u = vec3_length(vec3_add(up, down)) / (2.0 * h) - 1.0;
        double v = vec3_length(vec3_sub(up, down)) / (2.0 * h) - 1.0;
        worst = fmax(worst, fmax(u, v));
        *pressed = fmax(*pressed, -fmin(u, v));
    }
    return worst;
}

/* plays to the end; *cpu [s] without the judge; returns the crossings of all frames */
static long judge(Play *play, double seconds, double *cpu) {
    long crossings = 0;
    for (int f = 1; f <= 30 * seconds + 0.5; f++) {
        play_to(play, f / 30.0);
        crossings += play_crossings(play);
    }
    *cpu = play->sim.total.cpu;
    return crossings;
}

static void write_rows(const char *name, int nodes, const Play *play, double seconds, double most,
                       double cpu, long crossings) {
    char note[160];
    const Statistics *total = &play->sim.total;
    snprintf(note, sizeof note,
             "%ld crossings; %.0f steps; %.0f impulses; %.0f shortened moves; gap %.2g / %.2g mm",
             crossings, total->steps, total->impulses, total->truncations,
             1e3 * total->smallest_gap, 1e3 * total->smallest_self_gap);
    bench_write((BenchRow){"contact", name, "central", "cpu_per_second", nodes, total->step_length,
                           cpu / seconds, most, NAN, cpu, note, NULL});
}

/* [CPU s / s] */
static double run_drape(const Drape *d) {
    char text[2000];
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: 30, seconds: 9}\ncloth:\n  sheet:\n"
             "    shape: {rectangle: {width: 1 m, height: 1 m}}\n"
             "    fabric: {name: f, weight: 150 g/m2, isotropic: {stretch: %g N/m, poisson: 0.3,"
             " bending: 1e-5 N m}}\n"
             "    nodes: %d x %d\n    sides: bounded\n    noise: 0.2 mm\n    at: %s\nobstacles:\n  "
             "%s, friction: 0.3}\n"
             "solver: {stepper: central}\n",
             d->stretch, d->nodes, d->nodes, d->at, d->below);
    Play play;
    double cpu;
    play_start(&play, text);
    long crossings = judge(&play, d->seconds, &cpu);
    write_rows(d->name, d->nodes, &play, d->seconds, d->most, cpu, crossings);
    bench_write((BenchRow){"contact", d->name, "central", "side_strain", d->nodes, NAN,
                           side_strain(&play, d->nodes), 0.04, NAN, NAN, "at the end", NULL});
    double pressed, stretched = cell_strain(&play, d->nodes, &pressed);
    char note[80];
    snprintf(note, sizeof note, "at the end; pressed by %.3g %% where folds cross", 100 * pressed);
    bench_write((BenchRow){"contact", d->name, "central", "cell_strain", d->nodes, NAN, stretched,
                           0.015, NAN, NAN, note, NULL});
    play_end(&play);
    return cpu / d->seconds;
}

/* `most` [CPU s / s] demanded */
static void run_twist(int around, int along, double stretch, double most) {
    char text[2000], name[80];
    Play play;
    double cpu;
    snprintf(text, sizeof text, twist, stretch, around, along);
    snprintf(name, sizeof name, "cylinder twisted by 1.6 turns; Eh=%g", stretch);
    play_start(&play, text);
    long crossings = judge(&play, 4.0, &cpu);
    write_rows(name, along, &play, 4.0, most, cpu, crossings);
    play_end(&play);
}

/* time grows as nodes a side to this power: the slope of the line through the logarithms */
static void write_growth(const double *nodes, const double *cpu, int count) {
    double sum[4] = {0};
    for (int k = 0; k < count; k++) {
        double x = log(nodes[k]), y = log(cpu[k]);
        sum[0] += x, sum[1] += y, sum[2] += x * x, sum[3] += x * y;
    }
    double slope = (count * sum[3] - sum[0] * sum[1]) / (count * sum[2] - sum[0] * sum[0]);
    bench_write((BenchRow){"contact", "cube; Eh=1000", "central", "growth", (int)nodes[count - 1],
                           NAN, slope, NAN, NAN, NAN, "power of the nodes a side", NULL});
}

static void run(void) {
    enum { DRAPES = sizeof drapes / sizeof drapes[0] };
    double nodes[DRAPES], cpu[DRAPES];
    int count = 0;
    for (int k = 0; k < DRAPES; k++) {
        nodes[count] = drapes[k].nodes, cpu[count] = run_drape(&drapes[k]);
        count += strcmp(drapes[k].name, drapes[0].name) == 0;
    }
    write_growth(nodes, cpu, count);
    run_twist(36, 41, 100, 1.6);
    run_twist(36, 41, 1000, 1.6);
    run_twist(72, 81, 100, 7);
}

const BenchSuite bench_contact = {"contact", "drapes, meshes and a twist; every frame judged", run};
