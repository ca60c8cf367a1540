#include "sim/reach.h"

#include <math.h>

/* What is held apart, over the cloth between: rubber tears at seven. Beyond, steps are shortened in vain or dear: contact
 * has to part cloth that draws together beside the pull. */
#define MOST_STRETCH 10.0

#define MOST_SWEEPS 20 /* over all triangles: rows of a lattice need a few */

/* A handle, and the node of it that the least cloth parts from the node where all paths begin. */
typedef struct Pull {
    int handle, place;
    double length; /* [m] of that path */
} Pull;

/* Of one cloth. `anchor`: node that is held while any is, where all paths begin. */
typedef struct Pulls {
    int anchor; /* place */
    int count;
    Pull *one; /* (count) */
} Pulls;

/* [m] of the side between corners k and k + 1 of a triangle at rest */
static double side_length(const Panel *p, int triangle, int k) {
    const int *corner = p->vertex_triangles + 3 * (size_t)triangle;
    const double *a = p->vertex_material + 2 * (size_t)corner[k];
    const double *b = p->vertex_material + 2 * (size_t)corner[(k + 1) % 3];
    double du = fabs(b[0] - a[0]), dv = b[1] - a[1];
    du = p->wrap ? fmin(du, p->nu * p->h1 - du) : du;
    return sqrt(du * du + dv * dv);
}

/* Shortens paths by the sides of one triangle; true: some became shorter. */
static bool relax(const Panel *p, int triangle, double *length) {
    const int *node = p->triangles + 3 * (size_t)triangle;
    bool shorter = false;
    for (int k = 0; k < 3; k++) {
        double *a = &length[node[k]], *b = &length[node[(k + 1) % 3]];
        double side = side_length(p, triangle, k);
        shorter = shorter || *a + side < *b || *b + side < *a;
        *b = fmin(*b, *a + side);
        *a = fmin(*a, *b + side);
    }
    return shorter;
}

/* Lengths [m] of paths along sides of triangles from `node` to every node (node_count): each is one, though perhaps not
 * the shortest; INFINITY: none was found. */
static void find_paths(const Panel *p, int node, double *length) {
    for (int i = 0; i < p->node_count; i++) {
        length[i] = i == node ? 0.0 : INFINITY;
    }
    bool shorter = true;
    for (int sweep = 0; sweep < MOST_SWEEPS && shorter; sweep++) {
        shorter = false;
        for (int t = 0; t < p->triangle_count; t++) {
            int triangle = sweep % 2 == 0 ? t : p->triangle_count - 1 - t;
            shorter = relax(p, triangle, length) || shorter;
        }
    }
}

/* the handle of a cloth that lets go last, or -1 when there is no other or none moves */
static int find_anchor(const System *system, int cloth) {
    int anchor = -1, count = 0;
    bool moves = false;
    for (int h = 0; h < system->handle_count; h++) {
        const HandleDef *def = system->handles[h].def;
        if (def->cloth == cloth) {
            bool later = anchor < 0 || def->release > system->handles[anchor].def->release;
            anchor = later ? h : anchor;
            moves = moves || def->motion.piece_count > 0;
            count++;
        }
    }
    return moves && count > 1 ? anchor : -1;
}

static Pulls pulls_create(const System *system, int cloth, int anchor, Arena *arena) {
    const Panel *panel = &system->cloths[cloth].panel;
    int first = system->first[cloth];
    double *length = arena_push(arena, double, panel->node_count);
    Pulls pulls = {system->handles[anchor].places[0], 0,
                   arena_push(arena, Pull, system->handle_count)};
    find_paths(panel, pulls.anchor - first, length);
    for (int h = 0; h < system->handle_count; h++) {
        const Handle *handle = &system->handles[h];
        Pull pull = {h, -1, INFINITY};
        bool other = handle->def->cloth == cloth && h != anchor;
        for (int i = 0; i < handle->count && other; i++) {
            int node = handle->places[i] - first;
            if (node < panel->node_count && length[node] > 0.0 && length[node] < pull.length) {
                pull = (Pull){h, handle->places[i], length[node]};
            }
        }
        if (pull.place >= 0) {
            pulls.one[pulls.count++] = pull;
        }
    }
    return pulls;
}

static bool check_pull(const System *system, const Pulls *pulls, const Pull *pull, int anchor,
                       double time, const double *x, Error *error) {
    Vec3 to = vec3_load(x + 3 * (size_t)pull->place);
    double apart = vec3_length(vec3_sub(to, vec3_load(x + 3 * (size_t)pulls->anchor)));
    const HandleDef *def = system->handles[pull->handle].def;
    if (time > def->release || apart <= MOST_STRETCH * pull->length) {
        return true;
    }
    def = def->motion.piece_count > 0 ? def : system->handles[anchor].def;
    return error_set(
        error, EXIT_BAD_INPUT,
        "%s: error: at t = %.4g s handles hold cloth '%s' at two nodes that are %.3g m "
        "apart, with %.3g m of cloth between them: no cloth stretches so far",
        def->where ? def->where : system->scene->path, time, system->cloths[def->cloth].def->name,
        apart, pull->length);
}

static bool check_cloth(const System *system, int cloth, int anchor, Arena *arena, Error *error) {
    const Film *film = &system->scene->film;
    Pulls pulls = pulls_create(system, cloth, anchor, arena);
    double *x = arena_push(arena, double, 3 * system->place_count);
    for (int frame = 1; frame < film->frame_count; frame++) {
        double time = frame / film->rate;
        system_place_held(system, time, x);
        for (int k = 0; k < pulls.count; k++) {
            if (!check_pull(system, &pulls, &pulls.one[k], anchor, time, x, error)) {
                return false;
            }
        }
    }
    return true;
}

bool reach_check(const System *system, Error *error) {
    bool ok = true;
    for (int c = 0; c < system->cloth_count && ok; c++) {
        int anchor = find_anchor(system, c);
        if (anchor >= 0) {
            ArenaMark mark = arena_mark(system->arena);
            ok = check_cloth(system, c, anchor, system->arena, error);
            arena_rewind(system->arena, mark);
        }
    }
    return ok;
}
