/* Metrics, profiles and thresholds files. */
#include <ctype.h>
#include <errno.h>
#include <fnmatch.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "render/diff.h"
#include "sim/base/text.h"

const DiffMetric diff_metrics[DIFF_METRIC_COUNT] = {
    {"largest", "largest difference of a channel, of 255", "", 1, false},
    {"share", "pixels with a channel that differs by more than `step` of 255", "%", 100, false},
    {"mean", "largest mean signed difference of a channel, of 255", "", 1, false},
    {"psnr", "signal to noise of red, green, blue", "dB", 1, true},
    {"ssim", "structural similarity of luma, 11 x 11 Gaussian", "", 1, true},
    {"ssim8", "the same as ffmpeg's filter has it, 8 x 8 blocks of red, green, blue", "", 1, true},
    {"flip", "what an eye sees when the pictures are flipped, 0 to 1", "", 1, false},
    {"iou", "silhouettes: common part over both, by alpha", "", 1, true},
    {"moved", "largest distance of a vertex", "mm", 1000, false},
    {"relative", "the same over the diagonal of the cloth at rest", "%", 100, false},
    {"drape", "drape coefficients at the end of the runs: their difference in points", "", 1,
     false},
    {"nodes", "folds at the end of the runs: how many more or fewer", "", 1, false},
    {"outline", "outlines at the end of the runs: Hausdorff distance over the specimen's radius",
     "%", 100, false},
    {"deep", "largest difference of a channel at full depth: 16-bit PNG of 1, EXR as it stands", "",
     1, false},
};

#define NO NAN

const DiffProfile diff_profiles[] = {
    {"exact",
     "the same bits: same machine and build, any number of threads",
     {{0, NO, NO, NO, NO, NO, NO, NO, 0, NO, NO, NO, NO, 0}, IMAGE_STEP}},
    {"golden",
     "a stored result on another processor",
     {{NO, IMAGE_GATE_SHARE, IMAGE_GATE_MEAN, IMAGE_GATE_PSNR, IMAGE_GATE_SSIM, NO, NO, NO, 1e-9,
       NO, NO, NO, NO, NO},
      IMAGE_STEP}},
    {"lossy",
     "a decoded video against its pictures",
     {{NO, NO, NO, 38, 0.97, NO, NO, NO, 1e-6, NO, NO, NO, NO, NO}, IMAGE_STEP}},
    {"look",
     "another density, other samples a pixel, another model",
     {{NO, NO, NO, NO, 0.95, NO, NO, 0.99, NO, 1e-3, NO, NO, NO, NO}, IMAGE_STEP}},
    {"geometry",
     "runs of other models or meshes: the drape at the end, not each vertex",
     {{NO, NO, NO, NO, NO, NO, NO, NO, NO, NO, 0.5, 0, 0.01, NO}, IMAGE_STEP}},
};
const int diff_profile_count = sizeof diff_profiles / sizeof diff_profiles[0];

const DiffProfile *diff_profile_find(const char *name, Error *error) {
    const char *names[8] = {0};
    for (int i = 0; i < diff_profile_count; i++) {
        names[i] = diff_profiles[i].name;
        if (strcmp(name, names[i]) == 0) {
            return &diff_profiles[i];
        }
    }
    const char *near = text_nearest(name, names);
    error_set(error, EXIT_USAGE,
              "profile '%s': expected exact, golden, lossy, look or geometry%s%s%s", name,
              near ? "; did you mean '" : "", near ? near : "", near ? "'?" : "");
    return NULL;
}

DiffRules diff_rules_of(const DiffProfile *profile) {
    DiffRules rules = {.gate = profile->gate};
    snprintf(rules.profile, sizeof rules.profile, "%s", profile->name);
    return rules;
}

static DiffGate empty_gate(void) {
    DiffGate gate = {.step = NAN};
    for (int i = 0; i < DIFF_METRIC_COUNT; i++) {
        gate.limit[i] = NAN;
    }
    return gate;
}

DiffGate diff_rules_gate(const DiffRules *rules, const char *name) {
    DiffGate gate = rules->gate;
    for (int s = 0; s < rules->section_count; s++) {
        const DiffGate *own = &rules->sections[s].gate;
        if (fnmatch(rules->sections[s].pattern, name, 0) != 0) {
            continue;
        }
        gate.step = isnan(own->step) ? gate.step : own->step;
        for (int i = 0; i < DIFF_METRIC_COUNT; i++) {
            gate.limit[i] = isnan(own->limit[i]) ? gate.limit[i] : own->limit[i];
        }
    }
    return gate;
}

/* ---- a thresholds file ---- */

typedef struct Lines {
    const char *path;
    int line;
    DiffRules *rules;
    DiffGate *gate; /* of the section */
} Lines;

static char *trim(char *text) {
    text += strspn(text, " \t\r\n");
    size_t length = strlen(text);
    while (length > 0 && isspace((unsigned char)text[length - 1])) {
        text[--length] = '\0';
    }
    return text;
}

