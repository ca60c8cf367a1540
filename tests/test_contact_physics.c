/* Contact, friction and bending together, against known answers. All
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

/* ---- overhangs ---- */

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
             "    nodes: %d x 3\n    at: [0, 0, 1 m]\n    damping: 5 1/s\nobstacles:\n"
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

/* holds at 0.99 of the limit and slides at 1.01 */
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

/* ---- capstan ---- */

/* log (T2 / T1) / (mu pi) of a strip over a drum */
static double capstan(double mu, double drawn, double turning, const char *stepper) {
    char text[2048];
    Play play;
    Strip strip = {0.36, 91};
    double h = spacing(strip), r = round_radius(0.05, h), stretch = 1.005;
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: 50, seconds: 4}\ncloth:\n  strip:\n"
             "    shape: {rectangle: {width: 36 cm, height: 8 mm}}\n    " LIMP
             "    nodes: 91 x 3\n    at: [0, 0, 1 m]\n    damping: 10 1/s\nhandles:\n"
             "  - {hold: strip.left, move: {velocity: [0, 0, %g m/s]}}\n"
             "  - {hold: strip.right, move: {velocity: [0, 0, %g m/s]}}\n"
             "obstacles:\n  drum: {cylinder: {radius: 5 cm, from: [0, -5 cm, 0], to: [0, 5 cm, "
             "0]}, friction: %g, motion: [{turn: {axis: y, rate: %g rad/s}}]}\n"
             "gravity: 0\nsolver: {stepper: %s, self_contact: false}\n",
             drawn, -drawn, mu, turning, stepper);
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
    CHECK_NEAR(capstan(0.3, 0.04, 0.0, "bdf2"), 1.0, 0.01);
    CHECK_NEAR(capstan(0.5, 0.04, 0.0, "bdf2"), 1.0, 0.01);
    CHECK_NEAR(capstan(0.5, 0.04, 0.0, "central"), 1.0, 0.01);
    CHECK_NEAR(capstan(0.3, 0.0, -0.8, "bdf2"), 1.0, 0.01);
    CHECK_NEAR(capstan(0.3, 0.0, 0.8, "bdf2"), -1.0, 0.01);
}

/* ---- bending ---- */

#define BENDING 1e-4 /* [N m] */
#define STIFF                                                                                      \
    "fabric: {weight: 200 g/m2, thickness: 1 mm, stretch: {warp: 1000 N/m, weft: 1000 N/m, "       \
    "poisson: 0}, shear: 500 N/m, bending: {warp: 100 uN m, weft: 100 uN m, poisson: 0}}\n"
#define STIFF_DENSITY 0.2 /* [kg/m2] */

/* [N] elastic gradient of all nodes: at rest the force of contact, gravity and handles on them */
static double *elastic_gradient(Play *play) {
    System *system = &play->sim.system;
    double *g = arena_push(&play->arena, double, 3 * system->place_count);
    system_add_gradient(system, play->sim.state.x, g);
    return g;
}

/* Ruck in a rug that absorbs one length (B / rho g h)^(1/3); all lengths in these units. */
#define RUCK_HEIGHT 1.24441468
#define RUCK_PRESSURE 3.32036330
#define RUCK_HALF 2.48109623 /* lifted, along the rug */
#define RUCK_FRICTION 0.5    /* that just holds it with these tails */
#define RUCK_NODES 111

static double ruck_unit(void) { return cbrt(BENDING / (STIFF_DENSITY * GRAVITY)); }

static Strip ruck_strip(void) {
    return (Strip){2.0 * RUCK_PRESSURE / RUCK_FRICTION * ruck_unit(), RUCK_NODES};
}

static void ruck_start(Play *play, double friction, const char *handles, const char *stepper) {
    char text[2048];
    Strip strip = ruck_strip();
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: 50, seconds: 4}\ncloth:\n  strip:\n"
             "    shape: {rectangle: {width: %.17g m, height: %.17g m}}\n    " STIFF
             "    nodes: %d x 3\n    damping: 5 1/s\n%sobstacles:\n"
             "  floor: {plane: {}, friction: %g}\n"
             "solver: {stepper: %s, self_contact: false}\n",
             strip.length, 2.0 * spacing(strip), strip.nodes, handles, friction, stepper);
    play_start(play, text);
}

/* lays half a cosine wave of this height; returns the length that it absorbs */
static double lay_bump(Play *play, Strip strip, double height, double half) {
    double x = 0.0;
    for (int i = strip.nodes / 2; i < strip.nodes; i++) {
        double s = spacing(strip) * (i - strip.nodes / 2), t = fmin(s / half, 1.0);
        for (int j = 0; j < STRIP_NODES; j++) {
            double *right = play->sim.state.x + 3 * (size_t)(j * strip.nodes + i);
            double *left = play->sim.state.x + 3 * (size_t)((j + 1) * strip.nodes - 1 - i);
            right[0] = x, left[0] = -x;
            right[2] = left[2] = rest_height(spacing(strip)) + 0.5 * height * (1.0 + cos(PI * t));
        }
        double middle = fmin((s + 0.5 * spacing(strip)) / half, 1.0);
        double slope = 0.5 * height * PI / half * sin(PI * middle);
        x += spacing(strip) * sqrt(fmax(0.0, 1.0 - slope * slope));
    }
    return strip.length - 2.0 * play->sim.state.x[3 * (strip.nodes - 1)];
}

