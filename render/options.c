/* The command line of toile-render: one table of options, which reader, help and messages loop over. */
#include <limits.h>
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "render/command.h"
#include "render/jobs.h"
#include "sim/base/text.h"

#define MOST_PIXELS 16384 /* along a side: the driver's largest texture, without supersampling */
#define MOST_ARGUMENTS 256
#define FIELD(member) offsetof(Options, member)

const Command commands[] = {
    {"render", "RUN -o FILE",
     "video (mp4, hevc.mp4, mov, prores.mov, webm, av1.webm, gif, mkv, apng), sequence (%04d.png, "
     "%04d.exr "
     "or a "
     "folder), picture",
     command_render, 1, 1, false},
    {"sheet", "RUN -o FILE.png", "contact sheet of a run", command_sheet, 1, 1, false},
    {"measure", "RUN...", "drape coefficient, folds, contour, strain; of several runs the ensemble",
     command_measure, 1, MOST_ARGUMENTS - 1, false},
    {"export", "RUN --as FORMAT -o PATH", "the moving mesh in a format of other programs",
     command_export, 1, 1, false},
    {"diff", "A B", "whether pictures, videos, runs or folders are the same; exit code 1 if not",
     command_diff, 2, 2, false},
    {"compare", "RUN PHOTO", "a photograph of a real drape, from above or the side, against a run",
     command_compare, 2, 2, false},
    {"looks", "[-o FILE.png]", "what cloths and obstacles can look like; a sheet of swatches",
     command_looks, 0, 0, false},
    {"frames", "RUN", "how many frames a run has, for scripts", command_frames, 1, 1, true},
    {"versions", "", "versions of the libraries in use", command_versions, 0, 0, false},
    {"bench", "RUN", "CPU time of each stage of a frame, as CSV", command_bench, 1, 1, true},
};
const int command_count = sizeof commands / sizeof commands[0];

Options options_default(void) {
    long processors = sysconf(_SC_NPROCESSORS_ONLN);
    return (Options){.run = run_default(),
                     .last = -1,
                     .quality = quality_find(QUALITY_DEFAULT),
                     .threads = processors > 0 ? (int)processors : 1,
                     .count = 12,
                     .every = 1,
                     .jobs = 1,
                     .blur = -1.0,
                     .play = -1.0,
                     .export = export_default(),
                     .drape = drape_default(),
                     .compare = compare_default(),
                     .progress = PROGRESS_AUTO};
}

/* ---- values ---- */

static bool read_int(const char *text, int least, int most, int *value, const char **rest) {
    char *end;
    long number = strtol(text, &end, 10);
    if (end == text || number < least || number > most || (!rest && *end)) {
        return false;
    }
    *value = (int)number;
    if (rest) {
        *rest = end;
    }
    return true;
}

/* A, A-, or A-B. */
static bool read_frames(const char *text, Options *options, Error *error) {
    const char *rest;
    options->frames_given = true;
    bool good = read_int(text, 0, INT_MAX, &options->first, &rest);
    if (good && *rest == '\0') {
        options->last = options->first;
    } else if (good && strcmp(rest, "-") == 0) {
        options->last = -1;
    } else {
        good = good && *rest == '-' && read_int(rest + 1, 0, INT_MAX, &options->last, NULL) &&
               options->last >= options->first;
    }
    return good || error_set(error, EXIT_USAGE, "--frames %s: expected A, A- or A-B", text);
}

static bool read_size(const char *text, Options *options, Error *error) {
    const char *rest;
    bool good = read_int(text, 16, MOST_PIXELS, &options->width, &rest) && *rest == 'x' &&
                read_int(rest + 1, 16, MOST_PIXELS, &options->height, NULL) &&
                options->width % 2 == 0 && options->height % 2 == 0;
    return good || error_set(error, EXIT_USAGE,
                             "--size %s: expected WIDTHxHEIGHT in pixels, both even, 16 to %d",
                             text, MOST_PIXELS);
}

static bool read_quality(const char *text, Options *options, Error *error) {
    const char *names[8] = {0};
    for (int i = 0; i < quality_count; i++) {
        names[i] = qualities[i].name;
    }
    options->quality = quality_find(text);
    const char *near = text_nearest(text, names);
    return options->quality ||
           error_set(error, EXIT_USAGE, "--quality %s: expected draft, standard or quality%s%s%s",
                     text, near ? "; did you mean '" : "", near ? near : "", near ? "'?" : "");
}

