#include "sim/tester.h"

#include <math.h>
#include <string.h>

#include "sim/base/text.h"
#include "sim/tester_loop.h"
#include "sim/tester_strip.h"

/* steps of a branch: as fine in the frame as on the shear tester */
enum { LOOP_STEPS = 320, FRAME_STEPS = 1600, PULL_STEPS = 40, HANG_SEGMENTS = 40 };

static void add_number(TesterReport *r, const char *key, const char *label, const char *unit,
                       double value, double fabric) {
    ASSERT(r->number_count < TESTER_NUMBERS);
    r->numbers[r->number_count++] = (TesterNumber){key, label, unit, value, fabric};
}

static void make_rows(TesterReport *r, Arena *arena, int count, int weft_row) {
    r->row_count = count;
    r->weft_row = weft_row;
    while (r->column_count < TESTER_COLUMNS && r->columns[r->column_count]) {
        r->column_count++;
    }
    r->rows = arena_push(arena, double, count * r->column_count);
}

/* ---- loops ---- */

/* the force that a crosshead reads, from that along the sides of the frame */
static double crosshead(double force, double phi) {
    return force * TESTER_FRAME_SIDE * 2.0 * cos(0.25 * PI - 0.5 * phi);
}

static void fill_loop(TesterKind kind, const Fabric *f, const TesterLoop *l, TesterReport *r) {
    for (int k = 0; k < r->row_count; k++) {
        double *row = r->rows + k * r->column_count, at = l->at[k];
        *row++ = at;
        *row++ = l->force[k];
        if (kind == TESTER_PICTURE) {
            *row++ = crosshead(l->force[k], at);
        }
        *row = tester_expected(kind, f, k / l->count, at);
    }
}

static bool run_loop(TesterKind kind, const Fabric *f, const char *model, Arena *arena,
                     TesterReport *r, Error *error) {
    static const char *const columns[][TESTER_COLUMNS] = {
        [TESTER_BENDING] = {"curvature [1/m]", "moment [N]", "fabric [N]"},
        [TESTER_SHEAR] = {"angle [rad]", "force [N/m]", "fabric [N/m]"},
        [TESTER_PICTURE] = {"angle [rad]", "force [N/m]", "crosshead [N]", "fabric [N/m]"}};
    bool bending = kind == TESTER_BENDING;
    memcpy(r->columns, columns[kind], sizeof columns[kind]);
    double mean = 0.5 * (f->bend_warp.value + f->bend_weft.value);
    TesterLoop l;
    if (!tester_run(kind, f, model, kind == TESTER_PICTURE ? FRAME_STEPS : LOOP_STEPS, arena, &l,
                    error)) {
        return false;
    }
    make_rows(r, arena, l.branches * l.count, l.branches * l.count);
    fill_loop(kind, f, &l, r);
    if (bending) {
        add_number(r, "stiffness", "B", "N m", l.slope, f->bend_warp.value);
        add_number(r, "hysteresis", "2HB", "N", l.width,
                   f->bend_hysteresis.value * f->bend_warp.value / mean);
    } else {
        add_number(r, "stiffness", "G", "N/m", l.slope, f->shear.value);
        add_number(r, "hysteresis", "2HG", "N/m", l.width, f->shear_hysteresis.value);
        add_number(r, "hysteresis_5", "2HG5", "N/m", l.width5, f->shear_hysteresis5.value);
    }
    add_number(r, "residual", "left without force", bending ? "1/m" : "rad", l.residual, NAN);
    r->curve_error = tester_curve_error(kind, f, &l);
    return true;
}

static bool run_bending(const Fabric *fabric, const char *model, Arena *arena, TesterReport *r,
                        Error *error) {
    return run_loop(TESTER_BENDING, fabric, model, arena, r, error);
}

static bool run_shear(const Fabric *fabric, const char *model, Arena *arena, TesterReport *r,
                      Error *error) {
    return run_loop(TESTER_SHEAR, fabric, model, arena, r, error);
}

