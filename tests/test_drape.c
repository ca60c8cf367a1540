/* measure: contours, harmonics and nodes with known answers; drapes with known outlines; ensembles. */
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "render/drape_report.h"
#include "tests/support/check.h"
#include "tests/support/drapes.h"
#include "tests/support/shell.h"

static char folder[] = "/tmp/toile_test_drape_XXXXXX";
static char program[4096], text[1 << 16];

static const char *in_folder(const char *name) {
    static char path[4200];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static int measure(const char *arguments) {
    char command[9000];
    snprintf(command, sizeof command, "cd %s && %s measure %s 2>&1", folder, program, arguments);
    return shell_run(command, text, sizeof text);
}

/* ---- contours ---- */

typedef struct Outline {
    double mean, a[CONTOUR_NODE_HARMONICS + 1], b[CONTOUR_NODE_HARMONICS + 1];
} Outline;

static double radius_at(const Outline *outline, double theta) {
    double r = outline->mean;
    for (int n = 1; n <= CONTOUR_NODE_HARMONICS; n++) {
        r += outline->a[n] * cos(n * theta) + outline->b[n] * sin(n * theta);
    }
    return r;
}

/* The outline as a silhouette of triangles from the middle. */
static Coverage draw_outline(const Outline *outline, double x, double y, double pixel,
                             double *area) {
    enum { SIDES = 2880 };
    SilhouetteDef def = {{0, 0}, {0, 0}, 0, INFINITY, pixel, 1.6 * outline->mean};
    Silhouette silhouette = silhouette_create(&def);
    for (int i = 0; i < SIDES; i++) {
        double p[6] = {x, y}, angle[2] = {2 * PI * i / SIDES, 2 * PI * (i + 1) / SIDES};
        for (int k = 0; k < 2; k++) {
            double r = radius_at(outline, angle[k]);
            p[2 + 2 * k] = x + r * cos(angle[k]);
            p[3 + 2 * k] = y + r * sin(angle[k]);
        }
        silhouette_add_polygon(&silhouette, p, 3);
    }
    *area = silhouette_area(&silhouette);
    Coverage coverage = silhouette_cover(&silhouette);
    silhouette_free(&silhouette);
    return coverage;
}

static double random_unit(unsigned *seed) {
    *seed = *seed * 1664525u + 1013904223u;
    return (*seed >> 8) / 8388608.0 - 1.0;
}

static void check_outline(const Outline *outline, double pixel) {
    double area, exact = PI * outline->mean * outline->mean;
    Coverage coverage = draw_outline(outline, 0.003, -0.002, pixel, &area);
    Contour contour = contour_trace(&coverage, 0.003, -0.002, 0.0);
    Harmonics h = harmonics_find(contour.r, CONTOUR_RAYS);
    for (int n = 1; n <= CONTOUR_NODE_HARMONICS; n++) {
        exact += 0.5 * PI * (outline->a[n] * outline->a[n] + outline->b[n] * outline->b[n]);
        CHECK_NEAR(h.a[n], outline->a[n], 0.1 * pixel);
        CHECK_NEAR(h.b[n], outline->b[n], 0.1 * pixel);
    }
    CHECK_NEAR(h.mean, outline->mean, 0.1 * pixel);
    CHECK_NEAR(area, exact, 2e-4 * exact);
    CHECK_NEAR(contour_area(contour.r), exact, 5e-4 * exact);
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        CHECK_NEAR(contour.r[i], radius_at(outline, 2 * PI * i / CONTOUR_RAYS), 1.0 * pixel);
    }
    assert_int_equal(contour.multivalued + contour.missed, 0);
    coverage_free(&coverage);
}

static void test_contours(void **unused) {
    (void)unused;
    unsigned seed = 7;
    static const double pixels[3] = {0.0005, 0.00025, 0.00012};
    for (int i = 0; i < 6; i++) {
        Outline outline = {.mean = 0.12};
        for (int n = 1; n <= CONTOUR_NODE_HARMONICS; n++) {
            outline.a[n] = 0.012 * random_unit(&seed) / n;
            outline.b[n] = 0.012 * random_unit(&seed) / n;
        }
        check_outline(&outline, pixels[i % 3]);
    }
}

