/* The parent's side: reads the file, starts the parser in a child, checks every number. */
#include "sim/scene/mesh_import.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "sim/base/clock.h"
#include "sim/base/vec.h"
#include "sim/scene/mesh_assimp.h"

#define LONGEST_URI 200 /* of a file beside a .gltf */

/* The shadow of AddressSanitizer needs terabytes of addresses: gcc's name and clang's. */
#ifdef __has_feature
#define HAS_FEATURE(name) __has_feature(name)
#else
#define HAS_FEATURE(name) 0
#endif
#if defined(__SANITIZE_ADDRESS__) || HAS_FEATURE(address_sanitizer)
#define ADDRESSES_UNLIMITED 1
#else
#define ADDRESSES_UNLIMITED 0
#endif

typedef struct Format {
    const char *ending;
    MeshUp up;
    double unit; /* [m] */
} Format;

/* see the table in mesh_import.h */
static const Format formats[] = {{"glb", MESH_UP_Y, 1.0},  {"gltf", MESH_UP_Y, 1.0},
                                 {"fbx", MESH_UP_Y, 0.01}, {"obj", MESH_UP_Y, 1.0},
                                 {"ply", MESH_UP_Z, 1.0},  {"stl", MESH_UP_Z, 1.0}};
#define FORMAT_COUNT (sizeof formats / sizeof formats[0])

MeshImportDef mesh_import_default(void) {
    return (MeshImportDef){.up = MESH_UP_AUTO,
                           .rate = 30.0,
                           .seconds = 4.0,
                           .farthest = 1e4,
                           .patience = MESH_SECONDS};
}

static const Format *find_format(const char *path, Error *error) {
    const char *dot = strrchr(path, '.');
    for (size_t i = 0; dot && i < FORMAT_COUNT; i++) {
        if (strcasecmp(dot + 1, formats[i].ending) == 0) {
            return &formats[i];
        }
    }
    error_set(error, EXIT_BAD_INPUT, "a mesh ends in .obj, .ply, .stl, .gltf, .glb or .fbx");
    return NULL;
}

/* ---- files ---- */

/* The whole file; only plain ones, a pipe could block for ever. */
static unsigned char *read_file(const char *path, size_t *size, Arena *arena, Error *error) {
    struct stat status;
    int file = open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK);
    if (file < 0 || fstat(file, &status) != 0) {
        bool missing = errno == ENOENT || errno == ENOTDIR;
        error_set(error, missing ? EXIT_MISSING_INPUT : EXIT_IO, "%s",
                  missing ? "there is no such file" : strerror(errno));
    } else if (!S_ISREG(status.st_mode)) {
        error_set(error, EXIT_IO, "it is not a plain file");
    } else if (status.st_size > MESH_MOST_BYTES || status.st_size == 0) {
        error_set(error, EXIT_BAD_INPUT,
                  status.st_size ? "it has %lld MiB, at most %d are read" : "it is empty",
                  (long long)status.st_size >> 20, MESH_MOST_BYTES >> 20);
    } else {
        unsigned char *bytes = arena_alloc(arena, (size_t)status.st_size + 1);
        size_t at = 0;
        for (ssize_t got = 1; got > 0 && at < (size_t)status.st_size;) {
            got = read(file, bytes + at, (size_t)status.st_size - at);
            at += got > 0 ? (size_t)got : 0;
        }
        *size = at;
        close(file);
        return bytes;
    }
    if (file >= 0) {
        close(file);
    }
    return NULL;
}

/* Files that a .gltf names and that lie beside it: names without a folder, no links to follow. */
static void read_parts(MeshJob *job, const char *path, Arena *arena) {
    const char *text = (const char *)job->parts[0].bytes; /* zero-terminated by the arena */
    const char *slash = strrchr(path, '/');
    int folder = slash ? (int)(slash + 1 - path) : 0;
    while (job->part_count <= MESH_MOST_PARTS && (text = strstr(text, "\"uri\""))) {
        text += 5;
        text += strspn(text, " \t\r\n:");
        size_t length = *text == '"' ? strcspn(text + 1, "\"/\\") : 0;
        if (length == 0 || length > LONGEST_URI || text[1 + length] != '"' || text[1] == '.') {
            continue;
        }
        char *name = arena_alloc(arena, length + 1);
        char *whole = arena_alloc(arena, (size_t)folder + length + 1);
        memcpy(name, text + 1, length);
        memcpy(whole, path, (size_t)folder);
        memcpy(whole + folder, name, length);
        MeshPart part = {.name = name};
        struct stat status;
        if (lstat(whole, &status) == 0 && S_ISREG(status.st_mode) &&
            (part.bytes = read_file(whole, &part.size, arena, NULL))) {
            job->parts[job->part_count++] = part;
        }
    }
}

