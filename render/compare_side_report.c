/* The numbers of a comparison from the side, and its pictures. */
#include <math.h>
#include <string.h>

#include "render/compare_side.h"
#include "render/json.h"
#include "render/sheet.h"

#define DEGREE (PI / 180.0)
#define SHADE 0.35 /* of a colour over what only one of them covers */

static const SheetColor photo_color = {0.15, 1.0, 0.35, 1}, run_color = {1.0, 0.2, 0.75, 1};

/* ---- numbers ---- */

void compare_side_print_text(const CompareFromSide *c, FILE *out) {
    const SideNumbers *n = &c->numbers;
    const Camera *camera = &c->fit.camera;
    double mm = 1e3 * c->pixel, cm2 = 1e4 * c->pixel * c->pixel;
    fprintf(out, "%-26s %.1f cm2 photograph, %.1f cm2 run (%+.2f %%)\n", "cloth that is seen",
            cm2 * n->area[0], cm2 * n->area[1], 100.0 * (n->area[1] / n->area[0] - 1.0));
    fprintf(out, "%-26s %.4f\n", "common part over both", n->iou);
    fprintf(out, "%-26s mean %.2f mm, 95 %% %.2f mm, Hausdorff %.2f mm\n", "distance", mm * n->mean,
            mm * n->hausdorff95, mm * n->hausdorff);
    fprintf(out, "%-26s %.3f mm at %.3f m\n", "a pixel of the photograph", mm / c->shrunk,
            c->depth);
    fprintf(out,
            "%-26s {perspective: {eye: [%.4f, %.4f, %.4f], target: [%.4f, %.4f, %.4f], up: [%.4f, "
            "%.4f, %.4f], fov: %.3f deg}}\n",
            "camera", camera->eye.x, camera->eye.y, camera->eye.z, camera->target.x,
            camera->target.y, camera->target.z, camera->up.x, camera->up.y, camera->up.z,
            c->film.fov / DEGREE);
    fprintf(out,
            "%-26s %.2f px, %s most by %.2f px; eye known to %.1f mm, focal length to %.2f %%, the "
            "cloth's place to %.2f px\n",
            "points missed by", c->shrunk * c->fit.missed, c->points[c->fit.worst].name,
            c->shrunk * c->fit.worst_missed, 1e3 * c->fit.eye_unsure, 100.0 * c->fit.focal_unsure,
            c->shrunk * c->fit.unsure);
    fprintf(out, "%-26s %s, area changes by %.2f %% with the threshold\n", "cloth told by",
            c->segment.feature, 100.0 * c->segment.change);
}

static void entry(FILE *out, const char *name, double value) {
    fprintf(out, ",\n \"%s\": ", name);
    json_number(out, value);
}

static void entry3(FILE *out, const char *name, Vec3 p) {
    fprintf(out, ",\n \"%s\": [%.9g, %.9g, %.9g]", name, p.x, p.y, p.z);
}

void compare_side_print_json(const CompareFromSide *c, FILE *out) {
    const SideNumbers *n = &c->numbers;
    double area = c->pixel * c->pixel;
    fprintf(out, "{\"schema\": \"toile-compare-side-1\",\n \"frame\": %d", c->frame);
    entry(out, "area_photo_m2", area * n->area[0]);
    entry(out, "area_run_m2", area * n->area[1]);
    entry(out, "iou", n->iou);
    entry(out, "mean_distance_m", c->pixel * n->mean);
    entry(out, "hausdorff_95_m", c->pixel * n->hausdorff95);
    entry(out, "hausdorff_m", c->pixel * n->hausdorff);
    entry(out, "depth_m", c->depth);
    entry(out, "pixel_m", c->pixel / c->shrunk);
    entry3(out, "eye_m", c->fit.camera.eye);
    entry3(out, "forward", c->fit.camera.forward);
    entry3(out, "up", c->fit.camera.up);
    entry(out, "focal_px", c->shrunk * c->fit.focal);
    entry(out, "fov_deg", c->film.fov / DEGREE);
    entry(out, "points_rms_px", c->shrunk * c->fit.missed);
    entry(out, "eye_deviation_m", c->fit.eye_unsure);
    entry(out, "focal_deviation", c->fit.focal_unsure);
    entry(out, "cloth_deviation_px", c->shrunk * c->fit.unsure);
    fprintf(out, ",\n \"told_by\": \"%s\"", c->segment.feature);
    entry(out, "threshold", c->segment.threshold);
    entry(out, "area_change_with_threshold", c->segment.change);
    fputs("}\n", out);
}

