#include "render/run.h"

#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>

#include "render/interrupt.h"
#include "sim/base/clock.h"
#include "sim/base/hash.h"

#define POLL_SECONDS 0.05  /* between two looks at a growing file */
#define UPRIGHT 0.999      /* smallest z of the normal of a plane that is a floor */
#define OBSTACLE_REACH 0.3 /* of the cloth's extent: how much of an obstacle around it is framed */

RunDef run_default(void) { return (RunDef){.patience = 60.0}; }

static void pause_a_little(void) {
    struct timespec time = {0, (long)(POLL_SECONDS * 1e9)};
    nanosleep(&time, NULL);
}

/* True while somebody may still write. Looks for the writer before the file is read once more,
 * so that its last frames are not missed. */
static bool writer_lives(const Run *run) {
    if (run->def.writer > 0) {
        return kill(run->def.writer, 0) == 0 || errno == EPERM;
    }
    return clock_seconds() - run->grown < run->def.patience;
}

static void find_file(Run *run) {
    struct stat status;
    bool folder = stat(run->def.path, &status) == 0 && S_ISDIR(status.st_mode);
    snprintf(run->path, sizeof run->path, "%s%s", run->def.path, folder ? "/" RUN_FILE : "");
}

bool run_open(Run *run, const RunDef *def, Error *error) {
    *run = (Run){.def = *def, .grown = clock_seconds()};
    for (;;) {
        Error why = {0};
        bool alive = def->follow && writer_lives(run);
        find_file(run);
        run->reader = state_open(run->path, &why);
        if (run->reader) {
            state_refresh(run->reader);
            return true;
        }
        struct stat status;
        bool started = stat(run->path, &status) == 0 && status.st_size > 0;
        if (!alive || (started && why.code != EXIT_BAD_INPUT)) {
            return error_set(error, why.code, "%s", why.text);
        }
        if (interrupt_requested()) {
            return error_set(error, EXIT_INTERRUPTED, "interrupted");
        }
        pause_a_little();
    }
}

void run_close(Run *run) {
    if (run->reader) {
        state_reader_close(run->reader);
    }
    *run = (Run){0};
}

RunEnd run_wait(Run *run, int index) {
    for (;;) {
        bool alive = run->def.follow && writer_lives(run);
        StateStatus status = state_refresh(run->reader);
        int count = state_frame_count(run->reader);
        if (index < count) {
            return RUN_FRAME;
        }
        if (status != STATE_GROWING) {
            return status == STATE_FINISHED ? RUN_FINISHED : RUN_DAMAGED;
        }
        if (count > run->seen) {
            run->seen = count;
            run->grown = clock_seconds();
        } else if (!alive) {
            return RUN_ABANDONED;
        }
        if (interrupt_requested()) {
            return RUN_INTERRUPTED;
        }
        pause_a_little();
    }
}

RunEnd run_wait_end(Run *run) {
    RunEnd end;
    do {
        end = run_wait(run, state_frame_count(run->reader));
    } while (end == RUN_FRAME);
    return end;
}

double run_floor(Run *run, int *obstacle, Error *error) {
    const StateHeader *header = state_header(run->reader);
    StateFrame frame;
    StateLayout layout;
    int layout_index;
    *obstacle = -1;
    if (header->obstacle_count == 0 ||
        !state_read_frame(run->reader, 0, &frame, &layout, &layout_index, error)) {
        return NAN;
    }
    for (int i = 0; i < header->obstacle_count; i++) {
        Vec3 up = quat_rotate(frame.pose[i].turn, vec3(0, 0, 1));
        if (header->obstacles[i].solid.kind == SOLID_PLANE && up.z > UPRIGHT) {
            *obstacle = i;
            return frame.pose[i].shift.z;
        }
    }
    return NAN;
}

typedef struct Bounds {
    Vec3 low, high;
} Bounds;

static double clamp(double x, double low, double high) {
    return x < low ? low : x > high ? high : x;
}

static void add_clamped(CameraReach *reach, Vec3 p, const Bounds *cloth) {
    Vec3 size = vec3_sub(cloth->high, cloth->low);
    double margin = OBSTACLE_REACH * fmax(size.x, fmax(size.y, size.z));
    camera_reach_add(reach, vec3(clamp(p.x, cloth->low.x - margin, cloth->high.x + margin),
                                 clamp(p.y, cloth->low.y - margin, cloth->high.y + margin),
                                 clamp(p.z, cloth->low.z - margin, cloth->high.z + margin)));
}

