/* camera_fit.h: where a photograph was taken from, by points whose place in the scene is known.
 *
 * A pinhole with square pixels and its axis through the middle of the picture: seven unknowns (eye,
 * orientation, focal length), so four points that are not on a line at least. The sum of squared
 * distances in the picture is made least [Levenberg 1944; Marquardt 1963] from starts all around the
 * points; for each direction of view the roll, the distance and the middle that fit best under weak
 * perspective are known in closed form.
 *
 * From far away a thing and its mirror image in depth look the same, the one from above, the other from
 * below: cameras lower than all points are left out.
 *
 * How sure the fit is is told by the picture: the covariance of the seven numbers, for points that are
 * CAMERA_FIT_PIXEL off (or as far as they miss), says by how much the places that are watched may lie
 * elsewhere. Points on a line, or too near to each other, leave that undecided and are refused.
 */
#ifndef TOILE_RENDER_CAMERA_FIT_H
#define TOILE_RENDER_CAMERA_FIT_H

#include "render/camera.h"
#include "sim/base/error.h"

#define CAMERA_FIT_LEAST 4
#define CAMERA_FIT_MOST 64
#define CAMERA_FIT_PIXEL 1.0   /* [px] by which a point given by hand is off */
#define CAMERA_FIT_UNSURE 0.02 /* of the picture's diagonal: a place may be so uncertain */
/* of the diagonal: points that miss by more do not belong together */
#define CAMERA_FIT_MISSED 0.008

typedef struct CameraPoint {
    char name[64];
    Vec3 place;  /* [m] in the scene */
    double x, y; /* [px] in the picture, from its upper left corner */
} CameraPoint;

typedef struct CameraFit {
    Camera camera;
    double focal;        /* [px] */
    double missed;       /* [px] root of the mean square of the points' distances */
    int worst;           /* the point that is missed most */
    double worst_missed; /* [px] */
    double unsure;       /* [px] standard deviation of the most uncertain watched place */
    double eye_unsure;   /* [m] standard deviation of the eye along its most uncertain axis */
    double focal_unsure; /* part of the focal length */
} CameraFit;

/* watched: [m] (watched_count) places that matter, in front of the camera; width, height: [px].
 * Errors: EXIT_BAD_INPUT: too few, outside the picture, on a line, not seen by any one camera, or seen by two. */
bool camera_fit(const CameraPoint *points, int count, const Vec3 *watched, int watched_count,
                int width, int height, CameraFit *fit, Error *error);

/* Where a camera sees a place: [px] from the upper left corner, and the depth [m] along the view. */
void camera_see(const Camera *camera, int width, int height, Vec3 place, double out[3]);

#endif
