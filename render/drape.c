/* The support, the surface and the silhouette of a drape, and the numbers that come from them. */
#include "render/drape.h"

#include <math.h>
#include <string.h>

#include "render/drape_parts.h"
#include "render/resample.h"
#include "sim/base/text.h"

#define PIXELS 600.0     /* of a silhouette, in R_s */
#define CELL_PIXELS 1.75 /* as resample.c has it */
#define CELL 4.0         /* [px of the silhouette] edge of a triangle, at most about */
#define MOST_TRIANGLES 500000
#define DISC_CORNERS 720
#define UPRIGHT 0.999
#define MOST_REACH 20.0 /* of R_s: cloth that is further off hangs on something else */
#define REACH                                                                                      \
    1.15 /* of R_s: half the side of the picture; cloth that slid off may lie further out */

DrapeDef drape_default(void) {
    return (DrapeDef){.disc = NAN,
                      .centre = {NAN, NAN},
                      .camera_height = INFINITY,
                      .cut = NAN,
                      .prominence = NAN};
}

static bool find_cloth(const StateHeader *header, const char *name, int *cloth, Error *error) {
    const char *names[64] = {0};
    *cloth = 0;
    for (int i = 0; name && i < header->cloth_count; i++) {
        if (i < 63) {
            names[i] = header->cloths[i].name;
        }
        if (strcmp(header->cloths[i].name, name) == 0) {
            *cloth = i;
            return true;
        }
    }
    if (!name && header->cloth_count > 0) {
        return true;
    }
    const char *near = name ? text_nearest(name, names) : NULL;
    return error_set(error, EXIT_USAGE, "--cloth %s: no cloth is called so%s%s%s", name ? name : "",
                     near ? "; did you mean '" : "", near ? near : "", near ? "'?" : "");
}

/* ---- the support ---- */

static void set_disc(DrapeSupport *support, double radius, Arena *arena) {
    support->radius = radius;
    support->count = DISC_CORNERS;
    support->outline = arena_push(arena, double, 2 * DISC_CORNERS);
    /* the polygon has the area of the disc */
    double corner = 2.0 * PI / DISC_CORNERS, r = radius * sqrt(corner / sin(corner));
    for (int i = 0; i < DISC_CORNERS; i++) {
        support->outline[2 * i] = support->centre[0] + r * cos(corner * i);
        support->outline[2 * i + 1] = support->centre[1] + r * sin(corner * i);
    }
}

static void set_box(DrapeSupport *support, const Solid *solid, Pose pose, Arena *arena) {
    support->radius = sqrt(4.0 * solid->half.x * solid->half.y / PI);
    support->count = 4;
    support->outline = arena_push(arena, double, 8);
    for (int i = 0; i < 4; i++) {
        Vec3 corner = vec3(i == 0 || i == 3 ? -solid->half.x : solid->half.x,
                           i < 2 ? -solid->half.y : solid->half.y, solid->half.z);
        Vec3 p = pose_apply(pose, corner);
        support->outline[2 * i] = p.x;
        support->outline[2 * i + 1] = p.y;
    }
}

/* The upright cylinder or box with the highest top. */
static void find_support(const DrapeDef *def, const StateHeader *header, const StateFrame *frame,
                         DrapeSupport *support, Arena *arena) {
    support->plane = -INFINITY;
    support->radius = NAN;
    for (int i = 0; i < header->obstacle_count; i++) {
        const StateObstacle *obstacle = &header->obstacles[i];
        const Solid *solid = &obstacle->solid;
        Pose pose = frame->pose[i];
        double top = pose.shift.z + solid->half.z;
        bool fits = solid->kind == SOLID_CYLINDER || solid->kind == SOLID_BOX;
        if (obstacle->mesh || !fits || top <= support->plane ||
            fabs(quat_rotate(pose.turn, vec3(0, 0, 1)).z) < UPRIGHT) {
            continue;
        }
        snprintf(support->name, sizeof support->name, "%s", obstacle->name);
        support->plane = top;
        support->centre[0] = pose.shift.x;
        support->centre[1] = pose.shift.y;
        if (solid->kind == SOLID_CYLINDER) {
            set_disc(support, solid->radius, arena);
        } else {
            set_box(support, solid, pose, arena);
        }
    }
    if (isfinite(def->centre[0])) {
        memcpy(support->centre, def->centre, sizeof support->centre);
    }
    if (isfinite(def->disc)) {
        set_disc(support, def->disc, arena);
    }
}

