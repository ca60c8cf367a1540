#include "sim/state/film_record.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { MORE_NUMBERS = 8, VIEW_NUMBERS = 16, KEY_NUMBERS = 8 };

static StateArray array_of(const char *name, StateType type, int components, int64_t count,
                           const void *data) {
    StateArray array = {.type = type, .components = components, .count = count, .data = data};
    strncpy(array.name, name, STATE_NAME_SIZE - 1);
    return array;
}

static FilmView view_of(const Film *film) {
    return (FilmView){.camera = film->camera,
                      .eye = film->eye,
                      .target = film->target,
                      .up = film->up,
                      .fov = film->fov,
                      .pixels_per_mm = film->pixels_per_mm,
                      .move = film->move};
}

static void encode_view(const FilmView *view, double *n) {
    const FilmMove *move = &view->move;
    n[0] = view->camera;
    vec3_store(n + 1, view->eye);
    vec3_store(n + 4, view->target);
    vec3_store(n + 7, view->up);
    n[10] = view->fov, n[11] = view->pixels_per_mm;
    n[12] = move->orbit, n[13] = move->orbit_begin, n[14] = move->orbit_end;
    n[15] = move->key_count + (move->follow ? 0.5 : 0.0);
}

void film_record_encode(const Film *film, Arena *arena, StateArray *arrays) {
    double *more = arena_push(arena, double, MORE_NUMBERS);
    double *views = arena_push(arena, double, VIEW_NUMBERS *(1 + FILM_MOST_VIEWS));
    double *keys = arena_push(arena, double, KEY_NUMBERS *FILM_MOST_KEYS *(1 + FILM_MOST_VIEWS));
    char *names = arena_push(arena, char, FILM_NAME_SIZE *(1 + FILM_MOST_VIEWS) + 1), *end = names;
    const double values[MORE_NUMBERS] = {film->surface,   film->range[0],     film->range[1],
                                         film->blur,      film->blur_samples, film->play,
                                         film->show_time, film->show_scale};
    memcpy(more, values, sizeof values);
    int key_count = 0;
    for (int i = 0; i <= film->view_count; i++) {
        FilmView view = i == 0 ? view_of(film) : film->views[i - 1];
        encode_view(&view, views + VIEW_NUMBERS * i);
        end += snprintf(end, FILM_NAME_SIZE + 1, "%s\n", view.name);
        for (int k = 0; k < view.move.key_count; k++, key_count++) {
            double *n = keys + KEY_NUMBERS * key_count;
            n[0] = view.move.keys[k].time;
            vec3_store(n + 1, view.move.keys[k].eye);
            vec3_store(n + 4, view.move.keys[k].target);
            n[7] = view.move.keys[k].fov;
        }
    }
    arrays[0] = array_of("film.more", STATE_F64, 1, MORE_NUMBERS, more);
    arrays[1] = array_of("film.view", STATE_F64, VIEW_NUMBERS, 1 + film->view_count, views);
    arrays[2] = array_of("film.name", STATE_U8, 1, end - names, names);
    arrays[3] = array_of("film.key", STATE_F64, KEY_NUMBERS, key_count, keys);
    arrays[4] = array_of("film.title", STATE_U8, 1, (int64_t)strlen(film->title), film->title);
    arrays[5] = array_of("film.backdrop", STATE_U8, 1, (int64_t)strlen(film->backdrop.path),
                         film->backdrop.path);
}

static bool all_finite(const double *numbers, int64_t count) {
    for (int64_t i = 0; i < count; i++) {
        if (!isfinite(numbers[i])) {
            return false;
        }
    }
    return true;
}

static bool decode_more(const double *n, Film *film) {
    if (!all_finite(n, MORE_NUMBERS) || (n[0] != 0.0 && n[0] != 1.0) || !(n[1] <= n[2]) ||
        !(n[3] >= 0.0 && n[3] <= 1.0) || !(n[4] >= 1.0 && n[4] <= 64.0) ||
        !(n[5] >= 0.0 && n[5] <= 1e5)) {
        return false;
    }
    film->surface = (FilmSurface)n[0];
    film->range[0] = n[1], film->range[1] = n[2];
    film->blur = n[3];
    film->blur_samples = (int)n[4];
    film->play = n[5];
    film->show_time = n[6] > 0.5;
    film->show_scale = n[7] > 0.5;
    return true;
}

