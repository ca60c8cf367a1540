#include "sim/contact/quiet.h"

#include <math.h>

#include "sim/contact/engine.h"

#define QUIET_FASTER 2.0 /* than in the last step: more makes the interval be done again */

static bool is_lattice(const Surface *surface, int panel) { return surface->panels[panel].nu > 0; }

/* ---- trees ---- */

Quiet quiet_create(const Surface *surface, Arena *arena) {
    Quiet quiet = {.panels = arena_push(arena, QuietPanel, surface->panel_count)};
    for (int p = 0; p < surface->panel_count; p++) {
        QuietPanel *panel = &quiet.panels[p];
        bool lattice = is_lattice(surface, p);
        int across = surface->first_group[p + 1] - surface->first_group[p], along = across > 0;
        if (lattice) {
            across = surface->blocks[2 * p], along = surface->blocks[2 * p + 1];
        }
        while (across * along > 0) {
            QuietLevel *level = &panel->level[panel->level_count++];
            *level = (QuietLevel){across, along, arena_push(arena, QuietBlock, across * along)};
            if (across * along == 1) {
                break;
            }
            across = (across + 1) / 2, along = (along + 1) / 2;
        }
    }
    return quiet;
}

static void fit_leaf(const Surface *surface, const Points *x, int g, QuietBlock *block) {
    const SurfaceGroup *group = &surface->groups[g];
    block->place = box_empty();
    for (int k = group->vertex_begin; k < group->vertex_end; k++) {
        box_add(&block->place, point_at(x, surface->group_vertices[k]));
    }
    if (is_lattice(surface, group->panel)) {
        flatness_slopes(surface, x, g, block->gradient);
    }
}

static void fit_panel(const Contact *c, const Points *x, int p) {
    const Surface *surface = &c->surface;
    QuietPanel *panel = &c->quiet.panels[p];
    int leaves = surface->first_group[p + 1] - surface->first_group[p];
    for (int k = 0; k < leaves; k++) {
        fit_leaf(surface, x, surface->first_group[p] + k, &panel->level[0].blocks[k]);
    }
    for (int k = 1; k < panel->level_count; k++) {
        const QuietLevel *fine = &panel->level[k - 1], *level = &panel->level[k];
        for (int b = 0; b < level->across * level->along; b++) {
            level->blocks[b] = (QuietBlock){box_empty(), {box_empty(), box_empty()}};
        }
        for (int b = 0; b < fine->across * fine->along; b++) {
            int i = b % fine->across / 2, j = b / fine->across / 2;
            QuietBlock *sum = &level->blocks[j * level->across + i];
            const QuietBlock *part = &fine->blocks[b];
            sum->place = box_union(sum->place, part->place);
            sum->gradient[0] = box_union(sum->gradient[0], part->gradient[0]);
            sum->gradient[1] = box_union(sum->gradient[1], part->gradient[1]);
        }
    }
}

/* ---- the proof ---- */

typedef struct Proof {
    const Contact *c;
    double near_motion, far_motion; /* [m] in a step at the speeds of now */
    double near_room, far_room;
    double steps; /* that it should last, and can as far as is known */
    bool fails;
} Proof;

typedef struct BlockRef {
    int panel, level, i, j;
} BlockRef;

static const QuietLevel *level_of(const Proof *p, BlockRef a) {
    return &p->c->quiet.panels[a.panel].level[a.level];
}

static const QuietBlock *block_of(const Proof *p, BlockRef a) {
    const QuietLevel *level = level_of(p, a);
    return &level->blocks[a.j * level->across + a.i];
}

/* Takes a room when it lasts as long as any other, or when there is nothing finer. */
static bool take(Proof *p, double *least, double room, double motion, bool finest) {
    if (room < p->steps * motion && !finest) {
        return false;
    }
    p->fails = p->fails || !(room > 0.0 && room > CONTACT_QUIET_LEAST_STEPS * motion);
    p->steps = room < p->steps * motion ? room / motion : p->steps;
    *least = min2(*least, room);
    return true;
}

/* rest of a row of blocks from one to another, in lines of the lattice */
static int lines_between(int a, int b, int level, int nodes, bool wrap) {
    int low = a < b ? a : b, high = a < b ? b : a;
    int lines = SURFACE_BLOCK * ((high + 1 - low) << level),
        most = wrap ? (nodes + 1) / 2 : nodes - 1;
    return lines < most ? lines : most;
}

