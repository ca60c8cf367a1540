#include "render/look.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/base/text.h"

#define WEAVE_REPEAT 20.0 /* [threads] divisible by the repeats of plain, twill and satin */
#define MOST_LOOKS 64
#define DENSITY_MOST                                                                               \
    2.5 /* times more or fewer threads than the look says: a fabric of another kind */

static bool unknown(const char *what, const char *name, const char **names, Error *error) {
    const char *near = text_nearest(name, names);
    return error_set(error, EXIT_BAD_INPUT, "no %s look is called '%s'; %s '%s'", what, name,
                     near ? "did you mean" : "there is for example", near ? near : names[0]);
}

const Look *look_find(const char *name, Error *error) {
    const char *names[MOST_LOOKS] = {0};
    for (int i = 0; i < look_count; i++) {
        if (strcmp(looks[i].name, name) == 0) {
            return &looks[i];
        }
        names[i] = looks[i].name;
    }
    unknown("cloth", name, names, error);
    return NULL;
}

const PropLook *prop_look_find(const char *name, Error *error) {
    const char *names[MOST_LOOKS] = {0};
    for (int i = 0; i < prop_look_count; i++) {
        if (strcmp(prop_looks[i].name, name) == 0) {
            return &prop_looks[i];
        }
        names[i] = prop_looks[i].name;
    }
    unknown("obstacle", name, names, error);
    return NULL;
}

uint64_t look_hash(const Look *look) {
    return hash_bytes(look->warp, sizeof *look - offsetof(Look, warp));
}

uint64_t prop_look_hash(const PropLook *look) {
    return hash_bytes(look->base, sizeof *look - offsetof(PropLook, base));
}

static void set(float out[4], const float rgb[3], float w) {
    memcpy(out, rgb, 3 * sizeof *rgb);
    out[3] = w;
}

/* A density that fits a whole number of weave repeats on the panel: no seam, no half thread. */
static float fit_density(float density, double size) {
    double repeats = fmax(round(density * size / WEAVE_REPEAT), 1.0);
    return (float)(repeats * WEAVE_REPEAT / size);
}

/* Thinner fabric of a kind has thinner, hence more threads. */
static float density_scale(const Look *look, double thickness) {
    if (look->thickness <= 0.0f || !(thickness > 0.0)) {
        return 1.0f;
    }
    double scale = (double)look->thickness / thickness;
    return (float)fmin(fmax(scale, 1.0 / DENSITY_MOST), DENSITY_MOST);
}

/* Bands as the shader wants them: begins and ends; a repeat that fits into the panel. */
static float set_bands(float out[4], const Bands *bands, double size, bool around) {
    out[0] = bands->second[0], out[1] = bands->second[1];
    out[2] = bands->third[0], out[3] = bands->third[1];
    double count = fmax(round(size / (double)bands->repeat), 1.0);
    return bands->repeat <= 0.0f ? 0.0f : around ? (float)(size / count) : bands->repeat;
}

ClothBlock look_cloth_block(const Look *look, const LookPanel *panel) {
    double width = panel->width, height = panel->height;
    float side = (float)(panel->around ? height : fmin(width, height));
    float scale = density_scale(look, panel->thickness);
    ClothBlock block = {
        .thread = {look->specular, look->shininess, look->transmission, look->bump},
        .panel = {(float)width, (float)height, (float)look->weave, look->reach},
        .yarn = {look->streaks, look->back,
                 panel->print[0] > 0.0 ? (float)(1.0 / panel->print[0]) : 0.0f,
                 panel->print[1] > 0.0 ? (float)(1.0 / panel->print[1]) : 0.0f},
        .border = {panel->rectangle ? look->hem : 0.0f, panel->rectangle ? look->selvedge : 0.0f,
                   look->cover},
    };
    set(block.warp, look->warp, fit_density(look->ends * scale, height));
    set(block.weft, look->weft, fit_density(look->picks * scale, width));
    set(block.stripe, look->stripe, panel->around ? 0.0f : 1.0f);
    set(block.sheen, look->sheen, look->roughness);
    set(block.back_warp, look->back_warp, 0.0f);
    set(block.back_weft, look->back_weft, 0.0f);
    set(block.second, look->second, set_bands(block.warp_bands, &look->warp_bands, height, false));
    set(block.third, look->third,
        set_bands(block.weft_bands, &look->weft_bands, width, panel->around));
    set(block.seam, look->seam, 0.0f);
    for (int i = 0; i < 4; i++) {
        block.stripes[i] = panel->rectangle ? look->stripes[i] * side : (float)INFINITY;
    }
    return block;
}

void look_cloth_defines(const Look *look, char text[LOOK_DEFINES_SIZE]) {
    bool double_cloth = look->back_warp[0] > 0.0f || look->back_weft[0] > 0.0f;
    bool banded = look->warp_bands.repeat > 0.0f || look->weft_bands.repeat > 0.0f;
    if (look->quantity != QUANTITY_NONE) {
        snprintf(text, LOOK_DEFINES_SIZE, "#define MEASURED\n");
        return;
    }
    snprintf(text, LOOK_DEFINES_SIZE, "#define WEAVE %d\n%s%s%s%s", (int)look->weave,
             double_cloth ? "#define DOUBLE_CLOTH\n" : "", banded ? "#define BANDED\n" : "",
             look->hem > 0.0f || look->selvedge > 0.0f ? "#define BORDERED\n" : "",
             look->cover > 0.0f ? "#define VEIL\n" : "");
}

MeasuredBlock look_measured_block(const Look *look, QuantityRange range) {
    MeasuredBlock block = {.range = {(float)range.low, (float)(1.0 / (range.high - range.low))}};
    colormap_fill(quantities[look->quantity].map, block.colors);
    return block;
}

PropBlock look_prop_block(const PropLook *look) {
    PropBlock block = {.surface = {look->metal, look->wood, look->grain_size}};
    set(block.base, look->base, look->roughness);
    set(block.second, look->second, look->grain);
    return block;
}
