/* reader.c: reads states files, also while they grow. Nothing that a file says is believed
 * before it was checked: records by their checksum, shapes and indices by layout_check. */
#include <errno.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "sim/base/hash.h"
#include "sim/base/memory.h"
#include "sim/state/decode.h"

typedef struct Entry {
    int64_t begin, end; /* offsets of a frame's record */
    int layout;         /* index into layouts */
} Entry;

struct StateReader {
    int file;
    int64_t scanned; /* offset up to which records are known */
    bool done;
    int frame_count, frame_capacity, layout_count, layout_capacity;
    Entry *frames;
    Entry *layouts;
    int layout_loaded; /* index, -1: none */
    StateHeader header;
    StateLayout layout;
    int array_count;
    StateArray arrays[RECORD_MAX_ARRAYS];
    Arena arena, layout_arena, frame_arena;
    char *path;
    char *done_reason;
    char damage[256];
};

static bool read_at(int file, int64_t offset, void *data, size_t bytes) {
    char *cursor = data;
    while (bytes > 0) {
        ssize_t got = pread(file, cursor, bytes, offset);
        if (got <= 0 && !(got < 0 && errno == EINTR)) {
            return false;
        }
        if (got > 0) {
            cursor += got;
            offset += got;
            bytes -= (size_t)got;
        }
    }
    return true;
}

typedef enum LoadResult { LOAD_OK, LOAD_SHORT, LOAD_WRONG } LoadResult;

/* Reads the record at `offset`; arrays point into `arena`. */
static LoadResult load_record(StateReader *reader, int64_t offset, Arena *arena, RecordHead *head,
                              StateArray *arrays, const char **why) {
    unsigned char bytes[RECORD_HEAD];
    struct stat status;
    if (fstat(reader->file, &status) != 0 || status.st_size - offset < RECORD_HEAD ||
        !read_at(reader->file, offset, bytes, sizeof bytes)) {
        return LOAD_SHORT;
    }
    if (!record_decode_head(bytes, head, why)) {
        return LOAD_WRONG;
    }
    if (status.st_size - offset - RECORD_HEAD < (int64_t)head->payload_bytes) {
        return LOAD_SHORT;
    }
    unsigned char *payload = arena_alloc(arena, head->payload_bytes);
    if (!read_at(reader->file, offset + RECORD_HEAD, payload, head->payload_bytes)) {
        return LOAD_SHORT;
    }
    if (hash_bytes(payload, head->payload_bytes) != head->checksum) {
        *why = "the checksum is wrong";
        return LOAD_WRONG;
    }
    return record_decode_arrays(head, payload, arrays, why) ? LOAD_OK : LOAD_WRONG;
}

static void note_damage(StateReader *reader, int64_t offset, const char *why) {
    snprintf(reader->damage, sizeof reader->damage,
             "damaged at byte %lld: %s; the %d frames before it are good", (long long)offset, why,
             reader->frame_count);
}

static void push_entry(Entry **entries, int *count, int *capacity, Entry entry) {
    if (*count == *capacity) {
        *capacity = *capacity ? 2 * *capacity : 64;
        Entry *grown = memory_resize(*entries, (size_t)*capacity * sizeof **entries);
        *entries = grown;
    }
    (*entries)[(*count)++] = entry;
}

/* Takes one good record into the index. False: it stands in a wrong place. */
static bool index_record(StateReader *reader, const RecordHead *head, const StateArray *arrays,
                         int64_t offset, int64_t end, const char **why) {
    int count = (int)head->array_count;
    Entry entry = {offset, end, reader->layout_count - 1};
    if (head->kind == STATE_LAYOUT) {
        StateLayout layout;
        if (!decode_layout(arrays, count, &reader->header, &layout, why)) {
            return false;
        }
        push_entry(&reader->layouts, &reader->layout_count, &reader->layout_capacity, entry);
        reader->layout = layout;
        return true;
    }
    if (head->kind == STATE_FRAME) {
        StateFrame frame;
        if (reader->layout_count == 0) {
            *why = "a frame stands before the first layout";
            return false;
        }
        if (!decode_frame(arrays, count, &reader->header, &reader->layout, &frame, why)) {
            return false;
        }
        push_entry(&reader->frames, &reader->frame_count, &reader->frame_capacity, entry);
        return true;
    }
    if (head->kind == STATE_DONE) {
        const StateArray *reason = record_find(arrays, count, "reason", STATE_U8, 1);
        reader->done_reason = decode_text(reason, &reader->arena);
        reader->done = true;
        return true;
    }
    *why = "a second header";
    return false;
}

