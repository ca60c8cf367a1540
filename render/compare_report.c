/* The numbers of a comparison, and its pictures. */
#include <math.h>
#include <string.h>

#include "render/compare.h"
#include "render/draw.h"
#include "render/json.h"
#include "render/sheet.h"

#define DEGREE (PI / 180.0)
#define GAP 8 /* [px] between pictures */

static const SheetColor photo_color = {0.15, 1.0, 0.35, 1}, run_color = {1.0, 0.2, 0.75, 1};

/* ---- numbers ---- */

static void print_nodes(const char *name, const CompareSide *side, FILE *out) {
    fprintf(out, "%-26s %.2f %%, %d nodes", name, side->dc, side->nodes.count);
    if (side->nodes_least != side->nodes_most) {
        fprintf(out, " (%d to %d)", side->nodes_least, side->nodes_most);
    }
    fputc('\n', out);
}

void compare_print_text(const Compare *c, FILE *out) {
    double percent = 100.0 / c->drape.specimen;
    print_nodes("photograph", &c->photo, out);
    print_nodes("run, same camera", &c->run, out);
    fprintf(out, "%-26s %+.2f points\n", "difference", c->run.dc - c->photo.dc);
    fprintf(out, "%-26s %.2f %%\n", "run, from infinity", c->dc_orthographic);
    fprintf(out, "%-26s %.2f mm (%.2f %% of the specimen's radius)\n", "outlines, rms along rays",
            1e3 * c->rms, percent * c->rms);
    fprintf(out, "%-26s mean %.2f mm, 95 %% %.2f mm, Hausdorff %.2f mm\n", "distance",
            1e3 * c->mean, 1e3 * c->hausdorff95, 1e3 * c->hausdorff);
    fprintf(out, "%-26s %.4f\n", "common part over both", c->iou);
    if (isfinite(c->node_angle)) {
        fprintf(out, "%-26s %.2f deg\n", "nodes apart by", c->node_angle / DEGREE);
    }
    fprintf(out, "%-26s %.2f deg%s, correlation %.3f (%s %.3f)\n", "warp lies at",
            c->rotation / DEGREE, c->mirrored ? ", mirrored" : "", c->correlation,
            c->mirrored ? "face up" : "mirrored", c->correlation_other);
    fprintf(out, "%-26s %.3f px/mm, support at (%.1f, %.1f)\n", "scale",
            1e-3 * c->shrunk * c->pixels_per_metre, c->shrunk * c->disc.x, c->shrunk * c->disc.y);
    fprintf(out, "%-26s %s, area changes by %.2f %% with the threshold\n", "cloth told by",
            c->segment.feature, 100 * c->segment.change);
}

static void entry(FILE *out, const char *name, double value) {
    fprintf(out, ",\n \"%s\": ", name);
    json_number(out, value);
}

static void print_side(FILE *out, const char *name, const CompareSide *side) {
    fprintf(out,
            ",\n \"%s\": {\"dc_percent\": %.9g, \"nodes\": %d, \"nodes_least\": %d, "
            "\"nodes_most\": %d, \"mean_radius_m\": %.9g, \"harmonic_amplitudes_m\": [",
            name, side->dc, side->nodes.count, side->nodes_least, side->nodes_most,
            side->harmonics.mean);
    for (int n = 1; n <= CONTOUR_NODE_HARMONICS; n++) {
        fprintf(out, "%s%.6g", n > 1 ? ", " : "", side->harmonics.amplitude[n]);
    }
    fputs("], \"node_angles_deg\": [", out);
    for (int i = 0; i < side->nodes.count; i++) {
        fprintf(out, "%s%.6g", i ? ", " : "", side->nodes.angle[i] / DEGREE);
    }
    fputs("]}", out);
}