/* *keys: how many of this camera's keys come next. */
static bool decode_view(const double *n, FilmView *view, int *keys) {
    if (!all_finite(n, VIEW_NUMBERS) || !(n[0] >= CAMERA_AUTO && n[0] <= CAMERA_ORTHOGRAPHIC) ||
        !(n[15] >= 0.0 && n[15] < FILM_MOST_KEYS + 1)) {
        return false;
    }
    view->camera = (CameraKind)n[0];
    view->eye = vec3_load(n + 1);
    view->target = vec3_load(n + 4);
    view->up = vec3_load(n + 7);
    view->fov = n[10];
    view->pixels_per_mm = n[11];
    view->move = (FilmMove){.orbit = n[12], .orbit_begin = n[13], .orbit_end = n[14]};
    *keys = (int)n[15];
    view->move.follow = n[15] - *keys > 0.25;
    return *keys != 1;
}

static bool decode_keys(const double *n, int count, FilmMove *move) {
    for (int i = 0; i < count; i++, n += KEY_NUMBERS) {
        move->keys[i] = (FilmKey){n[0], vec3_load(n + 1), vec3_load(n + 4), n[7]};
        if (!all_finite(n, KEY_NUMBERS) || !(n[7] > 0.0 && n[7] < 3.14) ||
            (i > 0 && !(n[0] > move->keys[i - 1].time))) {
            return false;
        }
    }
    move->key_count = count;
    return true;
}

static bool decode_name(const char **text, const char *end, char name[FILM_NAME_SIZE]) {
    const char *line = memchr(*text, '\n', (size_t)(end - *text));
    if (!line || line - *text >= FILM_NAME_SIZE) {
        return false;
    }
    memcpy(name, *text, (size_t)(line - *text));
    name[line - *text] = 0;
    *text = line + 1;
    return true;
}

static bool decode_views(const StateArray *views, const StateArray *names, const StateArray *keys,
                         Film *film) {
    const char *text = names->data, *end = text + names->count;
    int64_t used = 0;
    if (views->count < 1 || views->count > 1 + FILM_MOST_VIEWS) {
        return false;
    }
    for (int i = 0; i < views->count; i++) {
        FilmView view = {.name = ""};
        int count;
        if (!decode_view((const double *)views->data + VIEW_NUMBERS * i, &view, &count) ||
            used + count > keys->count || !decode_name(&text, end, view.name) ||
            !decode_keys((const double *)keys->data + KEY_NUMBERS * used, count, &view.move)) {
            return false;
        }
        used += count;
        if (i == 0) {
            film->move = view.move;
        } else {
            film->views[i - 1] = view;
        }
    }
    film->view_count = (int)views->count - 1;
    return true;
}

bool film_record_decode(const StateArray *arrays, int count, Film *film) {
    const StateArray *more = record_find(arrays, count, "film.more", STATE_F64, 1);
    const StateArray *views = record_find(arrays, count, "film.view", STATE_F64, VIEW_NUMBERS);
    const StateArray *names = record_find(arrays, count, "film.name", STATE_U8, 1);
    const StateArray *keys = record_find(arrays, count, "film.key", STATE_F64, KEY_NUMBERS);
    const StateArray *title = record_find(arrays, count, "film.title", STATE_U8, 1);
    const StateArray *backdrop = record_find(arrays, count, "film.backdrop", STATE_U8, 1);
    if (!more) {
        return true;
    }
    if (backdrop && backdrop->count < FILM_PATH_SIZE) { /* older runs have none */
        memcpy(film->backdrop.path, backdrop->data, (size_t)backdrop->count);
        film->backdrop.path[backdrop->count] = 0;
    }
    if ((backdrop && backdrop->count >= FILM_PATH_SIZE) || more->count != MORE_NUMBERS || !views ||
        !names || !keys || !title || title->count >= FILM_TITLE_SIZE) {
        return false;
    }
    memcpy(film->title, title->data, (size_t)title->count);
    film->title[title->count] = 0;
    return decode_more(more->data, film) && decode_views(views, names, keys, film);
}
