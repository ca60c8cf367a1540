#include "sim/state/decode.h"

#include <limits.h>
#include <string.h>

#include "sim/state/film_record.h"

#define FILM_NUMBERS 18
#define MAX_ITEMS 100000 /* cloths or obstacles in one scene */

char *decode_text(const StateArray *array, Arena *arena) {
    size_t bytes = array ? (size_t)array->count : 0;
    char *text = arena_alloc(arena, bytes + 1);
    if (bytes > 0) {
        memcpy(text, array->data, bytes);
    }
    return text;
}

/* a double from the file as an int in [low, high] */
static bool whole(double value, int low, int high, int *out) {
    if (!(value >= low && value <= high) || value != (double)(int)value) {
        return false;
    }
    *out = (int)value;
    return true;
}

static bool decode_film(const double *n, Film *film) {
    int camera, floor;
    if (!whole(n[1], 1, INT_MAX, &film->frame_count) || !whole(n[2], 2, 32768, &film->width) ||
        !whole(n[3], 2, 32768, &film->height) ||
        !whole(n[4], CAMERA_AUTO, CAMERA_ORTHOGRAPHIC, &camera) || !whole(n[16], 0, 1, &floor)) {
        return false;
    }
    film->rate = n[0];
    film->camera = (CameraKind)camera;
    film->eye = vec3_load(n + 5);
    film->target = vec3_load(n + 8);
    film->up = vec3_load(n + 11);
    film->fov = n[14];
    film->pixels_per_mm = n[15];
    film->floor = floor;
    film->floor_height = n[17];
    for (int i = 0; i < FILM_NUMBERS - 1; i++) {
        if (!isfinite(n[i])) {
            return false;
        }
    }
    return film->rate > 0.0;
}

/* finds an array of exactly `expected` items (any number when negative) */
static const void *need(const StateArray *arrays, int count, const char *name, StateType type,
                        int components, int64_t expected, int *items) {
    const StateArray *array = record_find(arrays, count, name, type, components);
    if (!array || array->count > INT_MAX / 16 || (expected >= 0 && array->count != expected)) {
        return NULL;
    }
    if (items) {
        *items = (int)array->count;
    }
    return array->data;
}

/* 0 = begin[0] <= ... <= begin[ranges] = total */
static bool check_ranges(const int32_t *begin, int ranges, int total) {
    for (int i = 0; i < ranges; i++) {
        if (begin[i] > begin[i + 1]) {
            return false;
        }
    }
    return begin[0] == 0 && begin[ranges] == total;
}

static bool check_indices(const int32_t *indices, int64_t count, int below) {
    for (int64_t i = 0; i < count; i++) {
        if (indices[i] < 0 || indices[i] >= below) {
            return false;
        }
    }
    return true;
}

static bool all_finite(const double *numbers, int64_t count) {
    for (int64_t i = 0; i < count; i++) {
        if (!isfinite(numbers[i])) {
            return false;
        }
    }
    return true;
}

/* copies the next word of `*cursor` and steps over the character after it */
static bool next_word(const char **cursor, char end, char word[STATE_WORD_SIZE]) {
    const char *stop = strchr(*cursor, end);
    if (!stop || stop - *cursor >= STATE_WORD_SIZE) {
        return false;
    }
    memcpy(word, *cursor, (size_t)(stop - *cursor));
    word[stop - *cursor] = 0;
    *cursor = stop + 1;
    return true;
}

/* *mesh: it is none of the solids */
static bool decode_solid(const double *n, Solid *solid, bool *mesh) {
    int kind;
    if (!whole(n[0], 0, STATE_KIND_MESH, &kind)) {
        return false;
    }
    *mesh = kind == STATE_KIND_MESH;
    *solid = (Solid){*mesh ? SOLID_SPHERE : (SolidKind)kind, vec3_load(n + 1), n[4]};
    return isfinite(n[1]) && isfinite(n[2]) && isfinite(n[3]) && isfinite(n[4]);
}

/* The arrays of all meshes; NULL where they do not fit. */
typedef struct MeshArrays {
    const int32_t *begin; /* (obstacles + 1) x 2 */
    const double *vertices;
    const int32_t *triangles;
    const unsigned char *flags; /* 1: moves, 2: closed */
} MeshArrays;

