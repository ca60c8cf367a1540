/* look.h: what cloths and obstacles look like. Tables of constant structs: a new look is an
 * entry in look_table.c. Colours are linear albedos. Sources: assets/looks/README.md.
 */
#ifndef TOILE_RENDER_LOOK_H
#define TOILE_RENDER_LOOK_H

#include <stdbool.h>
#include <stdint.h>

#include "render/quantity.h"
#include "sim/base/error.h"

/* weave.glsl knows them by these numbers. */
typedef enum WeaveKind {
    WEAVE_PLAIN,
    WEAVE_TWILL,  /* 2/2 */
    WEAVE_SATIN,  /* 5-harness */
    WEAVE_PILE,   /* fibres without a direction: velvet, felt */
    WEAVE_DENIM,  /* 3/1 twill */
    WEAVE_PANAMA, /* 2/2 hopsack: pairs of threads in plain weave */
    WEAVE_KNIT    /* plain jersey: wales along u, courses along v */
} WeaveKind;

/* Colours that come back along one direction of threads. */
typedef struct Bands {
    float repeat;    /* [m]; 0: none */
    float second[2]; /* begin, end of the second colour, parts of the repeat */
    float third[2];
} Bands;

typedef struct Look {
    const char *name, *about;
    float warp[3], weft[3]; /* albedo of the threads along u, along v */
    float ends, picks;      /* [1/m] threads along u counted across v; along v across u */
    WeaveKind weave;
    float reach; /* [threads] smallest visible feature: 1 plain, 1.3 twill, 2.2 satin */
    float bump;  /* 0..1 relief of the threads */
    float sheen[3], roughness; /* light of loose fibres (Charlie), its alpha 0.2..0.9 */
    float specular, shininess; /* highlights of the threads (Kajiya-Kay) */
    float transmission;        /* part of the light that comes through */
    float streaks;             /* unevenness of the yarn, seen from afar; 0..0.3 */
    float back;                /* brightness of the back side; 1 = as the face */
    /* albedos on the back of a double cloth; 0: the same threads */
    float back_warp[3], back_weft[3];
    Bands warp_bands, weft_bands; /* of warp threads, counted across v; of weft threads */
    float second[3], third[3];    /* albedos of the bands */
    float hem;                    /* [m] width of the hem at all borders; 0: none */
    float selvedge;               /* [m] width of the border along the warp, instead of a hem */
    float seam[3];                /* albedo of the stitches and of the line in the selvedge */
    float thickness;  /* [m] of the fabric that ends and picks belong to; 0: they are fixed */
    float stripe[3];  /* albedo of woven border stripes */
    float stripes[4]; /* begin, end, begin, end from the edge, in shorter panel sides */
    /* part that threads cover, seen straight on; 0: all, light never passes between them */
    float cover;
    QuantityKind quantity; /* a measuring look: colours stand for numbers, threads are not drawn */
} Look;

typedef struct PropLook {
    const char *name, *about;
    float base[3], roughness;
    float second[3], grain; /* second colour of the surface and how strong it is */
    float metal;            /* 0 or 1 */
    float wood;             /* 1: rings and fibres; 0: speckle */
    float grain_size;       /* [m] */
} PropLook;

extern const Look looks[];
extern const int look_count;
extern const PropLook prop_looks[];
extern const int prop_look_count;

/* By name. Unknown names are the states file's fault: EXIT_BAD_INPUT, with the nearest name. */
const Look *look_find(const char *name, Error *error);
const PropLook *prop_look_find(const char *name, Error *error);

/* Of all numbers of a look. */
uint64_t look_hash(const Look *look);
uint64_t prop_look_hash(const PropLook *look);

/* std140 twins of the blocks in cloth.frag.glsl and prop.frag.glsl. */
typedef struct ClothBlock {
    float warp[4], weft[4], stripe[4], stripes[4], sheen[4], thread[4], panel[4], yarn[4];
    float back_warp[4], back_weft[4], second[4], third[4], warp_bands[4], weft_bands[4];
    float border[4], seam[4];
} ClothBlock;

/* std140 twin of the block in measured.frag.glsl. */
typedef struct MeasuredBlock {
    float range[4], colors[COLORMAP_STEPS + 1][4];
} MeasuredBlock;

typedef struct PropBlock {
    float base[4], second[4], surface[4];
} PropBlock;

/* The panel that a look is put on. */
typedef struct LookPanel {
    double width, height; /* [m] */
    double thickness;     /* [m] of its fabric; 0: unknown */
    bool around;     /* u is closed: the thread count becomes whole, the u edges have no stripes */
    bool rectangle;  /* no: no stripes along borders, no hem */
    double print[2]; /* [m] of a repeat of a printed picture; 0: none */
} LookPanel;

ClothBlock look_cloth_block(const Look *look, const LookPanel *panel);

/* Lines of #define for cloth.frag.glsl: a program has only what its look needs. */
#define LOOK_DEFINES_SIZE 160
void look_cloth_defines(const Look *look, char text[LOOK_DEFINES_SIZE]);
MeasuredBlock look_measured_block(const Look *look, QuantityRange range);
PropBlock look_prop_block(const PropLook *look);

#endif
