/* self.c: contact of cloth with cloth on the explicit road (contact.md). */
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "sim/base/clock.h"
#include "sim/base/parallel.h"
#include "sim/contact/force.h"
#include "sim/contact/pair_batch.h"

/* what a thread takes at once, some 10 us: group pairs to be asked, to be evaluated */
#define OWNER_GRAIN 1000
#define BLOCK_GRAIN 16
#define FORCE_GRAIN 32 /* some 1 us */
#define PART_LEAST 256 /* forces that threads share the vertices for */
#define FETCH_AHEAD 12 /* pairs */
#define FORCE_BLOCK 32 /* likewise of one thread alone: added while in its cache */

/* ---- lists ---- */

static void make_room(Contact *c) {
    if (c->asked.room < c->lists.group_pair_room) {
        c->asked.room = c->lists.group_pair_room;
        int chunks = parallel_chunk_count(c->asked.room, OWNER_GRAIN);
        c->asked.wanted = arena_push(c->arena, int, c->asked.room);
        c->asked.counts = arena_push(c->arena, int, chunks);
        c->due.owners = arena_push(c->arena, int, c->asked.room);
        c->due.near_counts = arena_push(c->arena, int, c->asked.room);
    }
}

/* those of first .. end - 1 with that flag, in order; returns how many */
static int collect(const unsigned char *flags, int first, int end, unsigned char flag, int *found) {
    int count = 0;
    for (int i = first; i < end; i += 8) {
        uint64_t hits = 0;
        memcpy(&hits, flags + i, end - i < 8 ? (size_t)(end - i) : 8);
        for (hits &= flag * 0x0101010101010101U; hits != 0; hits &= hits - 1) {
            found[count++] = i + __builtin_ctzll(hits) / 8; /* the first byte is the lowest */
        }
    }
    return count;
}

static void ask_chunk(int chunk, int first, int end, void *context) {
    Contact *c = context;
    const PathRows *paths = &c->lists.paths;
    const PathKernel *kernel = c->lists.path_kernel;
    unsigned char wanted = PATH_SPENT;
    if (c->asked.question == OUTGROWN || c->asked.question == OUTRUN) {
        bool outgrown = c->asked.question == OUTGROWN;
        PathQuestion question = {.steps = outgrown ? CONTACT_LEAST_NEAR_STEPS : 1.0,
                                 .share = outgrown ? 1.0 : CONTACT_PLANE_SHARE,
                                 .dt = c->asked.step};
        kernel->ask(paths, c->groups.motion, &question, first, end);
        wanted = PATH_WANTED;
    } else if (c->asked.question == ADVANCED) {
        kernel->advance(paths, first, end, c->asked.step);
    }
    c->asked.counts[chunk] = collect(paths->flags, first, end, wanted, c->asked.wanted + first);
}

static ParallelLoop ask_loop(Contact *c, Question question, double dt) {
    c->asked.question = question;
    c->asked.step = dt;
    return (ParallelLoop){c->lists.group_pair_count, OWNER_GRAIN, ask_chunk, c};
}

/* c->asked.wanted: those of which the answer is yes */
static void take_answers(Contact *c) {
    int all = c->lists.group_pair_count;
    c->asked.count = parallel_close_up(c->asked.wanted, c->asked.counts, all, OWNER_GRAIN);
    c->asked.foreseen = c->asked.question == OUTGROWN || c->asked.question == OUTRUN;
    c->asked.advanced = false;
}

static void ask_all(Contact *c, Question question, double dt) {
    ParallelLoop loop = ask_loop(c, question, dt);
    parallel_for_all(&loop, 1);
    take_answers(c);
}

/* Moves all paths on by a step of dt (0: none), and finds which group pairs spent theirs (c->asked.wanted) and
 * which have pairs to be looked at: mostly the last question foresaw it. */
static ParallelLoop advance_loop(Contact *c, double dt) {
    bool foreseen = c->asked.foreseen && c->asked.step == dt;
    return ask_loop(c, foreseen ? FORESEEN : ADVANCED, dt);
}