/* ---- the surface ---- */

/* Where the cloth is, without a support: the mean of its vertices, its highest point. */
static void use_cloth(const DrapePart *part, DrapeSupport *support) {
    double middle[2] = {0.0, 0.0}, top = -INFINITY;
    for (int i = 0; i < part->mesh.vertex_count; i++) {
        middle[0] += part->x[3 * (size_t)i] / part->mesh.vertex_count;
        middle[1] += part->x[3 * (size_t)i + 1] / part->mesh.vertex_count;
        top = fmax(top, part->x[3 * (size_t)i + 2]);
    }
    if (!support->name[0] && !isfinite(support->radius)) {
        memcpy(support->centre, middle, sizeof middle);
    }
    support->plane = isfinite(support->plane) ? support->plane : top;
}

/* Direction of growing u, from above: of the covariances of u with x and y. */
static double find_warp(const DrapePart *part) {
    double u = 0.0, x = 0.0, y = 0.0, ux = 0.0, uy = 0.0;
    int count = part->mesh.vertex_count;
    for (int i = 0; i < count; i++) {
        u += part->mesh.uv[2 * (size_t)i] / count;
        x += part->x[3 * (size_t)i] / count;
        y += part->x[3 * (size_t)i + 1] / count;
    }
    for (int i = 0; i < count; i++) {
        ux += (part->mesh.uv[2 * (size_t)i] - u) * (part->x[3 * (size_t)i] - x);
        uy += (part->mesh.uv[2 * (size_t)i] - u) * (part->x[3 * (size_t)i + 1] - y);
    }
    return atan2(uy, ux);
}

bool drape_read_part(Run *run, const DrapeDef *def, int index, Arena *arena, DrapePart *part,
                     Error *error) {
    const StateHeader *header = state_header(run->reader);
    int layout_index;
    if (!find_cloth(header, def->cloth, &part->cloth, error) ||
        !state_read_frame(run->reader, index, &part->frame, &part->layout, &layout_index, error)) {
        return false;
    }
    const StateLayout *layout = &part->layout;
    double *x = arena_push(arena, double, 3 * (size_t)layout->vertex_count);
    double *v = arena_push(arena, double, 3 * (size_t)layout->vertex_count);
    state_surface(layout, part->frame.x, x);
    state_surface(layout, part->frame.v, v);
    part->mesh = field_mesh_create(layout, part->cloth, arena);
    part->x = x + 3 * (size_t)layout->vertex_begin[part->cloth];
    part->v = v + 3 * (size_t)layout->vertex_begin[part->cloth];
    return part->mesh.triangle_count > 0 ||
           error_set(error, EXIT_BAD_INPUT, "%s: the cloth has no triangles", run->path);
}

static bool start(Run *run, const DrapeDef *def, int index, Arena *arena, DrapePart *part,
                  Drape *drape, Error *error) {
    const StateHeader *header = state_header(run->reader);
    *drape = (Drape){.lowest = INFINITY, .highest = -INFINITY};
    if (!drape_read_part(run, def, 0, arena, part, error)) {
        return false;
    }
    drape->warp = find_warp(part);
    if (!drape_read_part(run, def, index, arena, part, error)) {
        return false;
    }
    snprintf(drape->cloth, sizeof drape->cloth, "%s", header->cloths[part->cloth].name);
    snprintf(drape->fabric, sizeof drape->fabric, "%s", header->cloths[part->cloth].fabric);
    drape->frame = part->frame.frame;
    drape->time = part->frame.time;
    find_support(def, header, &part->frame, &drape->support, arena);
    use_cloth(part, &drape->support);
    drape->area_specimen = drape_flat_area(&part->mesh);
    drape->specimen = sqrt(drape->area_specimen / PI);
    double r = drape->support.radius;
    drape->area_disc = isfinite(r) ? PI * r * r : 0.0;
    return (!isfinite(r) || drape->area_disc < drape->area_specimen) ||
           error_set(error, EXIT_BAD_INPUT,
                     "the support '%s' is larger than the cloth; --disc RADIUS says otherwise",
                     drape->support.name);
}

