/* Round solids are a profile (distance from the axis, height, normal) turned around z; a box is
 * six patches pushed out to its rounded surface. */
#include "render/solid_mesh.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#define TURN_PIECES 128  /* around the axis */
#define ARC_PIECES 32    /* along a quarter circle of the profile */
#define BEVEL_PIECES 4   /* along the bevel of a sharp edge */
#define BEVEL_PART 0.02  /* of the smaller dimension */
#define BEVEL_MOST 0.002 /* [m] */
#define FACE_PIECES 16   /* along a rounded edge of a box, and as many on the flat part */
#define MOST_PROFILE 256

typedef struct ProfilePoint {
    double r, z;   /* [m] */
    double nr, nz; /* unit normal */
} ProfilePoint;

typedef struct Profile {
    ProfilePoint points[MOST_PROFILE];
    int count;
    bool flat[2]; /* the first, the last ring is closed by a flat disc */
} Profile;

static void profile_add(Profile *profile, double r, double z, double angle) {
    profile->points[profile->count++] = (ProfilePoint){r, z, cos(angle), sin(angle)};
}

/* An arc of the profile around (r, z), from one angle of the normal to another. */
static void profile_arc(Profile *profile, double r, double z, double radius, double from, double to,
                        int pieces) {
    for (int i = 0; i <= pieces; i++) {
        double angle = from + (to - from) * i / pieces;
        profile_add(profile, r + radius * cos(angle), z + radius * sin(angle), angle);
    }
}

static double bevel_of(double a, double b) { return fmin(BEVEL_PART * fmin(a, b), BEVEL_MOST); }

static void profile_of(const Solid *solid, Profile *profile) {
    double r = solid->radius, h = solid->half.z, up = 0.5 * PI;
    if (solid->kind == SOLID_SPHERE) {
        profile_arc(profile, 0, 0, r, -up, up, 2 * ARC_PIECES);
    } else if (solid->kind == SOLID_CAPSULE) {
        profile_arc(profile, 0, -h, r, -up, 0, ARC_PIECES);
        profile_arc(profile, 0, h, r, 0, up, ARC_PIECES);
    } else if (solid->kind == SOLID_CYLINDER) {
        double b = bevel_of(r, h);
        profile_arc(profile, r - b, -h + b, b, -up, 0, BEVEL_PIECES);
        profile_arc(profile, r - b, h - b, b, 0, up, BEVEL_PIECES);
        profile->flat[0] = profile->flat[1] = true;
    } else { /* cone: side normal at this angle above the horizontal */
        double side = atan2(r, 2.0 * h), b = bevel_of(r, h);
        double inset = b / tan(0.5 * (up - side));
        profile->flat[0] = true;
        profile_arc(profile, r - inset, -h + b, b, -up, side, BEVEL_PIECES);
        profile_add(profile, 0, h, side);
    }
}

/* A disc from ring points first .. first + count: few large triangles instead of many slivers,
 * which the rasteriser would fill several times slower. */
static uint32_t *close_disc(uint32_t ring, uint32_t first, uint32_t count, bool upward,
                            uint32_t *out) {
    if (count < 2) {
        return out;
    }
    uint32_t half = count / 2, a = ring + first, b = a + half, c = a + count;
    *out++ = a, *out++ = upward ? b : c, *out++ = upward ? c : b;
    out = close_disc(ring, first, half, upward, out);
    return close_disc(ring, first + half, count - half, upward, out);
}

static void turn_profile(const Profile *profile, SolidMesh *mesh, Arena *arena) {
    int columns = TURN_PIECES + 1;
    mesh->vertex_count = profile->count * columns;
    int discs = profile->flat[0] + profile->flat[1];
    int most = 2 * (profile->count - 1) * TURN_PIECES + discs * TURN_PIECES;
    mesh->vertices = arena_push(arena, SolidVertex, mesh->vertex_count);
    mesh->triangles = arena_push(arena, uint32_t, 3 * most);
    SolidVertex *vertex = mesh->vertices;
    for (int i = 0; i < profile->count; i++) {
        const ProfilePoint *p = &profile->points[i];
        for (int j = 0; j < columns; j++) {
            double angle = 2.0 * PI * (j % TURN_PIECES) / TURN_PIECES;
            double c = cos(angle), s = sin(angle);
            *vertex++ = (SolidVertex){{(float)(p->r * c), (float)(p->r * s), (float)p->z},
                                      {(float)(p->nr * c), (float)(p->nr * s), (float)p->nz}};
        }
    }
    uint32_t *out = mesh->triangles;
    for (int i = 0; i + 1 < profile->count; i++) {
        for (int j = 0; j < TURN_PIECES; j++) {
            uint32_t a = (uint32_t)(i * columns + j), b = a + 1, c = a + (uint32_t)columns;
            uint32_t cell[6] = {a, b, c + 1, a, c + 1, c};
            memcpy(out, cell, sizeof cell);
            out += 6;
        }
    }
    for (int end = 0; end < 2; end++) {
        uint32_t ring = end ? (uint32_t)((profile->count - 1) * columns) : 0;
        out = profile->flat[end] ? close_disc(ring, 0, TURN_PIECES, end, out) : out;
    }
    mesh->triangle_count = (int)(out - mesh->triangles) / 3;
}