static void take_paths(Contact *c) {
    PathRows *paths = &c->lists.paths;
    take_answers(c);
    double *before = paths->path;
    paths->path = paths->next;
    paths->next = before;
    c->asked.advanced = true;
}

static void advance(Contact *c, double dt) {
    ParallelLoop loop = advance_loop(c, dt);
    parallel_for_all(&loop, 1);
    take_paths(c);
}

/* the pairs of one group pair that are due by its path, into c->due.near from its `begin` on; returns their
 * number */
static int find_due(Contact *c, int index) {
    Lists *l = &c->lists;
    const GroupPair *owner = &l->group_pairs[index];
    int *found = c->due.near + owner->begin, count = 0;
    double path = l->paths.path[index], later = INFINITY;
    for (int p = owner->begin; p < owner->begin + owner->count; p++) {
        double due = l->due[p];
        bool is_due = path >= due;
        found[count] = p; /* no branch: which it is cannot be guessed */
        count += is_due;
        later = min2(later, is_due ? INFINITY : due);
    }
    l->paths.earliest[index] = later;
    return count;
}

/* Those of them that may be near go into the batch and stay; returns their number. */
static int choose_pairs(Contact *c, const Points *x, int index, int count, PairBatch *batch) {
    Lists *l = &c->lists;
    double near = l->paths.near[index], path = l->paths.path[index];
    int *due = c->due.near + l->group_pairs[index].begin, left = 0;
    for (int k = 0; k < count; k++) {
        contact_fetch(&l->pairs[due[k]].distance);
    }
    for (int k = 0; k < count; k++) {
        int p = due[k];
        Pair *pair = &l->pairs[p];
        double bound = pair->distance > near ? pair_bound(x, pair) : 0.0;
        if (bound <= near) {
            pair_batch_add(batch, x, pair);
            due[left++] = p;
        } else {
            l->due[p] = path + bound - near;
            l->paths.earliest[index] = min2(l->paths.earliest[index], l->due[p]);
            pair->bristle = vec3(0, 0, 0);
        }
    }
    return left;
}

/* ... after the batch: those that are near stay. Returns their number. */
static int keep_near(Contact *c, int index, int count) {
    Lists *l = &c->lists;
    GroupPair *owner = &l->group_pairs[index];
    double near = l->paths.near[index], path = l->paths.path[index];
    double earliest = l->paths.earliest[index];
    int *found = c->due.near + owner->begin, left = 0;
    for (int k = 0; k < count; k++) {
        int p = found[k];
        Pair *pair = &l->pairs[p];
        l->due[p] = path + pair->distance - near;
        earliest = min2(earliest, l->due[p]);
        if (pair->distance <= near) {
            found[left++] = p;
        } else {
            pair->bristle = vec3(0, 0, 0);
        }
    }
    l->paths.earliest[index] = earliest;
    owner->evaluated = l->stamp;
    return left;
}

static void evaluate_chunk(int chunk, int first, int end, void *context) {
    (void)chunk;
    Contact *c = context;
    Points x = contact_positions(c);
    Lists *l = &c->lists;
    PairBatch batch;
    pair_batch_begin(&batch, l->width);
    for (int k = first; k < end; k++) {
        int index = c->due.owners[k], count = find_due(c, index);
        bool known = l->group_pairs[index].evaluated == l->stamp;
        c->due.near_counts[k] = known ? count : choose_pairs(c, &x, index, count, &batch);
    }
    pair_batch_end(&batch);
    for (int k = first; k < end; k++) {
        c->due.near_counts[k] = keep_near(c, c->due.owners[k], c->due.near_counts[k]);
    }
}

