#include "render/look.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/base/text.h"

#define COUNT(array) ((int)(sizeof(array) / sizeof(array)[0]))
#define WEAVE_REPEAT 20.0 /* [threads] divisible by the repeats of plain, twill and satin */
#define MOST_LOOKS 64

const Look looks[] = {
    {.name = "teal-twill",
     .about = "coarse 2/2 wool twill, gold border stripes",
     .warp = {.020f, .085f, .120f},
     .weft = {.032f, .125f, .160f},
     .ends = 900,
     .picks = 900,
     .weave = WEAVE_TWILL,
     .reach = 1.3f,
     .bump = .60f,
     .sheen = {.05f, .075f, .085f},
     .roughness = .50f,
     .specular = .05f,
     .shininess = 22,
     .transmission = .05f,
     .streaks = .06f,
     .back = 1,
     .stripe = {.74f, .60f, .36f},
     .stripes = {.100f, .145f, .160f, .174f}},
    {.name = "linen",
     .about = "raw linen, plain weave of uneven yarn, blue band",
     .warp = {.60f, .53f, .43f},
     .weft = {.66f, .60f, .51f},
     .ends = 1100,
     .picks = 1000,
     .weave = WEAVE_PLAIN,
     .reach = 1,
     .bump = .60f,
     .sheen = {.05f, .05f, .045f},
     .roughness = .60f,
     .specular = .03f,
     .shininess = 14,
     .transmission = .25f,
     .streaks = .16f,
     .back = 1,
     .stripe = {.13f, .17f, .27f},
     .stripes = {.11f, .19f, 2, 2}},
    {.name = "cotton",
     .about = "white cotton percale",
     .warp = {.76f, .75f, .72f},
     .weft = {.78f, .77f, .75f},
     .ends = 3200,
     .picks = 2800,
     .weave = WEAVE_PLAIN,
     .reach = 1,
     .bump = .45f,
     .sheen = {.04f, .04f, .04f},
     .roughness = .60f,
     .specular = .03f,
     .shininess = 16,
     .transmission = .22f,
     .streaks = .04f,
     .back = 1,
     .stripes = {2, 2, 2, 2}},
    {.name = "wool",
     .about = "grey worsted suiting, 2/2 twill, lighter weft",
     .warp = {.060f, .062f, .070f},
     .weft = {.160f, .158f, .160f},
     .ends = 2400,
     .picks = 2200,
     .weave = WEAVE_TWILL,
     .reach = 1.3f,
     .bump = .50f,
     .sheen = {.07f, .07f, .075f},
     .roughness = .55f,
     .specular = .03f,
     .shininess = 18,
     .transmission = .02f,
     .streaks = .10f,
     .back = 1,
     .stripes = {2, 2, 2, 2}},
    {.name = "velvet",
     .about = "red velvet: no threads, strong sheen",
     .warp = {.115f, .004f, .012f},
     .weft = {.095f, .004f, .010f},
     .ends = 2500,
     .picks = 2500,
     .weave = WEAVE_PILE,
     .reach = 1,
     .bump = .25f,
     .sheen = {.42f, .06f, .085f},
     .roughness = .30f,
     .shininess = 1,
     .streaks = .03f,
     .back = .7f,
     .stripes = {2, 2, 2, 2}},
    {.name = "satin",
     .about = "champagne silk satin, 5-harness",
     .warp = {.52f, .27f, .16f},
     .weft = {.62f, .38f, .25f},
     .ends = 6000,
     .picks = 4000,
     .weave = WEAVE_SATIN,
     .reach = 2.2f,
     .bump = .12f,
     .sheen = {.03f, .025f, .02f},
     .roughness = .50f,
     .specular = .55f,
     .shininess = 64,
     .transmission = .10f,
     .streaks = .02f,
     .back = .8f,
     .stripes = {2, 2, 2, 2}},
    {.name = "denim",
     .about = "indigo denim: blue warp, pale weft, 3/1 twill",
     .warp = {.022f, .045f, .130f},
     .weft = {.30f, .30f, .29f},
     .ends = 2600,
     .picks = 1800,
     .weave = WEAVE_DENIM,
     .reach = 1.3f,
     .bump = .60f,
     .sheen = {.03f, .035f, .045f},
     .roughness = .60f,
     .specular = .02f,
     .shininess = 14,
     .transmission = .01f,
     .streaks = .26f,
     .back = 1,
     .stripes = {2, 2, 2, 2}},
    {.name = "felt",
     .about = "moss green felt",
     .warp = {.095f, .130f, .040f},
     .weft = {.095f, .130f, .040f},
     .ends = 1000,
     .picks = 1000,
     .weave = WEAVE_PILE,
     .reach = 1,
     .bump = .2f,
     .sheen = {.10f, .11f, .07f},
     .roughness = .65f,
     .shininess = 1,
     .streaks = .12f,
     .back = 1,
     .stripes = {2, 2, 2, 2}},
    {.name = "strain-warp", .about = "stretch along the warp", .quantity = QUANTITY_STRAIN_WARP},
    {.name = "strain-weft", .about = "stretch along the weft", .quantity = QUANTITY_STRAIN_WEFT},
    {.name = "shear",
     .about = "angle between warp and weft less 90\302\260",
     .quantity = QUANTITY_SHEAR},
    {.name = "curvature",
     .about = "mean curvature, positive towards the face",
     .quantity = QUANTITY_CURVATURE},
    {.name = "speed", .about = "speed", .quantity = QUANTITY_SPEED},
};
const int look_count = COUNT(looks);

const PropLook prop_looks[] = {
    {"clay", "unglazed clay", {.36f, .245f, .175f}, .70f, {.28f, .18f, .125f}, .35f, 0, 0, .012f},
    {"wood", "oiled walnut", {.20f, .090f, .038f}, .42f, {.085f, .034f, .014f}, .85f, 0, 1, .020f},
    {"metal", "brushed steel", {.56f, .55f, .53f}, .34f, {.48f, .47f, .46f}, .30f, 1, 0, .004f},
    {"brass", "polished brass", {.78f, .54f, .22f}, .26f, {.66f, .44f, .18f}, .25f, 1, 0, .010f},
    {"plaster", "white plaster", {.70f, .69f, .66f}, .80f, {.60f, .59f, .56f}, .25f, 0, 0, .015f},
    {"skin", "soft tailor's dummy", {.52f, .32f, .23f}, .52f, {.46f, .26f, .19f}, .3f, 0, 0, .02f},
    {"slate", "dark slate", {.055f, .058f, .064f}, .55f, {.035f, .037f, .041f}, .5f, 0, 0, .02f},
};
const int prop_look_count = COUNT(prop_looks);

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

ClothBlock look_cloth_block(const Look *look, double width, double height, bool around,
                            bool striped) {
    float side = (float)(around ? height : fmin(width, height));
    ClothBlock block = {
        .thread = {look->specular, look->shininess, look->transmission, look->bump},
        .panel = {(float)width, (float)height, (float)look->weave, look->reach},
        .yarn = {look->streaks, look->back},
    };
    set(block.warp, look->warp, fit_density(look->ends, height));
    set(block.weft, look->weft, fit_density(look->picks, width));
    set(block.stripe, look->stripe, around ? 0.0f : 1.0f);
    set(block.sheen, look->sheen, look->roughness);
    for (int i = 0; i < 4; i++) {
        block.stripes[i] = striped ? look->stripes[i] * side : (float)INFINITY;
    }
    return block;
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
