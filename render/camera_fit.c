#include "render/camera_fit.h"

#include <string.h>

/* turn x y z [rad], shift x y z [of the distance], logarithm of the focal length */
#define UNKNOWNS 7
#define AZIMUTHS 12
#define HEIGHTS 5 /* from straight below to straight above */
#define ROUNDS 60
#define PATIENCE 20  /* throws either way along a valley */
#define STALLED 1e-3 /* part by which they improve a camera that has come to its end */
#define STARTS (3 * AZIMUTHS * HEIGHTS)
#define SMALL_STEP 1e-10 /* of the unknowns: the fit has settled */
#define DIFFERENCE 1e-6  /* of the numeric derivatives */
#define SINGULAR 1e-14   /* of the largest eigenvalue: what the points say nothing about */
#define AS_GOOD 2.0      /* times the best miss: another camera that fits as well */
#define SWEEPS 60        /* of Jacobi's rotations, many more than are needed */
#define ON_LINE 1e-3     /* thickness over length of points on a line */
#define SAME_PART 0.25   /* of `unsure`: cameras that differ by less see the same */

/* A trial: rows of the rotation are right, up, forward. */
typedef struct Trial {
    Vec3 axis[3], eye;
    double focal; /* [px] */
    double sum;   /* [px2] of the squared distances; INFINITY: a point lies behind */
} Trial;

typedef struct Problem {
    const CameraPoint *points;
    int count, width, height;
    Vec3 middle;   /* [m] of the points */
    double spread; /* [m] root of their mean square distance from it */
    double lowest; /* [m] z of the lowest point or watched place */
} Problem;

static bool see(const Problem *problem, const Trial *trial, Vec3 place, double out[2]) {
    Vec3 d = vec3_sub(place, trial->eye);
    double depth = vec3_dot(d, trial->axis[2]);
    out[0] = 0.5 * problem->width + trial->focal * vec3_dot(d, trial->axis[0]) / depth;
    out[1] = 0.5 * problem->height - trial->focal * vec3_dot(d, trial->axis[1]) / depth;
    return depth > 1e-6 * problem->spread;
}

/* Distances in the picture, x and y of each point. False: one is behind the camera. */
static bool miss(const Problem *problem, const Trial *trial, double *out) {
    bool good = true;
    for (int i = 0; i < problem->count && good; i++) {
        good = see(problem, trial, problem->points[i].place, out + 2 * i);
        out[2 * i] -= problem->points[i].x;
        out[2 * i + 1] -= problem->points[i].y;
    }
    return good;
}

static void judge(const Problem *problem, Trial *trial) {
    double off[2 * CAMERA_FIT_MOST];
    trial->sum = INFINITY;
    if (miss(problem, trial, off)) {
        trial->sum = 0.0;
        for (int i = 0; i < 2 * problem->count; i++) {
            trial->sum += off[i] * off[i];
        }
    }
}

static double depth_of(const Problem *problem, const Trial *trial) {
    return vec3_dot(vec3_sub(problem->middle, trial->eye), trial->axis[2]);
}

/* A longer focal length goes with a larger distance: the picture keeps its size. */
static Trial step_from(const Problem *problem, const Trial *trial, const double *step) {
    Trial next = *trial;
    Vec3 turn = vec3(step[0], step[1], step[2]);
    Quat q = quat_from_axis_angle(turn, vec3_length(turn));
    double far = vec3_length(vec3_sub(problem->middle, trial->eye));
    for (int k = 0; k < 3; k++) {
        next.axis[k] = quat_rotate(q, trial->axis[k]);
        next.eye = vec3_axpy(next.eye, far * step[3 + k], trial->axis[k]);
    }
    next.focal = trial->focal * exp(step[6]);
    next.eye = vec3_axpy(next.eye, depth_of(problem, trial) * (1.0 - exp(step[6])), trial->axis[2]);
    return next;
}

