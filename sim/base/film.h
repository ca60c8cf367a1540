/* film.h: what a film of a run should look like. Written by the scene reader, carried by the
 * states file, read by the renderer. */
#ifndef TOILE_BASE_FILM_H
#define TOILE_BASE_FILM_H

#include <math.h>
#include <stdbool.h>

#include "sim/base/vec.h"

typedef enum CameraKind { CAMERA_AUTO, CAMERA_PERSPECTIVE, CAMERA_ORTHOGRAPHIC } CameraKind;

/* Where the camera is at one time; between two it goes along a smooth curve. */
typedef struct FilmKey {
    double time;      /* [s] */
    Vec3 eye, target; /* [m] */
    double fov;       /* [rad] */
} FilmKey;

#define FILM_MOST_KEYS 16
typedef struct FilmMove {
    double orbit;                  /* [rad] turn about the upright line through the target; 0 */
    double orbit_begin, orbit_end; /* [s] starts and stops gently */
    bool follow;                   /* go along with the middle of the cloth */
    int key_count;                 /* 0, or at least 2; then eye, target and fov are not used */
    FilmKey keys[FILM_MOST_KEYS];  /* times increase */
} FilmMove;

/* Another camera of the same scene. */
#define FILM_NAME_SIZE 32
#define FILM_MOST_VIEWS 8
typedef struct FilmView {
    char name[FILM_NAME_SIZE];
    CameraKind camera;
    Vec3 eye, target, up;      /* [m] as in Film */
    double fov, pixels_per_mm; /* [rad], [px/mm] likewise */
    FilmMove move;
} FilmView;

/* The look that shows contact forces: only runs of scenes that name it hold them. */
#define FILM_LOOK_CONTACT "contact-force"

typedef enum FilmSurface { FILM_MESH, FILM_SPLATS } FilmSurface;
#define FILM_TITLE_SIZE 128

/* A picture that a scene names. */
#define FILM_PATH_SIZE 512
typedef struct FilmPicture {
    char name[FILM_PATH_SIZE]; /* as the scene has it; not in the states */
    char path[FILM_PATH_SIZE]; /* absolute; or #rrggbb; "": none */
    double width;              /* [m] of a repeat on cloth; 0 = the panel's */
} FilmPicture;

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
    FilmMove move;        /* of the camera; none */
    FilmSurface surface;  /* how cloth is drawn; mesh */
    double range[2];      /* of measuring looks, in the units of their legend; equal: automatic */
    double blur;          /* part of a frame for which the shutter is open, 0..1; 0 */
    int blur_samples;     /* pictures that are averaged for it; 8 */
    double play;          /* [1/s] frames a second when it is shown; 0 = rate */
    bool show_time, show_scale;  /* write time, a scale bar; false */
    char title[FILM_TITLE_SIZE]; /* written over the picture; "" */
    FilmPicture backdrop;        /* in place of the studio; none */
    int view_count;
    FilmView views[FILM_MOST_VIEWS];
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
                  .floor_height = NAN,
                  .blur_samples = 8};
}

/* Makes one of its other cameras the camera. */
static inline void film_use_view(Film *film, const FilmView *view) {
    film->camera = view->camera;
    film->eye = view->eye;
    film->target = view->target;
    film->up = view->up;
    film->fov = view->fov;
    film->pixels_per_mm = view->pixels_per_mm;
    film->move = view->move;
}

#endif
