#include <math.h>
#include <string.h>

#include "sim/step/stepper.h"
#include "sim/tester_strip.h"

#define WIDTH 0.025               /* [m] */
#define PLANE (41.5 * PI / 180.0) /* below the edge */
#define GAMMA_PLANE 8.0           /* rho g l^3 / B where the tip meets it: the rule c = l / 2 */
#define FOUND 1e-7                /* error of the logarithm of tan(angle) */
#define POWER 2.55                /* d ln tan(angle) / d ln l of the elastica there */
#define CELL_MOST 1.5             /* sides of cells, across / along */
#define SHOTS 60                  /* halvings towards the curvature at the edge */
enum { TRIALS = 30, PARTS = 8, ACROSS_LEAST = 5, ACROSS_MOST = 41 };

/* ---- the exact curve: theta'' = -gamma (1 - s) cos(theta), theta(0) = 0, theta'(1) = 0 ---- */

/* one step of Runge and Kutta; y: theta, theta', reach, drop */
static void shoot_step(double gamma, double s, double ds, double y[4]) {
    double slope[4] = {0}, at[4], sum[4] = {0};
    static const double place[4] = {0.0, 0.5, 0.5, 1.0}, weight[4] = {1.0, 2.0, 2.0, 1.0};
    for (int k = 0; k < 4; k++) {
        for (int c = 0; c < 4; c++) {
            at[c] = y[c] + place[k] * ds * slope[c];
        }
        slope[0] = at[1];
        slope[1] = -gamma * (1.0 - s - place[k] * ds) * cos(at[0]);
        slope[2] = cos(at[0]);
        slope[3] = sin(at[0]);
        for (int c = 0; c < 4; c++) {
            sum[c] += weight[k] / 6.0 * ds * slope[c];
        }
    }
    for (int c = 0; c < 4; c++) {
        y[c] += sum[c];
    }
}

/* curvature at the tip for one at the edge */
static double shoot(double gamma, double curvature, int count, double *reach, double *drop) {
    double y[4] = {0.0, curvature}, ds = 1.0 / (PARTS * (count - 1));
    reach[0] = drop[0] = 0.0;
    for (int k = 0; k < PARTS * (count - 1); k++) {
        shoot_step(gamma, k * ds, ds, y);
        if ((k + 1) % PARTS == 0) {
            reach[(k + 1) / PARTS] = y[2];
            drop[(k + 1) / PARTS] = y[3];
        }
    }
    return y[1];
}

void tester_elastica(double gamma, int count, double *reach, double *drop) {
    double low = 0.0, high = 0.5 * gamma; /* that of a strip which stays level */
    for (int k = 0; k < SHOTS; k++) {
        double middle = 0.5 * (low + high);
        if (shoot(gamma, middle, count, reach, drop) < 0.0) {
            low = middle;
        } else {
            high = middle;
        }
    }
}

/* ---- the strip ---- */

/* equilibrium of an overhang; its middle line into hang */
static bool hang_once(const Fabric *fabric, const char *model, StripWay way, double overhang,
                      TesterHang *hang, Error *error) {
    Strip s;
    int n = hang->count;
    double cells = WIDTH * (n - 1) / (CELL_MOST * overhang);
    int across = (int)fmin(fmax(ceil(cells) + 1.0, ACROSS_LEAST), ACROSS_MOST);
    if (!strip_create(&s, fabric, model, way, (double[2]){overhang, WIDTH}, (int[2]){n, across},
                      false, error)) {
        return false;
    }
    void *data;
    Statistics statistics = {.smallest_gap = INFINITY};
    bool ok = stepper_static.create(&s.system, &data, error);
    if (ok) {
        ok = stepper_static.advance(&s.system, data, &s.state, 1.0, &statistics, error);
        stepper_static.destroy(data);
    }
    for (int i = 0; ok && i < n; i++) {
        hang->at[i] = overhang * i / (n - 1);
        hang->reach[i] = hang->drop[i] = 0.0;
        for (int j = 0; j < s.across; j++) {
            const double *x = s.state.x + 3 * strip_node(&s, i, j);
            hang->reach[i] += strip_share(&s, j) * x[0];
            hang->drop[i] -= strip_share(&s, j) * x[2];
        }
    }
    strip_destroy(&s);
    return ok;
}

bool tester_hang(const Fabric *fabric, const char *model, StripWay way, int segments, Arena *arena,
                 TesterHang *hang, Error *error) {
    const FabricNumber *b = way == STRIP_WEFT ? &fabric->bend_weft : &fabric->bend_warp;
    int n = segments + 1;
    *hang = (TesterHang){.count = n,
                         .at = arena_push(arena, double, n),
                         .reach = arena_push(arena, double, n),
                         .drop = arena_push(arena, double, n)};
    double l = cbrt(GAMMA_PLANE) * fabric_bending_length(fabric, b->value);
    double off = INFINITY, before = 0.0, l_before = 0.0, power = POWER;
    for (int k = 0; k < TRIALS && fabs(off) > FOUND; k++) {
        if (!hang_once(fabric, model, way, l, hang, error)) {
            return false;
        }
        before = off;
        off = log(hang->drop[n - 1] / (hang->reach[n - 1] * tan(PLANE)));
        if (k > 0 && l != l_before) { /* the slope of the last two, unless it is noise */
            double slope = (off - before) / log(l / l_before);
            power = slope > 0.5 * POWER && slope < 2.0 * POWER ? slope : POWER;
        }
        hang->overhang = l_before = l;
        l *= exp(-off / power);
    }
    if (!(fabs(off) <= FOUND)) {
        return error_set(error, EXIT_DIFFERS,
                         "test: no overhang was found whose tip lies %.4g deg "
                         "below the edge",
                         PLANE * 180.0 / PI);
    }
    hang->length = 0.5 * hang->overhang;
    hang->stiffness = -scene_default().gravity.z * fabric->weight.value * pow(hang->length, 3.0);
    return true;
}