/* all due pairs */
static void evaluate(Contact *c) {
    Lists *l = &c->lists;
    if (!c->asked.advanced) { /* lists were made again since */
        advance(c, 0.0);
    }
    c->asked.advanced = false;
    c->due.owner_count = collect(l->paths.flags, 0, l->group_pair_count, PATH_DUE, c->due.owners);
    if (c->due.room < l->pair_room) {
        c->due.room = l->pair_room;
        c->due.pairs = arena_push(c->arena, DuePair, c->due.room);
        c->due.near = arena_push(c->arena, int, c->due.room);
        c->due.tight = arena_push(c->arena, int, c->due.room);
    }
    parallel_for(c->due.owner_count, BLOCK_GRAIN, evaluate_chunk, c);
    c->due.count = 0;
    for (int k = 0; k < c->due.owner_count; k++) {
        int owner = c->due.owners[k], begin = l->group_pairs[owner].begin;
        for (int m = 0; m < c->due.near_counts[k]; m++) {
            c->due.pairs[c->due.count++] = (DuePair){c->due.near[begin + m], owner};
        }
    }
    c->statistics.evaluations += c->due.count;
    c->statistics.pairs += l->pair_count;
}

/* searches the wanted group pairs; what is evaluated stays valid */
static void search(Contact *c, double dt) {
    Points x = contact_positions(c);
    const PathRows *paths = &c->lists.paths;
    double start = clock_seconds();
    lists_query(&c->lists, &x, c->asked.wanted, c->asked.count, dt);
    c->asked.foreseen = false;
    for (int k = 0; k < c->asked.count && c->asked.advanced; k++) { /* answers of now */
        int i = c->asked.wanted[k];
        paths->flags[i] = paths->path[i] >= paths->earliest[i] ? PATH_DUE : 0;
    }
    c->statistics.search_seconds += clock_seconds() - start;
    c->statistics.rebuilds++;
    evaluate(c);
}

static void remake(Contact *c, double dt) {
    Points x = contact_positions(c);
    double fastest = 2.0 * c->groups.fastest_relative * dt;
    double least = c->def->distance * (1.0 + CONTACT_LEAST_SLACK) +
                   (CONTACT_NEAR_STEPS + CONTACT_SLACK_STEPS) * fastest;
    lists_remake(&c->lists, &x, least);
    c->asked.advanced = false;
    make_room(c);
}

void self_begin(Contact *c, double dt) {
    Lists *l = &c->lists;
    l->stamp++;
    remake(c, dt);
    ask_all(c, OUTGROWN, dt); /* all of them are new */
    search(c, dt);
}

/* ---- forces ---- */

static double pair_mass(const Contact *c, const Pair *pair) {
    return min2(surface_panel(&c->surface, pair->place[0])->mass,
                surface_panel(&c->surface, pair->place[3])->mass);
}

/* Between cloths it does not follow the step: what is stored in a tight twist would jump with every
 * halving. At meshes it does, as at solids: short steps are there to stop impacts. */
static double pair_stiffness(const Contact *c, const Pair *pair, double dt) {
    bool at_mesh = pair_obstacle(c, pair) >= 0;
    double step = at_mesh ? dt : c->def->reference_step;
    double share = at_mesh ? min2(c->at_cloth.share, CONTACT_MESH_STIFFNESS) * c->view.stiffer
                           : c->at_cloth.share;
    return share * pair->soft * pair_mass(c, pair) / (step * step);
}

double pair_friction(const Contact *c, const Pair *pair) {
    int obstacle = pair_obstacle(c, pair);
    if (obstacle >= 0) {
        double own = c->def->obstacles[obstacle].friction;
        int cloth = pair->place[pair->place[0] < c->def->vertex_count ? 0 : 3];
        return own >= 0.0 ? own : c->def->friction[cloth];
    }
    return sqrt(c->def->friction[pair->place[0]] * c->def->friction[pair->place[3]]);
}

static Vec3 pair_velocity(const Contact *c, const Pair *pair) {
    return contact_point_velocity(c, 4, pair->place, pair->weight);
}

Vec3 pair_carried(const Contact *c, const Pair *pair) {
    Vec3 carried = {0, 0, 0};
    for (int a = 0; a < 4 && c->places.meshes; a++) {
        if (pair->place[a] >= c->def->vertex_count) {
            Vec3 v = contact_velocity(c, pair->place[a]);
            carried = vec3_axpy(carried, -pair->weight[a], v);
        }
    }
    return carried;
}