static bool prove_flat(Proof *p, BlockRef a, BlockRef b) {
    const SurfacePanel *panel = &p->c->surface.panels[a.panel];
    Box gradient[2] = {box_empty(), box_empty()};
    for (int k = 0; k < 4; k++) { /* the rectangle of both */
        BlockRef corner = {a.panel, a.level, k & 1 ? b.i : a.i, k & 2 ? b.j : a.j};
        const QuietBlock *block = block_of(p, corner);
        gradient[0] = box_union(gradient[0], block->gradient[0]);
        gradient[1] = box_union(gradient[1], block->gradient[1]);
    }
    double spare = flatness_least(gradient) - panel->distance / surface_lattice_altitude(panel);
    double room = spare / sqrt(1.0 / (panel->h1 * panel->h1) + 1.0 / (panel->h2 * panel->h2));
    return take(p, &p->near_room, room, p->near_motion, a.level == 0);
}

static bool prove_apart(Proof *p, BlockRef a, BlockRef b) {
    const Surface *surface = &p->c->surface;
    const SurfacePanel *of_a = &surface->panels[a.panel], *of_b = &surface->panels[b.panel];
    double apart = box_distance(&block_of(p, a)->place, &block_of(p, b)->place) -
                   0.5 * (of_a->distance + of_b->distance);
    bool finest = a.level == 0 && b.level == 0;
    if (a.panel == b.panel && is_lattice(surface, a.panel)) {
        int lines = lines_between(a.i, b.i, a.level, of_a->nu, of_a->wrap) +
                    lines_between(a.j, b.j, a.level, of_a->nv, false);
        if (lines * p->near_motion < p->far_motion) {
            return take(p, &p->near_room, apart / lines, p->near_motion, finest);
        }
    }
    return take(p, &p->far_room, apart, p->far_motion, finest);
}

static bool are_neighbours(const Proof *p, BlockRef a, BlockRef b) {
    if (a.panel != b.panel || !is_lattice(&p->c->surface, a.panel)) {
        return false;
    }
    const QuietLevel *level = level_of(p, a);
    bool wrap = p->c->surface.panels[a.panel].wrap;
    return flatness_step(a.i, b.i, level->across, wrap) < 2 &&
           flatness_step(a.j, b.j, level->along, false) < 2;
}

/* the children of a block, or itself */
static int children_of(const Proof *p, BlockRef a, bool split, BlockRef child[4]) {
    if (!split) {
        child[0] = a;
        return 1;
    }
    const QuietLevel *fine = &p->c->quiet.panels[a.panel].level[a.level - 1];
    int count = 0;
    for (int k = 0; k < 4; k++) {
        int i = 2 * a.i + (k & 1), j = 2 * a.j + (k >> 1);
        if (i < fine->across && j < fine->along) {
            child[count++] = (BlockRef){a.panel, a.level - 1, i, j};
        }
    }
    return count;
}

static void prove_pair(Proof *p, BlockRef a, BlockRef b) {
    bool same = a.panel == b.panel && a.level == b.level && a.i == b.i && a.j == b.j;
    if (p->fails || (are_neighbours(p, a, b) ? prove_flat(p, a, b) : prove_apart(p, a, b))) {
        return;
    }
    BlockRef of_a[4], of_b[4];
    int in_a = children_of(p, a, a.level > 0 && a.level >= b.level, of_a);
    int in_b = children_of(p, b, b.level > 0 && b.level >= a.level, of_b);
    for (int k = 0; k < in_a; k++) {
        for (int m = same ? k : 0; m < in_b; m++) {
            prove_pair(p, of_a[k], of_b[m]);
        }
    }
}

static void prove_solid(Proof *p, BlockRef a, int o) {
    const Contact *c = p->c;
    const Box *box = &block_of(p, a)->place;
    Vec3 normal, centre = vec3_scale(0.5, vec3_add(box->low, box->high));
    double radius = 0.5 * vec3_length(vec3_sub(box->high, box->low));
    Vec3 place = pose_unapply(c->poses[o], centre);
    double apart = solid_distance(&c->def->obstacles[o].solid, place, &normal) - radius -
                   c->surface.panels[a.panel].distance;
    if (p->fails || take(p, &p->far_room, apart, p->far_motion, a.level == 0)) {
        return;
    }
    BlockRef child[4];
    int count = children_of(p, a, true, child);
    for (int k = 0; k < count; k++) {
        prove_solid(p, child[k], o);
    }
}

