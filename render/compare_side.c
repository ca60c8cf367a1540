#include "render/compare_side.h"

#include <stdlib.h>
#include <string.h>

#include "render/image_source.h"
#include "render/solid_mesh.h"
#include "sim/base/text.h"

#define LONGEST 1600        /* [px] a photograph is measured at no more than this */
#define TRIANGLES 200000    /* of the cloths */
#define WATCHED 8           /* corners of the box around the cloth */
#define MOST_OBSTACLES 1024 /* that are named in a message */

void compare_from_side_free(CompareFromSide *compare) {
    image_free(&compare->image);
    segment_free(&compare->segment);
    free(compare->photo);
    free(compare->run);
}

/* ---- points ---- */

static bool read_place(const char *text, Vec3 *place) {
    double p[3];
    for (int k = 0; k < 3; k++) {
        char *end;
        p[k] = strtod(text, &end);
        if (end == text || !isfinite(p[k]) || *end != (k < 2 ? ',' : '\0')) {
            return false;
        }
        text = end + 1;
    }
    *place = vec3_load(p);
    return true;
}

/* A place of an obstacle in its own frame. */
static bool find_mark(const StateObstacle *obstacle, const char *mark, Vec3 *place) {
    const Solid *solid = &obstacle->solid;
    bool box = solid->kind == SOLID_BOX && !obstacle->mesh, axis = !obstacle->mesh && !box;
    if (strcmp(mark, "middle") == 0) {
        *place = vec3(0, 0, 0);
        return true;
    }
    if (axis && (strcmp(mark, "start") == 0 || strcmp(mark, "end") == 0)) {
        *place = vec3(0, 0, mark[0] == 's' ? -solid->half.z : solid->half.z);
        return true;
    }
    if (!box || strlen(mark) != 3 || strspn(mark, "+-") != 3) {
        return false;
    }
    *place = vec3(mark[0] == '+' ? solid->half.x : -solid->half.x,
                  mark[1] == '+' ? solid->half.y : -solid->half.y,
                  mark[2] == '+' ? solid->half.z : -solid->half.z);
    return true;
}

bool compare_find_place(const StateHeader *header, const StateFrame *frame, const char *name,
                        Vec3 *place, Error *error) {
    const char *names[MOST_OBSTACLES + 1] = {0}, *dot = strrchr(name, '.');
    size_t length = dot ? (size_t)(dot - name) : strlen(name);
    if (read_place(name, place)) {
        return true;
    }
    for (int i = 0; i < header->obstacle_count; i++) {
        const StateObstacle *obstacle = &header->obstacles[i];
        if (i < MOST_OBSTACLES) {
            names[i] = obstacle->name;
        }
        if (strlen(obstacle->name) != length || strncmp(obstacle->name, name, length) != 0) {
            continue;
        }
        if (dot && find_mark(obstacle, dot + 1, place)) {
            *place = pose_apply(frame->pose[i], *place);
            return true;
        }
        return error_set(error, EXIT_USAGE,
                         "point %s: expected %s.middle%s, or a place X,Y,Z in metres", name,
                         obstacle->name,
                         obstacle->mesh                      ? ""
                         : obstacle->solid.kind == SOLID_BOX ? " or a corner like .+-+"
                                                             : ", .start or .end");
    }
    char word[64];
    snprintf(word, sizeof word, "%.*s", (int)length, name);
    const char *near = text_nearest(word, names);
    return error_set(error, EXIT_USAGE, "point %s: no obstacle is called '%s'%s%s%s", name, word,
                     near ? "; did you mean '" : "", near ? near : "", near ? "'?" : "");
}

/* NAME=X,Y */
static bool read_point(const StateHeader *header, const StateFrame *frame, const char *text,
                       CameraPoint *point, Error *error) {
    const char *equals = strrchr(text, '=');
    char *comma = NULL, *end = NULL;
    *point = (CameraPoint){0};
    if (equals && (size_t)(equals - text) < sizeof point->name) {
        snprintf(point->name, sizeof point->name, "%.*s", (int)(equals - text), text);
        point->x = strtod(equals + 1, &comma);
        point->y = comma && *comma == ',' ? strtod(comma + 1, &end) : NAN;
    }
    if (!end || end == comma + 1 || *end || comma == equals + 1 || !isfinite(point->x) ||
        !isfinite(point->y)) {
        return error_set(error, EXIT_USAGE, "--point %s: expected NAME=X,Y in pixels", text);
    }
    return compare_find_place(header, frame, point->name, &point->place, error);
}