static void test_asymmetry(void **unused) {
    (void)unused;
    double r[CONTOUR_RAYS];
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        double t = 2 * PI * i / CONTOUR_RAYS;
        r[i] = 0.1 + 0.01 * cos(4 * (t - 0.2)) + 0.02 * cos(3 * (t - 0.2));
    }
    Harmonics harmonics = harmonics_find(r, CONTOUR_RAYS);
    CHECK_NEAR(contour_asymmetry(&harmonics, 0.2), 0.0, 1e-9);
    for (int k = 0; k < 8; k++) { /* about another axis each harmonic is odd by sin^2 */
        double off = 0.1 * k, odd4 = sin(4 * off) * sin(4 * off),
               odd3 = sin(3 * off) * sin(3 * off);
        CHECK_NEAR(contour_asymmetry(&harmonics, 0.2 + off), (odd4 + 4 * odd3) / 5, 1e-6);
    }
    Harmonics circle = {.mean = 0.1};
    assert_true(isnan(contour_asymmetry(&circle, 0.0)));
}

static void test_nodes(void **unused) {
    (void)unused;
    for (int n = 2; n <= 16; n++) { /* folds of 8 mm on 12 cm */
        double r[CONTOUR_RAYS];
        for (int i = 0; i < CONTOUR_RAYS; i++) {
            r[i] = 0.12 + 0.004 * cos(n * (2 * PI * i / CONTOUR_RAYS - 0.3));
        }
        Nodes nodes = contour_find_nodes(r, 0.0045);
        assert_int_equal(nodes.count, n);
        for (int k = 0; k < n; k++) {
            double turn = (nodes.angle[k] - 0.3) * n / (2 * PI);
            CHECK_NEAR(turn - round(turn), 0.0, 2e-4 * n);
            CHECK_NEAR(nodes.peak[k], 0.124, 1e-6 * n);
            CHECK_NEAR(nodes.depth[k], 0.008, 1e-5 * n);
        }
        assert_int_equal(contour_find_nodes(r, 0.0081).count, 0);
    }
    /* a shoulder of 1 mm beside a fold of 10 mm is no node at 3 % of 15 cm, but is at 0.5 % */
    double r[CONTOUR_RAYS];
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        double t = 2 * PI * i / CONTOUR_RAYS;
        r[i] = 0.12 + 0.005 * cos(3 * t) + 0.0015 * cos(12 * t);
    }
    assert_int_equal(contour_find_nodes(r, 0.0045).count, 3);
    assert_true(contour_find_nodes(r, 0.00001).count > 3);
}

/* ---- drapes ---- */

static Drape measure_shape(const DrapeShape *shape, const DrapeDef *def, Arena *arena) {
    Run run;
    RunDef run_def = run_default();
    Drape drape;
    Error error = {0};
    run_def.path = in_folder("shape.states");
    assert_true(drape_shape_write(shape, run_def.path));
    assert_true(run_open(&run, &run_def, &error));
    bool good = drape_measure(&run, def, 1, arena, &drape, &error);
    assert_true(good || (printf("%s\n", error.text), false));
    run_close(&run);
    return drape;
}