StateStatus state_refresh(StateReader *reader) {
    while (!reader->done && !reader->damage[0]) {
        RecordHead head = {0};
        const char *why = "";
        StateArray arrays[RECORD_MAX_ARRAYS];
        ArenaMark mark = arena_mark(&reader->frame_arena);
        LoadResult result =
            load_record(reader, reader->scanned, &reader->frame_arena, &head, arrays, &why);
        int64_t end = 0;
        if (result == LOAD_OK) { /* the size of any other record may be anything */
            end = reader->scanned + RECORD_HEAD + (int64_t)head.payload_bytes;
        }
        if (result == LOAD_OK && !index_record(reader, &head, arrays, reader->scanned, end, &why)) {
            result = LOAD_WRONG;
        }
        if (result == LOAD_OK && head.kind == STATE_LAYOUT) {
            reader->layout_loaded = -1; /* its arrays are gone after the rewind */
        }
        arena_rewind(&reader->frame_arena, mark);
        if (result == LOAD_SHORT) {
            break;
        }
        if (result == LOAD_WRONG) {
            note_damage(reader, reader->scanned, why);
            break;
        }
        reader->scanned = end;
    }
    return reader->damage[0] ? STATE_DAMAGED : reader->done ? STATE_FINISHED : STATE_GROWING;
}

static bool check_file_head(StateReader *reader, const char *path, Error *error) {
    unsigned char head[RECORD_FILE_HEAD];
    uint32_t version, zero;
    memset(head, 0, sizeof head);
    bool whole = read_at(reader->file, 0, head, sizeof head);
    memcpy(&zero, head + 12, sizeof zero);
    if (!whole || memcmp(head, RECORD_MAGIC, 8) != 0 || zero != 0) {
        return error_set(error, EXIT_BAD_INPUT, "%s: not a toile states file", path);
    }
    memcpy(&version, head + 8, sizeof version);
    if (version != STATE_VERSION) {
        return error_set(error, EXIT_BAD_INPUT,
                         "%s: written in version %u of the states format; this is version %d", path,
                         version, STATE_VERSION);
    }
    return true;
}

static bool read_header(StateReader *reader, const char *path, Error *error) {
    RecordHead head = {0};
    const char *why = "the file ends inside the header";
    StateArray arrays[RECORD_MAX_ARRAYS];
    LoadResult result = load_record(reader, RECORD_FILE_HEAD, &reader->arena, &head, arrays, &why);
    if (result == LOAD_OK && head.kind != STATE_HEAD) {
        result = LOAD_WRONG;
        why = "the header is missing";
    }
    if (result != LOAD_OK ||
        !decode_header(arrays, (int)head.array_count, &reader->arena, &reader->header, &why)) {
        return error_set(error, EXIT_BAD_INPUT, "%s: damaged states file: %s", path, why);
    }
    reader->scanned = RECORD_FILE_HEAD + RECORD_HEAD + (int64_t)head.payload_bytes;
    return true;
}

StateReader *state_open(const char *path, Error *error) {
    int file = open(path, O_RDONLY | O_CLOEXEC);
    if (file < 0) {
        ExitCode code = errno == ENOENT ? EXIT_MISSING_INPUT : EXIT_IO;
        error_set_errno(error, code, "cannot read %s", path);
        return NULL;
    }
    StateReader *reader = memory_zeroed(1, sizeof *reader);
    reader->file = file;
    reader->layout_loaded = -1;
    reader->path = arena_strdup(&reader->arena, path);
    reader->done_reason = "";
    if (!check_file_head(reader, path, error) || !read_header(reader, path, error)) {
        state_reader_close(reader);
        return NULL;
    }
    return reader;
}

