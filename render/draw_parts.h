/* draw_parts.h: inside of the drawer. */
#ifndef TOILE_RENDER_DRAW_PARTS_H
#define TOILE_RENDER_DRAW_PARTS_H

#include "render/draw.h"

struct Drawer {
    Arena arena, scratch; /* for good; of a frame */
    Run *run;
    DrawDef def;
    Film film;          /* as it is drawn */
    Camera camera;      /* at the start */
    Vec3 middle;        /* [m] of the cloth's nodes in the first frame, for a camera that follows */
    const Look **looks; /* (cloth_count) */
    double *thickness;  /* [m] (cloth_count) */
    QuantityKind *kinds; /* (cloth_count) of measuring looks */
    bool measures, shown_kinds[QUANTITY_COUNT];
    QuantityRange ranges[QUANTITY_COUNT];
    PaintProp *props;    /* (obstacle_count) */
    Image plate;         /* behind the scene, or empty */
    Print *prints;       /* (cloth_count) */
    Image *print_images; /* (print_count) */
    int print_count;
    uint64_t pictures; /* hash of these */
    Painter *painter;  /* NULL until the first frame is drawn */
    Resampler *resampler;
    int layout_index; /* of the resampler; -1 = none */
    int drawn;        /* index of the frame in `image`; -1 = none */
    uint64_t shown;   /* hash of what `image` shows */
    int count;        /* frames drawn so far */
    Image image;
    DrawTimes *times;
};

/* draw_pictures.c: reads what def names. Errors: EXIT_USAGE, EXIT_MISSING_INPUT, EXIT_BAD_INPUT. */
bool draw_read_plate(Drawer *drawer, Error *error);
bool draw_read_prints(Drawer *drawer, Error *error);
uint64_t draw_hash_pictures(const Drawer *drawer);
void draw_free_pictures(Drawer *drawer);

/* The driver is started for the first frame that really has to be drawn. */
bool draw_start_painter(Drawer *drawer, Error *error);

/* The mean of all nodes [m]. */
Vec3 draw_middle(const StateFrame *frame, int node_count);

/* True if the picture depends on velocities: measuring looks and motion blur. */
bool draw_needs_velocities(const Drawer *drawer);

#endif