static bool run_picture(const Fabric *fabric, const char *model, Arena *arena, TesterReport *r,
                        Error *error) {
    return run_loop(TESTER_PICTURE, fabric, model, arena, r, error);
}

/* ---- strips ---- */

static bool run_tensile(const Fabric *f, const char *model, Arena *arena, TesterReport *r,
                        Error *error) {
    static const char *const columns[] = {"strain", "force [N/m]", "narrowing", "fabric [N/m]"};
    memcpy(r->columns, columns, sizeof columns);
    TesterPull pulls[2];
    const double e[2] = {f->stretch_warp.value, f->stretch_weft.value};
    for (int way = 0; way < 2; way++) {
        if (!tester_pull(f, model, (StripWay)way, PULL_STEPS, arena, &pulls[way], error)) {
            return false;
        }
    }
    make_rows(r, arena, pulls[0].count + pulls[1].count, pulls[0].count);
    for (int way = 0, row = 0; way < 2; way++) {
        const TesterPull *p = &pulls[way];
        for (int k = 0; k < p->count; k++, row++) {
            const double values[] = {p->strain[k], p->force[k], p->narrowing[k],
                                     e[way] * p->strain[k]};
            memcpy(r->rows + row * r->column_count, values, sizeof values);
        }
    }
    double nu = f->stretch_poisson.value;
    add_number(r, "stiffness_warp", "E warp", "N/m", pulls[0].stiffness, e[0]);
    add_number(r, "stiffness_weft", "E weft", "N/m", pulls[1].stiffness, e[1]);
    add_number(r, "poisson_warp", "narrowing, warp", "of the strain", pulls[0].poisson, nu);
    add_number(r, "poisson_weft", "narrowing, weft", "of the strain", pulls[1].poisson,
               nu * e[1] / e[0]);
    return true;
}

/* the strip, and the elastica of the fabric's B with the same overhang */
static void fill_hang(const Fabric *f, double rigidity, const TesterHang *h, Arena *arena,
                      double *rows, int columns) {
    double *reach = arena_push(arena, double, h->count),
           *drop = arena_push(arena, double, h->count);
    double gamma = pow(h->overhang / fabric_bending_length(f, rigidity), 3.0);
    tester_elastica(gamma, h->count, reach, drop);
    for (int k = 0; k < h->count; k++) {
        const double row[] = {h->at[k], h->reach[k], h->drop[k], h->overhang * reach[k],
                              h->overhang * drop[k]};
        memcpy(rows + k * columns, row, sizeof row);
    }
}

static bool run_cantilever(const Fabric *f, const char *model, Arena *arena, TesterReport *r,
                           Error *error) {
    static const char *const columns[] = {"along [m]", "reach [m]", "drop [m]",
                                          "reach of fabric [m]", "drop of fabric [m]"};
    memcpy(r->columns, columns, sizeof columns);
    TesterHang hangs[2];
    const double b[2] = {f->bend_warp.value, f->bend_weft.value};
    for (int way = 0; way < 2; way++) {
        if (!tester_hang(f, model, (StripWay)way, HANG_SEGMENTS, arena, &hangs[way], error)) {
            return false;
        }
    }
    make_rows(r, arena, hangs[0].count + hangs[1].count, hangs[0].count);
    for (int way = 0; way < 2; way++) {
        fill_hang(f, b[way], &hangs[way], arena,
                  r->rows + (way ? r->weft_row : 0) * r->column_count, r->column_count);
    }
    add_number(r, "bending_length_warp", "c warp", "m", hangs[0].length,
               fabric_bending_length(f, b[0]));
    add_number(r, "bending_length_weft", "c weft", "m", hangs[1].length,
               fabric_bending_length(f, b[1]));
    add_number(r, "stiffness_warp", "B warp", "N m", hangs[0].stiffness, b[0]);
    add_number(r, "stiffness_weft", "B weft", "N m", hangs[1].stiffness, b[1]);
    return true;
}