static MeshArrays find_meshes(const StateArray *a, int n, int obstacles) {
    int vertices = 0, triangles = 0;
    MeshArrays m = {
        need(a, n, "obstacle.mesh_begin", STATE_I32, 2, obstacles + 1, NULL),
        need(a, n, "obstacle.vertex", STATE_F64, 3, -1, &vertices),
        need(a, n, "obstacle.triangle", STATE_I32, 3, -1, &triangles),
        need(a, n, "obstacle.flags", STATE_U8, 1, obstacles, NULL),
    };
    bool good = m.begin && m.vertices && m.triangles && m.flags && m.begin[0] == 0 &&
                m.begin[1] == 0 && m.begin[2 * obstacles] == vertices &&
                m.begin[2 * obstacles + 1] == triangles;
    for (int i = 0; good && i < 2 * obstacles; i++) {
        good = m.begin[i] <= m.begin[i + 2];
    }
    good = good && all_finite(m.vertices, 3 * (int64_t)vertices);
    return good ? m : (MeshArrays){0};
}

static const StateMesh *decode_mesh(const MeshArrays *m, int obstacle, Arena *arena) {
    if (!m->begin) {
        return NULL;
    }
    const int32_t *begin = m->begin + 2 * obstacle;
    StateMesh *mesh = arena_push(arena, StateMesh, 1);
    *mesh = (StateMesh){.vertex_count = begin[2] - begin[0],
                        .triangle_count = begin[3] - begin[1],
                        .vertices = m->vertices + 3 * (int64_t)begin[0],
                        .triangles = m->triangles + 3 * (int64_t)begin[1],
                        .moves = m->flags[obstacle] & 1,
                        .closed = m->flags[obstacle] & 2};
    bool good =
        mesh->vertex_count > 0 && mesh->triangle_count > 0 &&
        check_indices(mesh->triangles, 3 * (int64_t)mesh->triangle_count, mesh->vertex_count);
    return good ? mesh : NULL;
}

static bool decode_obstacles(const StateArray *arrays, int array_count, const StateArray *solids,
                             Arena *arena, StateHeader *header) {
    int count = (int)solids->count;
    const char *text =
        decode_text(record_find(arrays, array_count, "obstacle.text", STATE_U8, 1), arena);
    StateObstacle *obstacles = arena_push(arena, StateObstacle, count);
    MeshArrays meshes = find_meshes(arrays, array_count, count);
    for (int i = 0; i < count; i++) {
        bool mesh = false;
        if (!next_word(&text, ' ', obstacles[i].name) ||
            !next_word(&text, '\n', obstacles[i].look) ||
            !decode_solid((const double *)solids->data + 5 * i, &obstacles[i].solid, &mesh)) {
            return false;
        }
        obstacles[i].mesh = mesh ? decode_mesh(&meshes, i, arena) : NULL;
        if (mesh && !obstacles[i].mesh) {
            return false;
        }
    }
    header->obstacle_count = count;
    header->obstacles = obstacles;
    return true;
}

/* Older runs have none. */
static bool decode_prints(const StateArray *arrays, int n, StateCloth *cloths, int count) {
    const StateArray *paths = record_find(arrays, n, "cloth.print", STATE_U8, 1);
    const StateArray *widths = record_find(arrays, n, "cloth.print_width", STATE_F64, 1);
    const char *text = paths ? paths->data : NULL, *end = paths ? text + paths->count : NULL;
    if (!paths || !widths) {
        return !paths && !widths;
    }
    for (int i = 0; i < count; i++) {
        const char *line = text < end ? memchr(text, '\n', (size_t)(end - text)) : NULL;
        if (widths->count != count || !line || line - text >= FILM_PATH_SIZE ||
            !(((const double *)widths->data)[i] >= 0.0)) {
            return false;
        }
        memcpy(cloths[i].print.path, text, (size_t)(line - text));
        cloths[i].print.width = ((const double *)widths->data)[i];
        text = line + 1;
    }
    return true;
}