/* The corners of the part of an obstacle that lies around the cloth. */
static void add_obstacle(CameraReach *reach, const Solid *solid, Pose pose, const Bounds *cloth) {
    double bound = solid_bound(solid);
    if (!isfinite(bound)) {
        return;
    }
    Vec3 extent = solid->half;
    double r = solid->radius;
    bool round = solid->kind != SOLID_BOX;
    extent = round ? vec3(r, r, solid->kind == SOLID_SPHERE ? r : extent.z) : extent;
    extent.z += solid->kind == SOLID_CAPSULE ? r : 0.0;
    for (int corner = 0; corner < 8; corner++) {
        Vec3 p = vec3(corner & 1 ? extent.x : -extent.x, corner & 2 ? extent.y : -extent.y,
                      corner & 4 ? extent.z : -extent.z);
        add_clamped(reach, pose_apply(pose, p), cloth);
    }
}

static void add_mesh(CameraReach *reach, const StateMesh *mesh, const double *vertices, Pose pose,
                     const Bounds *cloth) {
    for (int i = 0; i < mesh->vertex_count; i++) {
        add_clamped(reach, pose_apply(pose, vec3_load(vertices + 3 * (size_t)i)), cloth);
    }
}

static void add_frame(CameraReach *reach, const StateHeader *header, const StateFrame *frame,
                      int node_count) {
    Bounds cloth = {vec3_load(frame->x), vec3_load(frame->x)};
    for (int i = 0; i < node_count; i++) {
        Vec3 p = vec3_load(frame->x + 3 * i);
        camera_reach_add(reach, p);
        cloth.low = vec3(fmin(cloth.low.x, p.x), fmin(cloth.low.y, p.y), fmin(cloth.low.z, p.z));
        cloth.high =
            vec3(fmax(cloth.high.x, p.x), fmax(cloth.high.y, p.y), fmax(cloth.high.z, p.z));
    }
    for (int i = 0; i < header->obstacle_count; i++) {
        const StateObstacle *obstacle = &header->obstacles[i];
        if (obstacle->mesh) {
            add_mesh(reach, obstacle->mesh, state_mesh_vertices(header, frame, i), frame->pose[i],
                     &cloth);
        } else {
            add_obstacle(reach, &obstacle->solid, frame->pose[i], &cloth);
        }
    }
}

bool run_find_reach(Run *run, int width, int height, CameraReach *reach, Error *error) {
    const StateHeader *header = state_header(run->reader);
    StateFrame frame;
    StateLayout layout;
    int layout_index;
    *reach = camera_reach_start(&header->film, width, height);
    for (int i = 0; i < state_frame_count(run->reader); i++) {
        if (!state_read_frame(run->reader, i, &frame, &layout, &layout_index, error)) {
            return false;
        }
        add_frame(reach, header, &frame, layout.node_count);
    }
    return true;
}

bool run_hash(Run *run, int first, int end, uint64_t *hash, Error *error) {
    const StateHeader *header = state_header(run->reader);
    StateFrame frame;
    StateLayout layout;
    int layout_index;
    *hash = header->scene_hash;
    for (int i = first; i < end; i++) {
        if (!state_read_frame(run->reader, i, &frame, &layout, &layout_index, error)) {
            return false;
        }
        uint64_t parts[7] = {
            *hash,
            hash_bytes(frame.x, 3 * sizeof *frame.x * (size_t)layout.node_count),
            hash_bytes(frame.pose, sizeof *frame.pose * (size_t)frame.pose_count),
            hash_bytes(layout.vertex_material, 2 * sizeof(double) * (size_t)layout.vertex_count),
            hash_bytes(layout.triangles, 3 * sizeof(int32_t) * (size_t)layout.triangle_count),
            (uint64_t)frame.frame,
            hash_bytes(frame.moved, 3 * sizeof *frame.moved * (size_t)frame.moved_count)};
        *hash = hash_bytes(parts, sizeof parts);
    }
    return true;
}