static void test_shapes(void **unused) {
    (void)unused;
    Arena arena = {0};
    DrapeDef def = drape_default();
    DrapeShape shape = drape_shape_default();
    shape.warp = 0.7;
    shape.centre[0] = 0.31;
    Drape drape = measure_shape(&shape, &def, &arena);
    CHECK_NEAR(drape.dc, drape_shape_dc(&shape), 0.2);
    CHECK_NEAR(drape.dc_geometry, drape_shape_dc(&shape), 0.2);
    CHECK_NEAR(drape.dc, drape.dc_geometry, 0.05);
    CHECK_NEAR(drape.warp, 0.7, 1e-9);
    assert_int_equal(drape.nodes.count, 6);
    assert_int_equal(drape.nodes_least, 6);
    assert_int_equal(drape.nodes_most, 6);
    assert_int_equal(drape.rim_nodes, 6);
    assert_int_equal(drape.harmonics.dominant, 6);
    CHECK_NEAR(drape.harmonics.amplitude[6], 0.01, 1e-4);
    CHECK_NEAR(fmin(drape.nodes.angle[0], 2 * PI - drape.nodes.angle[5]), 0.0, 0.01);
    CHECK_NEAR(drape.fold_depth, 0.02, 2e-4);
    CHECK_NEAR(drape.ddr, 100 * (0.15 - 0.12) / 0.06, 0.3);
    CHECK_NEAR(drape.fold_index, 100 * 0.02 / 0.06, 0.3);
    CHECK_NEAR(drape.rim_low, -sqrt(0.06 * 0.06 - 0.02 * 0.02), 1e-3);
    CHECK_NEAR(drape.kinetic, 0.0, 0.0);
    /* the cut 2 cm below: the line to the rim of 13 cm is 45 mm deep, to that of 11 cm 57 mm */
    const DrapeSlice *slice = &drape.slices[1];
    CHECK_NEAR(slice->high, 0.09 + 0.04 * 0.0205 / sqrt(0.06 * 0.06 - 0.04 * 0.04), 5e-4);
    CHECK_NEAR(slice->low, 0.09 + 0.02 * 0.0205 / sqrt(0.06 * 0.06 - 0.02 * 0.02), 5e-4);
    /* 37.5 mm below, folds stand out by 18 mm, 10.5 mm count; cos(6 t) is even about warp and odd
     * about 45 degrees */
    const DrapeCut *cut = &drape.cut;
    assert_int_equal(cut->count, 6);
    assert_int_equal(cut->corners, 0);
    CHECK_NEAR(cut->billows[1].angle - cut->billows[0].angle, PI / 3, 0.01);
    CHECK_NEAR(cut->billows[0].off, drape_shape_cut(&shape, 0.0, 0.0375) - 0.09, 3e-4);
    CHECK_NEAR(cut->billows[0].prominence,
               drape_shape_cut(&shape, 0.0, 0.0375) - drape_shape_cut(&shape, PI / 6, 0.0375),
               5e-4);
    CHECK_NEAR(drape.asymmetry[0], 0.0, 1e-3);
    CHECK_NEAR(drape.asymmetry[1], 1.0, 1e-3);
    arena_free(&arena);
}

/* Flat, and cones that do not shrink: the formula of the rigid test piece. */
static void test_cones(void **unused) {
    (void)unused;
    Arena arena = {0};
    DrapeDef def = drape_default();
    static const double rims[4] = {0.15, 0.14, 0.12, 0.105};
    for (int i = 0; i < 4; i++) {
        DrapeShape shape = drape_shape_default();
        shape.a[6] = 0.0;
        shape.a[0] = rims[i];
        Drape drape = measure_shape(&shape, &def, &arena);
        double sine = (rims[i] - 0.09) / 0.06, r = 0.09 + 0.06 * sine;
        CHECK_NEAR(drape.dc, 100 * (r * r - 0.0081) / (0.0225 - 0.0081), 0.15);
        assert_int_equal(drape.nodes.count, 0);
        CHECK_NEAR(drape.circularity, 1.0, 1e-3);
        /* a camera 50 cm over the table: the rim, deeper by d, is smaller by H / (H + d) */
        DrapeDef near_def = def;
        near_def.camera_height = 0.5;
        double deep = -drape.rim_mean, small = r * 0.5 / (0.5 + deep);
        Drape seen = measure_shape(&shape, &near_def, &arena);
        double expected = fmax(small, 0.09);
        CHECK_NEAR(seen.harmonics.mean, expected, 3e-4);
    }
    arena_free(&arena);
}

