/* film.h: what a film of a run should look like. Written by the scene reader, carried by the
 * states file, read by the renderer. */
#ifndef TOILE_BASE_FILM_H
#define TOILE_BASE_FILM_H

#include <math.h>
#include <stdbool.h>

#include "sim/base/vec.h"

typedef enum CameraKind { CAMERA_AUTO, CAMERA_PERSPECTIVE, CAMERA_ORTHOGRAPHIC } CameraKind;

typedef struct Film {
    double rate;          /* [1/s] frames a second; 30 */
    int frame_count;      /* frames in the whole film, the one at t = 0 included */
    int width, height;    /* [px] even; 1280, 720 */
    CameraKind camera;    /* auto frames the whole motion, looking along target - eye */
    Vec3 eye, target, up; /* [m] eye (1, -2, 0.9), target 0, up z */
    double fov;           /* [rad] vertical field of view; 0.5 */
    double pixels_per_mm; /* [px/mm] orthographic scale; 0 = as large as fits */
    bool floor;           /* draw a floor and its backdrop; true */
    double floor_height;  /* [m] z of the floor; NAN = just under the lowest point of the film */
} Film;

static inline Film film_default(void) {
    return (Film){.rate = 30.0,
                  .frame_count = 1,
                  .width = 1280,
                  .height = 720,
                  .camera = CAMERA_AUTO,
                  .eye = {1.0, -2.0, 0.9},
                  .up = {0.0, 0.0, 1.0},
                  .fov = 0.5,
                  .floor = true,
                  .floor_height = NAN};
}

#endif