/* ---- pictures ---- */

/* True where the outline passes between a pixel and the one to the right of or below it. */
static bool on_outline(const float *cover, const Image *image, int x, int y) {
    size_t at = (size_t)y * (size_t)image->width + (size_t)x;
    bool in = cover[at] >= 0.5f;
    return (x + 1 < image->width && (cover[at + 1] >= 0.5f) != in) ||
           (y + 1 < image->height && (cover[at + (size_t)image->width] >= 0.5f) != in);
}

static void mix(uint8_t *pixel, SheetColor color, double part) {
    const double to[3] = {color.red, color.green, color.blue};
    for (int k = 0; k < 3; k++) {
        pixel[k] = (uint8_t)(pixel[k] + part * (255.0 * to[k] - pixel[k]) + 0.5);
    }
}

static void write_on(const CompareFromSide *c, Image *image) {
    Sheet *sheet = sheet_over(image);
    double size = 0.022 * image->height, dot = fmax(2.0, 0.004 * image->height), seen[3];
    char text[128];
    for (int i = 0; i < c->point_count; i++) {
        const CameraPoint *p = &c->points[i];
        camera_see(&c->fit.camera, image->width, image->height, p->place, seen);
        sheet_dot(sheet, p->x / c->shrunk, p->y / c->shrunk, dot, photo_color);
        sheet_dot(sheet, seen[0], seen[1], 0.6 * dot, run_color);
    }
    snprintf(text, sizeof text, "photograph: %.0f cm2",
             1e4 * c->pixel * c->pixel * c->numbers.area[0]);
    sheet_text(sheet, size, 1.6 * size, size, SHEET_LEFT, photo_color, text);
    snprintf(text, sizeof text, "run: %.0f cm2; outlines %.2f mm apart, common part %.3f",
             1e4 * c->pixel * c->pixel * c->numbers.area[1], 1e3 * c->pixel * c->numbers.mean,
             c->numbers.iou);
    sheet_text(sheet, size, 3.0 * size, size, SHEET_LEFT, run_color, text);
    sheet_close(sheet, NULL);
}

Image compare_side_draw_overlay(const CompareFromSide *c) {
    Image image = image_create(c->image.width, c->image.height);
    size_t count = (size_t)image.width * (size_t)image.height;
    for (size_t i = 0; i < count; i++) {
        const uint8_t *p = c->image.rgba + IMAGE_CHANNELS * i;
        uint8_t *to = image.rgba + IMAGE_CHANNELS * i;
        int x = (int)(i % (size_t)image.width), y = (int)(i / (size_t)image.width);
        double only = (double)c->photo[i] - (double)c->run[i];
        memset(to, (int)(0.55 * (0.299 * p[0] + 0.587 * p[1] + 0.114 * p[2])), 3);
        to[3] = 255;
        mix(to, only > 0.0 ? photo_color : run_color, SHADE * fabs(only));
        if (on_outline(c->photo, &image, x, y)) {
            mix(to, photo_color, 1.0);
        }
        if (on_outline(c->run, &image, x, y)) {
            mix(to, run_color, on_outline(c->photo, &image, x, y) ? 0.5 : 1.0);
        }
    }
    write_on(c, &image);
    return image;
}

bool compare_side_draw_strip(const CompareDef *def, const CompareFromSide *c, int threads,
                             Image *strip, Error *error) {
    Image drawn = image_create(c->image.width & ~1, c->image.height & ~1); /* even sides */
    bool good = compare_draw_run(def->run, &c->film, c->frame, threads, &drawn, error);
    if (good) {
        Image overlay = compare_side_draw_overlay(c);
        const Image *parts[3] = {&c->image, &drawn, &overlay};
        *strip = compare_join(parts);
        image_free(&overlay);
    }
    image_free(&drawn);
    return good;
}