/* Peaks of a row and of a ring. */
static void test_peaks(void **unused) {
    (void)unused;
    static const double row[9] = {5, 2, 4, 1, 3, 3, 0, 2, 1};
    Peak peaks[9];
    assert_int_equal(contour_find_peaks(row, 9, false, 0.5, peaks, 9), 4);
    static const double prominences[4] = {5, 2, 2, 2}; /* 5 - 0, 4 - 2, 3 - 1, 2 - 0 */
    static const int places[4] = {0, 2, 4, 7};
    for (int k = 0; k < 4; k++) {
        assert_int_equal(peaks[k].at, places[k]);
        CHECK_NEAR(peaks[k].prominence, prominences[k], 0.0);
    }
    /* in a ring the last one reaches the first over 1, not 0 */
    assert_int_equal(contour_find_peaks(row, 9, true, 0.5, peaks, 9), 4);
    CHECK_NEAR(peaks[3].prominence, 1.0, 0.0);
    assert_int_equal(contour_find_peaks(row, 9, true, 1.5, peaks, 9), 3);
    assert_int_equal(contour_find_peaks(row, 9, false, 0.5, peaks, 2), 2);
    assert_int_equal(contour_find_peaks(row, 0, true, 0.5, peaks, 9), 0);
}

#define CUT_SAMPLES 20000

/* [m] from a square of half side `half`; 0 inside */
static double square_distance(double half, double x, double y) {
    return hypot(fmax(fabs(x) - half, 0.0), fmax(fabs(y) - half, 0.0));
}

/* Of each corner, by areas in polar coordinates; returns what is common to them. */
static double exact_skew(const DrapeShape *shape, double depth, double skew[4]) {
    double odd[4] = {0}, all[4] = {0}, common = 0.0;
    for (int pass = 0; pass < 2; pass++) {
        for (int i = 0; i < CUT_SAMPLES; i++) {
            double turn = 0.25 * PI * (i + 0.5) / CUT_SAMPLES, mean = 0.0;
            for (int k = 0; k < 4; k++) {
                double area[2];
                for (int side = 0; side < 2; side++) {
                    double out = side == k % 2 ? turn : -turn; /* first towards the weft */
                    double theta = (1.25 + 0.5 * k) * PI + out;
                    double r = drape_shape_cut(shape, theta, depth);
                    double edge = shape->box / fmax(fabs(cos(theta)), fabs(sin(theta)));
                    area[side] = r * r - edge * edge;
                }
                odd[k] += pass ? 0.0 : fabs(area[0] - area[1]);
                all[k] += pass ? 0.0 : area[0] + area[1];
                mean += pass ? 0.25 * (area[0] - area[1]) / all[k] : 0.0;
            }
            common += fabs(mean);
        }
    }
    for (int k = 0; k < 4; k++) {
        skew[k] = odd[k] / all[k];
    }
    return common;
}

static Drape check_corners(const DrapeShape *shape, int at_corner, Arena *arena) {
    DrapeDef def = drape_default();
    def.cut = 0.02;
    def.prominence = 0.003;
    Drape drape = measure_shape(shape, &def, arena);
    double off[CUT_SAMPLES], found = 0.0, exact = 0.0;
    Peak peaks[DRAPE_MOST_BILLOWS];
    for (int i = 0; i < CUT_SAMPLES; i++) {
        double theta = 2.0 * PI * i / CUT_SAMPLES, r = drape_shape_cut(shape, theta, def.cut);
        off[i] = square_distance(shape->box, r * cos(theta), r * sin(theta));
    }
    int count = contour_find_peaks(off, CUT_SAMPLES, true, 0.003, peaks, DRAPE_MOST_BILLOWS);
    assert_int_equal(count, 4 * at_corner);
    assert_int_equal(drape.cut.count, count);
    assert_int_equal(drape.cut.corners, 4);
    for (int k = 0; k < count; k++) {
        CHECK_NEAR(drape.cut.billows[k].angle, 2.0 * PI * peaks[k].at / CUT_SAMPLES, 0.03);
        CHECK_NEAR(drape.cut.billows[k].off, off[peaks[k].at], 2e-4);
        found +=
            drape.cut.billows[k].prominence / count; /* which of two near ones is higher is open */
        exact += peaks[k].prominence / count;
    }
    CHECK_NEAR(found, exact, 3e-4);
    double skew[4];
    CHECK_NEAR(drape.cut.skew_common, exact_skew(shape, def.cut, skew), 0.003);
    for (int k = 0; k < 4; k++) {
        assert_int_equal(drape.cut.at_corner[k], at_corner);
        CHECK_NEAR(drape.cut.skew[k], skew[k], 0.003);
    }
    return drape;
}