/* Place -1..1 of patch line i: dense where the edges are round. */
static double patch_place(int i, double flat) {
    if (i < FACE_PIECES) {
        return -1.0 + (1.0 - flat) * i / FACE_PIECES;
    }
    if (i <= 2 * FACE_PIECES) {
        return flat * (2.0 * (i - FACE_PIECES) / FACE_PIECES - 1.0);
    }
    return flat + (1.0 - flat) * (i - 2 * FACE_PIECES) / FACE_PIECES;
}

#define PATCH_LINES (3 * FACE_PIECES + 1)

/* One face of a box: `axis` is its normal's, `side` its sign. */
static SolidVertex *box_face(const double half[3], double radius, int axis, double side,
                             SolidVertex *vertex) {
    int a = (axis + 1) % 3, b = (axis + 2) % 3;
    for (int j = 0; j < PATCH_LINES; j++) {
        for (int i = 0; i < PATCH_LINES; i++, vertex++) {
            double p[3], core[3], d[3], length = 0.0;
            p[axis] = side * half[axis];
            p[a] = side * half[a] * patch_place(i, 1.0 - radius / half[a]);
            p[b] = half[b] * patch_place(j, 1.0 - radius / half[b]);
            for (int k = 0; k < 3; k++) {
                double inner = half[k] - radius;
                core[k] = fmax(-inner, fmin(inner, p[k]));
                d[k] = p[k] - core[k];
                length += d[k] * d[k];
            }
            length = sqrt(length);
            for (int k = 0; k < 3; k++) {
                vertex->normal[k] = (float)(d[k] / length);
                vertex->position[k] = (float)(core[k] + radius * d[k] / length);
            }
        }
    }
    return vertex;
}

static void box_mesh(const Solid *solid, SolidMesh *mesh, Arena *arena) {
    double half[3] = {solid->half.x, solid->half.y, solid->half.z};
    double smallest = fmin(half[0], fmin(half[1], half[2]));
    double radius = fmin(fmax(solid->radius, bevel_of(smallest, smallest)), smallest);
    mesh->vertex_count = 6 * PATCH_LINES * PATCH_LINES;
    mesh->triangle_count = 12 * (PATCH_LINES - 1) * (PATCH_LINES - 1);
    mesh->vertices = arena_push(arena, SolidVertex, mesh->vertex_count);
    mesh->triangles = arena_push(arena, uint32_t, 3 * mesh->triangle_count);
    SolidVertex *vertex = mesh->vertices;
    uint32_t *out = mesh->triangles;
    for (int face = 0; face < 6; face++) {
        uint32_t base = (uint32_t)(vertex - mesh->vertices);
        vertex = box_face(half, radius, face / 2, face % 2 ? 1.0 : -1.0, vertex);
        for (uint32_t j = 0; j + 1 < PATCH_LINES; j++) {
            for (uint32_t i = 0; i + 1 < PATCH_LINES; i++) {
                uint32_t a = base + j * PATCH_LINES + i, c = a + PATCH_LINES;
                uint32_t cell[6] = {a, a + 1, c + 1, a, c + 1, c};
                memcpy(out, cell, sizeof cell);
                out += 6;
            }
        }
    }
}

static void plane_mesh(double extent, SolidMesh *mesh, Arena *arena) {
    static const float corner[4][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}};
    static const uint32_t triangles[6] = {0, 1, 2, 0, 2, 3};
    mesh->vertex_count = 4;
    mesh->triangle_count = 2;
    mesh->vertices = arena_push(arena, SolidVertex, 4);
    mesh->triangles = arena_push(arena, uint32_t, 6);
    memcpy(mesh->triangles, triangles, sizeof triangles);
    for (int i = 0; i < 4; i++) {
        mesh->vertices[i] = (SolidVertex){
            {(float)extent * corner[i][0], (float)extent * corner[i][1], 0}, {0, 0, 1}};
    }
}

SolidMesh solid_mesh_create(const Solid *solid, double plane_extent, Arena *arena) {
    SolidMesh mesh = {.low = {INFINITY, INFINITY, INFINITY},
                      .high = {-INFINITY, -INFINITY, -INFINITY}};
    if (solid->kind == SOLID_PLANE) {
        plane_mesh(plane_extent, &mesh, arena);
    } else if (solid->kind == SOLID_BOX) {
        box_mesh(solid, &mesh, arena);
    } else {
        Profile profile = {.count = 0};
        profile_of(solid, &profile);
        turn_profile(&profile, &mesh, arena);
    }
    for (int i = 0; i < mesh.vertex_count; i++) {
        for (int k = 0; k < 3; k++) {
            mesh.low[k] = fminf(mesh.low[k], mesh.vertices[i].position[k]);
            mesh.high[k] = fmaxf(mesh.high[k], mesh.vertices[i].position[k]);
        }
    }
    return mesh;
}