static bool read_patience(const char *text, Options *options, Error *error) {
    int seconds;
    bool good = read_int(text, 0, INT_MAX, &seconds, NULL);
    options->run.patience = good ? seconds : 0;
    return good || error_set(error, EXIT_USAGE, "--patience %s: expected whole seconds", text);
}

static bool read_progress(const char *text, Options *options, Error *error) {
    return progress_parse(text, &options->progress) ||
           error_set(error, EXIT_USAGE, "--progress %s: expected auto, json or none", text);
}

static bool read_format(const char *text, Options *options, Error *error) {
    options->export.format = export_format_find(text, error);
    return options->export.format != NULL;
}

static bool read_up(const char *text, Options *options, Error *error) {
    options->export.up = text[0];
    return ((text[0] == 'y' || text[0] == 'z') && !text[1]) ||
           error_set(error, EXIT_USAGE, "--up %s: expected y or z", text);
}

static bool read_unit(const char *text, Options *options, Error *error) {
    static const struct {
        const char *name;
        double scale;
    } units[] = {{"m", 1.0}, {"cm", 100.0}, {"mm", 1000.0}};
    for (size_t i = 0; i < sizeof units / sizeof *units; i++) {
        if (strcmp(text, units[i].name) == 0) {
            options->export.unit = units[i].name;
            options->export.scale = units[i].scale;
            return true;
        }
    }
    return error_set(error, EXIT_USAGE, "--unit %s: expected m, cm or mm", text);
}

/* A length with or without a unit: 0.09, 9cm, "90 mm". */
static bool read_length(const char *text, double *length, const char **rest) {
    static const struct {
        const char *name;
        double scale;
    } units[] = {{"mm", 1e-3}, {"cm", 1e-2}, {"m", 1.0}, {"", 1.0}};
    char *end;
    double value = strtod(text, &end);
    const char *unit = end + strspn(end, " ");
    for (size_t i = 0; end != text && isfinite(value) && i < sizeof units / sizeof *units; i++) {
        size_t size = strlen(units[i].name);
        if (strncmp(unit, units[i].name, size) == 0) {
            *length = value * units[i].scale;
            *rest = unit + size;
            return true;
        }
    }
    return false;
}

static bool read_disc(const char *text, Options *options, Error *error) {
    const char *rest;
    return (read_length(text, &options->drape.disc, &rest) && !*rest && options->drape.disc > 0) ||
           error_set(error, EXIT_USAGE, "--disc %s: expected a radius like 9cm", text);
}

static bool read_cut(const char *text, Options *options, Error *error) {
    const char *rest;
    return (read_length(text, &options->drape.cut, &rest) && !*rest && options->drape.cut > 0) ||
           error_set(error, EXIT_USAGE, "--cut %s: expected a depth like 20cm", text);
}

static bool read_prominence(const char *text, Options *options, Error *error) {
    const char *rest;
    double *prominence = &options->drape.prominence;
    return (read_length(text, prominence, &rest) && !*rest && *prominence > 0) ||
           error_set(error, EXIT_USAGE, "--prominence %s: expected a length like 3cm", text);
}

static bool read_centre(const char *text, Options *options, Error *error) {
    const char *rest;
    double *centre = options->drape.centre;
    return (read_length(text, &centre[0], &rest) && *rest == ',' &&
            read_length(rest + 1, &centre[1], &rest) && !*rest) ||
           error_set(error, EXIT_USAGE, "--centre %s: expected X,Y like 2cm,0", text);
}

static bool read_camera_height(const char *text, Options *options, Error *error) {
    const char *rest;
    double *height = &options->drape.camera_height;
    return (read_length(text, height, &rest) && !*rest && *height > 0) ||
           error_set(error, EXIT_USAGE, "--camera-height %s: expected a length like 1.2m", text);
}

/* `count` numbers with commas between them. */
static bool read_numbers(const char *text, double *numbers, int count) {
    for (int i = 0; i < count; i++) {
        char *end;
        numbers[i] = strtod(text, &end);
        if (end == text || !isfinite(numbers[i]) || *end != (i + 1 < count ? ',' : '\0')) {
            return false;
        }
        text = end + 1;
    }
    return true;
}

static bool read_photo_disc(const char *text, Options *options, Error *error) {
    double *disc = options->compare.disc;
    return (read_numbers(text, disc, 3) && disc[2] > 0) ||
           error_set(error, EXIT_USAGE, "--photo-disc %s: expected X,Y,DIAMETER in pixels", text);
}