/* A number with the unit of its metric, or without: then as it is stored. */
static bool read_limit(const Lines *lines, const DiffMetric *metric, const char *text,
                       double *limit, Error *error) {
    if (strcmp(text, "off") == 0) {
        *limit = metric->at_least ? -INFINITY : INFINITY;
        return true;
    }
    char *end;
    double value = strtod(text, &end);
    const char *unit = end + strspn(end, " \t");
    bool printed = *unit && strcmp(unit, metric->unit) == 0;
    bool metres = *unit && strcmp(metric->unit, "mm") == 0 && strcmp(unit, "m") == 0;
    if (end == text || !isfinite(value) || value < 0 || (*unit && !printed && !metres)) {
        return error_set(error, EXIT_BAD_INPUT, "%s:%d: '%s' of %s: expected a number%s%s, or off",
                         lines->path, lines->line, text, metric->name,
                         metric->unit[0] ? ", alone or in " : "", metric->unit);
    }
    *limit = printed ? value / metric->scale : value;
    return true;
}

static bool read_entry(Lines *lines, char *key, char *value, Error *error) {
    const char *names[DIFF_METRIC_COUNT + 3] = {"profile", "step"};
    if (strcmp(key, "profile") == 0) {
        if (lines->gate != &lines->rules->gate) {
            return error_set(error, EXIT_BAD_INPUT, "%s:%d: profile belongs before all sections",
                             lines->path, lines->line);
        }
        Error why = {0};
        const DiffProfile *profile = diff_profile_find(value, &why);
        if (!profile) {
            return error_set(error, EXIT_BAD_INPUT, "%s:%d: %s", lines->path, lines->line,
                             why.text);
        }
        *lines->rules = diff_rules_of(profile);
        return true;
    }
    if (strcmp(key, "step") == 0) {
        DiffMetric step = {"step", "", "", 1, false};
        return read_limit(lines, &step, value, &lines->gate->step, error);
    }
    for (int i = 0; i < DIFF_METRIC_COUNT; i++) {
        names[2 + i] = diff_metrics[i].name;
        if (strcmp(key, diff_metrics[i].name) == 0) {
            return read_limit(lines, &diff_metrics[i], value, &lines->gate->limit[i], error);
        }
    }
    const char *near = text_nearest(key, names);
    return error_set(error, EXIT_BAD_INPUT, "%s:%d: '%.40s' is no threshold%s%s%s", lines->path,
                     lines->line, key, near ? "; did you mean '" : "", near ? near : "",
                     near ? "'?" : "");
}

static bool read_section(Lines *lines, char *name, Error *error) {
    size_t length = strlen(name);
    DiffRules *rules = lines->rules;
    if (length < 3 || name[length - 1] != ']' || length > sizeof rules->sections[0].pattern ||
        rules->section_count == DIFF_MOST_SECTIONS) {
        return error_set(error, EXIT_BAD_INPUT,
                         "%s:%d: expected [PATTERN], short, and at most %d of them", lines->path,
                         lines->line, DIFF_MOST_SECTIONS);
    }
    int at = rules->section_count++;
    snprintf(rules->sections[at].pattern, sizeof rules->sections[at].pattern, "%.*s",
             (int)length - 2, name + 1);
    rules->sections[at].gate = empty_gate();
    lines->gate = &rules->sections[at].gate;
    return true;
}

static bool read_line(Lines *lines, char *text, Error *error) {
    char *comment = strchr(text, '#');
    if (comment) {
        *comment = '\0';
    }
    text = trim(text);
    if (!*text) {
        return true;
    }
    if (*text == '[') {
        return read_section(lines, text, error);
    }
    char *colon = strchr(text, ':');
    if (!colon) {
        return error_set(error, EXIT_BAD_INPUT, "%s:%d: expected NAME: LIMIT, found '%.40s'",
                         lines->path, lines->line, text);
    }
    *colon = '\0';
    return read_entry(lines, trim(text), trim(colon + 1), error);
}

bool diff_rules_read(const char *path, DiffRules *rules, Error *error) {
    FILE *file = fopen(path, "rb");
    if (!file) {
        return error_set_errno(error, errno == ENOENT ? EXIT_MISSING_INPUT : EXIT_IO, "%s", path);
    }
    Lines lines = {path, 0, rules, &rules->gate};
    char text[1024];
    bool good = true;
    while (good && fgets(text, sizeof text, file)) {
        lines.line++;
        if (!strchr(text, '\n') && !feof(file)) {
            good =
                error_set(error, EXIT_BAD_INPUT, "%s:%d: the line is too long", path, lines.line);
        } else {
            good = read_line(&lines, text, error);
        }
    }
    good = good && (!ferror(file) || error_set_errno(error, EXIT_IO, "%s", path));
    fclose(file);
    return good;
}