static BlockRef root_of(const Contact *c, int panel) {
    return (BlockRef){panel, c->quiet.panels[panel].level_count - 1, 0, 0};
}

static void prove_all(Proof *p) {
    const Contact *c = p->c;
    const Surface *surface = &c->surface;
    for (int a = 0; a < c->def->panel_count && !p->fails; a++) {
        if (c->quiet.panels[a].level_count == 0) {
            continue;
        }
        for (int b = a; b < surface->panel_count; b++) {
            bool meet = b < c->def->panel_count ? c->def->self : c->pairs_wanted;
            if (meet && c->quiet.panels[b].level_count > 0) {
                prove_pair(p, root_of(c, a), root_of(c, b));
            }
        }
        for (int o = 0; o < c->def->obstacle_count; o++) {
            if (!c->def->obstacles[o].mesh) {
                prove_solid(p, root_of(c, a), o);
            }
        }
    }
}

/* ---- paths ---- */

static double fastest_obstacle(const Contact *c) {
    double most = 0.0;
    for (int o = 0; o < c->def->obstacle_count; o++) {
        most = max2(most, c->obstacle_speed[o]);
    }
    return most;
}

/* two nodes next to each other, of velocities that were gathered: how long will a proof last? */
static double relative_speed(const Contact *c) {
    double most = 0.0;
    for (int a = 0; a < c->def->panel_count; a++) {
        const SurfacePanel *panel = &c->surface.panels[a];
        for (int i = 0; panel->nu > 0 && i < panel->vertex_count; i++) {
            int place = panel->first + i;
            Vec3 v = contact_velocity(c, place);
            if (i % panel->nu > 0) {
                Vec3 d = vec3_sub(contact_velocity(c, place - 1), v);
                most = max2(most, vec3_dot(d, d));
            }
            if (i >= panel->nu) {
                Vec3 d = vec3_sub(contact_velocity(c, place - panel->nu), v);
                most = max2(most, vec3_dot(d, d));
            }
        }
    }
    return sqrt(most);
}

bool quiet_prove(Contact *c, double dt) {
    Quiet *quiet = &c->quiet;
    const ContactMotion *motion = &c->view.motion;
    Points x = contact_positions(c);
    quiet->fastest = motion->fastest(motion->owner);
    Proof proof = {.c = c,
                   .near_motion = dt * relative_speed(c),
                   .far_motion = dt * (2.0 * quiet->fastest + fastest_obstacle(c)),
                   .near_room = INFINITY,
                   .far_room = INFINITY,
                   .steps = CONTACT_QUIET_STEPS};
    for (int p = 0; p < c->surface.panel_count; p++) {
        fit_panel(c, &x, p);
    }
    prove_all(&proof);
    quiet->holds = !proof.fails;
    quiet->near_path = quiet->far_path = 0.0;
    quiet->near_room = proof.near_room, quiet->far_room = proof.far_room;
    quiet->spread_room = CONTACT_QUIET_SPREAD * proof.near_room;
    quiet->retry = c->step_count + CONTACT_QUIET_RETRY;
    if (quiet->holds) {
        motion->mark(motion->owner);
    }
    return quiet->holds;
}

bool quiet_has_room(Contact *c, double dt) {
    Quiet *quiet = &c->quiet;
    const ContactMotion *motion = &c->view.motion;
    double step = QUIET_FASTER * 2.0 * dt * quiet->fastest;
    if (quiet->near_path + step >= quiet->near_room) {
        double spread = motion->spread(motion->owner);
        quiet->near_path = spread < quiet->spread_room ? spread : INFINITY;
    }
    return quiet->near_path + step < quiet->near_room &&
           quiet->far_path + step + dt * fastest_obstacle(c) < quiet->far_room;
}

bool quiet_spend(Contact *c, double fastest, double dt) {
    Quiet *quiet = &c->quiet;
    double step = 2.0 * dt * fastest;
    quiet->fastest = fastest;
    quiet->near_path += step;
    quiet->far_path += step + dt * fastest_obstacle(c);
    return quiet->near_path < quiet->near_room && quiet->far_path < quiet->far_room;
}