static bool read_photo_scale(const char *text, Options *options, Error *error) {
    double scale;
    bool good = read_numbers(text, &scale, 1) && scale > 0;
    options->compare.scale = good ? 100.0 * scale : NAN;
    return good || error_set(error, EXIT_USAGE, "--photo-scale %s: expected pixels in a cm", text);
}

static bool read_photo_centre(const char *text, Options *options, Error *error) {
    return read_numbers(text, options->compare.centre, 2) ||
           error_set(error, EXIT_USAGE, "--photo-centre %s: expected X,Y in pixels", text);
}

static bool read_fit(const char *text, Options *options, Error *error) {
    options->compare.fit_camera = strcmp(text, "camera") == 0;
    return options->compare.fit_camera ||
           error_set(error, EXIT_USAGE, "--fit %s: expected camera", text);
}

static bool read_point(const char *text, Options *options, Error *error) {
    CompareDef *compare = &options->compare;
    if (compare->point_count == COMPARE_MOST_POINTS) {
        return error_set(error, EXIT_USAGE, "--point: at most %d of them", COMPARE_MOST_POINTS);
    }
    compare->points[compare->point_count++] = text;
    return true;
}

static bool read_print(const char *text, Options *options, Error *error) {
    if (options->print_count == OPTIONS_MOST_PRINTS) {
        return error_set(error, EXIT_USAGE, "--print: at most %d of them", OPTIONS_MOST_PRINTS);
    }
    options->prints[options->print_count++] = text;
    return true;
}

static bool read_range(const char *text, Options *options, Error *error) {
    double range[2];
    bool good = read_numbers(text, range, 2) && range[0] < range[1];
    options->range = good ? (QuantityRange){range[0], range[1]} : options->range;
    return good || error_set(error, EXIT_USAGE,
                             "--range %s: expected LOW,HIGH in the units of the legend", text);
}

static bool read_jobs(const char *text, Options *options, Error *error) {
    return read_int(text, 1, JOBS_MOST, &options->jobs, NULL) ||
           error_set(error, EXIT_USAGE, "--jobs %s: expected 1 to %d processes", text, JOBS_MOST);
}

static bool read_blur(const char *text, Options *options, Error *error) {
    return (read_numbers(text, &options->blur, 1) && options->blur >= 0 && options->blur <= 1) ||
           error_set(error, EXIT_USAGE, "--blur %s: expected a number from 0 to 1", text);
}

static bool read_play(const char *text, Options *options, Error *error) {
    return (read_numbers(text, &options->play, 1) && options->play > 0 && options->play <= 1e5) ||
           error_set(error, EXIT_USAGE, "--play %s: expected frames a second", text);
}

static bool read_threshold(const char *text, Options *options, Error *error) {
    return (read_numbers(text, &options->compare.threshold, 1) && options->compare.threshold > 0) ||
           error_set(error, EXIT_USAGE, "--threshold %s: expected a positive number", text);
}

/* ---- the table; its first row has the short name -o ---- */

typedef enum OptionKind { FLAG, TEXT, WHOLE, READER } OptionKind;

typedef struct OptionRow {
    const char *name;
    const char *value; /* what stands for it in the help; NULL: a flag */
    const char *verbs; /* that take it; NULL: all */
    const char *help;
    OptionKind kind;
    int least;    /* of a whole number */
    size_t field; /* of Options: bool (flag), const char * (text), int (whole) */
    bool (*read)(const char *text, Options *options, Error *error);
} OptionRow;

#define DRAWING "render sheet bench"