/* d out / d step of what `place` looks like, by central differences. */
static bool find_slopes(const Problem *problem, const Trial *trial, Vec3 place,
                        double slope[2][UNKNOWNS]) {
    bool good = true;
    for (int k = 0; k < UNKNOWNS; k++) {
        double step[UNKNOWNS] = {0}, more[2], less[2];
        step[k] = DIFFERENCE;
        Trial next = step_from(problem, trial, step);
        good = good && see(problem, &next, place, more);
        step[k] = -DIFFERENCE;
        next = step_from(problem, trial, step);
        good = good && see(problem, &next, place, less);
        for (int j = 0; j < 2 && good; j++) {
            slope[j][k] = (more[j] - less[j]) / (2.0 * DIFFERENCE);
        }
    }
    return good;
}

/* J'J and J'r. */
static bool set_normal(const Problem *problem, const Trial *trial, double m[UNKNOWNS][UNKNOWNS],
                       double *g) {
    double off[2 * CAMERA_FIT_MOST], slope[2][UNKNOWNS];
    memset(m, 0, sizeof(double) * UNKNOWNS * UNKNOWNS);
    memset(g, 0, sizeof(double) * UNKNOWNS);
    bool good = miss(problem, trial, off);
    for (int i = 0; i < problem->count && good; i++) {
        good = find_slopes(problem, trial, problem->points[i].place, slope);
        for (int row = 0; row < 2 * UNKNOWNS && good; row++) {
            int j = row / UNKNOWNS, a = row % UNKNOWNS;
            g[a] += slope[j][a] * off[2 * i + j];
            for (int b = 0; b < UNKNOWNS; b++) {
                m[a][b] += slope[j][a] * slope[j][b];
            }
        }
    }
    return good;
}

/* Eigenvalues on the diagonal of m, vectors in the columns of v [Jacobi 1846]. */
static void diagonalise(double m[UNKNOWNS][UNKNOWNS], double v[UNKNOWNS][UNKNOWNS]) {
    for (int i = 0; i < UNKNOWNS * UNKNOWNS; i++) {
        v[i / UNKNOWNS][i % UNKNOWNS] = i / UNKNOWNS == i % UNKNOWNS;
    }
    for (int turn = 0; turn < SWEEPS * UNKNOWNS * UNKNOWNS; turn++) {
        int p = turn / UNKNOWNS % UNKNOWNS, q = turn % UNKNOWNS;
        if (q <= p || fabs(m[p][q]) <= 1e-300) {
            continue;
        }
        double angle = 0.5 * atan2(2.0 * m[p][q], m[q][q] - m[p][p]), c = cos(angle),
               s = sin(angle);
        for (int k = 0; k < UNKNOWNS; k++) {
            double a = m[k][p], b = m[k][q];
            m[k][p] = c * a - s * b, m[k][q] = s * a + c * b;
        }
        for (int k = 0; k < UNKNOWNS; k++) {
            double a = m[p][k], b = m[q][k];
            m[p][k] = c * a - s * b, m[q][k] = s * a + c * b;
            a = v[k][p], b = v[k][q];
            v[k][p] = c * a - s * b, v[k][q] = s * a + c * b;
        }
    }
}

/* step = -(M + lambda diag M)^-1 g, by Cholesky; false: not positive. */
static bool solve(double given[UNKNOWNS][UNKNOWNS], const double *g, double lambda, double *step) {
    double l[UNKNOWNS][UNKNOWNS] = {{0}};
    for (int i = 0; i < UNKNOWNS; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = given[i][j] + (i == j ? lambda * given[i][i] + 1e-300 : 0.0);
            for (int k = 0; k < j; k++) {
                sum -= l[i][k] * l[j][k];
            }
            if (i == j && !(sum > 0.0)) {
                return false;
            }
            l[i][j] = i == j ? sqrt(sum) : sum / l[j][j];
        }
    }
    for (int i = 0; i < UNKNOWNS; i++) {
        step[i] = -g[i];
        for (int k = 0; k < i; k++) {
            step[i] -= l[i][k] * step[k];
        }
        step[i] /= l[i][i];
    }
    for (int i = UNKNOWNS - 1; i >= 0; i--) {
        for (int k = i + 1; k < UNKNOWNS; k++) {
            step[i] -= l[k][i] * step[k];
        }
        step[i] /= l[i][i];
    }
    return true;
}

