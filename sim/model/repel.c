#include "sim/model/repel.h"

#include <math.h>
#include <stdlib.h>

#define SLACK 0.25   /* of the spacing: motion of a particle until pairs are found anew */
#define CLOSEST 1e-3 /* of the spacing: below, the force stays finite */

static Vec3 place_of(const double *x, int i) { return vec3_load(x + 3 * (size_t)i); }

Repel *repel_create(const Panel *panel, double strength, const double *start, Arena *arena) {
    Repel *r = arena_push(arena, Repel, 1);
    Vec3 *centres = arena_push(arena, Vec3, panel->node_count);
    for (int i = 0; i < panel->node_count; i++) {
        centres[i] = place_of(start, i);
    }
    *r = (Repel){.spacing = fmin(panel->h1, panel->h2),
                 .strength = strength,
                 .nu = panel->nu,
                 .wrap = panel->wrap,
                 .node_count = panel->node_count,
                 .arena = arena,
                 .tree = box_tree_create(centres, panel->node_count, arena),
                 .places = arena_push(arena, Box, panel->node_count)};
    return r;
}

/* on a thread within three, or in one cell */
static bool share_unit(const Repel *r, int a, int b) {
    int across = abs(a % r->nu - b % r->nu), along = abs(a / r->nu - b / r->nu);
    across = r->wrap && r->nu - across < across ? r->nu - across : across;
    return (along == 0 && across <= 2) || (across == 0 && along <= 2) ||
           (along <= 1 && across <= 1);
}

static void add_pair(int a, int b, void *context) {
    Repel *r = context;
    if (share_unit(r, a, b)) {
        return;
    }
    if (r->pair_count == r->pair_room) {
        int room = 2 * r->pair_room + 256;
        r->pairs = arena_grow(r->arena, int, r->pairs, 2 * r->pair_count, 2 * room);
        r->pair_room = room;
    }
    r->pairs[2 * r->pair_count] = a;
    r->pairs[2 * r->pair_count++ + 1] = b;
}

static bool moved_far(const Repel *r, const double *x) {
    double most = SLACK * r->spacing;
    for (int i = 0; i < r->node_count; i++) {
        Vec3 d = vec3_sub(place_of(x, i), r->places[i].low);
        if (!(vec3_dot(d, d) <= most * most)) {
            return true;
        }
    }
    return false;
}

static void find_pairs(Repel *r, const double *x) {
    if (r->found && !moved_far(r, x)) {
        return;
    }
    for (int i = 0; i < r->node_count; i++) {
        r->places[i] = (Box){place_of(x, i), place_of(x, i)};
    }
    r->found = true;
    r->pair_count = 0;
    box_tree_refit(&r->tree, r->places);
    box_tree_pairs(&r->tree, (1.0 + 2.0 * SLACK) * r->spacing, add_pair, r);
}

/* R at a distance, and its slope [N] */
static double law(const Repel *r, double distance, double *slope) {
    double s = r->spacing, safe = fmax(distance, CLOSEST * s), left = (s - safe) / s;
    double fourth = left * left * left * left, fifth = fourth * left;
    *slope = -r->strength * (5.0 * fourth / safe + fifth * s / (safe * safe));
    return r->strength * fifth * s / safe + *slope * (distance - safe);
}

double repel_energy(Repel *r, const double *x) {
    double sum = 0.0, slope;
    find_pairs(r, x);
    for (int k = 0; k < r->pair_count; k++) {
        const int *p = r->pairs + 2 * (size_t)k;
        double distance = vec3_length(vec3_sub(place_of(x, p[1]), place_of(x, p[0])));
        sum += distance < r->spacing ? law(r, distance, &slope) : 0.0;
    }
    return sum;
}

void repel_add_gradient(Repel *r, const double *x, double *gradient) {
    find_pairs(r, x);
    for (int k = 0; k < r->pair_count; k++) {
        const int *p = r->pairs + 2 * (size_t)k;
        Vec3 d = vec3_sub(place_of(x, p[1]), place_of(x, p[0]));
        double distance = vec3_length(d), slope;
        if (distance >= r->spacing || distance == 0.0) { /* in one place: no direction */
            continue;
        }
        law(r, distance, &slope);
        double *a = gradient + 3 * (size_t)p[0], *b = gradient + 3 * (size_t)p[1];
        vec3_store(a, vec3_axpy(vec3_load(a), -slope / distance, d));
        vec3_store(b, vec3_axpy(vec3_load(b), slope / distance, d));
    }
}
