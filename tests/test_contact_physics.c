/* Contact, friction and bending together, against known answers (contact.md 10, rows 9 to 12). All
 * strips are three nodes wide and their fabric has no Poisson effect: sheets in plane bending. */
#include <string.h>

#include "sim/base/parallel.h"
#include "tests/support/check.h"
#include "tests/support/play.h"

#define GRAVITY 9.81
#define MU 0.3

/* A strip along x, STRIP_NODES wide. */
typedef struct Strip {
    double length; /* [m] */
    int nodes;     /* along it */
} Strip;
#define STRIP_NODES 3

static double spacing(Strip strip) { return strip.length / (strip.nodes - 1); }

/* [m] height of a strip of this spacing that rests on a surface: hardly less than the contact
 * distance, which is a quarter of the spacing and at most 1 mm here */
static double rest_height(double h) { return 0.9999 * fmin(1e-3, 0.25 * h); }

/* [m] radius on which its nodes lie round a solid: the middles of its edges touch */
static double round_radius(double radius, double h) {
    double r = radius + rest_height(h);
    return r / cos(0.5 * h / r);
}

/* handles hold their nodes where these are now */
static void hold_where_laid(Play *play) {
    const System *system = &play->sim.system;
    for (int h = 0; h < system->handle_count; h++) {
        const Handle *handle = &system->handles[h];
        for (int i = 0; i < handle->count; i++) {
            memcpy((double *)handle->start + 3 * (size_t)i,
                   play->sim.state.x + 3 * (size_t)handle->places[i], 3 * sizeof(double));
        }
    }
}

/* ---- row 9: overhangs ---- */

/* A limp strip over a round edge (a quarter) or a rod (half a turn), on the point of slipping. */
typedef struct Hang {
    double radius;  /* [m] of the middle surface */
    double turn;    /* [rad] of the arc, whose end points down */
    double shorter; /* [m] before the arc: on the table, or hanging */
    double longer;  /* [m] hanging after the arc */
} Hang;

static void hang(const void *context, double s, double *x, double *z) {
    const Hang *h = context;
    double start = 0.5 * PI - h->turn, arc = h->turn * h->radius;
    double angle = start + fmin(fmax(s - h->shorter, 0.0), arc) / h->radius;
    double before = fmax(0.0, h->shorter - s), after = fmax(0.0, s - h->shorter - arc);
    *x = h->radius * sin(angle) - before * cos(start);
    *z = h->radius * cos(angle) + before * sin(start) - after;
}

/* [m] tension / (weight / area) at s: on the arc T' = mu (T + w R cos) - w R sin, that is
 * T = T0 e^(mu angle) + A cos + B sin */
static double hang_tension(const Hang *h, double mu, double s) {
    double b = 2.0 * mu * h->radius / (1.0 + mu * mu), a = b * (1.0 - mu * mu) / (2.0 * mu);
    double arc = h->turn * h->radius, after = s - h->shorter - arc, start = 0.5 * PI - h->turn;
    double angle = start + fmax(0.0, s - h->shorter) / h->radius;
    double first = (h->longer - b) * exp(mu * (start - 0.5 * PI)) + a * cos(start) + b * sin(start);
    return after > 0.0 ? h->longer - after
           : s < h->shorter
               ? first * s / h->shorter
               : (h->longer - b) * exp(mu * (angle - 0.5 * PI)) + a * cos(angle) + b * sin(angle);
}

/* [m] hanging length of a limp strip on the point of slipping.
 * T' = mu (T + w R cos) - w R sin along the arc has T = (T0 - A) e^(mu angle) + A cos + B sin */
static double limit_edge(double length, double radius, double mu) {
    double b = 2.0 * mu * radius / (1.0 + mu * mu), a = radius * (1.0 - mu * mu) / (1.0 + mu * mu);
    double grows = exp(0.5 * PI * mu), rest = length - 0.5 * PI * radius;
    /* h = (mu (rest - h) - a) grows + b */
    return ((mu * rest - a) * grows + b) / (1.0 + mu * grows);
}

static double limit_rod(double length, double radius, double mu) {
    double b = 2.0 * mu * radius / (1.0 + mu * mu), grows = exp(PI * mu);
    double rest = length - PI * radius;
    /* h = (rest - h + b) grows + b */
    return ((rest + b) * grows + b) / (1.0 + grows);
}

#define LIMP                                                                                       \
    "fabric: {weight: 200 g/m2, thickness: 1 mm, stretch: {warp: 1000 N/m, weft: 1000 N/m, "       \
    "poisson: 0}, shear: 500 N/m, bending: {warp: 0.1 uN m, weft: 0.1 uN m}}\n"
#define LIMP_DENSITY 0.2    /* [kg/m2] */
#define LIMP_STRETCH 1000.0 /* [N/m] */

/* hangs the strip with the tension it has on the point of slipping */
static void hang_up(Play *play, Strip strip, const Hang *h, double mu) {
    int fine = 64;
    double step = spacing(strip) / fine, at = 0.0;
    for (int i = 0; i < strip.nodes; i++) {
        for (int j = 0; j < STRIP_NODES; j++) {
            double *x = play->sim.state.x + 3 * (size_t)(j * strip.nodes + i);
            hang(h, at, &x[0], &x[2]);
        }
        for (int k = 0; k < fine; k++) {
            double s = (i * fine + k + 0.5) * step;
            double tension = LIMP_DENSITY * GRAVITY * hang_tension(h, mu, s);
            at += step * (1.0 + tension / LIMP_STRETCH);
        }
    }
}