/* ---- the run ---- */

typedef struct Scene {
    const StateHeader *header;
    StateFrame frame;
    StateLayout layout;
    Arena arena;
    Resampler *resampler;
    const Surface *surface;
} Scene;

static void find_box(const Scene *scene, Vec3 corners[WATCHED]) {
    const float *low = scene->surface->low, *high = scene->surface->high;
    for (int i = 0; i < WATCHED; i++) {
        corners[i] = vec3((double)(i & 1 ? high[0] : low[0]), (double)(i & 2 ? high[1] : low[1]),
                          (double)(i & 4 ? high[2] : low[2]));
    }
}

static bool read_scene(Run *run, const CompareDef *def, CompareFromSide *compare, Scene *scene,
                       Error *error) {
    RunDef run_def = run_default();
    int layout_index, count;
    run_def.path = def->run;
    if (!run_open(run, &run_def, error)) {
        return false;
    }
    count = state_frame_count(run->reader);
    compare->frame = def->frame < 0 ? count - 1 : def->frame;
    if (compare->frame < 0 || compare->frame >= count) {
        return error_set(error, EXIT_USAGE, "--frames: %s holds %d frames", run->path, count);
    }
    scene->header = state_header(run->reader);
    if (!state_read_frame(run->reader, compare->frame, &scene->frame, &scene->layout, &layout_index,
                          error)) {
        return false;
    }
    compare->point_count = def->point_count;
    for (int i = 0; i < def->point_count; i++) {
        if (!read_point(scene->header, &scene->frame, def->points[i], &compare->points[i], error)) {
            return false;
        }
    }
    ResampleDef resample = {.pixels_per_metre = 1e5, .triangle_cap = TRIANGLES};
    scene->resampler = resample_create(&scene->layout, &resample);
    scene->surface = resample_frame(scene->resampler, &scene->layout, scene->frame.x);
    return true;
}

static void add_cloth(SideView *view, const Scene *scene, int cloth, bool wanted) {
    const SurfacePart *part = &scene->surface->parts[cloth];
    const uint32_t *corner = scene->surface->fine + 3 * (size_t)part->fine_begin;
    for (int t = 0; t < part->fine_count; t++, corner += 3) {
        Vec3 p[3];
        for (int k = 0; k < 3; k++) {
            const float *at = scene->surface->vertices[corner[k]].position;
            p[k] = vec3((double)at[0], (double)at[1], (double)at[2]);
        }
        side_view_add(view, p, wanted);
    }
}

static void add_obstacle(SideView *view, Scene *scene, int number) {
    const StateObstacle *obstacle = &scene->header->obstacles[number];
    if (!obstacle->mesh && obstacle->solid.kind == SOLID_PLANE) {
        return; /* nothing is seen through a floor */
    }
    ArenaMark mark = arena_mark(&scene->arena);
    SolidMesh mesh =
        obstacle->mesh
            ? solid_mesh_from_triangles(obstacle->mesh,
                                        state_mesh_vertices(scene->header, &scene->frame, number),
                                        &scene->arena)
            : solid_mesh_create(&obstacle->solid, 1.0, &scene->arena);
    for (int t = 0; t < mesh.triangle_count; t++) {
        Vec3 p[3];
        for (int k = 0; k < 3; k++) {
            const float *at = mesh.vertices[mesh.triangles[3 * t + k]].position;
            p[k] = pose_apply(scene->frame.pose[number],
                              vec3((double)at[0], (double)at[1], (double)at[2]));
        }
        side_view_add(view, p, false);
    }
    arena_rewind(&scene->arena, mark);
}

/* What the camera sees of the cloth (all of them, unless one is named). */
static bool cover_run(const CompareDef *def, CompareFromSide *compare, Scene *scene, Error *error) {
    SideView view =
        side_view_create(&compare->fit.camera, compare->image.width, compare->image.height);
    bool known = !def->drape.cloth;
    for (int i = 0; i < scene->header->cloth_count; i++) {
        bool wanted =
            !def->drape.cloth || strcmp(scene->header->cloths[i].name, def->drape.cloth) == 0;
        known = known || wanted;
        add_cloth(&view, scene, i, wanted);
    }
    for (int i = 0; i < scene->header->obstacle_count; i++) {
        add_obstacle(&view, scene, i);
    }
    bool behind = view.behind;
    compare->run = side_view_cover(&view, &compare->depth);
    compare->pixel = compare->depth / compare->fit.focal;
    side_view_free(&view);
    if (!known) {
        return error_set(error, EXIT_USAGE, "--cloth %s: no cloth is called so", def->drape.cloth);
    }
    return (!behind && isfinite(compare->depth)) ||
           error_set(error, EXIT_BAD_INPUT, "the camera of the photograph %s",
                     behind ? "stands in the middle of the scene" : "sees no cloth of the run");
}