/* ---- the child ---- */

static void limit(int what, rlim_t value) {
    struct rlimit both = {value, value};
    setrlimit(what, &both);
}

/* Nothing but its memory, its processor and the pipe. */
static void lock_up(int out) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0);
    int nothing = open("/dev/null", O_RDWR);
    for (int i = 0; i < 3 && nothing >= 0; i++) {
        dup2(nothing, i);
    }
    dup2(out, 3);
    closefrom(4);
    limit(RLIMIT_CORE, 0);
    limit(RLIMIT_FSIZE, 0);
    limit(RLIMIT_NOFILE, 0);
    limit(RLIMIT_NPROC, 0);
    limit(RLIMIT_CPU, (rlim_t)MESH_SECONDS);
    if (!ADDRESSES_UNLIMITED) {
        limit(RLIMIT_AS, MESH_MEMORY);
    }
    for (int s = 1; s < NSIG; s++) {
        signal(s, SIG_DFL);
    }
}

static pid_t start_child(const MeshJob *job, int *in, Error *error) {
    int ends[2];
    if (pipe2(ends, O_CLOEXEC) != 0) {
        error_set_errno(error, EXIT_IO, "cannot start the parser");
        return -1;
    }
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        lock_up(ends[1]);
        mesh_assimp_answer(job, 3);
        _exit(0);
    }
    close(ends[1]);
    if (child < 0) {
        error_set_errno(error, EXIT_IO, "cannot start the parser");
        close(ends[0]);
    }
    *in = ends[0];
    return child;
}

typedef enum Reading { READ_ALL, READ_ENDED, READ_LATE } Reading;

static Reading receive(int in, double deadline, void *to, size_t bytes) {
    char *at = to;
    while (bytes > 0) {
        double left = deadline - clock_seconds();
        struct pollfd wait = {in, POLLIN, 0};
        if (left <= 0.0) {
            return READ_LATE;
        }
        if (poll(&wait, 1, (int)(1e3 * left) + 1) <= 0) {
            continue;
        }
        ssize_t got = read(in, at, bytes);
        if (got == 0 || (got < 0 && errno != EINTR)) {
            return READ_ENDED;
        }
        at += got > 0 ? got : 0;
        bytes -= got > 0 ? (size_t)got : 0;
    }
    return READ_ALL;
}

/* ---- what came back ---- */

static bool check_counts(MeshReply *reply, const MeshJob *job, Error *error) {
    reply->text[MESH_REPLY_TEXT - 1] = '\0';
    for (char *c = reply->text; *c; c++) {
        *c = *c < ' ' || *c > '~' ? ' ' : *c;
    }
    if (reply->magic != MESH_REPLY_MAGIC) {
        return error_set(error, EXIT_BAD_INPUT, "the parser broke down on it");
    }
    if (reply->text[0]) {
        return error_set(error, EXIT_BAD_INPUT, "it cannot be read: %s", reply->text);
    }
    bool fits = reply->vertex_count > 0 && reply->vertex_count <= (int64_t)job->most_bytes / 24 &&
                reply->triangle_count > 0 && reply->triangle_count <= job->most_triangles &&
                reply->frame_count > 0 && reply->frame_count <= job->frame_count &&
                reply->vertex_count * reply->frame_count <= (int64_t)job->most_bytes / 24;
    return fits || error_set(error, EXIT_BAD_INPUT, "the parser broke down on it");
}

static bool explain(Reading reading, Error *error) {
    if (reading == READ_LATE) {
        return error_set(error, EXIT_BAD_INPUT,
                         "the parser was not done in time; the file is damaged or too large");
    }
    return error_set(error, EXIT_BAD_INPUT,
                     "the parser broke down on it: the file is damaged, or needs more than %zu GiB",
                     MESH_MEMORY >> 30);
}

static bool receive_mesh(int in, double deadline, const MeshJob *job, Arena *arena, MeshDef *mesh,
                         MeshReply *reply, Error *error) {
    Reading reading = receive(in, deadline, reply, sizeof *reply);
    if (reading != READ_ALL) {
        return explain(reading, error);
    }
    if (!check_counts(reply, job, error)) {
        return false;
    }
    size_t numbers = 3 * (size_t)reply->vertex_count * (size_t)reply->frame_count;
    int32_t *triangles = arena_push(arena, int32_t, 3 * reply->triangle_count);
    double *frames = arena_push(arena, double, numbers);
    size_t bytes = 3 * sizeof *triangles * (size_t)reply->triangle_count;
    reading = receive(in, deadline, triangles, bytes);
    reading =
        reading == READ_ALL ? receive(in, deadline, frames, numbers * sizeof *frames) : reading;
    if (reading != READ_ALL) {
        return explain(reading, error);
    }
    for (int64_t i = 0; i < 3 * reply->triangle_count; i++) {
        if (triangles[i] < 0 || triangles[i] >= reply->vertex_count) {
            return error_set(error, EXIT_BAD_INPUT, "a triangle names a vertex that is not there");
        }
    }
    mesh->vertex_count = (int)reply->vertex_count;
    mesh->triangle_count = (int)reply->triangle_count;
    mesh->frame_count = (int)reply->frame_count;
    mesh->triangles = triangles;
    mesh->frames = mesh->vertices = frames;
    return true;
}