/* A round cloth over a box: one fold at each corner, two, more on one side of it. */
static void test_corners(void **unused) {
    (void)unused;
    Arena arena = {0};
    DrapeShape shape = drape_shape_default();
    shape.box = 0.02; /* small: all of the fold is the cloth's */
    shape.rings = 60;
    shape.a[6] = 0.0;
    shape.a[4] = -0.02;
    shape.a[1] = 0.0008, shape.b[1] = 0.0003; /* no two peaks are as high */
    shape.a[2] = 0.006;                       /* further out along warp: common to the corners */
    Drape along = check_corners(&shape, 1, &arena);
    assert_true(along.cut.skew_common > 0.03);
    shape.a[8] = -0.015, shape.a[2] = 0.0, shape.b[4] = 0.006; /* turned about the middle: not */
    Drape turned = check_corners(&shape, 2, &arena);
    assert_true(turned.cut.skew[0] > 0.03 && turned.cut.skew_common < 0.01);
    /* the plane misses what stands out furthest: four pieces, highest at their ends */
    shape.b[4] = shape.a[8] = 0.0, shape.a[4] = -0.025;
    DrapeDef def = drape_default();
    def.cut = 0.045;
    def.prominence = 0.002;
    Drape open = measure_shape(&shape, &def, &arena);
    assert_int_equal(open.cut.count, 8);
    arena_free(&arena);
}

/* Turned, mirrored, moved, other rings: the same numbers. */
static void test_invariance(void **unused) {
    (void)unused;
    Arena arena = {0};
    DrapeDef def = drape_default();
    DrapeShape shape = drape_shape_default();
    shape.a[2] = 0.004, shape.b[3] = -0.003, shape.b[5] = 0.002;
    Drape one = measure_shape(&shape, &def, &arena);
    shape.warp = 1.1;
    shape.rings = 40;
    Drape other = measure_shape(&shape, &def, &arena);
    CHECK_NEAR(one.dc, other.dc, 0.1);
    CHECK_NEAR(one.dc, drape_shape_dc(&shape), 0.2);
    assert_int_equal(one.nodes.count, other.nodes.count);
    for (int n = 1; n <= 8; n++) {
        CHECK_NEAR(one.harmonics.a[n], other.harmonics.a[n], 1.5e-4);
        CHECK_NEAR(one.harmonics.b[n], other.harmonics.b[n], 1.5e-4);
    }
    for (int n = 1; n < DRAPE_SHAPE_TERMS; n++) {
        shape.b[n] = -shape.b[n];
    }
    Drape mirrored = measure_shape(&shape, &def, &arena);
    CHECK_NEAR(mirrored.dc, other.dc, 0.05);
    CHECK_NEAR(mirrored.harmonics.b[3], -other.harmonics.b[3], 1e-4);
    arena_free(&arena);
}

/* ---- the program ---- */

static double json_number_of(const char *key) {
    char quoted[80];
    snprintf(quoted, sizeof quoted, "\"%s\": ", key);
    const char *at = strstr(text, quoted);
    assert_non_null(at);
    return strncmp(at + strlen(quoted), "null", 4) == 0 ? NAN : atof(at + strlen(quoted));
}