/* ---- the photograph ---- */

/* The camera, in pixels of the picture that is measured. */
static bool find_camera(CompareFromSide *compare, const Scene *scene, Error *error) {
    CameraPoint points[CAMERA_FIT_MOST];
    Vec3 watched[WATCHED];
    int count = compare->point_count;
    for (int i = 0; i < count && i < CAMERA_FIT_MOST; i++) {
        points[i] = compare->points[i];
        points[i].x /= compare->shrunk, points[i].y /= compare->shrunk;
    }
    find_box(scene, watched);
    if (!camera_fit(points, count, watched, WATCHED, compare->image.width, compare->image.height,
                    &compare->fit, error)) {
        return false;
    }
    Film *film = &compare->film;
    const Camera *camera = &compare->fit.camera;
    *film = scene->header->film;
    film->camera = CAMERA_PERSPECTIVE;
    film->move = (FilmMove){0};
    film->eye = camera->eye;
    film->target = camera->target;
    film->up = camera->up;
    film->fov = 2.0 * atan(camera->half_y);
    return true;
}

/* A pixel in the middle of what the run covers: there the photograph has cloth too. */
static void find_seed(const CompareFromSide *compare, SegmentDef *cut) {
    double sum = 0.0, x = 0.0, y = 0.0, best = INFINITY;
    int width = compare->image.width;
    size_t count = (size_t)width * (size_t)compare->image.height;
    for (size_t i = 0; i < count; i++) {
        double part = (double)compare->run[i];
        sum += part;
        x += part * (double)(i % (size_t)width);
        y += part * (double)(i / (size_t)width);
    }
    for (size_t i = 0; i < count; i++) { /* covered wholly, nearest to the middle */
        double dx = (double)(i % (size_t)width) - x / sum,
               dy = (double)(i / (size_t)width) - y / sum;
        if (compare->run[i] > 0.99f && dx * dx + dy * dy < best) {
            best = dx * dx + dy * dy;
            cut->x = (double)(i % (size_t)width);
            cut->y = (double)(i / (size_t)width);
        }
    }
}

static bool cover_photo(const CompareDef *def, CompareFromSide *compare, const Image *mask,
                        Error *error) {
    SegmentDef cut = {.threshold = def->threshold, .mask = mask->rgba ? mask : NULL};
    Error why = {0};
    find_seed(compare, &cut);
    bool good = cut.mask
                    ? segment_photo(&compare->image, &cut, &compare->segment, &why)
                    : side_cut_photo(&compare->image, compare->run, &cut, &compare->segment, &why);
    if (!good) {
        return error_set(error, why.code, "%s: %s", def->photo, why.text);
    }
    compare->photo = side_photo_cover(&compare->image, &compare->segment);
    return true;
}

static bool compare_all(const CompareDef *def, CompareFromSide *compare, Run *run, Scene *scene,
                        Image *mask, Error *error) {
    if (!read_scene(run, def, compare, scene, error)) {
        return false;
    }
    ASSERT(scene->header && scene->surface);
    return compare_read_photo(def, LONGEST, &compare->image, &compare->shrunk, mask, error) &&
           find_camera(compare, scene, error) && cover_run(def, compare, scene, error) &&
           cover_photo(def, compare, mask, error) &&
           (side_compare(compare->photo, compare->run, compare->image.width, compare->image.height,
                         &compare->numbers) ||
            error_set(error, EXIT_BAD_INPUT, "%s: no cloth is seen", def->photo));
}

bool compare_from_side(const CompareDef *def, CompareFromSide *compare, Error *error) {
    Run run = {0};
    Scene scene = {0};
    Image mask = {0};
    *compare = (CompareFromSide){.shrunk = 1.0};
    bool good = compare_all(def, compare, &run, &scene, &mask, error);
    resample_destroy(scene.resampler);
    arena_free(&scene.arena);
    image_free(&mask);
    run_close(&run);
    return good;
}