static const OptionRow rows[] = {
    {"output", "PATH", "render sheet looks measure export diff compare", "where to write", TEXT, 0,
     FIELD(output), NULL},
    {"frames", "A-B", NULL, "only these frames, from 0; A or A- too", READER, 0, 0, read_frames},
    {"size", "WxH", DRAWING, "[px] even; default: the film's", READER, 0, 0, read_size},
    {"quality", "NAME", DRAWING " looks", "draft, standard, quality", READER, 0, 0, read_quality},
    {"look", "NAME", DRAWING, "of all cloths, instead of their own (see looks)", TEXT, 0,
     FIELD(look), NULL},
    {"camera", "NAME", DRAWING, "one of film: cameras", TEXT, 0, FIELD(camera), NULL},
    {"surface", "KIND", DRAWING, "mesh or splats; default: the film's", TEXT, 0, FIELD(surface),
     NULL},
    {"backdrop", "FILE", DRAWING, "a picture or #rrggbb behind the scene, with its shadows", TEXT,
     0, FIELD(backdrop), NULL},
    {"print", "[CLOTH=]FILE[@W]", DRAWING,
     "a picture printed on cloth, repeated every W metres; the panel's width", READER, 0, 0,
     read_print},
    {"triangles", "N", DRAWING " measure",
     "of the smooth cloth, about (surfels: half); default: as the picture needs", WHOLE, 2000,
     FIELD(triangles), NULL},
    {"blur", "PART", DRAWING, "motion blur: part of a frame with the shutter open, 0 to 1", READER,
     0, 0, read_blur},
    {"play", "RATE", "render", "[1/s] frames a second when shown: slow motion, time-lapse", READER,
     0, 0, read_play},
    {"jobs", "N", "render", "draw in N processes; 1", READER, 0, 0, read_jobs},
    {"every", "N", "render", "draw every N-th frame; 1", WHOLE, 1, FIELD(every), NULL},
    {"title", "TEXT", DRAWING, "written over the picture", TEXT, 0, FIELD(title), NULL},
    {"alpha", NULL, "render", "no backdrop, but alpha (png, exr, prores.mov, webm, apng, gif, mkv)",
     FLAG, 0, FIELD(clear), NULL},
    {"show-time", NULL, DRAWING, "write the time", FLAG, 0, FIELD(show_time), NULL},
    {"show-scale", NULL, DRAWING, "a scale bar (parallel projections)", FLAG, 0, FIELD(show_scale),
     NULL},
    {"range", "LOW,HIGH", DRAWING, "of a measuring look, in the units of its legend; automatic",
     READER, 0, 0, read_range},
    {"follow", NULL, NULL, "wait for frames while the run is still written", FLAG, 0,
     FIELD(run.follow), NULL},
    {"writer", "PID", NULL, "with --follow: the process that writes it", WHOLE, 1,
     FIELD(run.writer), NULL},
    {"patience", "SECONDS", NULL, "with --follow: without a writer, give up after so long; 60",
     READER, 0, 0, read_patience},
    {"count", "N", "sheet", "pictures on a contact sheet; 12", WHOLE, 1, FIELD(count), NULL},
    {"crossings", NULL, "measure",
     "pairs of triangles that cross, exactly, and triangles inside an obstacle", FLAG, 0,
     FIELD(crossings), NULL},
    {"drawn", NULL, "measure", "with --crossings: of the drawn surface, cloth with cloth", FLAG, 0,
     FIELD(drawn), NULL},
    {"gaps", NULL, "measure", "distances of near cloth by triangles and by the smooth surface",
     FLAG, 0, FIELD(gaps), NULL},
    {"cloth", "NAME", "measure compare", "which one; the first", TEXT, 0, FIELD(drape.cloth), NULL},
    {"disc", "RADIUS", "measure compare", "of the support, 9 cm; default: the obstacle's", READER,
     0, 0, read_disc},
    {"cut", "DEPTH", "measure", "where billows are counted, below the support's top; R_s / 4",
     READER, 0, 0, read_cut},
    {"prominence", "LENGTH", "measure", "by which billows stand out; 0.07 R_s", READER, 0, 0,
     read_prominence},
    {"centre", "X,Y", "measure compare", "[m] of the support; default: the obstacle's", READER, 0,
     0, read_centre},
    {"camera-height", "H", "compare", "of the photo's camera above the support, 1.2m", READER, 0, 0,
     read_camera_height},
    {"photo-disc", "X,Y,D", "compare", "[px] middle and diameter of the support in the photo",
     READER, 0, 0, read_photo_disc},
    {"photo-scale", "N", "compare", "[px/cm] with --photo-centre, instead", READER, 0, 0,
     read_photo_scale},
    {"photo-centre", "X,Y", "compare", "[px]", READER, 0, 0, read_photo_centre},
    {"fit", "camera", "compare", "a photo from the side: find its camera from four --point or more",
     READER, 0, 0, read_fit},
    {"point", "NAME=X,Y", "compare",
     "[px] where a box's corner pedestal.+-+ or a place 0.1,0,0.4 [m] is in the photo", READER, 0,
     0, read_point},
    {"mask", "FILE", "compare", "a picture that is white where the cloth is", TEXT, 0,
     FIELD(compare.mask), NULL},
    {"threshold", "T", "compare", "instead of Otsu's", READER, 0, 0, read_threshold},
    {"face-only", NULL, "compare", "do not try the mirror image", FLAG, 0, FIELD(compare.face_only),
     NULL},
    {"csv", NULL, "measure", "a row; with --frames A-B a row a frame", FLAG, 0, FIELD(csv), NULL},
    {"plot", "FILE", "measure", ".svg or .png: contour and harmonics", TEXT, 0, FIELD(plot), NULL},
    {"as", "FORMAT", "export", "obj-pc2, obj-mdd, ply, vtp, gltf, usd", READER, 0, 0, read_format},
    {"up", "AXIS", "export", "z or y; default: what the format wants", READER, 0, 0, read_up},
    {"unit", "UNIT", "export", "m, cm or mm; m (glTF: always m)", READER, 0, 0, read_unit},
    {"keys", "N", "export", "gltf: key shapes, those that are missed most; 60", WHOLE, 2,
     FIELD(export.keys), NULL},
    {"pc2-frames", NULL, "export", "obj-pc2: count start and step in frames (3ds Max)", FLAG, 0,
     FIELD(export.pc2_frames), NULL},
    {"vtp-ascii", NULL, "export", "vtp: numbers as text", FLAG, 0, FIELD(export.vtp_ascii), NULL},
    {"profile", "NAME", "diff", "exact, golden, lossy, look, geometry; golden", TEXT, 0,
     FIELD(profile), NULL},
    {"thresholds", "FILE", "diff", "limits of your own", TEXT, 0, FIELD(thresholds), NULL},
    {"resize", NULL, "diff", "bring B to the size of A", FLAG, 0, FIELD(resize), NULL},
    {"update", NULL, "diff", "accept: copy what differs from B to A", FLAG, 0, FIELD(update), NULL},
    {"threads", "N", NULL, "default: all processors", WHOLE, 1, FIELD(threads), NULL},
    {"force", NULL, NULL, "make it again; overwrite files of others", FLAG, 0, FIELD(force), NULL},
    {"json", NULL, NULL, "results as JSON", FLAG, 0, FIELD(json), NULL},
    {"progress", "KIND", NULL, "auto, json or none", READER, 0, 0, read_progress},
    {"quiet", NULL, NULL, "no notes, no progress", FLAG, 0, FIELD(quiet), NULL},
};
#define ROW_COUNT ((int)(sizeof rows / sizeof *rows))

