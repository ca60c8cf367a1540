#include "sim/contact/quiet.h"

#include <math.h>

#include "sim/contact/engine.h"

#define QUIET_FASTER 2.0 /* than in the last step: more makes the interval be done again */
#define QUIET_FRAMED 3.0 /* times faster than nodes are: no bound by frames is more */
#define FOLD_STRIPS 3    /* that are proven by slopes together, of those of two blocks */
#define BRIDGE 4         /* blocks along a side of a rectangle that may prove its ends apart */

Quiet quiet_create(const Surface *surface, Arena *arena) {
    return (Quiet){.panels = quiet_blocks_create(surface, arena),
                   .kernel = quiet_blocks_kernel(vector_best())};
}

/* ---- the proof ---- */

typedef struct Proof {
    const Contact *c;
    QuietView view;
    double near_motion, far_motion; /* [m] in a step at the speeds of now */
    double near_room, far_room;
    double steps; /* that it should last, and can as far as is known */
    bool fails;
    int folds;       /* axis along which the last fold was proven, to be tried first */
    QuietPair tight; /* lasts no longer */
} Proof;

static const QuietLevel *level_of(const Proof *p, BlockRef a) {
    return &p->c->quiet.panels[a.panel].level[a.level];
}

static const Box *place_of(const Proof *p, BlockRef a) {
    const QuietLevel *level = level_of(p, a);
    return &level->places[a.j * level->across + a.i];
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

/* by how many spreads at most features come nearer that are so many lines from each other along u and v */
static double lines_spread(const Proof *p, int panel, int u, int v) {
    const double *line = p->c->quiet.panels[panel].line;
    double across = u * line[0], along = v * line[1];
    return sqrt(across * across + along * along);
}

/* rest of a row from a cell to another, or from blocks of so many cells, in lines of the lattice */
static int lines_between(int a, int b, int cells, int nodes, bool wrap) {
    int low = a < b ? a : b, high = a < b ? b : a;
    int lines = cells * (high + 1 - low), most = wrap ? (nodes + 1) / 2 : nodes - 1;
    return lines < most ? lines : most;
}

/* [m] how far neighbours in these blocks may move against each other: in a rectangle */
static double flat_room(const QuietPanel *panel, const Slopes *const part[], int count) {
    return panel->motion * (slopes_least(part, count) - panel->least);
}

/* ... the 2 x 2 blocks between two corners, or fewer */
static double corner_room(const Proof *p, BlockRef a, BlockRef b) {
    Slopes corner[4];
    const Slopes *part[4] = {&corner[0], &corner[1], &corner[2], &corner[3]};
    int count = 0;
    for (int k = 0; k < 4; k++) {
        if ((k & 1 && a.i == b.i) || (k & 2 && a.j == b.j)) {
            continue;
        }
        corner[count++] = quiet_slopes_at(level_of(p, a), k & 1 ? b.i : a.i, k & 2 ? b.j : a.j);
    }
    return flat_room(&p->c->quiet.panels[a.panel], part, count);
}

/* ... all blocks from one to another, where these are few; else none */
static double bridge_room(const Proof *p, BlockRef a, BlockRef b) {
    Slopes between[BRIDGE * BRIDGE];
    const Slopes *part[BRIDGE * BRIDGE];
    int count = 0, left = a.i < b.i ? a.i : b.i, low = a.j < b.j ? a.j : b.j;
    int right = a.i + b.i - left, high = a.j + b.j - low;
    if (right - left >= BRIDGE || high - low >= BRIDGE) {
        return 0.0;
    }
    for (int j = low; j <= high; j++) {
        for (int i = left; i <= right; i++, count++) {
            between[count] = quiet_slopes_at(level_of(p, a), i, j);
            part[count] = &between[count];
        }
    }
    return flat_room(&p->c->quiet.panels[a.panel], part, count);
}

/* first of two neighbours in a row, which may run around */
static int lower_of(int a, int b, int count) {
    int low = a < b ? a : b, high = a < b ? b : a;
    return high - low > 1 && high - low == count - 1 ? high : low;
}

/* of 2 x 2 blocks that hold two neighbours: most neighbours are proven by few of them */
static double window_room(const Proof *p, BlockRef a, BlockRef b) {
    const QuietLevel *level = level_of(p, a);
    const QuietPanel *panel = &p->c->quiet.panels[a.panel];
    int i = lower_of(a.i, b.i, level->across), j = lower_of(a.j, b.j, level->along);
    return panel->motion * (quiet_blocks_window(p->view.kernel, level, i, j) - panel->least);
}

/* How far two parts of a lattice are from each other. */
typedef struct Apart {
    double far;  /* [m] */
    double near; /* [m] that neighbours may move */
} Apart;

/* takes it by whatever lasts longer */
static bool take_apart(Proof *p, Apart apart, bool finest) {
    if (apart.near * p->far_motion > apart.far * p->near_motion) {
        return take(p, &p->near_room, apart.near, p->near_motion, finest);
    }
    return take(p, &p->far_room, apart.far, p->far_motion, finest);
}

/* A row of strips through a leaf, or through two that lie side by side. */
typedef struct Strip {
    const QuietStrip *part[2];
    int parts;
    Box place;
} Strip;

/* of two neighbours, in turn along an axis; returns their number */
static int find_strips(const Proof *p, BlockRef a, BlockRef b, int axis, Strip strip[]) {
    const Surface *surface = &p->c->surface;
    const QuietLevel *level = level_of(p, a);
    int of_a[2] = {a.i, a.j}, of_b[2] = {b.i, b.j}, most[2] = {level->across, level->along};
    int low = lower_of(of_a[axis], of_b[axis], most[axis]), other = 1 - axis, count = 0;
    int high = of_a[axis] + of_b[axis] - low;
    for (int end = 0; end < (low == high ? 1 : 2); end++) {
        int cells = 0;
        for (int side = 0; side < (of_a[other] == of_b[other] ? 1 : 2); side++) {
            int block[2];
            block[axis] = end ? high : low, block[other] = side ? of_b[other] : of_a[other];
            const QuietStrip *cut =
                quiet_blocks_cut(&p->view, &p->c->quiet.panels[a.panel], a.panel, block, axis);
            cells = quiet_blocks_cells(&surface->panels[a.panel], block, axis);
            for (int k = 0; k < cells; k++) {
                Strip *one = &strip[count + k];
                one->place = side ? box_union(one->place, cut[k].place) : cut[k].place;
                one->part[side] = &cut[k];
                one->parts = side + 1;
            }
        }
        count += cells;
    }
    return count;
}

/* [m] of strips that follow each other */
static double strips_room(const QuietPanel *panel, const Strip *strip, int count) {
    const Slopes *part[2 * FOLD_STRIPS];
    int parts = 0;
    for (int k = 0; k < count; k++) {
        for (int side = 0; side < strip[k].parts; side++) {
            part[parts++] = &strip[k].part[side]->slopes;
        }
    }
    return flat_room(panel, part, parts);
}

/* Two neighbours where cloth is folded: a few strips by their slopes, others by their boxes. */
static Proof prove_folded(const Proof *p, BlockRef a, BlockRef b, int axis) {
    const SurfacePanel *panel = &p->c->surface.panels[a.panel];
    Proof trial = *p;
    Strip strip[2 * SURFACE_BLOCK] = {{.parts = 0}};
    int count = find_strips(p, a, b, axis, strip);
    int width = count > FOLD_STRIPS ? FOLD_STRIPS : count < FOLD_STRIPS ? count : FOLD_STRIPS - 1;
    for (int k = 0; k + width <= count && !trial.fails; k++) {
        double room = strips_room(&p->c->quiet.panels[a.panel], strip + k, width);
        take(&trial, &trial.near_room, room, p->near_motion, true);
    }
    for (int k = 0; k < count; k++) {
        for (int m = k + width; m < count && !trial.fails; m++) {
            double apart = box_distance(&strip[k].place, &strip[m].place) - panel->distance;
            int lines = m - k + 1, beside = SURFACE_BLOCK * strip[k].parts;
            double most = axis == 0 ? lines_spread(p, a.panel, lines, beside)
                                    : lines_spread(p, a.panel, beside, lines);
            take_apart(&trial, (Apart){apart, apart / most}, true);
        }
    }
    return trial;
}

static bool prove_flat(Proof *p, BlockRef a, BlockRef b) {
    double room = window_room(p, a, b);
    if (room < p->steps * p->near_motion) {
        room = max2(room, corner_room(p, a, b));
    }
    if (a.level > 0 || room >= min2(p->steps, CONTACT_QUIET_FOLD_STEPS) * p->near_motion) {
        return take(p, &p->near_room, room, p->near_motion, a.level == 0);
    }
    Proof best = *p;
    int first = p->folds;
    take(&best, &best.near_room, room, p->near_motion, true);
    for (int k = 0; k < 2 && (best.fails || best.steps < p->steps); k++) {
        int axis = k == 0 ? first : 1 - first;
        Proof trial = prove_folded(p, a, b, axis);
        if (!trial.fails && (best.fails || trial.steps > best.steps)) {
            best = trial;
            best.folds = axis;
        }
    }
    *p = best;
    return true;
}

/* the strips of two leaves along an axis: those of folds are thin */
static Apart strips_apart(const Proof *p, BlockRef a, BlockRef b, int axis) {
    const QuietPanel *panel = &p->c->quiet.panels[a.panel];
    const SurfacePanel *of = &p->c->surface.panels[a.panel];
    const int at[2][2] = {{a.i, a.j}, {b.i, b.j}}, nodes[2] = {of->nu, of->nv};
    const QuietStrip *cut[2];
    int cells[2], other = 1 - axis;
    int beside = lines_between(at[0][other], at[1][other], SURFACE_BLOCK, nodes[other],
                               of->wrap && other == 0);
    for (int k = 0; k < 2; k++) {
        cut[k] = quiet_blocks_cut(&p->view, panel, a.panel, at[k], axis);
        cells[k] = quiet_blocks_cells(of, at[k], axis);
    }
    Apart least = {INFINITY, INFINITY};
    for (int k = 0; k < cells[0]; k++) {
        for (int m = 0; m < cells[1]; m++) {
            int first = SURFACE_BLOCK * at[0][axis] + k, second = SURFACE_BLOCK * at[1][axis] + m;
            int lines = lines_between(first, second, 1, nodes[axis], of->wrap && axis == 0);
            double apart = box_distance(&cut[0][k].place, &cut[1][m].place) - of->distance;
            least.far = min2(apart, least.far);
            double most = axis == 0 ? lines_spread(p, a.panel, lines, beside)
                                    : lines_spread(p, a.panel, beside, lines);
            least.near = min2(apart / most, least.near);
        }
    }
    return least;
}

/* does it last for a number of steps? */
static bool lasts(const Proof *p, Apart apart, double steps) {
    return apart.near >= steps * p->near_motion || apart.far >= steps * p->far_motion;
}

static bool prove_apart(Proof *p, BlockRef a, BlockRef b) {
    const Surface *surface = &p->c->surface;
    const SurfacePanel *of_a = &surface->panels[a.panel], *of_b = &surface->panels[b.panel];
    double far =
        box_distance(place_of(p, a), place_of(p, b)) - 0.5 * (of_a->distance + of_b->distance);
    bool finest = a.level == 0 && b.level == 0;
    if (a.panel != b.panel || !quiet_is_lattice(surface, a.panel)) {
        return take(p, &p->far_room, far, p->far_motion, finest);
    }
    int cells = SURFACE_BLOCK << a.level;
    int across = lines_between(a.i, b.i, cells, of_a->nu, of_a->wrap);
    int along = lines_between(a.j, b.j, cells, of_a->nv, false);
    Apart apart = {far, far / lines_spread(p, a.panel, across, along)};
    if (!lasts(p, apart, p->steps)) {
        apart.near = max2(bridge_room(p, a, b), apart.near);
    }
    double steps = min2(p->steps, CONTACT_QUIET_FOLD_STEPS);
    for (int axis = 1; axis >= 0 && finest && !lasts(p, apart, steps); axis--) {
        Apart cut = strips_apart(p, a, b, axis);
        apart = (Apart){max2(cut.far, apart.far), max2(cut.near, apart.near)};
    }
    return take_apart(p, apart, finest);
}

static bool are_neighbours(const Proof *p, BlockRef a, BlockRef b) {
    if (a.panel != b.panel || !quiet_is_lattice(&p->c->surface, a.panel)) {
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

/* by address: copies of what was just put together wait for it */
static void prove_pair(Proof *p, const BlockRef *a, const BlockRef *b) {
    bool same = a->panel == b->panel && a->level == b->level && a->i == b->i && a->j == b->j;
    double steps = p->steps;
    if (p->fails || (are_neighbours(p, *a, *b) ? prove_flat(p, *a, *b) : prove_apart(p, *a, *b))) {
        p->tight = p->steps < steps ? (QuietPair){*a, *b, true} : p->tight;
        return;
    }
    BlockRef of_a[4], of_b[4];
    int in_a = children_of(p, *a, a->level > 0 && a->level >= b->level, of_a);
    int in_b = children_of(p, *b, b->level > 0 && b->level >= a->level, of_b);
    for (int k = 0; k < in_a; k++) {
        for (int m = same ? k : 0; m < in_b; m++) {
            prove_pair(p, &of_a[k], &of_b[m]);
        }
    }
}

static void prove_solid(Proof *p, BlockRef a, int o) {
    const Contact *c = p->c;
    const Box *box = place_of(p, a);
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
    const QuietPair *tight =
        &c->quiet.tight; /* first: what will last longer is left in coarse blocks */
    if (tight->is_known) {
        prove_pair(p, &tight->a, &tight->b);
    }
    for (int a = 0; a < c->def->panel_count && !p->fails; a++) {
        if (c->quiet.panels[a].level_count == 0) {
            continue;
        }
        for (int b = a; b < surface->panel_count; b++) {
            bool meet = b < c->def->panel_count ? c->def->self : c->pairs_wanted;
            if (meet && c->quiet.panels[b].level_count > 0) {
                BlockRef of_a = root_of(c, a), of_b = root_of(c, b);
                prove_pair(p, &of_a, &of_b);
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

/* [m/s] of cloth towards cloth, or towards an obstacle at rest */
static double approach(const Contact *c) {
    const ContactSpeeds *speeds = &c->quiet.speeds;
    return c->def->obstacle_count > 0 ? max2(speeds->mutual, speeds->fastest) : speeds->mutual;
}

/* [m] room of neighbours that is worth looking for: a share of what flat cloth has */
static double near_enough(const Contact *c) {
    double room = INFINITY;
    for (int p = 0; p < c->def->panel_count; p++) {
        const QuietPanel *panel = &c->quiet.panels[p];
        if (quiet_is_lattice(&c->surface, p)) {
            room = min2(room, CONTACT_QUIET_SHARE * panel->motion * (1.0 - panel->least));
        }
    }
    return room;
}

/* [steps] that a proof should hold: somewhat more than the last one of this interval could */
static double aim(const Contact *c, double near_motion) {
    double more = c->step_count > 0.0 ? CONTACT_QUIET_LONGER * c->quiet.lasting : INFINITY;
    double steps = max2(CONTACT_QUIET_SHORT_STEPS, min2(CONTACT_QUIET_STEPS, more));
    return min2(steps, near_enough(c) / near_motion);
}

/* Proves from the positions on to which the velocities lead in `ahead` [s]; is there room for those of now? */
static bool prove_ahead(Contact *c, Proof *proof, double ahead) {
    Quiet *quiet = &c->quiet;
    const ContactMotion *motion = &c->view.motion;
    proof->view.lanes = motion->mark(motion->owner, ahead);
    for (int p = 0; p < c->surface.panel_count; p++) {
        quiet_blocks_fit(&proof->view, &quiet->panels[p], p);
    }
    prove_all(proof);
    bool look = ahead > 0.0 && !proof->fails;
    double near = look ? motion->spread(motion->owner) : 0.0;
    double far = look ? motion->mutual(motion->owner) : 0.0;
    quiet->holds = !proof->fails && near <= CONTACT_QUIET_BEGIN * proof->near_room &&
                   far <= CONTACT_QUIET_BEGIN * proof->far_room;
    quiet->near_path = quiet->spread = quiet->begun = near;
    quiet->far_path = quiet->far_seen = far;
    quiet->near_room = proof->near_room, quiet->far_room = proof->far_room;
    quiet->lasting = proof->steps;
    quiet->tight = proof->tight;
    return quiet->holds;
}

bool quiet_prove(Contact *c, double dt) {
    Quiet *quiet = &c->quiet;
    const ContactMotion *motion = &c->view.motion;
    double steps = c->step_count - quiet->proven, near = (quiet->begun + quiet->spread) / steps;
    double ahead = 0.0;
    if (!(quiet->holds && steps > 0.0 && near > 0.0)) {
        double fastest = motion->fastest(motion->owner);
        quiet->speeds = (ContactSpeeds){fastest, 2.0 * fastest, motion->relative(motion->owner)};
        near = dt * quiet->speeds.relative;
    } else if (c->def->obstacle_count == 0) {
        ahead = dt * CONTACT_QUIET_AHEAD * quiet->near_room / near;
    }
    Proof proof = {
        .c = c,
        .view = {&c->surface, NULL, c->view.slot, c->def->vertex_count, c->x, quiet->kernel},
        .near_motion = near,
        .far_motion = dt * (approach(c) + fastest_obstacle(c)),
        .near_room = INFINITY,
        .far_room = INFINITY,
        .steps = aim(c, near)};
    Proof again = proof;
    if (!prove_ahead(c, &proof, ahead) && ahead > 0.0) {
        prove_ahead(c, &again, 0.0);
    }
    quiet->close = false;
    quiet->proven = c->step_count;
    quiet->cost = CONTACT_QUIET_COST;
    quiet->retry = c->step_count + CONTACT_QUIET_RETRY;
    return quiet->holds;
}

bool quiet_continues(Contact *c, double steps) {
    Quiet *quiet = &c->quiet;
    const ContactMotion *motion = &c->view.motion;
    if (!quiet->holds || !c->view.continues || c->def->obstacle_count > 0) {
        return false;
    }
    ContactSpeeds *speeds = &quiet->speeds; /* velocities may be others */
    double fastest = motion->fastest(motion->owner), mutual = 2.0 * fastest, relative = mutual;
    if (speeds->fastest > 0.0) {
        double more = max2(1.0, fastest / speeds->fastest);
        mutual = min2(mutual, more * speeds->mutual);
        relative = min2(relative, more * speeds->relative);
    }
    *speeds = (ContactSpeeds){fastest, mutual, relative};
    quiet->proven -= steps;
    return true;
}

/* Is there room for neighbours in a step in which they move by at most `step` [m] against each other, or by
 * less when that is looked at? False also where a proof is cheaper than looking so often. */
static bool near_has_room(Quiet *quiet, const ContactMotion *motion, double steps, double step,
                          double dt) {
    double looks = quiet->cost, bought = 1.0;
    if (quiet->near_room - quiet->spread <= step) { /* as seen last: would last for no step */
        quiet->near_step = dt * motion->relative(motion->owner);
        quiet->cost++;
    }
    if (quiet->near_path + min2(step, quiet->near_step) >= quiet->near_room) {
        quiet->near_path = quiet->spread = motion->spread(motion->owner);
        quiet->cost++;
        double room = quiet->near_room - quiet->spread;
        bought = max2(1.0, room / step);
        if (room <= step && isinf(quiet->near_step)) {
            quiet->near_step = dt * motion->relative(motion->owner);
            quiet->cost++;
        }
    }
    bool rare = (quiet->cost - looks) * steps <= looks * bought;
    return quiet->near_path + min2(step, quiet->near_step) < quiet->near_room &&
           (rare || steps == 0.0);
}

bool quiet_has_room(Contact *c, double dt) {
    Quiet *quiet = &c->quiet;
    const ContactMotion *motion = &c->view.motion;
    bool was_close = quiet->close;
    quiet->close = was_close ||
                   quiet->near_room < CONTACT_QUIET_CLOSE_STEPS * dt * 2.0 * quiet->speeds.fastest;
    double most = quiet->close && !was_close ? QUIET_FRAMED * QUIET_FASTER : QUIET_FASTER;
    double fast = most * dt * approach(c), own = dt * fastest_obstacle(c);
    double step = most * dt * quiet->speeds.relative;
    if (quiet->close && !motion->framed) { /* the drift will say no more than that */
        step = QUIET_FASTER * dt * 2.0 * quiet->speeds.fastest;
    }
    quiet->near_step = quiet->far_step = INFINITY;
    if (quiet->far_path + fast + own >= quiet->far_room && c->def->obstacle_count == 0 &&
        quiet->far_path - quiet->far_seen > CONTACT_QUIET_FAR_STEPS * fast) {
        quiet->far_path = quiet->far_seen = motion->mutual(motion->owner);
        quiet->cost++;
    }
    if (quiet->far_path + fast + own >= quiet->far_room) {
        quiet->far_step = 2.0 * dt * motion->fastest(motion->owner);
        if (quiet->far_path + quiet->far_step + own >= quiet->far_room) {
            return false;
        }
    }
    return quiet->near_path + step < quiet->near_room ||
           near_has_room(quiet, motion, c->step_count - quiet->proven, step, dt);
}

bool quiet_spend(Contact *c, const ContactSpeeds *speeds, double dt) {
    Quiet *quiet = &c->quiet;
    quiet->speeds = *speeds;
    quiet->speeds.mutual = min2(speeds->mutual, 2.0 * speeds->fastest);
    quiet->speeds.relative = min2(speeds->relative, quiet->speeds.mutual);
    quiet->near_path += min2(dt * quiet->speeds.relative, quiet->near_step);
    quiet->far_path += min2(dt * approach(c), quiet->far_step) + dt * fastest_obstacle(c);
    return quiet->near_path < quiet->near_room && quiet->far_path < quiet->far_room;
}