static ContactForce force_of(const Contact *c, Pair *pair, double dt, double share) {
    double force, curvature, mass = pair_mass(c, pair), k = pair_stiffness(c, pair, dt);
    contact_law(pair->distance, pair->dhat, k, &force, &curvature);
    Vec3 v = pair_velocity(c, pair);
    double vn = vec3_dot(v, pair->normal), critical = 2.0 * sqrt(k * mass);
    double damping = CONTACT_SELF_DAMPING * critical;
    double total = max2(0.0, force - damping * vn);
    Vec3 sliding = vec3_axpy(v, -vn, pair->normal);
    Vec3 friction = contact_friction(&pair->bristle, pair->normal, sliding, share * dt,
                                     total * pair_friction(c, pair), k, critical);
    return (ContactForce){.sum = vec3_axpy(friction, total, pair->normal),
                          .damping = vec3_scale(total - force, pair->normal),
                          .friction = friction,
                          .stiffness = 2.0 * (curvature + damping / dt),
                          .carried = pair_carried(c, pair),
                          .approach = -vn};
}

static bool all_held(const Contact *c, const Pair *pair) {
    return c->held[pair->place[0]] && c->held[pair->place[1]] && c->held[pair->place[2]] &&
           c->held[pair->place[3]];
}

/* Does the pair give a force? An edge-edge pair when both points lie inside their edges; a
 * vertex-triangle pair always, but once for every vertex or edge of the other side: -1, or the pair
 * that stands for it. Without one its bristle is none. */
static bool is_active(Contact *c, int p, int *twin) {
    const Pair *pair = &c->lists.pairs[p];
    *twin = -1;
    if (pair->distance >= pair->dhat || all_held(c, pair) ||
        (pair->kind == PAIR_EDGES && pair->feature != 3)) {
        return false;
    }
    if (pair->kind == PAIR_FACE && pair->feature != 7) {
        int key[3];
        pair_twin_key(pair, key);
        *twin = twins_find(&c->twins, key, p);
    }
    return *twin < 0;
}

static void choose_pushing(Contact *c) {
    contact_make_force_room(c, c->due.count);
    twins_clear(&c->twins, c->due.count, c->arena);
    for (int k = 0; k < c->due.count; k++) {
        int twin, p = c->due.pairs[k].pair;
        if (is_active(c, p, &twin)) {
            c->forces.pushing[c->forces.pushing_count++] = p;
        } else if (twin >= 0) {
            c->forces.followers[c->forces.follower_count++] = (Follower){p, twin};
        } else {
            c->lists.pairs[p].bristle = vec3(0, 0, 0);
        }
    }
}

void self_find(Contact *c, double dt) {
    Lists *l = &c->lists;
    if (!c->asked.advanced) {
        advance(c, 0.0);
    }
    if (c->asked.count > 0) { /* few large searches share more than many small ones */
        c->asked.count =
            collect(l->paths.flags, 0, l->group_pair_count, PATH_SOON, c->asked.wanted);
        search(c, dt);
    } else {
        evaluate(c);
    }
    for (int k = 0; k < c->due.count; k++) {
        int ahead = k + FETCH_AHEAD < c->due.count ? k + FETCH_AHEAD : k;
        contact_fetch(&l->pairs[c->due.pairs[ahead].pair]); /* another thread may have written it */
        const Pair *pair = &l->pairs[c->due.pairs[k].pair];
        double *gap = pair_obstacle(c, pair) < 0 ? &c->statistics.smallest_self_gap
                                                 : &c->statistics.smallest_gap;
        *gap = min2(*gap, pair->distance);
        c->at_cloth.room = min2(c->at_cloth.room, pair->distance / pair->dhat);
    }
}

/* Forces of c->forces.pushing, some at a time. */
typedef struct ForceJob {
    Contact *c;
    double dt, share;
    int begin, count;
    bool by_parts; /* threads share the vertices */
    ContactWork work;
} ForceJob;

static void find_forces(int chunk, int first, int end, void *context) {
    (void)chunk;
    const ForceJob *job = context;
    Contact *c = job->c;
    for (int k = first; k < end; k++) {
        Pair *pair = &c->lists.pairs[c->forces.pushing[job->begin + k]];
        c->forces.found[k] = force_of(c, pair, job->dt, job->share);
        if (job->by_parts) {
            memcpy(c->forces.ends[k].place, pair->place, sizeof pair->place);
            memcpy(c->forces.ends[k].weight, pair->weight, sizeof pair->weight);
        }
    }
}