/* True if `word` is one of the words of a list that are parted by spaces. */
static bool has_word(const char *list, const char *word) {
    size_t length = strlen(word);
    for (const char *at = list; (at = strstr(at, word)) != NULL; at += length) {
        if ((at == list || at[-1] == ' ') && (at[length] == ' ' || !at[length])) {
            return true;
        }
    }
    return false;
}

static void print_help(FILE *out) {
    fprintf(out, "toile-render: draws the runs of toile-sim\n\n");
    for (int i = 0; i < command_count; i++) {
        if (!commands[i].hidden) {
            fprintf(out, "  toile-render %-8s %-24s %s\n", commands[i].name, commands[i].usage,
                    commands[i].about);
        }
    }
    fprintf(out, "\n  RUN                  a run directory, or its " RUN_FILE "\n");
    for (int i = 0; i < ROW_COUNT; i++) {
        const OptionRow *row = &rows[i];
        char name[64];
        snprintf(name, sizeof name, "%s%s%s %s", i == 0 ? "-o, " : "", "--", row->name,
                 row->value ? row->value : "");
        fprintf(out, "  %-20s %s%s%s%s\n", name, row->help, row->verbs ? " (" : "",
                row->verbs ? row->verbs : "", row->verbs ? ")" : "");
    }
    fprintf(out, "  --help --version\n");
}

static const OptionRow *find_row(const char *name, size_t length, Error *error) {
    const char *names[ROW_COUNT + 1];
    char word[64];
    for (int i = 0; i < ROW_COUNT; i++) {
        names[i] = rows[i].name;
        if (strlen(rows[i].name) == length && strncmp(rows[i].name, name, length) == 0) {
            return &rows[i];
        }
    }
    names[ROW_COUNT] = NULL;
    snprintf(word, sizeof word, "%.*s", (int)length, name);
    const char *near = text_nearest(word, names);
    error_set(error, EXIT_USAGE, "no option is called '--%s'%s%s%s", word,
              near ? "; did you mean '--" : "; see toile-render --help", near ? near : "",
              near ? "'?" : "");
    return NULL;
}