static void improve(const Problem *problem, Trial *trial) {
    double m[UNKNOWNS][UNKNOWNS], g[UNKNOWNS], step[UNKNOWNS], lambda = 1e-2;
    bool fresh = false;
    for (int round = 0; round < ROUNDS && isfinite(trial->sum); round++) {
        if (!fresh && !set_normal(problem, trial, m, g)) {
            return;
        }
        fresh = true;
        Trial next = {.sum = INFINITY};
        double longest = 0.0;
        if (solve(m, g, lambda, step)) {
            for (int k = 0; k < UNKNOWNS; k++) {
                longest = fmax(longest, fabs(step[k]));
            }
            if (longest < 1.0) {
                next = step_from(problem, trial, step);
                judge(problem, &next);
            }
        }
        if (next.sum <= trial->sum) {
            *trial = next;
            lambda = fmax(0.1 * lambda, 1e-15);
            fresh = false;
            if (longest < SMALL_STEP) {
                return;
            }
        } else {
            lambda *= 10.0;
        }
    }
}

/* Longer focal lengths from farther away look much the same: a long curved valley, along which the
 * fit is thrown to either side as long as it comes down elsewhere. */
static void settle(const Problem *problem, Trial *trial) {
    static const double throws[] = {-1.4, 1.4, -0.7, 0.7, -0.35, 0.35, -0.15, 0.15};
    double before = INFINITY;
    for (int turn = 0; turn < PATIENCE && trial->sum < (1.0 - STALLED) * before; turn++) {
        before = trial->sum;
        for (size_t i = 0; i < sizeof throws / sizeof *throws; i++) {
            const double step[UNKNOWNS] = {0, 0, 0, 0, 0, 0, throws[i]};
            Trial next = step_from(problem, trial, step);
            judge(problem, &next);
            improve(problem, &next);
            *trial = next.sum < trial->sum ? next : *trial;
        }
    }
}

/* Roll, distance and middle that fit best when depths hardly differ: a similarity of the picture. */
static Trial start_from(const Problem *problem, double azimuth, double height, double focal) {
    Vec3 forward = vec3(-cos(height) * cos(azimuth), -cos(height) * sin(azimuth), -sin(height));
    Vec3 right = vec3(-sin(azimuth), cos(azimuth), 0.0), up = vec3_cross(right, forward);
    double a = 0.0, b = 0.0, size = 0.0, x = 0.0, y = 0.0;
    for (int i = 0; i < problem->count; i++) {
        x += problem->points[i].x / problem->count;
        y -= problem->points[i].y / problem->count;
    }
    for (int i = 0; i < problem->count; i++) {
        Vec3 d = vec3_sub(problem->points[i].place, problem->middle);
        double p = vec3_dot(d, right), q = vec3_dot(d, up);
        double u = problem->points[i].x - x, v = -problem->points[i].y - y;
        a += u * p + v * q, b += v * p - u * q, size += p * p + q * q;
    }
    double scale = hypot(a, b) / fmax(size, 1e-300), c = a / hypot(a, b), s = b / hypot(a, b);
    Trial trial = {.focal = focal, .sum = INFINITY};
    if (!(scale > 0.0)) {
        return trial;
    }
    trial.axis[0] = vec3_axpy(vec3_scale(c, right), -s, up);
    trial.axis[1] = vec3_axpy(vec3_scale(s, right), c, up);
    trial.axis[2] = forward;
    double far = focal / scale, shift_x = (x - 0.5 * problem->width) / scale,
           shift_y = (y + 0.5 * problem->height) / scale;
    trial.eye = vec3_axpy(problem->middle, -far, forward);
    trial.eye = vec3_axpy(vec3_axpy(trial.eye, -shift_x, trial.axis[0]), -shift_y, trial.axis[1]);
    judge(problem, &trial);
    return trial;
}

