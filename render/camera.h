/* camera.h: where a film is seen from.
 *
 * A camera is a pure function of the film and, for `auto` or an unset floor, of the bounds of
 * the whole motion: a frame never depends on when it was drawn, or on which frames were.
 */
#ifndef TOILE_RENDER_CAMERA_H
#define TOILE_RENDER_CAMERA_H

#include <stdbool.h>

#include "render/mat4.h"
#include "sim/base/film.h"

typedef struct Camera {
    bool perspective;
    Vec3 eye;                /* [m] */
    Vec3 right, up, forward; /* unit; forward is the direction of the view */
    Vec3 target;             /* [m] the middle of the picture, at `distance` */
    double distance;         /* [m] from the eye to the target, along the view */
    double half_x, half_y;   /* tangents of half the angles (perspective) or half extents [m] */
    double near, far;        /* [m] depths along the view that are drawn */
    double scale;            /* [m] half the height of the view at the target */
    double floor_height;     /* [m] */
} Camera;

/* What the automatic choices need: for a direction of view, how far the motion reaches. */
typedef struct CameraReach {
    Vec3 right, up, forward;  /* the basis that the numbers refer to */
    double tan_x, tan_y;      /* perspective: tangents of half the angles */
    double left, right_most;  /* max of -p.right - tan_x p.forward, p.right - tan_x p.forward */
    double below, above;      /* the same with p.up and tan_y */
    double nearest, farthest; /* [m] range of p.forward */
    double lowest;            /* [m] smallest z */
    bool empty;
} CameraReach;

/* True if the film's camera or floor depends on the whole motion. floor_known: an obstacle gives
 * the height of the floor. */
bool camera_needs_reach(const Film *film, bool floor_known);

/* An empty reach for this film and picture size. */
CameraReach camera_reach_start(const Film *film, int width, int height);
void camera_reach_add(CameraReach *reach, Vec3 p);

/* floor: [m], or NAN to use the film's or the lowest point. reach may be NULL if it is not
 * needed. */
Camera camera_create(const Film *film, int width, int height, const CameraReach *reach,
                     double floor);

/* True if pictures of different times are seen differently. */
bool camera_moves(const Film *film);

/* The camera at a time [s]: along its keys, round its orbit, and shifted by `moved` [m] when it follows.
 * start: camera_create of the same film. */
Camera camera_at(const Film *film, const Camera *start, double time, Vec3 moved);

/* World -> clip coordinates. */
Mat4 camera_clip(const Camera *camera);
/* Its inverse. */
Mat4 camera_unclip(const Camera *camera);

/* [px/m] scale of a picture of this height, at the target. */
double camera_pixels_per_metre(const Camera *camera, int height);

#endif