/* all forces, to those of the vertices first .. end - 1 */
static void add_forces(int chunk, int first, int end, void *context) {
    ForceJob *job = context;
    Contact *c = job->c;
    for (int k = 0; k < job->count; k++) {
        const ForceEnds *ends = &c->forces.ends[k];
        if (chunk == 0) {
            contact_add_work(c, &c->forces.found[k], &job->work);
        }
        for (int a = 0; a < 4; a++) {
            if (ends->place[a] >= first && ends->place[a] < end && ends->weight[a] != 0.0) {
                contact_push(c, ends->place[a], ends->weight[a], &c->forces.found[k]);
            }
        }
    }
}

/* Every vertex gets its forces in the order of the pairs. One thread adds a few while they are in its cache. */
static void push_all(Contact *c, ForceJob *job) {
    int n = c->def->vertex_count, threads = parallel_threads();
    job->by_parts = threads > 1 && c->forces.pushing_count > PART_LEAST;
    for (; job->begin < c->forces.pushing_count; job->begin += job->count) {
        int left = c->forces.pushing_count - job->begin;
        job->count = job->by_parts || left < FORCE_BLOCK ? left : FORCE_BLOCK;
        parallel_for(job->count, FORCE_GRAIN, find_forces, job);
        if (job->by_parts) {
            parallel_for(n, (n + threads - 1) / threads, add_forces, job);
            continue;
        }
        for (int k = 0; k < job->count; k++) {
            const Pair *pair = &c->lists.pairs[c->forces.pushing[job->begin + k]];
            contact_apply(c, &c->forces.found[k], 4, pair->place, pair->weight, &job->work);
        }
    }
}

void self_forces(Contact *c, double dt, double share) {
    self_find(c, dt);
    choose_pushing(c);
    Pair *pairs = c->lists.pairs;
    ForceJob job = {.c = c, .dt = dt, .share = share};
    push_all(c, &job);
    contact_note_work(c, &job.work);
    c->some_touched = c->some_touched || c->forces.pushing_count > 0;
    for (int k = 0; k < c->forces.follower_count; k++) { /* whichever is first after a search */
        pairs[c->forces.followers[k].second].bristle = pairs[c->forces.followers[k].first].bristle;
    }
}

double self_energy(Contact *c, double dt) {
    double energy = 0.0;
    twins_clear(&c->twins, c->due.count, c->arena);
    for (int k = 0; k < c->due.count; k++) {
        const Pair *pair = &c->lists.pairs[c->due.pairs[k].pair];
        double force, curvature;
        int twin;
        if (is_active(c, c->due.pairs[k].pair, &twin)) {
            energy += contact_law(pair->distance, pair->dhat, pair_stiffness(c, pair, dt), &force,
                                  &curvature);
        }
    }
    return energy;
}

/* ---- guard ---- */

/* with the velocities after the kick */
void self_refresh(Contact *c, double dt) {
    Lists *l = &c->lists;
    double step = 2.0 * c->groups.fastest_relative * dt;
    bool remade = l->spent + step > l->reach - l->widest;
    if (remade) {
        remake(c, dt);
    }
    ask_all(c, OUTGROWN, dt);
    if (c->asked.count > 0 || remade) {
        search(c, dt);
    }
    c->asked.level_step = step;
}

static void pair_impulse(Contact *c, const Pair *pair, double dt) {
    double floor = CONTACT_IMPULSE_GAP * pair->dhat;
    double vn = vec3_dot(pair_velocity(c, pair), pair->normal);
    double least = pair->distance > floor ? (floor - pair->distance) / dt : 0.0;
    contact_impulse(c, 4, pair->place, pair->weight, pair->normal, pair_carried(c, pair), vn,
                    least);
}