static Camera camera_of(const Problem *problem, const Trial *trial) {
    double distance = depth_of(problem, trial);
    return (Camera){.perspective = true,
                    .eye = trial->eye,
                    .right = trial->axis[0],
                    .up = trial->axis[1],
                    .forward = trial->axis[2],
                    .target = vec3_axpy(trial->eye, distance, trial->axis[2]),
                    .distance = distance,
                    .half_x = 0.5 * problem->width / trial->focal,
                    .half_y = 0.5 * problem->height / trial->focal};
}

/* [px] largest distance between what two cameras make of the watched places. */
static double differ(const Problem *problem, const Trial *a, const Trial *b, const Vec3 *watched,
                     int count) {
    double most = 0.0, p[2], q[2];
    for (int i = 0; i < count; i++) {
        bool seen = see(problem, a, watched[i], p) && see(problem, b, watched[i], q);
        most = seen ? fmax(most, hypot(p[0] - q[0], p[1] - q[1])) : INFINITY;
    }
    return most;
}

/* Standard deviations, for points off by `pixel`. False: a watched place is behind the camera. */
static bool find_unsure(const Problem *problem, const Trial *trial, const Vec3 *watched, int count,
                        double pixel, CameraFit *fit) {
    double m[UNKNOWNS][UNKNOWNS], v[UNKNOWNS][UNKNOWNS], g[UNKNOWNS], slope[2][UNKNOWNS];
    double most = 0.0, far = vec3_length(vec3_sub(problem->middle, trial->eye));
    double eye = 0.0, focal = 0.0, variance[UNKNOWNS];
    bool good = set_normal(problem, trial, m, g);
    diagonalise(m, v);
    for (int k = 0; k < UNKNOWNS; k++) {
        most = fmax(most, m[k][k]);
    }
    for (int k = 0; k < UNKNOWNS; k++) {
        variance[k] = pixel * pixel / fmax(m[k][k], SINGULAR * most);
        double along = v[5][k] - depth_of(problem, trial) / far * v[6][k];
        eye += variance[k] * (v[3][k] * v[3][k] + v[4][k] * v[4][k] + along * along);
        focal += variance[k] * v[6][k] * v[6][k];
    }
    fit->unsure = 0.0;
    for (int i = 0; i < count && good; i++) {
        good = find_slopes(problem, trial, watched[i], slope);
        double sum = 0.0;
        for (int k = 0; k < 2 * UNKNOWNS && good; k++) {
            double along = 0.0;
            for (int a = 0; a < UNKNOWNS; a++) {
                along += slope[k / UNKNOWNS][a] * v[a][k % UNKNOWNS];
            }
            sum += variance[k % UNKNOWNS] * along * along;
        }
        fit->unsure = fmax(fit->unsure, sqrt(sum));
    }
    fit->eye_unsure = far * sqrt(eye);
    fit->focal_unsure = sqrt(focal);
    return good;
}

/* ---- what is asked of the points ---- */

/* True if the points lie along a line, in space or in the picture. */
static bool on_line(const Vec3 *p, int count) {
    double longest = 0.0, off = 0.0;
    int one = 0, other = 0;
    for (int i = 0; i < count * count; i++) {
        double far = vec3_length(vec3_sub(p[i / count], p[i % count]));
        if (far > longest) {
            longest = far;
            one = i / count;
            other = i % count;
        }
    }
    Vec3 along = vec3_unit(vec3_sub(p[other], p[one]), vec3(1, 0, 0));
    for (int i = 0; i < count; i++) {
        off = fmax(off, vec3_length(vec3_cross(along, vec3_sub(p[i], p[one]))));
    }
    return off <= ON_LINE * longest;
}