void compare_print_json(const Compare *c, FILE *out) {
    fprintf(out, "{\"schema\": \"toile-compare-1\"");
    print_side(out, "photo", &c->photo);
    print_side(out, "run", &c->run);
    entry(out, "dc_difference_points", c->run.dc - c->photo.dc);
    entry(out, "dc_run_orthographic_percent", c->dc_orthographic);
    entry(out, "dc_run_from_1_m_percent", c->dc_near);
    entry(out, "rms_radial_m", c->rms);
    entry(out, "rms_radial_over_specimen", c->rms / c->drape.specimen);
    entry(out, "mean_distance_m", c->mean);
    entry(out, "hausdorff_m", c->hausdorff);
    entry(out, "hausdorff_95_m", c->hausdorff95);
    entry(out, "iou", c->iou);
    entry(out, "node_angle_deg", c->node_angle / DEGREE);
    entry(out, "rotation_deg", c->rotation / DEGREE);
    fprintf(out, ",\n \"mirrored\": %s", c->mirrored ? "true" : "false");
    entry(out, "correlation", c->correlation);
    entry(out, "correlation_other_face", c->correlation_other);
    entry(out, "pixels_per_metre", c->shrunk * c->pixels_per_metre);
    fprintf(out, ",\n \"support_px\": [%.6g, %.6g, %.6g]", c->shrunk * c->disc.x,
            c->shrunk * c->disc.y, 2.0 * c->shrunk * c->disc.radius);
    entry(out, "plate_axes_ratio", c->disc.ratio);
    fprintf(out, ",\n \"told_by\": \"%s\"", c->segment.feature);
    entry(out, "threshold", c->segment.threshold);
    entry(out, "area_change_with_threshold", c->segment.change);
    fputs("}\n", out);
}

void compare_print_contours(const Compare *c, FILE *out) {
    fputs("theta_deg,r_photo_m,r_run_m\n", out);
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        fprintf(out, "%.9g,%.9g,%.9g\n", 360.0 * i / CONTOUR_RAYS, c->photo.r[i], c->run.r[i]);
    }
}

/* ---- pictures ---- */

static void place_outline(const Compare *c, const double *r, double *points) {
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        double angle = 2.0 * PI * i / CONTOUR_RAYS, far = c->pixels_per_metre * r[i];
        points[2 * i] = c->disc.x + far * cos(angle);
        points[2 * i + 1] = c->disc.y - far * sin(angle);
    }
}

/* What lies between the outlines, in the colour of the one that reaches further. */
static void shade(Sheet *sheet, const double *photo, const double *run, const Compare *c) {
    for (int i = 0; i < CONTOUR_RAYS; i++) {
        int next = (i + 1) % CONTOUR_RAYS;
        double piece[8] = {photo[2 * i],  photo[2 * i + 1],  photo[2 * next], photo[2 * next + 1],
                           run[2 * next], run[2 * next + 1], run[2 * i],      run[2 * i + 1]};
        SheetColor color = c->photo.r[i] > c->run.r[i] ? photo_color : run_color;
        color.alpha = 0.35;
        sheet_fill(sheet, piece, 4, color);
    }
}

Image compare_draw_overlay(const Compare *c) {
    Image image = image_create(c->image.width, c->image.height);
    size_t count = (size_t)image.width * (size_t)image.height;
    for (size_t i = 0; i < count; i++) {
        const uint8_t *p = c->image.rgba + IMAGE_CHANNELS * i;
        int grey = (int)(0.55 * (0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2]));
        for (int k = 0; k < 3; k++) {
            image.rgba[IMAGE_CHANNELS * i + (size_t)k] = (uint8_t)grey;
        }
    }
    double photo[2 * CONTOUR_RAYS], run[2 * CONTOUR_RAYS], size = 0.022 * image.height;
    place_outline(c, c->photo.r, photo);
    place_outline(c, c->run.r, run);
    Sheet *sheet = sheet_over(&image);
    double width = fmax(1.5, 0.0025 * image.height);
    shade(sheet, photo, run, c);
    sheet_line(sheet, photo, CONTOUR_RAYS, true, width, photo_color);
    sheet_line(sheet, run, CONTOUR_RAYS, true, width, run_color);
    sheet_dot(sheet, c->disc.x, c->disc.y, 2.0 * width, (SheetColor){1, 1, 1, 1});
    char text[128];
    snprintf(text, sizeof text, "photograph: DC %.1f %%, %d nodes", c->photo.dc,
             c->photo.nodes.count);
    sheet_text(sheet, size, 1.6 * size, size, SHEET_LEFT, photo_color, text);
    snprintf(text, sizeof text, "run: DC %.1f %%, %d nodes; rms %.2f mm", c->run.dc,
             c->run.nodes.count, 1e3 * c->rms);
    sheet_text(sheet, size, 3.0 * size, size, SHEET_LEFT, run_color, text);
    sheet_close(sheet, NULL);
    return image;
}