/* [m] how far the long end falls between 0.25 and 0.5 s */
static double falls(Strip strip, Hang h, const char *solid, const char *stepper) {
    char text[2048];
    Play play;
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: 60, seconds: 4}\ncloth:\n  strip:\n"
             "    shape: {rectangle: {width: %.17g m, height: %.17g m}}\n    " LIMP
             "    nodes: %d x 3\n    damping: 5 1/s\nobstacles:\n"
             "  solid: {%s, friction: 0.3}\n"
             "solver: {stepper: %s, self_contact: false}\n",
             strip.length, 2.0 * spacing(strip), strip.nodes, solid, stepper);
    play_start(&play, text);
    hang_up(&play, strip, &h, MU);
    play_to(&play, 0.25);
    double before = play_x(&play, strip.nodes - 1).z;
    play_to(&play, 0.5);
    double moved = before - play_x(&play, strip.nodes - 1).z;
    play_end(&play);
    return moved;
}

/* of the greatest overhang: over the rounded edge of a table (a / L = 0.32460 for a sharp one) and
 * over a rod (0.71960 for a thin one) */
static double overhang(bool rod, double share, int nodes, const char *stepper) {
    Strip strip = {0.6, nodes};
    Hang h = {.radius = round_radius(0.02, spacing(strip)), .turn = rod ? PI : 0.5 * PI};
    double limit =
        rod ? limit_rod(strip.length, h.radius, MU) : limit_edge(strip.length, h.radius, MU);
    h.longer = share * limit;
    h.shorter = strip.length - h.turn * h.radius - h.longer;
    return falls(strip, h,
                 rod ? "cylinder: {radius: 2 cm, from: [0, -10 cm, 0], to: [0, 10 cm, 0]}"
                     : "box: {size: [1 m, 20 cm, 40 cm], rounding: 2 cm}, at: [-48 cm, 0, -18 cm]",
                 stepper);
}

/* row 9: holds at 0.99 of the limit and slides at 1.01 */
static void test_overhangs(void **unused) {
    (void)unused;
    /* the formulas against the limits of vanishing radius */
    CHECK_NEAR(limit_edge(1.0, 1e-9, MU), 0.32459508, 1e-7);
    CHECK_NEAR(limit_rod(1.0, 1e-9, MU), 0.71959989, 1e-7);
    const char *roads[2] = {"central", "bdf2"};
    for (int k = 0; k < 2; k++) {
        for (int rod = 0; rod < 2; rod++) {
            int nodes = k == 0 && rod ? 151 : 301;
            double holds = overhang(rod, 0.99, nodes, roads[k]);
            double slides = overhang(rod, 1.01, nodes, roads[k]);
            CHECK_AT_MOST(holds / 0.6, 1e-4); /* of the length */
            CHECK_AT_MOST(1e-3 * 0.6 / slides, 1.0);
        }
    }
}

/* ---- row 5: capstan ---- */

/* log (T2 / T1) / (mu pi) of a strip over a drum and is drawn along */
static double capstan(double mu, const char *stepper) {
    char text[2048];
    Play play;
    Strip strip = {0.36, 91};
    double h = spacing(strip), r = round_radius(0.05, h), stretch = 1.005;
    snprintf(
        text, sizeof text,
        "toile: 1\nfilm: {rate: 50, seconds: 4}\ncloth:\n  strip:\n"
        "    shape: {rectangle: {width: 36 cm, height: 8 mm}}\n    " LIMP
        "    nodes: 91 x 3\n    damping: 10 1/s\nhandles:\n"
        "  - {hold: strip.left, move: {by: [0, 0, 4 cm], from: 0 s, to: 1 s, ease: linear}}\n"
        "  - {hold: strip.right, move: {by: [0, 0, -4 cm], from: 0 s, to: 1 s, ease: linear}}\n"
        "obstacles:\n  drum: {cylinder: {radius: 5 cm, from: [0, -5 cm, 0], to: [0, 5 cm, "
        "0]}, friction: %g}\n"
        "gravity: 0\nsolver: {stepper: %s, self_contact: false}\n",
        mu, stepper);
    play_start(&play, text);
    System *system = &play.sim.system;
    double straight = 0.5 * (stretch * strip.length - PI * r);
    Hang at = {r, PI, straight, straight};
    for (int i = 0; i < system->node_count; i++) {
        double *x = play.sim.state.x + 3 * (size_t)i;
        hang(&at, stretch * h * (i % strip.nodes), &x[0], &x[2]);
    }
    hold_where_laid(&play);
    double tension[2] = {0, 0};
    for (int frame = 36; frame <= 40; frame++) { /* a mean over frames: slipping cloth trembles */
        play_to(&play, frame / 50.0);
        for (int k = 0; k < 30; k++) {
            int side = k % 2, i = 3 + k / 2;
            int a = strip.nodes + (side == 0 ? i : strip.nodes - 1 - i);
            int b = side == 0 ? a + 1 : a - 1;
            double length = vec3_length(vec3_sub(play_x(&play, b), play_x(&play, a))) / h;
            tension[side] += 0.5 * (length * length - 1.0) * length;
        }
    }
    play_end(&play);
    return log(tension[1] / tension[0]) / (mu * PI);
}

static void test_capstan(void **unused) {
    (void)unused;
    CHECK_NEAR(capstan(0.3, "bdf2"), 1.0, 0.01);
    CHECK_NEAR(capstan(0.5, "bdf2"), 1.0, 0.01);
    CHECK_NEAR(capstan(0.5, "central"), 1.0, 0.01);
}

int main(int argc, char **argv) {
    parallel_fix_environment(argv);
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_overhangs),
                                       cmocka_unit_test(test_capstan)};
    if (argc > 1)
        cmocka_set_test_filter(argv[1]);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