static bool check_points(const Problem *problem, Error *error) {
    Vec3 places[CAMERA_FIT_MOST], pixels[CAMERA_FIT_MOST];
    if (problem->count < CAMERA_FIT_LEAST || problem->count > CAMERA_FIT_MOST) {
        return error_set(error, EXIT_BAD_INPUT, "%d points; a camera is found from %d to %d",
                         problem->count, CAMERA_FIT_LEAST, CAMERA_FIT_MOST);
    }
    for (int i = 0; i < problem->count; i++) {
        const CameraPoint *p = &problem->points[i];
        if (!(p->x >= 0 && p->y >= 0 && p->x <= problem->width && p->y <= problem->height)) {
            return error_set(error, EXIT_BAD_INPUT,
                             "point %s: (%g, %g) is outside the picture of %d x %d pixels", p->name,
                             p->x, p->y, problem->width, problem->height);
        }
        places[i] = p->place;
        pixels[i] = vec3(p->x, p->y, 0.0);
    }
    if (on_line(places, problem->count) || on_line(pixels, problem->count)) {
        return error_set(error, EXIT_BAD_INPUT,
                         "the points lie on a line: a camera is found from points all around");
    }
    return true;
}

static void set_worst(const Problem *problem, const Trial *best, CameraFit *fit) {
    double off[2 * CAMERA_FIT_MOST];
    miss(problem, best, off);
    fit->worst_missed = -1.0;
    for (int i = 0; i < problem->count; i++) {
        double far = hypot(off[2 * i], off[2 * i + 1]);
        if (far > fit->worst_missed) {
            fit->worst = i;
            fit->worst_missed = far;
        }
    }
    fit->missed = sqrt(best->sum / problem->count);
}

static bool accept(const Problem *problem, const Trial *best, bool other, const Vec3 *watched,
                   int watched_count, CameraFit *fit, Error *error) {
    double diagonal = hypot(problem->width, problem->height);
    fit->camera = camera_of(problem, best);
    fit->focal = best->focal;
    set_worst(problem, best, fit);
    if (fit->missed > CAMERA_FIT_MISSED * diagonal) {
        return error_set(error, EXIT_BAD_INPUT,
                         "no camera sees the points where they are: %s is %.1f px off, all of them "
                         "%.1f px on average",
                         problem->points[fit->worst].name, fit->worst_missed, fit->missed);
    }
    double pixel = fmax(CAMERA_FIT_PIXEL, fit->missed);
    if (!find_unsure(problem, best, watched, watched_count, pixel, fit) ||
        !(fit->unsure <= CAMERA_FIT_UNSURE * diagonal)) {
        return error_set(error, EXIT_BAD_INPUT,
                         "the points do not tell where the camera is: off by a pixel they move the "
                         "cloth by %.0f px; more points, farther apart and not all in one line",
                         fit->unsure);
    }
    if (other) {
        return error_set(error, EXIT_BAD_INPUT,
                         "two different cameras see the points where they are; one more point");
    }
    return true;
}

/* Number i of the starts: directions of view all around, three focal lengths each. */
static Trial start_number(const Problem *problem, int i) {
    static const double focals[3] = {0.8, 2.0, 6.0}; /* of the longer side */
    double longer = fmax(problem->width, problem->height);
    int direction = i / 3;
    double azimuth = 2.0 * PI * (direction % AZIMUTHS) / AZIMUTHS;
    double height = 0.49 * PI * (2.0 * (direction / AZIMUTHS) / (HEIGHTS - 1) - 1.0);
    return start_from(problem, azimuth, height, focals[i % 3] * longer);
}