/* [unit] half of the lifted length: z grows with the cube of the way from where it lifts off */
static double ruck_half(const Play *play, Strip strip) {
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0, unit = ruck_unit();
    for (int i = strip.nodes / 2; i < strip.nodes; i++) {
        double s = spacing(strip) * (i - strip.nodes / 2) / unit;
        double z = (play_x(play, strip.nodes + i).z - rest_height(spacing(strip))) / unit;
        if (z > 0.002 && z < 0.08) {
            double root = cbrt(z);
            n++, sx += s, sy += root, sxx += s * s, sxy += s * root;
        }
    }
    double slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
    return (sx - sy / slope) / n;
}

/* shape and pressure between held ends; with its ends let go it stays when friction is 2 %
 * more than it needs and flattens when it is 2 % less */
static void test_ruck(void **unused) {
    (void)unused;
    Play play;
    Strip strip = ruck_strip();
    double unit = ruck_unit(), high = 0.8 * unit, step = 0.8 * unit;
    ruck_start(&play, 0.0, "handles: [{hold: [strip.left, strip.right]}]\n", "static");
    for (int k = 0; k < 50; k++) { /* absorbs one unit */
        step *= 0.5;
        high += lay_bump(&play, strip, high, RUCK_HALF * unit) < unit ? step : -step;
    }
    hold_where_laid(&play);
    play_to(&play, 0.02);
    int middle = strip.nodes + strip.nodes / 2;
    double height = (play_x(&play, middle).z - rest_height(spacing(strip))) / unit, pressure = 0.0;
    double *g = elastic_gradient(&play);
    for (int j = 0; j < STRIP_NODES; j++) {
        pressure -= g[3 * j * strip.nodes];
    }
    pressure *= unit * unit / (BENDING * 2.0 * spacing(strip));
    CHECK_NEAR(height / RUCK_HEIGHT, 1.0, 0.01);
    CHECK_NEAR(fabs(pressure) / RUCK_PRESSURE, 1.0, 0.01);
    CHECK_NEAR(ruck_half(&play, strip) / RUCK_HALF, 1.0, 0.01);
    const char *roads[2] = {"central", "bdf2"};
    for (int k = 0; k < 4; k++) {
        Play free_ends;
        double share = k % 2 ? 0.98 : 1.02;
        ruck_start(&free_ends, share * RUCK_FRICTION, "", roads[k / 2]);
        memcpy(free_ends.sim.state.x, play.sim.state.x,
               3 * (size_t)play.sim.system.node_count * sizeof(double));
        play_to(&free_ends, 1.0);
        double now = (play_x(&free_ends, middle).z - rest_height(spacing(strip))) / unit;
        if (share > 1.0) {
            CHECK_NEAR(now / height, 1.0, 0.03);
        } else {
            CHECK_AT_MOST(now / height, 0.9);
        }
        play_end(&free_ends);
    }
    play_end(&play);
}

/* a fold between frictionless plates, d apart as its middle surface runs, is pressed with
 * F d^2 / B = 2.87108 per width */
static double pressed_fold(const char *stepper) {
    char text[2048];
    Play play;
    Strip strip = {0.2, 81};
    double h = spacing(strip), d = 0.04, low = rest_height(h);
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: 50, seconds: 4}\ncloth:\n  strip:\n"
             "    shape: {rectangle: {width: 20 cm, height: %.17g m}}\n    " STIFF
             "    nodes: 81 x 3\n    damping: 20 1/s\nhandles: [{hold: strip.left}]\nobstacles:\n"
             "  lower: {plane: {}, friction: 0}\n"
             "  upper: {plane: {normal: [0, 0, -1]}, at: [0, 0, %.17g m], friction: 0}\n"
             "gravity: 0\nsolver: {stepper: %s}\n",
             2.0 * h, d + 2.0 * low, stepper);
    play_start(&play, text);
    double straight = 0.5 * (strip.length - PI * 0.5 * d);
    for (int i = 0; i < play.sim.system.node_count; i++) {
        double s = h * (i % strip.nodes), arc = (s - straight) / (0.5 * d);
        double turn = fmin(fmax(arc, 0.0), PI), after = fmax(0.0, s - straight - 0.5 * PI * d);
        double *x = play.sim.state.x + 3 * (size_t)i;
        x[0] = fmin(s, straight) + 0.5 * d * sin(turn) - after;
        x[2] = low + 0.5 * d * (1.0 - cos(turn));
    }
    hold_where_laid(&play);
    play_to(&play, strcmp(stepper, "static") == 0 ? 0.02 : 1.0);
    double *g = elastic_gradient(&play), force = 0.0, bottom = INFINITY, top = 0.0;
    for (int i = 0; i < play.sim.system.node_count; i++) {
        double z = play_x(&play, i).z;
        force += z < 0.5 * d && i % strip.nodes > 0 ? g[3 * i + 2] : 0.0;
        bottom = fmin(bottom, z), top = fmax(top, z);
    }
    play_end(&play);
    return force / (2.0 * h) * (top - bottom) * (top - bottom) / BENDING;
}

