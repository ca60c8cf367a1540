#include "render/compare.h"

#include <math.h>
#include <string.h>

#include "render/drape_parts.h"
#include "render/image_source.h"

#define LONGEST 2400        /* [px] a photograph is measured at no more than this */
#define NEAR_HEIGHT 1.0     /* [m] of a camera, to say what an unknown height may mean */
#define MIRROR_MARGIN 0.005 /* of the correlation: outlines that are their own mirror image stay */
#define PIXELS 300.0        /* of the silhouette of the run, in the radius of the specimen */
#define PASSES 3 /* the rotation tells where the camera is, the camera changes the outline */

CompareDef compare_default(void) {
    return (CompareDef){.drape = drape_default(),
                        .frame = -1,
                        .disc = {NAN, NAN, NAN},
                        .scale = NAN,
                        .centre = {NAN, NAN},
                        .threshold = NAN};
}

void compare_free(Compare *compare) {
    image_free(&compare->image);
    segment_free(&compare->segment);
}

/* ---- the photograph ---- */

static void shrink(Image *image, double factor) {
    int width = (int)lround(image->width / factor), height = (int)lround(image->height / factor);
    Image small = image_create(width, height);
    image_paste_shrunk(&small, image, 0, 0, width, height);
    image_free(image);
    *image = small;
}

bool compare_read_photo(const CompareDef *def, int longest, Image *image, double *shrunk,
                        Image *mask, Error *error) {
    if (!image_read(def->photo, image, error) ||
        (def->mask && !image_read(def->mask, mask, error))) {
        return false;
    }
    if (mask->rgba && (mask->width != image->width || mask->height != image->height)) {
        return error_set(error, EXIT_BAD_INPUT,
                         "%s: the mask has %d x %d pixels, the photograph "
                         "%d x %d",
                         def->mask, mask->width, mask->height, image->width, image->height);
    }
    int side = image->width > image->height ? image->width : image->height;
    *shrunk = side > longest ? (double)side / longest : 1.0;
    if (*shrunk > 1.0) {
        shrink(image, *shrunk);
        if (mask->rgba) {
            shrink(mask, *shrunk);
        }
    }
    return true;
}

/* The support in the photograph: given, or found as a plate of another colour. */
static bool find_scale(const CompareDef *def, Compare *compare, Error *error) {
    SegmentDisc *disc = &compare->disc;
    double radius = compare->drape.support.radius;
    if (isfinite(def->scale) && isfinite(def->centre[0])) {
        *disc = (SegmentDisc){def->centre[0] / compare->shrunk, def->centre[1] / compare->shrunk,
                              def->scale / compare->shrunk * radius, 1.0};
    } else if (isfinite(def->disc[2])) {
        *disc = (SegmentDisc){def->disc[0] / compare->shrunk, def->disc[1] / compare->shrunk,
                              0.5 * def->disc[2] / compare->shrunk, 1.0};
    } else if (!segment_find_disc(&compare->image, &compare->segment, disc)) {
        return error_set(
            error, EXIT_USAGE,
            "%s: no plate stands out on the cloth: --photo-disc X,Y,DIAMETER in pixels "
            "says where the support is",
            def->photo);
    }
    if (disc->ratio > COMPARE_TILTED) {
        return error_set(error, EXIT_BAD_INPUT,
                         "%s: the camera is tilted: the plate is an ellipse with axes 1 : %.3f",
                         def->photo, disc->ratio);
    }
    compare->pixels_per_metre = disc->radius / radius;
    return true;
}

static bool measure_photo(const CompareDef *def, Compare *compare, const Image *mask,
                          Error *error) {
    bool given = isfinite(def->disc[0]), placed = isfinite(def->centre[0]);
    SegmentDef cut = {.threshold = def->threshold, .mask = mask->rgba ? mask : NULL};
    cut.x = given    ? def->disc[0] / compare->shrunk
            : placed ? def->centre[0] / compare->shrunk
                     : 0.5 * compare->image.width;
    cut.y = given    ? def->disc[1] / compare->shrunk
            : placed ? def->centre[1] / compare->shrunk
                     : 0.5 * compare->image.height;
    Error why = {0};
    if (!segment_photo(&compare->image, &cut, &compare->segment, &why)) {
        return error_set(error, why.code, "%s: %s", def->photo, why.text);
    }
    if (!find_scale(def, compare, error)) {
        return false;
    }
    Contour contour =
        segment_trace(&compare->image, &compare->segment, compare->disc.x, compare->disc.y);
    if (contour.missed > 0) {
        return error_set(error, EXIT_BAD_INPUT,
                         "%s: the support at (%.0f, %.0f) is not on the cloth", def->photo,
                         compare->shrunk * compare->disc.x, compare->shrunk * compare->disc.y);
    }
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        compare->photo.r[i] = contour.r[i] / compare->pixels_per_metre;
    }
    return true;
}

/* ---- the run, seen by that camera ---- */