static void test_program(void **unused) {
    (void)unused;
    DrapeShape shape = drape_shape_default();
    assert_true(drape_shape_write(&shape, in_folder("run.states")));
    assert_int_equal(measure("run.states --json -o out --plot out.svg"), EXIT_OK);
    CHECK_NEAR(json_number_of("drape_coefficient_percent"), drape_shape_dc(&shape), 0.2);
    CHECK_NEAR(json_number_of("settle_time_s"), 1 / 30.0, 1e-6);
    CHECK_NEAR(json_number_of("nodes"), 6, 0);
    char command[9000];
    snprintf(
        command, sizeof command,
        "cd %s && python3 -m json.tool out/drape.json > /dev/null && wc -l < out/contour.csv && "
        "wc -l < out/harmonics.csv && grep -c '<path' out.svg > /dev/null && head -c 4 out.svg | "
        "grep -c xml; %s measure run.states --plot out.png && head -c 4 out.png | grep -c PNG",
        folder, program);
    shell_run(command, text, sizeof text);
    assert_non_null(strstr(text, "361\n25\n"));
    assert_non_null(strstr(text, "\n1\n")); /* PNG */
    assert_int_equal(measure("run.states --csv --frames 0-1"), EXIT_OK);
    double flat = atof(strstr(text, "\n0,0,") + 5);
    CHECK_NEAR(flat, 100.0, 0.05);
    const char *second = strstr(text, "\n1,0.0333333333,");
    assert_non_null(second);
    CHECK_NEAR(atof(second + 16), drape_shape_dc(&shape), 0.2);
    /* another disc, another place, no support at all */
    assert_int_equal(measure("run.states --json --disc 100mm"), EXIT_OK);
    CHECK_NEAR(json_number_of("drape_coefficient_percent"),
               100 * (0.12 * 0.12 + 0.5e-4 - 0.01) / (0.0225 - 0.01), 0.2);
    assert_int_equal(measure("run.states --centre 1cm,0"), EXIT_OK);
    assert_non_null(strstr(text, "warning: specimen or support is off-centre by"));
    assert_int_equal(measure("run.states --disc 2"), EXIT_BAD_INPUT);
    assert_int_equal(measure("run.states --disc 2km"), EXIT_USAGE);
    assert_int_equal(measure("run.states --json --cut 20mm --prominence 5m2"), EXIT_USAGE);
    assert_int_equal(measure("run.states --json --cut 20mm --prominence 5mm"), EXIT_OK);
    CHECK_NEAR(json_number_of("cut_depth_m"), 0.02, 1e-12);
    CHECK_NEAR(json_number_of("prominence_m"), 0.005, 1e-12);
    assert_int_equal(measure("run.states --json --cut 20cm"), EXIT_OK); /* below the cloth */
    CHECK_NEAR(json_number_of("billows"), 0, 0);
    assert_int_equal(measure("run.states --cut -1"), EXIT_USAGE);
    assert_int_equal(measure("run.states --prominence fold"), EXIT_USAGE);
    assert_int_equal(measure("run.states --cloth rond"), EXIT_USAGE);
    assert_non_null(strstr(text, "did you mean 'round'"));
    assert_int_equal(measure("run.states --plot out.pdf"), EXIT_USAGE);
    assert_int_equal(measure("run.states --plot /dev/null/x.png"), EXIT_IO);
    assert_int_equal(measure("none.states"), EXIT_MISSING_INPUT);
}