static void test_fold(void **unused) {
    (void)unused;
    CHECK_NEAR(pressed_fold("static"), 2.87108004, 0.01 * 2.87108);
    CHECK_NEAR(pressed_fold("central"), 2.87108004, 0.01 * 2.87108);
}

/* stiff enough to follow its clamp at once */
#define BOARD                                                                                      \
    "fabric: {weight: 200 g/m2, thickness: 1 mm, stretch: {warp: 100 kN/m, weft: 100 kN/m, "       \
    "poisson: 0}, shear: 50 kN/m, bending: {warp: 10 mN m, weft: 10 mN m, poisson: 0}}\n"

/* Row 12: a strip clamped upright is lowered on to a floor; its foot sticks until friction is less
 * than mu*(lowered share of the length). Weightless: stickslip_pinned.csv, by its own columns. */
static const double stick[][2] = {
    {0.075, 0.1294891793}, {0.1, 0.1527925554}, {0.125, 0.1747115218},
    {0.175, 0.2168330251}, {0.2, 0.2377737849}, {0.225, 0.2589900794},
    {0.275, 0.3031331473}, {0.3, 0.3264913142}, {0.325, 0.3510128708}};

/* mu* at a share between those of the row before and after `row` */
static double stick_at(int row, double share) {
    double sum = 0.0;
    for (int i = row - 1; i <= row + 1; i++) {
        double part = stick[i][1];
        for (int j = row - 1; j <= row + 1; j++) {
            part *= i == j ? 1.0 : (share - stick[j][0]) / (stick[i][0] - stick[j][0]);
        }
        sum += part;
    }
    return sum;
}

/* share of the length at which the foot slips */
static double slips_at(double friction, double expected, const char *stepper) {
    char text[2048];
    Play play;
    Strip strip = {0.2, 61};
    double h = spacing(strip), early = 0.9 * expected * 0.2, late = 0.15 * expected * 0.2;
    snprintf(text, sizeof text,
             "toile: 1\nfilm: {rate: 100, seconds: 10}\ncloth:\n  strip:\n"
             "    shape: {rectangle: {width: 20 cm, height: %.17g m}}\n    " BOARD
             "    nodes: 61 x 3\n    at: [0, 0, %.17g m]\n    turn: {axis: y, by: 90 deg}\n"
             "handles:\n  - {clamp: strip.left, move: [{by: [0, 0, %.17g m], from: 0 s, to: 2 s},"
             " {by: [0, 0, %.17g m], from: 2 s, to: 6 s, ease: linear}]}\n"
             "obstacles:\n  floor: {plane: {}, friction: %.17g}\n"
             "gravity: 0\nsolver: {stepper: %s, self_contact: false}\n",
             2.0 * h, 0.1 + rest_height(h), -early, -late, friction, stepper);
    play_start(&play, text);
    for (int i = 0; i < play.sim.system.node_count; i++) { /* which way it bulges */
        double at = (double)(i % strip.nodes) / (strip.nodes - 1);
        play.sim.state.x[3 * i] += 1e-3 * strip.length * at * at * (1.0 - at);
    }
    int foot = 2 * strip.nodes - 1;
    double top = play_x(&play, strip.nodes).z, start = play_x(&play, foot).x, share = 0.0;
    while (fabs(play_x(&play, foot).x - start) < 1e-3 * strip.length && play.sim.state.time < 6.0) {
        play_to(&play, play.sim.state.time + 0.01);
        share = (top - play_x(&play, strip.nodes).z) / strip.length;
    }
    play_end(&play);
    return share;
}

static void test_stick_slip(void **unused) {
    (void)unused;
    for (int row = 1; row < 9; row += 3) {
        double share = slips_at(stick[row][1], stick[row][0], row % 2 ? "bdf2" : "backward_euler");
        CHECK_NEAR(stick_at(row, share) / stick[row][1], 1.0, 0.005);
    }
}

int main(int argc, char **argv) {
    (void)argc;
    parallel_fix_environment(argv);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_overhangs),  cmocka_unit_test(test_capstan),
        cmocka_unit_test(test_ruck),       cmocka_unit_test(test_fold),
        cmocka_unit_test(test_stick_slip),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