/* Outline of the run from warp on. */
static bool trace_run(DrapeView *view, const DrapeDef *camera, Drape *drape, double *r,
                      Error *error) {
    Coverage coverage;
    if (!drape_view_cover(view, camera, drape->specimen / PIXELS, drape, &coverage)) {
        return error_set(error, EXIT_BAD_INPUT, "the cloth is nowhere near the support");
    }
    Contour contour =
        contour_trace(&coverage, drape->support.centre[0], drape->support.centre[1], drape->warp);
    memcpy(r, contour.r, sizeof contour.r);
    coverage_free(&coverage);
    return contour.missed == 0 ||
           error_set(error, EXIT_BAD_INPUT, "the support is not under the cloth");
}

/* r at an angle in rays, linear between them. */
static double at_ray(const double *r, double ray) {
    double low = floor(ray), part = ray - low;
    int i = ((int)low % CONTOUR_RAYS + CONTOUR_RAYS) % CONTOUR_RAYS;
    return (1.0 - part) * r[i] + part * r[(i + 1) % CONTOUR_RAYS];
}

/* The turn [rays] by which the run, mirrored first if so, fits the photograph best. */
static double correlate(const double *photo, const double *run, bool mirrored, double *best) {
    double sums[CONTOUR_RAYS], means[2] = {0}, squares[2] = {0};
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        means[0] += photo[i] / CONTOUR_RAYS;
        means[1] += run[i] / CONTOUR_RAYS;
    }
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        squares[0] += (photo[i] - means[0]) * (photo[i] - means[0]);
        squares[1] += (run[i] - means[1]) * (run[i] - means[1]);
    }
    int top = 0;
    for (int turn = 0; turn < CONTOUR_RAYS; turn++) {
        sums[turn] = 0.0;
        for (int i = 0; i < CONTOUR_RAYS; i++) {
            int from = mirrored ? turn - i : i - turn;
            sums[turn] +=
                (photo[i] - means[0]) * (run[(from + 2 * CONTOUR_RAYS) % CONTOUR_RAYS] - means[1]);
        }
        top = sums[turn] > sums[top] ? turn : top;
    }
    double before = sums[(top + CONTOUR_RAYS - 1) % CONTOUR_RAYS];
    double after = sums[(top + 1) % CONTOUR_RAYS], bend = before - 2.0 * sums[top] + after;
    double scale = sqrt(squares[0] * squares[1]);
    *best = scale > 0.0 ? sums[top] / scale : 0.0;
    return top + (bend < 0.0 ? 0.5 * (before - after) / bend : 0.0);
}

/* Turns the outline of the run into the photograph; sets rotation and correlations. */
static void align(const CompareDef *def, Compare *compare, const double *run) {
    double fits[2], turns[2];
    for (int m = 0; m < 2; m++) {
        turns[m] = correlate(compare->photo.r, run, m == 1, &fits[m]);
    }
    compare->mirrored = !def->face_only && fits[1] > fits[0] + MIRROR_MARGIN;
    double turn = turns[compare->mirrored];
    compare->correlation = fits[compare->mirrored];
    compare->correlation_other = fits[!compare->mirrored];
    compare->rotation = 2.0 * PI * turn / CONTOUR_RAYS;
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        compare->run.r[i] = at_ray(run, compare->mirrored ? turn - i : i - turn);
    }
}

/* Where the camera is over the run, in its own axes: the middle of the picture. */
static void place_camera(Compare *compare, DrapeDef *def) {
    double x = (0.5 * compare->image.width - compare->disc.x) / compare->pixels_per_metre;
    double y = (compare->disc.y - 0.5 * compare->image.height) / compare->pixels_per_metre;
    double angle = atan2(y, x), far = hypot(x, y);
    double own = compare->mirrored ? compare->rotation - angle : angle - compare->rotation;
    compare->camera_offset[0] = far * cos(own + compare->drape.warp);
    compare->camera_offset[1] = far * sin(own + compare->drape.warp);
    memcpy(def->camera_offset, compare->camera_offset, sizeof def->camera_offset);
}

/* ---- numbers ---- */

static void point_of(const double *r, int i, double p[2]) {
    double angle = 2.0 * PI * i / CONTOUR_RAYS;
    p[0] = r[i % CONTOUR_RAYS] * cos(angle);
    p[1] = r[i % CONTOUR_RAYS] * sin(angle);
}

/* From a point to the closed line of another outline. */
static double distance_to(const double p[2], const double *r) {
    double best = INFINITY, a[2], b[2];
    point_of(r, 0, a);
    for (int i = 1; i <= CONTOUR_RAYS; i++) {
        point_of(r, i, b);
        double dx = b[0] - a[0], dy = b[1] - a[1], length = dx * dx + dy * dy;
        double t = length > 0.0 ? ((p[0] - a[0]) * dx + (p[1] - a[1]) * dy) / length : 0.0;
        t = fmax(0.0, fmin(1.0, t));
        best = fmin(best, hypot(p[0] - a[0] - t * dx, p[1] - a[1] - t * dy));
        memcpy(a, b, sizeof a);
    }
    return best;
}

static void sort(double *values, int count) {
    for (int gap = count / 2; gap > 0; gap /= 2) { /* Shell */
        for (int i = gap; i < count; i++) {
            double value = values[i];
            int j = i;
            for (; j >= gap && values[j - gap] > value; j -= gap) {
                values[j] = values[j - gap];
            }
            values[j] = value;
        }
    }
}