/* The film that the photographer would have made of the run. */
static Film view_of(const Compare *c, const Film *film, double camera_height) {
    Film view = *film;
    const DrapeSupport *support = &c->drape.support;
    double up = c->mirrored ? c->rotation - 0.5 * PI + c->drape.warp
                            : 0.5 * PI + c->drape.warp - c->rotation;
    double half = 0.5 * c->image.height / c->pixels_per_metre; /* [m] */
    bool far = isinf(camera_height);
    view.camera = far ? CAMERA_ORTHOGRAPHIC : CAMERA_PERSPECTIVE;
    view.target = vec3(support->centre[0] + c->camera_offset[0],
                       support->centre[1] + c->camera_offset[1], support->plane);
    view.eye = vec3(view.target.x, view.target.y, support->plane + (far ? 2.0 : camera_height));
    view.up = vec3(cos(up), sin(up), 0.0);
    view.fov = far ? view.fov : 2.0 * atan(half / camera_height);
    view.pixels_per_mm = 1e-3 * c->pixels_per_metre;
    return view;
}

static void mirror(Image *image) {
    uint32_t *row = (uint32_t *)(void *)image->rgba;
    for (int y = 0; y < image->height; y++, row += image->width) {
        for (int i = 0, j = image->width - 1; i < j; i++, j--) {
            uint32_t swap = row[i];
            row[i] = row[j];
            row[j] = swap;
        }
    }
}

bool compare_draw_run(const char *path, const Film *film, int frame, int threads, Image *image,
                      Error *error) {
    Run run = {0};
    RunDef run_def = run_default();
    run_def.path = path;
    if (!run_open(&run, &run_def, error)) {
        return false;
    }
    DrawDef draw = {.width = image->width,
                    .height = image->height,
                    .quality = quality_find("standard"),
                    .film = film,
                    .threads = threads > 1 ? threads : 0};
    Drawer *drawer = draw_create(&run, &draw, error);
    const Image *drawn = drawer ? draw_frame(drawer, frame, error) : NULL;
    if (drawn) {
        memcpy(image->rgba, drawn->rgba,
               IMAGE_CHANNELS * (size_t)image->width * (size_t)image->height);
    }
    draw_destroy(drawer);
    run_close(&run);
    return drawn != NULL;
}

Image compare_join(const Image *const parts[3]) {
    int width = parts[0]->width, height = parts[0]->height;
    for (int i = 1; i < 3; i++) {
        width = parts[i]->width < width ? parts[i]->width : width;
        height = parts[i]->height < height ? parts[i]->height : height;
    }
    Image strip = image_create(3 * width + 2 * GAP, height);
    memset(strip.rgba, 255, IMAGE_CHANNELS * (size_t)strip.width * (size_t)strip.height);
    for (int i = 0; i < 3; i++) {
        for (int y = 0; y < height; y++) {
            size_t to = (size_t)y * (size_t)strip.width + (size_t)(i * (width + GAP));
            memcpy(strip.rgba + IMAGE_CHANNELS * to,
                   parts[i]->rgba + IMAGE_CHANNELS * (size_t)y * (size_t)parts[i]->width,
                   IMAGE_CHANNELS * (size_t)width);
        }
    }
    return strip;
}

/* The film of the run as it is, with the photographer's camera. */
static bool find_view(const CompareDef *def, const Compare *c, Film *view, Error *error) {
    Run run = {0};
    RunDef run_def = run_default();
    run_def.path = def->run;
    bool good = run_open(&run, &run_def, error);
    if (good) {
        *view = view_of(c, &state_header(run.reader)->film, def->drape.camera_height);
        run_close(&run);
    }
    return good;
}

bool compare_draw_strip(const CompareDef *def, const Compare *c, int threads, Image *strip,
                        Error *error) {
    Film view;
    Image drawn = image_create(c->image.width & ~1, c->image.height & ~1); /* even sides */
    bool good = find_view(def, c, &view, error) &&
                compare_draw_run(def->run, &view, c->drape.frame, threads, &drawn, error);
    if (good) {
        Image overlay = compare_draw_overlay(c);
        const Image *parts[3] = {&c->image, &drawn, &overlay};
        if (c->mirrored) {
            mirror(&drawn);
        }
        *strip = compare_join(parts);
        image_free(&overlay);
    }
    image_free(&drawn);
    return good;
}
