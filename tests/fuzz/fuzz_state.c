/* Fuzzes the states reader: no file may crash it, leak, or make it read or index outside of what
 * the file holds. Every input is tried twice: as it is, and with the checksums of its records put
 * right, or nothing would ever come past them.
 * Needs clang -fsanitize=fuzzer; corpus: small states files (scripts/fuzz.sh makes them). */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

#include "sim/base/hash.h"
#include "sim/state/record.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* A failed ASSERT ends in _exit; here it is a crash, of which the fuzzer keeps the input. */
_Noreturn void _exit(int status) {
    (void)status;
    abort();
}

static volatile double sink; /* what is read must not be optimised away */

static void touch(const double *numbers, int64_t count) {
    for (int64_t i = 0; i < count; i++) {
        sink = numbers[i];
    }
}

static void read_one_frame(StateReader *reader, int index) {
    StateFrame frame;
    StateLayout layout;
    int layout_index;
    Error error = {0};
    if (!state_read_frame(reader, index, &frame, &layout, &layout_index, &error)) {
        ASSERT(error.text[0]); /* a frame that was counted can be read: the file does not change */
        abort();
    }
    touch(frame.x, 3 * (int64_t)layout.node_count);
    touch(frame.v, 3 * (int64_t)layout.node_count);
    touch(layout.rest, 3 * (int64_t)layout.node_count);
    touch(layout.outline, 2 * (int64_t)layout.outline_count);
    for (int i = 0; i < frame.pose_count; i++) {
        sink = frame.pose[i].turn.w;
    }
    const StateHeader *header = state_header(reader);
    for (int i = 0; i < header->obstacle_count; i++) {
        const StateMesh *mesh = header->obstacles[i].mesh;
        if (mesh) {
            const double *vertices = state_mesh_vertices(header, &frame, i);
            touch(vertices, 3 * (int64_t)mesh->vertex_count);
            for (int k = 0; k < 3 * mesh->triangle_count; k++) {
                sink = vertices[3 * (size_t)mesh->triangles[k] + 2];
            }
        }
    }
    double *surface = calloc((size_t)layout.vertex_count * 3 + 1, sizeof *surface);
    ASSERT(surface);
    state_surface(&layout, frame.x, surface);
    for (int i = 0; i < 3 * layout.triangle_count; i++) {
        sink = surface[3 * (size_t)layout.triangles[i] + 2];
    }
    free(surface);
    const StateArray *array = state_frame_array(reader, "x", STATE_F64, 3);
    ASSERT(array && array->count == layout.node_count);
    ASSERT(!state_frame_array(reader, "no such array", STATE_I64, 1));
    sink = state_frame_statistic(reader, "steps");
    sink = state_frame_statistic(reader, "");
    ASSERT(state_frame_end(reader, index) > 0);
}

static void read_header(const StateHeader *header) {
    size_t letters = strlen(header->program) + strlen(header->scene_path);
    letters += strlen(header->scene_text);
    for (int i = 0; i < header->cloth_count; i++) {
        const StateCloth *cloth = &header->cloths[i];
        letters += strlen(cloth->name) + strlen(cloth->fabric) + strlen(cloth->look);
    }
    for (int i = 0; i < header->obstacle_count; i++) {
        letters += strlen(header->obstacles[i].name) + strlen(header->obstacles[i].look);
        ASSERT(isfinite(header->obstacles[i].solid.radius));
    }
    sink = (double)letters;
}

static void read_file(const unsigned char *bytes, size_t size) {
    int file = memfd_create("fuzz", 0);
    ASSERT(file >= 0 && write(file, bytes, size) == (ssize_t)size);
    char path[64];
    snprintf(path, sizeof path, "/proc/self/fd/%d", file);
    Error error = {0};
    StateReader *reader = state_open(path, &error);
    if (reader) {
        StateStatus status = state_refresh(reader);
        ASSERT((status == STATE_DAMAGED) == (state_damage(reader)[0] != 0));
        ASSERT(state_refresh(reader) == status);
        read_header(state_header(reader));
        sink = (double)strlen(state_done_reason(reader));
        int count = state_frame_count(reader);
        for (int i = 0; i < count; i++) {
            read_one_frame(reader, count - 1 - i); /* backwards: layouts are loaded again */
        }
        state_reader_close(reader);
    } else {
        ASSERT(error.text[0] && error.code == EXIT_BAD_INPUT);
    }
    close(file);
}

/* Puts magic, version and the checksums of all whole records right. */
static void repair(unsigned char *bytes, size_t size) {
    const uint32_t version[2] = {STATE_VERSION, 0};
    memcpy(bytes, RECORD_MAGIC, 8);
    memcpy(bytes + 8, version, sizeof version);
    for (size_t at = RECORD_FILE_HEAD; size - at >= RECORD_HEAD;) {
        uint64_t payload;
        memcpy(&payload, bytes + at + 8, sizeof payload);
        if (payload > size - at - RECORD_HEAD) {
            return;
        }
        uint64_t checksum = hash_bytes(bytes + at + RECORD_HEAD, payload);
        memcpy(bytes + at + 16, &checksum, sizeof checksum);
        at += RECORD_HEAD + payload;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    read_file(data, size);
    if (size > RECORD_FILE_HEAD) {
        unsigned char *bytes = malloc(size);
        ASSERT(bytes);
        memcpy(bytes, data, size);
        repair(bytes, size);
        read_file(bytes, size);
        free(bytes);
    }
    return 0;
}