static void measure_distances(Compare *compare) {
    double all[2 * CONTOUR_RAYS], p[2], squares = 0.0, common = 0.0, either = 0.0;
    const double *a = compare->photo.r, *b = compare->run.r;
    compare->mean = 0.0;
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        point_of(a, i, p);
        all[i] = distance_to(p, b);
        point_of(b, i, p);
        all[CONTOUR_RAYS + i] = distance_to(p, a);
        compare->mean += (all[i] + all[CONTOUR_RAYS + i]) / (2 * CONTOUR_RAYS);
        squares += (a[i] - b[i]) * (a[i] - b[i]);
        common += fmin(a[i] * a[i], b[i] * b[i]);
        either += fmax(a[i] * a[i], b[i] * b[i]);
    }
    sort(all, 2 * CONTOUR_RAYS);
    compare->rms = sqrt(squares / CONTOUR_RAYS);
    compare->hausdorff = all[2 * CONTOUR_RAYS - 1];
    compare->hausdorff95 = all[(int)(0.95 * (2 * CONTOUR_RAYS - 1))];
    compare->iou = either > 0.0 ? common / either : 1.0;
}

static double dc_of(const Drape *drape, const double *r) {
    return 100.0 * (contour_area(r) - drape->area_disc) / (drape->area_specimen - drape->area_disc);
}

static void measure_side(const Drape *drape, CompareSide *side) {
    drape_measure_outline(side->r, drape->specimen, &side->harmonics, &side->nodes,
                          &side->nodes_most, &side->nodes_least);
    side->dc = dc_of(drape, side->r);
}

/* Each node to the nearest one of the other side, when there are as many. */
static double match_nodes(const Nodes *a, const Nodes *b) {
    double sum = 0.0;
    for (int i = 0; i < a->count; i++) {
        double best = PI;
        for (int k = 0; k < b->count; k++) {
            double d = a->angle[i] - b->angle[k];
            best = fmin(best, fabs(d - 2.0 * PI * round(d / (2.0 * PI))));
        }
        sum += best;
    }
    return a->count == b->count && a->count > 0 ? sum / a->count : NAN;
}

static bool measure_run(const CompareDef *def, Compare *compare, DrapeView *view, Error *error) {
    DrapeDef camera = def->drape;
    double r[CONTOUR_RAYS] = {0};
    for (int pass = 0; pass < PASSES; pass++) {
        if (pass > 0) {
            place_camera(compare, &camera);
        }
        if (!trace_run(view, &camera, &compare->drape, r, error)) {
            return false;
        }
        align(def, compare, r);
        if (isinf(camera.camera_height)) {
            break;
        }
    }
    camera.camera_height = INFINITY;
    if (!trace_run(view, &camera, &compare->drape, r, error)) {
        return false;
    }
    compare->dc_orthographic = dc_of(&compare->drape, r);
    camera.camera_height = NEAR_HEIGHT;
    if (!trace_run(view, &camera, &compare->drape, r, error)) {
        return false;
    }
    compare->dc_near = dc_of(&compare->drape, r);
    return true;
}

static bool compare_view(const CompareDef *def, Compare *compare, DrapeView *view, Error *error) {
    Image mask = {0};
    if (!isfinite(compare->drape.support.radius)) {
        return error_set(error, EXIT_USAGE, "%s: no support below the cloth; --disc RADIUS",
                         def->run);
    }
    bool good = compare_read_photo(def, LONGEST, &compare->image, &compare->shrunk, &mask, error) &&
                measure_photo(def, compare, &mask, error) && measure_run(def, compare, view, error);
    image_free(&mask);
    if (good) {
        measure_side(&compare->drape, &compare->photo);
        measure_side(&compare->drape, &compare->run);
        measure_distances(compare);
        compare->node_angle = match_nodes(&compare->photo.nodes, &compare->run.nodes);
    }
    return good;
}

static bool compare_all(const CompareDef *def, Compare *compare, Run *run, Arena *arena,
                        Error *error) {
    RunDef run_def = run_default();
    run_def.path = def->run;
    if (!run_open(run, &run_def, error)) {
        return false;
    }
    int count = state_frame_count(run->reader), frame = def->frame < 0 ? count - 1 : def->frame;
    if (frame < 0 || frame >= count) {
        return error_set(error, EXIT_USAGE, "--frames: %s holds %d frames", run->path, count);
    }
    DrapeView *view = drape_view_open(run, &def->drape, frame, arena, &compare->drape, error);
    bool good = view && compare_view(def, compare, view, error);
    drape_view_close(view);
    compare->drape.support.outline = NULL; /* it lives in the arena */
    return good;
}

bool compare_photo(const CompareDef *def, Compare *compare, Error *error) {
    Arena arena = {0};
    Run run = {0};
    *compare = (Compare){.shrunk = 1.0};
    bool good = compare_all(def, compare, &run, &arena, error);
    run_close(&run);
    arena_free(&arena);
    return good;
}