static bool decode_cloths(const StateArray *arrays, int n, const StateArray *thickness,
                          const char *text, Arena *arena, StateHeader *header) {
    int count = (int)thickness->count;
    StateCloth *cloths = arena_push(arena, StateCloth, count);
    for (int i = 0; i < count; i++) {
        if (!next_word(&text, ' ', cloths[i].name) || !next_word(&text, ' ', cloths[i].fabric) ||
            !next_word(&text, '\n', cloths[i].look)) {
            return false;
        }
        cloths[i].thickness = ((const double *)thickness->data)[i];
    }
    header->cloth_count = count;
    header->cloths = cloths;
    return decode_prints(arrays, n, cloths, count);
}

bool decode_header(const StateArray *arrays, int count, Arena *arena, StateHeader *header,
                   const char **why) {
    const StateArray *hash = record_find(arrays, count, "scene_hash", STATE_I64, 1);
    const StateArray *film = record_find(arrays, count, "film", STATE_F64, 1);
    const StateArray *solids = record_find(arrays, count, "obstacle.solid", STATE_F64, 5);
    const StateArray *thickness = record_find(arrays, count, "cloth.thickness", STATE_F64, 1);
    *why = "the header is incomplete";
    if (!hash || hash->count != 1 || !film || film->count != FILM_NUMBERS || !solids ||
        solids->count > MAX_ITEMS || !thickness || thickness->count > MAX_ITEMS) {
        return false;
    }
    *why = "the header holds impossible values";
    header->program = decode_text(record_find(arrays, count, "program", STATE_U8, 1), arena);
    header->scene_text = decode_text(record_find(arrays, count, "scene_text", STATE_U8, 1), arena);
    header->scene_path = decode_text(record_find(arrays, count, "scene_path", STATE_U8, 1), arena);
    int64_t bits;
    memcpy(&bits, hash->data, sizeof bits);
    header->scene_hash = (uint64_t)bits;
    const char *cloths = decode_text(record_find(arrays, count, "cloth.text", STATE_U8, 1), arena);
    header->film = film_default();
    return decode_film(film->data, &header->film) &&
           film_record_decode(arrays, count, &header->film) &&
           decode_obstacles(arrays, count, solids, arena, header) &&
           decode_cloths(arrays, count, thickness, cloths, arena, header);
}

static bool check_lattices(const StateLayout *l) {
    for (int c = 0; c < l->cloth_count; c++) {
        const int32_t *lattice = l->lattice + 4 * c;
        int nodes = l->node_begin[c + 1] - l->node_begin[c];
        bool scattered = lattice[0] == 0 && lattice[1] == 0;
        bool regular = lattice[0] >= 2 && lattice[1] >= 2 && lattice[0] <= nodes &&
                       (int64_t)lattice[0] * lattice[1] == nodes &&
                       (lattice[2] == 0 || lattice[2] == 1);
        if (!scattered && !regular) {
            return false;
        }
    }
    return true;
}

static bool check_layout(const StateLayout *l) {
    return check_ranges(l->node_begin, l->cloth_count, l->node_count) &&
           check_ranges(l->vertex_begin, l->cloth_count, l->vertex_count) &&
           check_ranges(l->triangle_begin, l->cloth_count, l->triangle_count) &&
           check_ranges(l->loop_begin, l->cloth_count, l->loop_count) &&
           check_ranges(l->outline_begin, l->loop_count, l->outline_count) && check_lattices(l) &&
           check_indices(l->triangles, 3 * (int64_t)l->triangle_count, l->vertex_count) &&
           (l->w_count == 0 ? l->vertex_count == l->node_count
                            : check_ranges(l->w_start, l->vertex_count, l->w_count)) &&
           check_indices(l->w_column, l->w_count, l->node_count);
}

