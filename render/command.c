#include <string.h>

#include "render/command.h"
#include "sim/base/text.h"

bool command_choose_frames(const Options *options, const Run *run, RunEnd end, const char *done,
                           int *first, int *last, Error *error) {
    int count = state_frame_count(run->reader);
    *first = options->first;
    *last = options->last < 0 ? count - 1 : options->last;
    if (end == RUN_INTERRUPTED) {
        return error_set(error, EXIT_INTERRUPTED, "interrupted");
    }
    if (end == RUN_DAMAGED && (count == 0 || *last >= count || options->last < 0)) {
        return error_set(error, EXIT_BAD_INPUT, "%s: %s", run->path, state_damage(run->reader));
    }
    if (count == 0) {
        return error_set(error, EXIT_BAD_INPUT, "%s: there is no frame in it", run->path);
    }
    if (*first >= count || *last >= count) {
        return error_set(error, EXIT_USAGE, "--frames: %s holds frames 0 to %d", run->path,
                         count - 1);
    }
    if (end != RUN_FINISHED && options->last < 0 && !options->quiet) {
        fprintf(stderr, "toile: %s is not finished: frames %d to %d are %s\n", run->path, *first,
                *last, done);
    }
    return true;
}

static bool choose_camera(const char *name, Film *film, Error *error) {
    const char *names[FILM_MOST_VIEWS + 1] = {0};
    for (int i = 0; i < film->view_count; i++) {
        names[i] = film->views[i].name;
        if (strcmp(name, names[i]) == 0) {
            film_use_view(film, &film->views[i]);
            return true;
        }
    }
    const char *near = text_nearest(name, names);
    return film->view_count == 0
               ? error_set(error, EXIT_USAGE, "--camera %s: the scene has no film: cameras", name)
               : error_set(error, EXIT_USAGE, "--camera: no camera is called '%s'; %s '%s'", name,
                           near ? "did you mean" : "there is for example", near ? near : names[0]);
}

bool command_film(const Options *options, const Film *film, Film *changed, Error *error) {
    *changed = *film;
    if (options->camera && !choose_camera(options->camera, changed, error)) {
        return false;
    }
    if (options->surface) {
        bool splats = strcmp(options->surface, "splats") == 0;
        if (!splats && strcmp(options->surface, "mesh") != 0) {
            return error_set(error, EXIT_USAGE, "--surface %s: expected mesh or splats",
                             options->surface);
        }
        changed->surface = splats ? FILM_SPLATS : FILM_MESH;
    }
    if (options->title && strlen(options->title) >= FILM_TITLE_SIZE) {
        return error_set(error, EXIT_USAGE, "--title: at most %d characters", FILM_TITLE_SIZE - 1);
    }
    if (options->title) {
        strcpy(changed->title, options->title);
    }
    changed->blur = options->blur >= 0.0 ? options->blur : film->blur;
    changed->play = options->play >= 0.0 ? options->play : film->play;
    changed->show_time = film->show_time || options->show_time;
    changed->show_scale = film->show_scale || options->show_scale;
    return !changed->show_scale || changed->camera == CAMERA_ORTHOGRAPHIC ||
           error_set(error, EXIT_USAGE,
                     "--show-scale: this camera has perspective; every depth has "
                     "its own scale");
}

ExitCode command_frames(const Options *options, Error *error) {
    Run run = {0};
    if (!run_open(&run, &options->run, error)) {
        return error->code;
    }
    run_wait_end(&run);
    printf("%d\n", state_frame_count(run.reader));
    run_close(&run);
    return EXIT_OK;
}