void state_reader_close(StateReader *reader) {
    close(reader->file);
    free(reader->frames);
    free(reader->layouts);
    arena_free(&reader->arena);
    arena_free(&reader->layout_arena);
    arena_free(&reader->frame_arena);
    free(reader);
}

const StateHeader *state_header(const StateReader *reader) { return &reader->header; }
int state_frame_count(const StateReader *reader) { return reader->frame_count; }
const char *state_damage(const StateReader *reader) { return reader->damage; }
const char *state_done_reason(const StateReader *reader) { return reader->done_reason; }

int64_t state_frame_end(const StateReader *reader, int index) {
    return index >= 0 && index < reader->frame_count ? reader->frames[index].end : -1;
}

static bool load_layout(StateReader *reader, int index, Error *error) {
    if (reader->layout_loaded == index) {
        return true;
    }
    RecordHead head;
    const char *why = "it can no longer be read";
    StateArray arrays[RECORD_MAX_ARRAYS];
    arena_free(&reader->layout_arena);
    reader->layout_loaded = -1;
    if (load_record(reader, reader->layouts[index].begin, &reader->layout_arena, &head, arrays,
                    &why) != LOAD_OK ||
        !decode_layout(arrays, (int)head.array_count, &reader->header, &reader->layout, &why)) {
        return error_set(error, EXIT_BAD_INPUT, "%s: layout %d: %s", reader->path, index, why);
    }
    reader->layout_loaded = index;
    return true;
}

bool state_read_frame(StateReader *reader, int index, StateFrame *frame, StateLayout *layout,
                      int *layout_index, Error *error) {
    ASSERT(index >= 0 && index < reader->frame_count);
    int layout_number = reader->frames[index].layout;
    if (!load_layout(reader, layout_number, error)) {
        return false;
    }
    RecordHead head;
    const char *why = "it can no longer be read";
    arena_rewind(&reader->frame_arena, (ArenaMark){0});
    reader->array_count = 0;
    if (load_record(reader, reader->frames[index].begin, &reader->frame_arena, &head,
                    reader->arrays, &why) != LOAD_OK ||
        !decode_frame(reader->arrays, (int)head.array_count, &reader->header, &reader->layout,
                      frame, &why)) {
        return error_set(error, EXIT_BAD_INPUT, "%s: frame %d: %s", reader->path, index, why);
    }
    reader->array_count = (int)head.array_count;
    *layout = reader->layout;
    if (layout_index) {
        *layout_index = layout_number;
    }
    return true;
}

const StateArray *state_frame_array(const StateReader *reader, const char *name, StateType type,
                                    int components) {
    return record_find(reader->arrays, reader->array_count, name, type, components);
}

double state_frame_statistic(const StateReader *reader, const char *name) {
    const StateArray *names = state_frame_array(reader, "statistics", STATE_U8, 1);
    const StateArray *values = state_frame_array(reader, "stat", STATE_F64, 1);
    if (!names || !values) {
        return NAN;
    }
    const char *line = names->data, *end = line + names->count;
    for (int64_t i = 0; i < values->count && line < end; i++) {
        const char *newline = memchr(line, '\n', (size_t)(end - line));
        const char *line_end = newline ? newline : end;
        if ((size_t)(line_end - line) == strlen(name) &&
            memcmp(line, name, (size_t)(line_end - line)) == 0) {
            return ((const double *)values->data)[i];
        }
        line = line_end + 1;
    }
    return NAN;
}

void state_surface(const StateLayout *layout, const double *x, double *surface) {
    if (layout->w_count == 0) {
        memcpy(surface, x, (size_t)layout->vertex_count * 3 * sizeof *x);
        return;
    }
    for (int i = 0; i < layout->vertex_count; i++) {
        double s[3] = {0, 0, 0};
        for (int k = layout->w_start[i]; k < layout->w_start[i + 1]; k++) {
            const double *node = x + 3 * (size_t)layout->w_column[k];
            for (int c = 0; c < 3; c++) {
                s[c] += layout->w_value[k] * node[c];
            }
        }
        memcpy(surface + 3 * (size_t)i, s, sizeof s);
    }
}