bool decode_layout(const StateArray *a, int n, const StateHeader *header, StateLayout *layout,
                   const char **why) {
    int cloths = header->cloth_count, loops_plus_one = 0, w_rows = 0;
    StateLayout l = {.cloth_count = cloths};
    l.lattice = need(a, n, "lattice", STATE_I32, 4, cloths, NULL);
    l.node_begin = need(a, n, "node_begin", STATE_I32, 1, cloths + 1, NULL);
    l.vertex_begin = need(a, n, "vertex_begin", STATE_I32, 1, cloths + 1, NULL);
    l.triangle_begin = need(a, n, "triangle_begin", STATE_I32, 1, cloths + 1, NULL);
    l.material = need(a, n, "material", STATE_F64, 2, -1, &l.node_count);
    l.rest = need(a, n, "rest", STATE_F64, 3, l.node_count, NULL);
    l.vertex_material = need(a, n, "vertex_material", STATE_F64, 2, -1, &l.vertex_count);
    l.triangles = need(a, n, "triangles", STATE_I32, 3, -1, &l.triangle_count);
    l.w_column = need(a, n, "w.column", STATE_I32, 1, -1, &l.w_count);
    l.w_value = need(a, n, "w.value", STATE_F64, 1, l.w_count, NULL);
    l.w_start = need(a, n, "w.start", STATE_I32, 1, l.w_count ? l.vertex_count + 1 : 0, &w_rows);
    l.outline = need(a, n, "outline", STATE_F64, 2, -1, &l.outline_count);
    l.outline_begin = need(a, n, "outline_begin", STATE_I32, 1, -1, &loops_plus_one);
    l.loop_begin = need(a, n, "loop_begin", STATE_I32, 1, cloths + 1, NULL);
    l.loop_count = loops_plus_one - 1;
    *why = "the layout is incomplete";
    if (!l.lattice || !l.node_begin || !l.vertex_begin || !l.triangle_begin || !l.material ||
        !l.rest || !l.vertex_material || !l.triangles || !l.w_column || !l.w_value || !l.w_start ||
        !l.outline || !l.outline_begin || l.loop_count < 0 || !l.loop_begin) {
        return false;
    }
    *why = "the layout does not fit together";
    *layout = l;
    return check_layout(&l);
}

static bool decode_moved(const StateArray *a, int n, const StateHeader *header, StateFrame *frame) {
    int64_t count = 0;
    for (int i = 0; i < header->obstacle_count; i++) {
        const StateMesh *mesh = header->obstacles[i].mesh;
        count += mesh && mesh->moves ? mesh->vertex_count : 0;
    }
    frame->moved_count = (int)count;
    frame->moved = count ? need(a, n, "obstacle.moved", STATE_F64, 3, count, NULL) : NULL;
    return count == 0 || frame->moved;
}

const double *state_mesh_vertices(const StateHeader *header, const StateFrame *frame,
                                  int obstacle) {
    const double *at = frame->moved;
    for (int i = 0; i < obstacle; i++) {
        const StateMesh *mesh = header->obstacles[i].mesh;
        at += mesh && mesh->moves ? 3 * (size_t)mesh->vertex_count : 0;
    }
    const StateMesh *mesh = header->obstacles[obstacle].mesh;
    return mesh->moves ? at : mesh->vertices;
}

bool decode_frame(const StateArray *a, int n, const StateHeader *header, const StateLayout *layout,
                  StateFrame *frame, const char **why) {
    const int32_t *number = need(a, n, "frame", STATE_I32, 1, 1, NULL);
    const double *time = need(a, n, "time", STATE_F64, 1, 1, NULL);
    frame->x = need(a, n, "x", STATE_F64, 3, layout->node_count, NULL);
    frame->v = need(a, n, "v", STATE_F64, 3, layout->node_count, NULL);
    frame->pose = need(a, n, "pose", STATE_F64, 7, header->obstacle_count, NULL);
    frame->pose_count = header->obstacle_count;
    if (!number || !time || !frame->x || !frame->v || !frame->pose) {
        *why = "the frame is incomplete";
        return false;
    }
    if (!decode_moved(a, n, header, frame)) {
        *why = "the frame lacks the vertices of a mesh";
        return false;
    }
    const StateArray *force = record_find(a, n, "contact.force", STATE_F64, 3);
    frame->contact_force = force ? force->data : NULL;
    if (force && (force->count != layout->node_count ||
                  !all_finite(force->data, 3 * (int64_t)layout->node_count))) {
        *why = "the frame's contact forces are not those of its nodes";
        return false;
    }
    if (!all_finite(frame->x, 3 * (int64_t)layout->node_count) ||
        !all_finite(frame->v, 3 * (int64_t)layout->node_count) ||
        !all_finite(frame->moved, 3 * (int64_t)frame->moved_count)) {
        *why = "the frame holds a number that is not finite";
        return false;
    }
    frame->frame = *number;
    frame->time = *time;
    return true;
}