void self_impulses(Contact *c, double dt) {
    const Lists *l = &c->lists;
    int count = 0;
    for (int k = 0; k < c->due.count; k++) {
        const Pair *pair = &l->pairs[c->due.pairs[k].pair];
        double motion = CONTACT_IMPULSE_RESERVE * dt * l->paths.speed[c->due.pairs[k].owner];
        if (pair->distance - CONTACT_IMPULSE_GAP * pair->dhat < motion) {
            c->due.tight[count++] = c->due.pairs[k].pair;
        }
    }
    double before = c->statistics.impulses;
    for (int k = 0; k < count; k++) {
        pair_impulse(c, &l->pairs[c->due.tight[k]], dt);
    }
    for (int k = count - 1; k >= 0; k--) {
        pair_impulse(c, &l->pairs[c->due.tight[k]], dt);
    }
    c->at_cloth.impulses += c->statistics.impulses - before;
}

/* cloth at a mesh: its vertices stay beyond the closest point of the mesh, less what is reserved
 * for the mesh's own motion */
static void shorten_at_mesh(Contact *c, const Points *x, const Pair *pair, double dt) {
    int first = pair->kind == PAIR_FACE ? 1 : 2;
    bool before = pair->place[0] < c->def->vertex_count; /* is the cloth the first feature? */
    int begin = before ? 0 : first, end = before ? first : 4;
    Vec3 away = vec3_scale(before ? 1.0 : -1.0, pair->normal), closest = {0, 0, 0};
    for (int a = begin; a < end; a++) {
        double w = fabs(pair->weight[a]);
        closest = vec3_axpy(closest, w, point_at(x, pair->place[a]));
    }
    double reserve = max2(0.0, min2(mesh_reach(c, pair, away), 0.5 * pair->distance));
    double floor = reserve + CONTACT_PLANE_FLOOR * pair->dhat - pair->distance;
    for (int a = begin; a < end; a++) {
        double over = vec3_dot(away, vec3_sub(point_at(x, pair->place[a]), closest));
        contact_hold_back(c, pair->place[a], away, over - floor, dt);
    }
}

/* every vertex stays on its side of the plane through the middle of the closest points */
static void pair_shorten(Contact *c, const Points *x, const Pair *pair, double dt) {
    int first = pair->kind == PAIR_FACE ? 1 : 2;
    Vec3 n = pair->normal, middle = {0, 0, 0};
    for (int a = 0; a < first; a++) {
        middle = vec3_axpy(middle, pair->weight[a], point_at(x, pair->place[a]));
    }
    middle = vec3_axpy(middle, -0.5 * pair->distance, n);
    for (int a = 0; a < 4; a++) {
        Vec3 away = vec3_scale(a < first ? 1.0 : -1.0, n);
        double height = vec3_dot(away, vec3_sub(point_at(x, pair->place[a]), middle));
        contact_hold_back(c, pair->place[a], away, height - CONTACT_MIDDLE_FLOOR * pair->dhat, dt);
    }
}

void self_shorten(Contact *c, double dt) {
    Points x = contact_positions(c);
    for (int k = 0; k < c->due.count; k++) {
        PathEnds owner = c->lists.paths.ends[c->due.pairs[k].owner];
        const Pair *pair = &c->lists.pairs[c->due.pairs[k].pair];
        double least = 0.5 * pair->distance - CONTACT_PLANE_FLOOR * pair->dhat;
        double motion =
            dt * max2(c->groups.motion[owner.a].fastest, c->groups.motion[owner.b].fastest);
        if (motion > CONTACT_PLANE_SHARE * least) { /* no vertex is nearer to the plane */
            if (pair_obstacle(c, pair) < 0) {
                pair_shorten(c, &x, pair, dt);
            } else {
                shorten_at_mesh(c, &x, pair, dt);
            }
        }
    }
}

bool self_check(Contact *c, double dt) {
    c->asked.level_step = max2(c->asked.level_step, 2.0 * c->groups.fastest_relative * dt);
    ask_all(c, OUTRUN, dt);
    bool again = c->asked.count > 0;
    if (again) {
        search(c, dt);
    }
    return again;
}

ParallelLoop self_advance_loop(Contact *c) {
    c->lists.spent += c->asked.level_step;
    return advance_loop(c, c->step);
}

void self_advanced(Contact *c) { take_paths(c); }