/* To metres and z up, in place; y up becomes z up by a quarter turn about x. */
static bool convert(const MeshImportDef *def, MeshDef *mesh, Error *error) {
    double *numbers = (double *)mesh->frames;
    for (size_t i = 0; i < (size_t)mesh->vertex_count * (size_t)mesh->frame_count; i++) {
        double *p = numbers + 3 * i;
        bool uv = def->uv > 0.0 && i >= (size_t)mesh->vertex_count;
        for (int k = 0; k < 3; k++) {
            if (!isfinite(p[k])) {
                return error_set(error, EXIT_BAD_INPUT, "vertex %zu is not finite",
                                 i % (size_t)mesh->vertex_count);
            }
            p[k] *= uv ? def->uv : mesh->scale;
            if (fabs(p[k]) > def->farthest) {
                return error_set(error, EXIT_BAD_INPUT,
                                 "it reaches to %g m, at most %g are allowed; is '%s' right?",
                                 fabs(p[k]), def->farthest, uv ? "uv" : "scale");
            }
        }
        if (mesh->up == MESH_UP_Y && !uv) {
            vec3_store(p, vec3(p[0], 0.0 - p[2], p[1])); /* no -0 */
        }
    }
    return true;
}

static void choose_units(const MeshImportDef *def, const Format *format, const MeshReply *reply,
                         MeshDef *mesh) {
    bool says = isfinite(reply->unit) && reply->unit > 0.0;
    double own = says ? reply->unit : format->unit;
    mesh->scale = def->scale > 0.0 ? def->scale : own;
    mesh->up = def->up != MESH_UP_AUTO ? def->up : reply->up == 2 ? MESH_UP_Z : format->up;
}

static bool run_job(const MeshImportDef *def, const MeshJob *job, const Format *format,
                    Arena *scratch, MeshDef *mesh, Error *error) {
    int in;
    MeshReply reply = {0};
    pid_t child = start_child(job, &in, error);
    if (child < 0) {
        return false;
    }
    bool good =
        receive_mesh(in, clock_seconds() + def->patience, job, scratch, mesh, &reply, error);
    close(in);
    kill(child, SIGKILL);
    while (waitpid(child, NULL, 0) < 0 && errno == EINTR) {
    }
    if (good && def->up == MESH_UP_AUTO && reply.up == 0) {
        return error_set(error, EXIT_BAD_INPUT, "its x axis points up: say 'up'");
    }
    choose_units(def, format, &reply, mesh);
    return good && convert(def, mesh, error);
}

bool mesh_import(const MeshImportDef *def, Arena *arena, MeshDef *mesh, Error *error) {
    *mesh = (MeshDef){.file = def->path, .animated = def->animated, .frame_rate = def->rate};
    const Format *format = find_format(def->path, error);
    Arena scratch = {0};
    MeshJob job = {.part_count = 1,
                   .animated = def->animated,
                   .rate = def->rate,
                   .uv = def->uv > 0.0,
                   .frame_count = def->animated   ? (int)ceil(def->seconds * def->rate) + 1
                                  : def->uv > 0.0 ? 2
                                                  : 1,
                   .most_triangles = MESH_MOST_TRIANGLES,
                   .most_bytes = MESH_FRAME_BYTES};
    char name[16];
    bool good = format != NULL;
    if (good) {
        snprintf(name, sizeof name, "mesh.%s", format->ending);
        job.parts[0].name = name;
        job.parts[0].bytes = read_file(def->path, &job.parts[0].size, &scratch, error);
        good = job.parts[0].bytes != NULL;
    }
    if (good && strcmp(format->ending, "gltf") == 0) {
        read_parts(&job, def->path, &scratch);
    }
    if (good) {
        good = run_job(def, &job, format, &scratch, mesh, error) &&
               (mesh_clean(mesh, arena) ||
                error_set(error, EXIT_BAD_INPUT, "none of its triangles has an area"));
    }
    arena_free(&scratch);
    return good;
}