struct DrapeView {
    DrapePart part;
    Resampler *resampler;
    const Surface *surface;
};

DrapeView *drape_view_open(Run *run, const DrapeDef *def, int index, Arena *arena, Drape *drape,
                           Error *error) {
    DrapeView *view = arena_push(arena, DrapeView, 1);
    if (!start(run, def, index, arena, &view->part, drape, error)) {
        return NULL;
    }
    ResampleDef density = {.pixels_per_metre = CELL_PIXELS * PIXELS / (CELL * drape->specimen),
                           .triangle_cap = MOST_TRIANGLES};
    view->resampler = resample_create(&view->part.layout, &density);
    view->surface = resample_frame(view->resampler, &view->part.layout, view->part.frame.x);
    return view;
}

void drape_view_close(DrapeView *view) {
    if (view) {
        resample_destroy(view->resampler);
    }
}

/* [m] half the side of a picture that holds all of it; also finds the lowest and highest point. */
static double find_reach(const DrapeView *view, double pixel, Drape *drape) {
    const SurfacePart *own = &view->surface->parts[view->part.cloth];
    double reach = REACH * drape->specimen;
    for (int i = 0; i < own->vertex_count; i++) {
        const float *p = view->surface->vertices[own->vertex_begin + i].position;
        reach = fmax(reach, fmax(fabs(p[0] - drape->support.centre[0]),
                                 fabs(p[1] - drape->support.centre[1])) +
                                4.0 * pixel);
        drape->lowest = fmin(drape->lowest, p[2]);
        drape->highest = fmax(drape->highest, p[2]);
    }
    return reach;
}

bool drape_view_cover(DrapeView *view, const DrapeDef *camera, double pixel, Drape *drape,
                      Coverage *coverage) {
    double fine = isnan(pixel) ? drape->specimen / PIXELS : pixel;
    double reach = find_reach(view, fine, drape);
    const double *middle = drape->support.centre;
    *coverage = (Coverage){0};
    if (reach > MOST_REACH * drape->specimen) {
        return false;
    }
    SilhouetteDef def = {
        {middle[0], middle[1]},
        {middle[0] + camera->camera_offset[0], middle[1] + camera->camera_offset[1]},
        drape->support.plane,
        camera->camera_height,
        fine,
        reach};
    Silhouette silhouette = silhouette_create(&def);
    silhouette_add_surface(&silhouette, view->surface, &view->surface->parts[view->part.cloth]);
    silhouette_add_polygon(&silhouette, drape->support.outline, drape->support.count);
    drape->area = silhouette_area(&silhouette);
    *coverage = silhouette_cover(&silhouette);
    silhouette_free(&silhouette);
    return true;
}