static bool set_value(const OptionRow *row, const char *text, Options *options, Error *error) {
    void *field = (char *)options + row->field;
    switch (row->kind) {
    case FLAG:
        *(bool *)field = true;
        return true;
    case TEXT:
        *(const char **)field = text;
        return true;
    case WHOLE:
        return read_int(text, row->least, INT_MAX, field, NULL) ||
               error_set(error, EXIT_USAGE, "--%s %s: expected a whole number from %d", row->name,
                         text, row->least);
    default:
        return row->read(text, options, error);
    }
}

/* Takes the option at arguments[*at], with its value; used: rows that were given. */
static bool read_option(int argc, char **argv, int *at, Options *options, bool *used,
                        Error *error) {
    const char *word = argv[*at], *name = word + 2, *equals = strchr(word, '=');
    const OptionRow *row = NULL;
    if (word[1] == '-') {
        row = find_row(name, equals ? (size_t)(equals - name) : strlen(name), error);
    } else if (word[1] == 'o') {
        row = &rows[0];
        equals = word[2] ? word + 1 : NULL; /* -oFILE */
    } else {
        error_set(error, EXIT_USAGE, "no option is called '%s'; see toile-render --help", word);
    }
    if (!row) {
        return false;
    }
    const char *text = equals ? equals + 1 : NULL;
    if (row->kind == FLAG && text) {
        return error_set(error, EXIT_USAGE, "--%s takes no value", row->name);
    }
    if (row->kind != FLAG && !text) {
        if (*at + 1 >= argc) {
            return error_set(error, EXIT_USAGE, "--%s: expected %s after it", row->name,
                             row->value);
        }
        text = argv[++*at];
    }
    used[row - rows] = true;
    return set_value(row, text, options, error);
}

static const Command *find_command(const char *name, Error *error) {
    const char *names[32] = {0};
    for (int i = 0; i < command_count; i++) {
        if (strcmp(commands[i].name, name) == 0) {
            return &commands[i];
        }
        names[i] = commands[i].name;
    }
    const char *near = text_nearest(name, names);
    error_set(error, EXIT_USAGE, "no verb is called '%s'; %s '%s'", name,
              near ? "did you mean" : "there is for example", near ? near : names[0]);
    return NULL;
}

/* The verb, as many arguments as it takes, and no option of another verb. */
static const Command *choose_command(const char *const *words, int count, const bool *used,
                                     Error *error) {
    const Command *command =
        count > 0 ? find_command(words[0], error)
                  : (error_set(error, EXIT_USAGE, "expected a verb; see --help"), NULL);
    if (!command) {
        return NULL;
    }
    if (count - 1 < command->least || count - 1 > command->most) {
        error_set(error, EXIT_USAGE, "usage: toile-render %s %s", command->name, command->usage);
        return NULL;
    }
    for (int i = 0; i < ROW_COUNT; i++) {
        if (used[i] && rows[i].verbs && !has_word(rows[i].verbs, command->name)) {
            error_set(error, EXIT_USAGE, "%s does not take --%s (it belongs to: %s)", command->name,
                      rows[i].name, rows[i].verbs);
            return NULL;
        }
    }
    return command;
}

ExitCode command_run(int argc, char **argv, Error *error) {
    Options options = options_default();
    const char *words[MOST_ARGUMENTS];
    bool used[ROW_COUNT] = {false}, only_words = false;
    int count = 0;
    for (int i = 1; i < argc; i++) {
        if (only_words || argv[i][0] != '-' || !argv[i][1]) {
            if (count == MOST_ARGUMENTS) {
                error_set(error, EXIT_USAGE, "more than %d arguments", MOST_ARGUMENTS);
                return EXIT_USAGE;
            }
            words[count++] = argv[i];
        } else if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) {
            print_help(stdout);
            return EXIT_OK;
        } else if (strcmp(argv[i], "--version") == 0) {
            printf("toile %s\n", TOILE_VERSION);
            return EXIT_OK;
        } else if (strcmp(argv[i], "--") == 0) {
            only_words = true;
        } else if (!read_option(argc, argv, &i, &options, used, error)) {
            return EXIT_USAGE;
        }
    }
    const Command *command = choose_command(words, count, used, error);
    if (!command) {
        return EXIT_USAGE;
    }
    options.arguments = words + 1;
    options.argument_count = count - 1;
    options.run.path = count > 1 ? words[1] : NULL;
    return command->run(&options, error);
}