static void set_lowest(Problem *problem, const Vec3 *watched, int count) {
    for (int i = 0; i < problem->count; i++) {
        problem->lowest = fmin(problem->lowest, problem->points[i].place.z);
    }
    for (int i = 0; i < count; i++) {
        problem->lowest = fmin(problem->lowest, watched[i].z);
    }
}

/* What is looked at lies in front of the camera, and the camera above the ground. */
static bool is_possible(const Problem *problem, const Trial *trial, const Vec3 *watched,
                        int count) {
    return isfinite(trial->sum) && trial->eye.z >= problem->lowest &&
           isfinite(differ(problem, trial, trial, watched, count));
}

static bool is_better(const Trial *a, const Trial *b) { return a->sum < b->sum; }

/* The best camera; *other: one that sees other things fits as well, or nearly. */
static Trial find_best(const Problem *problem, Trial *trials, const Vec3 *watched, int count,
                       bool *other) {
    double diagonal = hypot(problem->width, problem->height);
    double same = SAME_PART * CAMERA_FIT_UNSURE * diagonal, missed = CAMERA_FIT_MISSED * diagonal;
    Trial best = {.sum = INFINITY};
    for (int i = 0; i < STARTS; i++) {
        trials[i] = start_number(problem, i);
        improve(problem, &trials[i]);
        trials[i].sum = is_possible(problem, &trials[i], watched, count) ? trials[i].sum : INFINITY;
        best = is_better(&trials[i], &best) ? trials[i] : best;
    }
    settle(problem, &best);
    for (int i = 0; i < STARTS; i++) {
        if (trials[i].sum <= missed * missed * problem->count &&
            differ(problem, &trials[i], &best, watched, count) > same) {
            settle(problem, &trials[i]);
            best = is_better(&trials[i], &best) ? trials[i] : best;
        }
    }
    double pixel = fmax(CAMERA_FIT_PIXEL, sqrt(best.sum / problem->count));
    *other = false;
    for (int i = 0; i < STARTS; i++) {
        *other = *other || (trials[i].sum <= AS_GOOD * AS_GOOD * pixel * pixel * problem->count &&
                            is_possible(problem, &trials[i], watched, count) &&
                            differ(problem, &trials[i], &best, watched, count) > same);
    }
    return best;
}

bool camera_fit(const CameraPoint *points, int count, const Vec3 *watched, int watched_count,
                int width, int height, CameraFit *fit, Error *error) {
    Problem problem = {points, count, width, height, {0, 0, 0}, 0.0, INFINITY};
    *fit = (CameraFit){0};
    if (!check_points(&problem, error)) {
        return false;
    }
    for (int i = 0; i < count; i++) {
        problem.middle = vec3_axpy(problem.middle, 1.0 / count, points[i].place);
    }
    for (int i = 0; i < count; i++) {
        Vec3 d = vec3_sub(points[i].place, problem.middle);
        problem.spread += vec3_dot(d, d) / count;
    }
    problem.spread = sqrt(problem.spread);
    set_lowest(&problem, watched, watched_count);
    Trial trials[STARTS];
    bool other;
    Trial best = find_best(&problem, trials, watched, watched_count, &other);
    if (!isfinite(best.sum)) {
        return error_set(error, EXIT_BAD_INPUT, "no camera sees the points where they are");
    }
    return accept(&problem, &best, other, watched, watched_count, fit, error);
}

void camera_see(const Camera *camera, int width, int height, Vec3 place, double out[3]) {
    Vec3 d = vec3_sub(place, camera->eye);
    double depth = vec3_dot(d, camera->forward), w = camera->perspective ? depth : 1.0;
    out[0] = 0.5 * width * (1.0 + vec3_dot(d, camera->right) / (w * camera->half_x));
    out[1] = 0.5 * height * (1.0 - vec3_dot(d, camera->up) / (w * camera->half_y));
    out[2] = depth;
}
