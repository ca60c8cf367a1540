/* diff.h: whether two results are the same, and where they are not.
 *
 * A comparison has items (pairs of files), an item has rows (pairs of frames), a row has metrics. A
 * gate is a limit on some of them. Pictures are compared as 8-bit sRGB, premultiplied with alpha.
 * States are compared by the positions of their surface vertices.
 */
#ifndef TOILE_RENDER_DIFF_H
#define TOILE_RENDER_DIFF_H

#include "render/file.h"
#include "render/image.h"
#include "sim/base/arena.h"

typedef enum DiffMetricKind {
    DIFF_LARGEST,  /* of 255, any channel */
    DIFF_SHARE,    /* of pixels with a channel that differs by more than `step` */
    DIFF_MEAN,     /* of 255, largest |mean signed difference| of a channel */
    DIFF_PSNR,     /* [dB] */
    DIFF_SSIM,     /* luma, 11 x 11 Gaussian */
    DIFF_BLOCKS,   /* SSIM as ffmpeg's filter has it */
    DIFF_FLIP,     /* mean */
    DIFF_IOU,      /* of the silhouettes, where the pictures have alpha */
    DIFF_MOVED,    /* [m] largest distance of a vertex */
    DIFF_RELATIVE, /* the same over the diagonal of the scene's cloth at rest */
    DIFF_DRAPE,    /* [points] difference of the drape coefficients at the end */
    DIFF_NODES,    /* difference of the numbers of folds */
    DIFF_OUTLINE,  /* Hausdorff distance of the outlines over the radius of the specimen */
    DIFF_DEEP, /* largest difference at the depth of the files: 16-bit PNG 0..1, EXR as it stands */
    DIFF_METRIC_COUNT
} DiffMetricKind;

typedef struct DiffMetric {
    const char *name, *about;
    const char *unit; /* in which it is printed and may be given; "" */
    double scale;     /* printed = scale * value */
    bool at_least;    /* the gate is a lower limit */
} DiffMetric;

extern const DiffMetric diff_metrics[DIFF_METRIC_COUNT];

typedef struct DiffGate {
    double limit[DIFF_METRIC_COUNT]; /* NAN: not asked for */
    double step;                     /* of 255, for DIFF_SHARE; NAN: inherited */
} DiffGate;

typedef struct DiffProfile {
    const char *name, *about;
    DiffGate gate;
} DiffProfile;

extern const DiffProfile diff_profiles[];
extern const int diff_profile_count;
const DiffProfile *diff_profile_find(const char *name, Error *error); /* EXIT_USAGE */

/* A gate, and others for items whose names match a pattern of the shell. */
#define DIFF_MOST_SECTIONS 64
typedef struct DiffRules {
    char profile[32];
    DiffGate gate;
    int section_count;
    struct {
        char pattern[128];
        DiffGate gate;
    } sections[DIFF_MOST_SECTIONS];
} DiffRules;

DiffRules diff_rules_of(const DiffProfile *profile);

/* Reads a thresholds file on top of rules:
 *     # comment
 *     profile: golden
 *     psnr: 45 dB          names and units of diff_metrics; `step`; `off` takes a limit away
 *     [hero*.png]          from here on only for items of such names
 *     share: 1 %
 * Errors: EXIT_BAD_INPUT with file and line, EXIT_MISSING_INPUT. */
bool diff_rules_read(const char *path, DiffRules *rules, Error *error);
DiffGate diff_rules_gate(const DiffRules *rules, const char *name);

/* ---- what is compared ---- */

typedef enum DiffItemKind { DIFF_PICTURES, DIFF_STATES, DIFF_BYTES } DiffItemKind;

typedef struct DiffItem {
    DiffItemKind kind;
    char name[FILE_PATH_SIZE]; /* below the folders; of a single pair: of b */
    char a[FILE_PATH_SIZE], b[FILE_PATH_SIZE];
    bool only_a, only_b; /* the other one is missing */
    /* results */
    int row_begin, row_count, failed;
    char trouble[512];      /* why it could not be compared, "" if it could */
    ExitCode code;          /* of the trouble */
    int worst;              /* row, -1: none */
    Image worst_a, worst_b; /* its pictures, kept for the worst items only */
} DiffItem;

typedef struct DiffRow {
    int item, frame;                 /* from 0 */
    double value[DIFF_METRIC_COUNT]; /* NAN: does not apply */
    double mean_signed[3];           /* of 255 */
    bool failed;
    char why[160]; /* "share 0.41 % > 0.2 % (golden)" */
} DiffRow;

typedef struct DiffDef {
    const char *a, *b;
    DiffRules rules;
    bool resize; /* b is brought to the size of a */
} DiffDef;

typedef struct Diff {
    DiffDef def;
    Arena arena;
    int item_count, row_count, row_room, failed_items;
    DiffItem *items;
    DiffRow *rows;  /* (row_count) item by item */
    int worst_item; /* -1: nothing failed */
} Diff;

/* Finds the pairs. Errors: EXIT_MISSING_INPUT, EXIT_BAD_INPUT. */
bool diff_find_items(Diff *diff, Error *error);

/* Compares all of them; `go_on` is asked after each row.
 * Trouble of single items goes into them. Errors: EXIT_INTERRUPTED. */
bool diff_compare(Diff *diff, bool (*go_on)(void *context, const DiffRow *row), void *context,
                  Error *error);
void diff_free(Diff *diff);

/* For the files of diff: compares two runs, row by row. */
void diff_compare_states(Diff *diff, DiffItem *item);
/* A new last row of an item, all metrics NAN; valid until the next one. */
DiffRow *diff_add_row(Diff *diff, DiffItem *item, int frame);
/* Sets `failed` and `why` by the gate of the item. */
void diff_judge_row(const Diff *diff, const DiffItem *item, DiffRow *row);

/* 0 same, 1 differs, or the code of the worst trouble. */
ExitCode diff_verdict(const Diff *diff);

/* ---- reports ---- */

void diff_print_table(const Diff *diff, FILE *out);
void diff_print_json(const Diff *diff, FILE *out);
void diff_print_junit(const Diff *diff, FILE *out);
/* A page without any other file: verdict, table, and a slider over each pair that is kept. */
void diff_print_page(const Diff *diff, FILE *out);
/* a, b and the heat of their difference, side by side. */
Image diff_strip(const Image *a, const Image *b);
/* diff.json, junit.xml, diff.html, and of the worst frame difference.png and side-by-side.png. */
bool diff_write_reports(const Diff *diff, const char *folder, Error *error);

#endif