static void test_ensemble(void **unused) {
    (void)unused;
    /* 3, 5, 4, 4 points about 40: mean 44, s 0.8165, t(3) = 3.182 */
    Drape drapes[4] = {{.dc = 43}, {.dc = 45}, {.dc = 44}, {.dc = 44}};
    drapes[0].nodes.count = 6, drapes[1].nodes.count = 7;
    drapes[2].nodes.count = 7, drapes[3].nodes.count = 5;
    Ensemble e = ensemble_find(drapes, 4);
    CHECK_NEAR(e.mean, 44, 1e-12);
    CHECK_NEAR(e.deviation, sqrt(2.0 / 3.0), 1e-12);
    CHECK_NEAR(e.half_interval, 3.182 * sqrt(2.0 / 3.0) / 2, 1e-9);
    assert_int_equal(e.mode, 7);
    CHECK_NEAR(e.dc_mode, 44.5, 1e-12);
    DrapeShape shape = drape_shape_default();
    assert_true(drape_shape_write(&shape, in_folder("m1.states")));
    shape.a[6] = 0, shape.a[5] = 0.012;
    assert_true(drape_shape_write(&shape, in_folder("m2.states")));
    assert_int_equal(measure("m1.states m2.states m1.states --json --plot many.png"), EXIT_OK);
    CHECK_NEAR(json_number_of("node_mode"), 6, 0);
    assert_non_null(strstr(text, "\"node_histogram\": {\"5\": 1, \"6\": 2}"));
    assert_int_equal(measure("m1.states m2.states"), EXIT_OK);
    assert_non_null(strstr(text, "nodes: 5 in 1 6 in 1"));
}

/* The boundary of the states' own triangles, as a polygon, by other code in another language. */
static void test_independent(void **unused) {
    (void)unused;
    static const char script[] =
        "import sys; sys.path.insert(0, '" TOILE_SOURCE_DIR "/scripts')\n"
        "import numpy as np; from read_states import States\n"
        "s = States(sys.argv[1]); f = s.frames[-1]; t = f.layout.triangles\n"
        "e = np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])\n"
        "seen = {tuple(x) for x in e}; nxt = {a: b for a, b in seen if (b, a) not in seen}\n"
        "def area(p):\n"
        "    a = next(iter(nxt)); loop = []\n"
        "    while a not in loop: loop.append(a); a = nxt[a]\n"
        "    x, y = p[loop, 0], p[loop, 1]\n"
        "    return 0.5 * abs(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))\n"
        "d = np.pi * 0.09 ** 2\n"
        "print(100 * (area(f['x']) - d) / (area(f.layout.rest) - d))\n";
    DrapeShape shape = drape_shape_default();
    shape.rings = 60;
    shape.b[3] = 0.006;
    assert_true(drape_shape_write(&shape, in_folder("fine.states")));
    FILE *file = fopen(in_folder("script.py"), "w");
    assert_non_null(file);
    fputs(script, file);
    fclose(file);
    char command[9000];
    snprintf(command, sizeof command, "cd %s && /usr/bin/python3 script.py fine.states 2>/dev/null",
             folder);
    if (shell_run(command, text, sizeof text) != 0) {
        printf("SKIPPED: the drape coefficient in Python: python3-numpy is not installed\n");
        return;
    }
    double expected = atof(text);
    assert_int_equal(measure("fine.states --json"), EXIT_OK);
    CHECK_NEAR(json_number_of("drape_coefficient_percent"), expected, 0.1);
    CHECK_NEAR(json_number_of("drape_coefficient_geometry_percent"), expected, 0.05);
}

int main(int argc, char **argv) {
    (void)argc;
    char *absolute = realpath(argv[0], NULL),
         *slash = absolute ? strstr(absolute, "/tests/") : NULL;
    if (!slash || !mkdtemp(folder)) {
        fprintf(stderr, "test_drape: must be started as build/CONFIG/tests/test_drape\n");
        return 1;
    }
    snprintf(program, sizeof program, "%.*s/toile-render", (int)(slash - absolute), absolute);
    free(absolute);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_contours),    cmocka_unit_test(test_nodes),
        cmocka_unit_test(test_asymmetry),   cmocka_unit_test(test_shapes),
        cmocka_unit_test(test_cones),       cmocka_unit_test(test_peaks),
        cmocka_unit_test(test_corners),     cmocka_unit_test(test_invariance),
        cmocka_unit_test(test_program),     cmocka_unit_test(test_ensemble),
        cmocka_unit_test(test_independent),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    char command[4200];
    snprintf(command, sizeof command, "rm -rf %s", folder);
    return system(command) == 0 ? failed : 1;
}
