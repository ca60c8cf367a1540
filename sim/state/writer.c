/* writer.c: appends records to a states file. A record is written with one write and becomes
 * visible to readers when it is whole. */
#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <unistd.h>

#include "sim/state/film_record.h"
#include "sim/state/record.h"

#define WRITER_MAX_ARRAYS 64
#define MESH_ARRAYS 4

struct StateWriter {
    int file;
    const char *path;
    Arena arena;   /* path */
    Arena scratch; /* one record */
};

static bool write_all(StateWriter *writer, const void *data, size_t bytes, Error *error) {
    const char *cursor = data;
    while (bytes > 0) {
        ssize_t written = write(writer->file, cursor, bytes);
        if (written < 0 && errno != EINTR) {
            return error_set_errno(error, EXIT_IO, "cannot write %s", writer->path);
        }
        if (written > 0) {
            cursor += written;
            bytes -= (size_t)written;
        }
    }
    return true;
}

/* Two writers of one file would tear it; where a file system knows no locks, that is left to the user. */
static StateWriter *writer_open(const char *path, int flags, Error *error) {
    int file = open(path, flags | O_CLOEXEC, 0644);
    if (file < 0) {
        error_set_errno(error, EXIT_IO, "cannot write %s", path);
        return NULL;
    }
    if (flock(file, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
        error_set(error, EXIT_IO, "cannot write %s: another process is writing it", path);
        close(file);
        return NULL;
    }
    Arena arena = {0};
    char *kept_path = arena_strdup(&arena, path);
    StateWriter *writer = arena_push(&arena, StateWriter, 1);
    *writer = (StateWriter){.file = file, .path = kept_path, .arena = arena};
    return writer;
}

StateWriter *state_create(const char *path, Error *error) {
    StateWriter *writer = writer_open(path, O_WRONLY | O_CREAT, error);
    if (!writer) {
        return NULL;
    }
    if (ftruncate(writer->file, 0) != 0) {
        error_set_errno(error, EXIT_IO, "cannot empty %s", path);
        state_close(writer, NULL);
        return NULL;
    }
    unsigned char head[RECORD_FILE_HEAD] = RECORD_MAGIC;
    uint32_t version = STATE_VERSION;
    memcpy(head + 8, &version, sizeof version);
    if (!write_all(writer, head, sizeof head, error)) {
        state_close(writer, NULL);
        return NULL;
    }
    return writer;
}

bool state_close(StateWriter *writer, Error *error) {
    bool ok = true;
    if (close(writer->file) != 0) {
        ok = error_set_errno(error, EXIT_IO, "cannot finish %s", writer->path);
    }
    arena_free(&writer->scratch);
    Arena arena = writer->arena;
    arena_free(&arena);
    return ok;
}

static StateArray array_of(const char *name, StateType type, int components, int64_t count,
                           const void *data) {
    StateArray array = {.type = type, .components = components, .count = count, .data = data};
    ASSERT(strlen(name) < STATE_NAME_SIZE);
    strcpy(array.name, name);
    return array;
}

static bool write_record(StateWriter *writer, StateKind kind, const StateArray *arrays, int count,
                         Error *error) {
    Record record = {kind, count, arrays};
    size_t bytes = record_bytes(&record);
    ArenaMark mark = arena_mark(&writer->scratch);
    unsigned char *buffer = arena_alloc(&writer->scratch, bytes);
    record_encode(&record, buffer);
    bool ok = write_all(writer, buffer, bytes, error);
    arena_rewind(&writer->scratch, mark);
    return ok;
}

/* "a b c" lines of names, so that a name may hold anything but white space */
static char *lines_of(StateWriter *writer, int count, int fields,
                      const char *(*field)(const void *items, int item, int index),
                      const void *items) {
    char *text = arena_push(&writer->scratch, char, count *fields *STATE_WORD_SIZE + 1);
    char *end = text;
    for (int i = 0; i < count; i++) {
        for (int j = 0; j < fields; j++) {
            const char *word = field(items, i, j);
            for (; *word; word++) {
                *end++ = *word == ' ' || *word == '\n' ? '_' : *word;
            }
            *end++ = j + 1 < fields ? ' ' : '\n';
        }
    }
    return text;
}

static const char *obstacle_field(const void *items, int item, int index) {
    const StateObstacle *obstacle = (const StateObstacle *)items + item;
    return index == 0 ? obstacle->name : obstacle->look;
}

static const char *cloth_field(const void *items, int item, int index) {
    const StateCloth *cloth = (const StateCloth *)items + item;
    return index == 0 ? cloth->name : index == 1 ? cloth->fabric : cloth->look;
}

static void encode_film(const Film *film, double numbers[18]) {
    double values[18] = {film->rate,     film->frame_count, film->width,    film->height,
                         film->camera,   film->eye.x,       film->eye.y,    film->eye.z,
                         film->target.x, film->target.y,    film->target.z, film->up.x,
                         film->up.y,     film->up.z,        film->fov,      film->pixels_per_mm,
                         film->floor,    film->floor_height};
    memcpy(numbers, values, sizeof values);
}

/* The meshes of all obstacles in four arrays. Returns how many arrays: 0 without a mesh. */
static int list_meshes(StateWriter *writer, const StateHeader *header, StateArray *arrays) {
    int obstacles = header->obstacle_count, meshes = 0;
    Arena *arena = &writer->scratch;
    int32_t *begin = arena_push(arena, int32_t, 2 * (obstacles + 1));
    unsigned char *flags = arena_push(arena, unsigned char, obstacles);
    for (int i = 0; i < obstacles; i++) {
        const StateMesh *mesh = header->obstacles[i].mesh;
        begin[2 * i + 2] = begin[2 * i] + (mesh ? mesh->vertex_count : 0);
        begin[2 * i + 3] = begin[2 * i + 1] + (mesh ? mesh->triangle_count : 0);
        flags[i] = mesh ? (unsigned char)(mesh->moves + 2 * mesh->closed) : 0;
        meshes += mesh != NULL;
    }
    int vertices = begin[2 * obstacles], triangles = begin[2 * obstacles + 1];
    double *vertex = arena_push(arena, double, 3 * vertices);
    int32_t *triangle = arena_push(arena, int32_t, 3 * triangles);
    for (int i = 0; i < obstacles; i++) {
        const StateMesh *mesh = header->obstacles[i].mesh;
        if (mesh) {
            memcpy(vertex + 3 * begin[2 * i], mesh->vertices,
                   3 * sizeof *vertex * (size_t)mesh->vertex_count);
            memcpy(triangle + 3 * begin[2 * i + 1], mesh->triangles,
                   3 * sizeof *triangle * (size_t)mesh->triangle_count);
        }
    }
    arrays[0] = array_of("obstacle.mesh_begin", STATE_I32, 2, obstacles + 1, begin);
    arrays[1] = array_of("obstacle.vertex", STATE_F64, 3, vertices, vertex);
    arrays[2] = array_of("obstacle.triangle", STATE_I32, 3, triangles, triangle);
    arrays[3] = array_of("obstacle.flags", STATE_U8, 1, obstacles, flags);
    return meshes > 0 ? MESH_ARRAYS : 0;
}

/* A line for each cloth, empty where it is not printed. */
static char *list_prints(StateWriter *writer, const StateHeader *header, double *widths) {
    int cloths = header->cloth_count;
    char *text = arena_push(&writer->scratch, char, (FILM_PATH_SIZE + 1) * cloths + 1), *end = text;
    for (int i = 0; i < cloths; i++) {
        end += sprintf(end, "%s\n", header->cloths[i].print.path);
        widths[i] = header->cloths[i].print.width;
    }
    return text;
}

bool state_write_header(StateWriter *writer, const StateHeader *header, Error *error) {
    ArenaMark mark = arena_mark(&writer->scratch);
    int obstacles = header->obstacle_count, cloths = header->cloth_count;
    double film[18];
    encode_film(&header->film, film);
    double *solids = arena_push(&writer->scratch, double, 5 * obstacles);
    for (int i = 0; i < obstacles; i++) {
        const Solid *solid = &header->obstacles[i].solid;
        int kind = header->obstacles[i].mesh ? STATE_KIND_MESH : (int)solid->kind;
        double numbers[5] = {kind, solid->half.x, solid->half.y, solid->half.z, solid->radius};
        memcpy(solids + 5 * i, numbers, sizeof numbers);
    }
    double *thickness = arena_push(&writer->scratch, double, cloths);
    for (int i = 0; i < cloths; i++) {
        thickness[i] = header->cloths[i].thickness;
    }
    double *widths = arena_push(&writer->scratch, double, cloths);
    char *prints = list_prints(writer, header, widths);
    char *obstacle_text = lines_of(writer, obstacles, 2, obstacle_field, header->obstacles);
    char *cloth_text = lines_of(writer, cloths, 3, cloth_field, header->cloths);
    int64_t hash = (int64_t)header->scene_hash;
    StateArray arrays[11 + FILM_ARRAYS + MESH_ARRAYS] = {
        array_of("program", STATE_U8, 1, (int64_t)strlen(header->program), header->program),
        array_of("scene_text", STATE_U8, 1, (int64_t)strlen(header->scene_text),
                 header->scene_text),
        array_of("scene_path", STATE_U8, 1, (int64_t)strlen(header->scene_path),
                 header->scene_path),
        array_of("scene_hash", STATE_I64, 1, 1, &hash),
        array_of("film", STATE_F64, 1, 18, film),
        array_of("obstacle.text", STATE_U8, 1, (int64_t)strlen(obstacle_text), obstacle_text),
        array_of("obstacle.solid", STATE_F64, 5, obstacles, solids),
        array_of("cloth.text", STATE_U8, 1, (int64_t)strlen(cloth_text), cloth_text),
        array_of("cloth.thickness", STATE_F64, 1, cloths, thickness),
        array_of("cloth.print", STATE_U8, 1, (int64_t)strlen(prints), prints),
        array_of("cloth.print_width", STATE_F64, 1, cloths, widths),
    };
    film_record_encode(&header->film, &writer->scratch, arrays + 11);
    int count = 11 + FILM_ARRAYS;
    count += list_meshes(writer, header, arrays + count);
    bool ok = write_record(writer, STATE_HEAD, arrays, count, error);
    arena_rewind(&writer->scratch, mark);
    return ok;
}

bool state_write_layout(StateWriter *writer, const StateLayout *l, Error *error) {
    int cloths = l->cloth_count, w_rows = l->w_count > 0 ? l->vertex_count + 1 : 0;
    StateArray arrays[] = {
        array_of("lattice", STATE_I32, 4, cloths, l->lattice),
        array_of("node_begin", STATE_I32, 1, cloths + 1, l->node_begin),
        array_of("vertex_begin", STATE_I32, 1, cloths + 1, l->vertex_begin),
        array_of("triangle_begin", STATE_I32, 1, cloths + 1, l->triangle_begin),
        array_of("material", STATE_F64, 2, l->node_count, l->material),
        array_of("rest", STATE_F64, 3, l->node_count, l->rest),
        array_of("vertex_material", STATE_F64, 2, l->vertex_count, l->vertex_material),
        array_of("triangles", STATE_I32, 3, l->triangle_count, l->triangles),
        array_of("w.start", STATE_I32, 1, w_rows, l->w_start),
        array_of("w.column", STATE_I32, 1, l->w_count, l->w_column),
        array_of("w.value", STATE_F64, 1, l->w_count, l->w_value),
        array_of("outline", STATE_F64, 2, l->outline_count, l->outline),
        array_of("outline_begin", STATE_I32, 1, l->loop_count + 1, l->outline_begin),
        array_of("loop_begin", STATE_I32, 1, cloths + 1, l->loop_begin),
    };
    return write_record(writer, STATE_LAYOUT, arrays, sizeof arrays / sizeof *arrays, error);
}

bool state_write_frame(StateWriter *writer, const StateFrame *frame, int node_count,
                       const StateArray *extra, int extra_count, Error *error) {
    ASSERT(extra_count <= WRITER_MAX_ARRAYS - 7);
    int32_t number = frame->frame;
    StateArray arrays[WRITER_MAX_ARRAYS] = {
        array_of("frame", STATE_I32, 1, 1, &number),
        array_of("time", STATE_F64, 1, 1, &frame->time),
        array_of("x", STATE_F64, 3, node_count, frame->x),
        array_of("v", STATE_F64, 3, node_count, frame->v),
        array_of("pose", STATE_F64, 7, frame->pose_count, frame->pose),
    };
    int count = 5;
    if (frame->moved_count > 0) {
        arrays[count++] =
            array_of("obstacle.moved", STATE_F64, 3, frame->moved_count, frame->moved);
    }
    if (frame->contact_force) {
        arrays[count++] = array_of("contact.force", STATE_F64, 3, node_count, frame->contact_force);
    }
    if (extra_count > 0) {
        memcpy(arrays + count, extra, (size_t)extra_count * sizeof *extra);
    }
    return write_record(writer, STATE_FRAME, arrays, count + extra_count, error);
}

bool state_write_done(StateWriter *writer, const char *reason, Error *error) {
    StateArray array = array_of("reason", STATE_U8, 1, (int64_t)strlen(reason), reason);
    return write_record(writer, STATE_DONE, &array, 1, error);
}

StateWriter *state_append(const char *path, int last_frame, Error *error) {
    StateReader *reader = state_open(path, error);
    if (!reader) {
        return NULL;
    }
    state_refresh(reader);
    int64_t end = state_frame_end(reader, last_frame);
    state_reader_close(reader);
    if (end < 0) {
        error_set(error, EXIT_BAD_INPUT, "%s: holds no whole frame %d", path, last_frame);
        return NULL;
    }
    StateWriter *writer = writer_open(path, O_WRONLY, error);
    if (writer && (ftruncate(writer->file, end) != 0 || lseek(writer->file, end, SEEK_SET) < 0)) {
        error_set_errno(error, EXIT_IO, "cannot cut %s after frame %d", path, last_frame);
        state_close(writer, NULL);
        return NULL;
    }
    return writer;
}