/* Numbers that come from the contour. */
static void measure_contour(const Coverage *coverage, Drape *drape) {
    const DrapeSupport *support = &drape->support;
    drape->contour = contour_trace(coverage, support->centre[0], support->centre[1], drape->warp);
    const double *r = drape->contour.r;
    drape_measure_outline(r, drape->specimen, &drape->harmonics, &drape->nodes, &drape->nodes_most,
                          &drape->nodes_least);
    const Nodes *nodes = &drape->nodes;
    double low = INFINITY, high = 0.0, spread = 0.0, depth = 0.0;
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        low = fmin(low, r[i]);
        high = fmax(high, r[i]);
    }
    for (int i = 0; i < nodes->count; i++) {
        double next = i + 1 < nodes->count ? nodes->angle[i + 1] : nodes->angle[0] + 2.0 * PI;
        double off = (next - nodes->angle[i]) * nodes->count / (2.0 * PI) - 1.0;
        spread += off * off;
        depth += nodes->depth[i] / nodes->count;
    }
    drape->fold_depth = depth;
    drape->node_spacing_cv = nodes->count > 1 ? sqrt(spread / (nodes->count - 1)) : NAN;
    double ring = drape->specimen - support->radius;
    drape->ddr = 100.0 * (drape->specimen - drape->harmonics.mean) / ring;
    drape->fold_index = 100.0 * (high - low) / ring;
    for (int k = 0; k < 2; k++) {
        double axis = 0.25 * PI * k;
        drape->asymmetry[k] = 0.5 * (contour_asymmetry(&drape->harmonics, axis) +
                                     contour_asymmetry(&drape->harmonics, axis + 0.5 * PI));
    }
    double perimeter = contour_perimeter(r);
    drape->circularity = 4.0 * PI * contour_area(r) / (perimeter * perimeter);
}

bool drape_measure(Run *run, const DrapeDef *def, int index, Arena *arena, Drape *drape,
                   Error *error) {
    Coverage coverage;
    DrapeView *view = drape_view_open(run, def, index, arena, drape, error);
    if (!view) {
        return false;
    }
    if (!drape_view_cover(view, def, NAN, drape, &coverage)) {
        drape_view_close(view);
        return error_set(error, EXIT_BAD_INPUT, "the cloth is nowhere near the support");
    }
    measure_contour(&coverage, drape);
    coverage_free(&coverage);
    drape_slice(view->surface, &view->surface->parts[view->part.cloth], drape);
    drape_cut(&view->part, def, arena, drape);
    drape_measure_mesh(&view->part, arena, drape);
    drape_view_close(view);
    double ring = drape->area_specimen - drape->area_disc;
    bool supported = isfinite(drape->support.radius);
    drape->dc = supported ? 100.0 * (drape->area - drape->area_disc) / ring : NAN;
    drape->dc_geometry = supported ? 100.0 * (drape->area_signed - drape->area_disc) / ring : NAN;
    drape->undercut = drape->dc - drape->dc_geometry;
    return true;
}

bool drape_find_settling(Run *run, const DrapeDef *def, double *time, Error *error) {
    Arena arena = {0};
    int count = state_frame_count(run->reader);
    bool good = true;
    *time = NAN;
    for (int i = 0; good && i < count; i++) {
        DrapePart part;
        ArenaMark mark = arena_mark(&arena);
        good = drape_read_part(run, def, i, &arena, &part, error);
        if (good) {
            double scale = sqrt(drape_flat_area(&part.mesh) / PI);
            bool rest = drape_kinetic(&part, scale) < DRAPE_REST;
            *time = rest ? (isnan(*time) ? part.frame.time : *time) : NAN;
        }
        arena_rewind(&arena, mark);
    }
    arena_free(&arena);
    return good;
}

const char *drape_warning(const Drape *drape, char *text, size_t size) {
    text[0] = '\0';
    if (drape->harmonics.amplitude[1] > 0.02 * drape->specimen) {
        snprintf(text, size, "specimen or support is off-centre by %.1f mm",
                 1e3 * drape->harmonics.amplitude[1]);
    } else if (drape->rim_stretch > 0.01) {
        snprintf(text, size, "the rim is stretched by %.1f %%", 100 * drape->rim_stretch);
    } else if (drape->undercut > 1.0) {
        snprintf(text, size, "folds undercut: silhouette and geometry differ by %.1f points",
                 drape->undercut);
    } else if (drape->contour.missed > 0) {
        snprintf(text, size, "%d of %d rays meet no cloth: the centre is outside of it",
                 drape->contour.missed, CONTOUR_RAYS);
    }
    return text;
}
