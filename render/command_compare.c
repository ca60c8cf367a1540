/* compare: a photograph of a real drape against a run. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "render/command.h"
#include "render/compare_side.h"

static bool start_text(const char *folder, const char *name, PartFile *file, Error *error) {
    char path[FILE_PATH_SIZE];
    snprintf(path, sizeof path, "%.4000s/%s", folder, name);
    return file_create_folders(path, error) && file_start(file, path, error);
}

static bool write_text(const char *folder, const char *name, const Compare *compare,
                       void (*print)(const Compare *compare, FILE *out), Error *error) {
    PartFile file;
    if (!start_text(folder, name, &file, error)) {
        return false;
    }
    print(compare, file.out);
    return file_finish(&file, error);
}

static bool write_picture(const char *folder, const char *name, const Image *image, Error *error) {
    char path[FILE_PATH_SIZE];
    PartFile file;
    snprintf(path, sizeof path, "%.4000s/%s", folder, name);
    if (!file_start(&file, path, error)) {
        return false;
    }
    image_put_png(file.out, image, NULL, 0);
    return file_finish(&file, error);
}

static bool write_files(const Options *options, const CompareDef *def, const Compare *compare,
                        Error *error) {
    const char *folder = options->output;
    Image strip = {0}, overlay;
    if (!write_text(folder, "compare.json", compare, compare_print_json, error) ||
        !write_text(folder, "contours.csv", compare, compare_print_contours, error)) {
        return false;
    }
    overlay = compare_draw_overlay(compare);
    bool good = write_picture(folder, "overlay.png", &overlay, error) &&
                compare_draw_strip(def, compare, options->threads, &strip, error) &&
                write_picture(folder, "side-by-side.png", &strip, error);
    image_free(&overlay);
    image_free(&strip);
    return good;
}

static bool write_side_files(const Options *options, const CompareDef *def,
                             const CompareFromSide *compare, Error *error) {
    const char *folder = options->output;
    PartFile file;
    Image strip = {0}, overlay;
    if (!start_text(folder, "compare.json", &file, error)) {
        return false;
    }
    compare_side_print_json(compare, file.out);
    overlay = compare_side_draw_overlay(compare);
    bool good = file_finish(&file, error) &&
                write_picture(folder, "overlay.png", &overlay, error) &&
                compare_side_draw_strip(def, compare, options->threads, &strip, error) &&
                write_picture(folder, "side-by-side.png", &strip, error);
    image_free(&overlay);
    image_free(&strip);
    return good;
}

static ExitCode compare_side(const Options *options, const CompareDef *def, Error *error) {
    CompareFromSide compare;
    bool good = compare_from_side(def, &compare, error);
    if (good && options->json) {
        compare_side_print_json(&compare, stdout);
    } else if (good) {
        compare_side_print_text(&compare, stdout);
    }
    good = good && (!options->output || write_side_files(options, def, &compare, error));
    compare_from_side_free(&compare);
    return good ? EXIT_OK : error->code;
}

ExitCode command_compare(const Options *options, Error *error) {
    CompareDef def = options->compare;
    Compare compare;
    def.drape = options->drape;
    def.run = options->arguments[0];
    def.photo = options->arguments[1];
    def.frame = options->frames_given ? options->last < 0 ? options->first : options->last : -1;
    if (def.fit_camera || def.point_count > 0) {
        return compare_side(options, &def, error);
    }
    bool good = compare_photo(&def, &compare, error);
    if (good && options->json) {
        compare_print_json(&compare, stdout);
    } else if (good) {
        compare_print_text(&compare, stdout);
    }
    if (good && isinf(def.drape.camera_height) && !options->quiet) {
        fprintf(stderr,
                "toile: the height of the camera is not known (--camera-height); from 1 m the run "
                "would have %.1f %% instead of %.1f %%\n",
                compare.dc_near, compare.dc_orthographic);
    }
    good = good && (!options->output || write_files(options, &def, &compare, error));
    compare_free(&compare);
    return good ? EXIT_OK : error->code;
}