const Tester testers[] = {
    {"bending", "Kawabata: 1 cm between walls that turn, along the warp", false, run_bending},
    {"shear", "Kawabata: 20 x 5 cm, threads keep their length", false, run_shear},
    {"picture", "picture frame: 20 x 20 cm, hinged bars, up to 40 degrees", false, run_picture},
    {"tensile", "20 x 5 cm pulled along warp and weft, up to 500 N/m", true, run_tensile},
    {"cantilever", "ASTM D1388: 2.5 cm wide, down to 41.5 degrees", true, run_cantilever},
    {0},
};

/* ---- what is printed ---- */

static const Tester *find(const char *name, Error *error) {
    const char *names[sizeof testers / sizeof *testers] = {0};
    char list[256] = "";
    for (int k = 0; testers[k].name; k++) {
        if (strcmp(testers[k].name, name) == 0) {
            return &testers[k];
        }
        names[k] = testers[k].name;
        size_t used = strlen(list);
        snprintf(list + used, sizeof list - used, "%s%s", k ? ", " : "", testers[k].name);
    }
    const char *near = text_nearest(name, names);
    error_set(error, EXIT_USAGE, "toile: no test is called '%s'%s%s%s (%s)", name,
              near ? "; did you mean '" : "", near ? near : "", near ? "'?" : "", list);
    return NULL;
}

static void print_rows(const Tester *tester, const TesterReport *r, FILE *out) {
    fputs(tester->both ? "direction," : "", out);
    for (int c = 0; c < r->column_count; c++) {
        fprintf(out, "%s%c", r->columns[c], c + 1 < r->column_count ? ',' : '\n');
    }
    for (int k = 0; k < r->row_count; k++) {
        fputs(!tester->both ? "" : k < r->weft_row ? "warp," : "weft,", out);
        for (int c = 0; c < r->column_count; c++) {
            fprintf(out, "%.6g%c", r->rows[k * r->column_count + c],
                    c + 1 < r->column_count ? ',' : '\n');
        }
    }
}

static void print_json(const Tester *tester, const char *fabric, const char *model,
                       const TesterReport *r, FILE *out) {
    fprintf(out,
            "{\"schema\": \"toile-test-1\", \"test\": \"%s\", \"fabric\": \"%s\", \"model\": "
            "\"%s\"",
            tester->name, fabric, model);
    for (int k = 0; k < r->number_count; k++) {
        const TesterNumber *n = &r->numbers[k];
        fprintf(out, ", \"%s\": %.9g", n->key, n->value);
        if (!isnan(n->fabric)) {
            fprintf(out, ", \"%s_fabric\": %.9g", n->key, n->fabric);
        }
    }
    fputs("}\n", out);
}

static void print_numbers(const Tester *tester, const char *fabric, const char *model,
                          const TesterReport *r) {
    fprintf(stderr, "test: %s of %s by %s%s\n", tester->name, fabric, model,
            strcmp(tester->name, "bending") == 0 ? ", along the warp" : "");
    for (int k = 0; k < r->number_count; k++) {
        const TesterNumber *n = &r->numbers[k];
        fprintf(stderr, "test: %s %.4g %s", n->label, n->value, n->unit);
        if (!isnan(n->fabric)) {
            fprintf(stderr, " (fabric: %.4g)", n->fabric);
        }
        fputc('\n', stderr);
    }
    if (!isnan(r->curve_error)) {
        fprintf(stderr, "test: first loading within %.2g %% of the fabric's curve\n",
                100.0 * r->curve_error);
    }
}

bool tester_print(const char *test, const char *fabric, const char *model, bool json, FILE *out,
                  Error *error) {
    Arena arena = {0};
    Fabric read;
    TesterReport report = {.curve_error = NAN};
    const Tester *tester = find(test, error);
    bool ok = tester && fabric_read(fabric, &arena, &read, error) &&
              tester->run(&read, model, &arena, &report, error);
    if (ok && json) {
        print_json(tester, read.name, model, &report, out);
    } else if (ok) {
        print_rows(tester, &report, out);
        print_numbers(tester, read.name, model, &report);
    }
    arena_free(&arena);
    return ok;
}
