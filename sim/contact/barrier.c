#include "sim/contact/meeting.h"

#include <math.h>
#include <string.h>

#include "sim/contact/constants.h"
#include "sim/geom/crossing.h"

Barrier *barrier_create(const ContactDef *def, Arena *arena) {
    Barrier *b = arena_push(arena, Barrier, 1);
    *b = (Barrier){.def = def,
                   .arena = arena,
                   .clamp = clamp_create(def, arena),
                   .poses = arena_push(arena, Pose, def->obstacle_count),
                   .clocks = arena_push(arena, double, def->obstacle_count),
                   .next = arena_push(arena, Pose, def->obstacle_count),
                   .advance = arena_push(arena, double, def->obstacle_count)};
    int places = b->clamp.near.places.count;
    b->start = arena_push(arena, double, 3 * places);
    b->x = arena_push(arena, double, 3 * places);
    b->dx = arena_push(arena, double, 3 * places);
    b->held = arena_push(arena, unsigned char, places);
    memset(b->held + def->vertex_count, 1, (size_t)(places - def->vertex_count));
    return b;
}

/* cloth vertices come first; those of meshes stay */
static void load_cloth(const Barrier *b, const double *from, double *to) {
    memcpy(to, from, 3 * (size_t)b->def->vertex_count * sizeof *to);
}

/* a mesh goes where its obstacle is */
static void place_mesh(Barrier *b, int obstacle) {
    const Places *places = &b->clamp.near.places;
    int first = places->mesh_first[obstacle];
    if (places->mesh_first[obstacle + 1] > first) {
        places_pose(&b->def->obstacles[obstacle], b->poses[obstacle], b->clocks[obstacle],
                    b->x + 3 * (size_t)first);
    }
}

void barrier_begin(Barrier *b, const ContactMemory *memory, const double *x,
                   const unsigned char *held) {
    b->memory = memory;
    load_cloth(b, x, b->start);
    memcpy(b->held, held, (size_t)b->def->vertex_count);
    size_t obstacles = (size_t)b->def->obstacle_count, cloth = 3 * (size_t)b->def->vertex_count;
    memcpy(b->poses, memory->poses, obstacles * sizeof *b->poses);
    memcpy(b->clocks, memory->clocks, obstacles * sizeof *b->clocks);
    for (int o = 0; o < b->def->obstacle_count; o++) {
        place_mesh(b, o);
    }
    memcpy(b->start + cloth, b->x + cloth,
           (3 * (size_t)b->clamp.near.places.count - cloth) * sizeof *b->x);
    b->driven = false;
    meetings_clear(&b->now);
    candidates_forget(&b->clamp.near);
    if (b->memory_slot_count < 2 * memory->pair_count || b->memory_slot_count == 0) {
        b->memory_slot_count = b->memory_slot_count > 0 ? b->memory_slot_count : 1024;
        while (b->memory_slot_count < 2 * memory->pair_count) {
            b->memory_slot_count *= 2;
        }
        b->memory_slots = arena_push(b->arena, int, b->memory_slot_count);
    }
    memset(b->memory_slots, 0, (size_t)b->memory_slot_count * sizeof *b->memory_slots);
    for (int i = 0; i < memory->pair_count; i++) {
        unsigned s = meeting_slot(memory->pairs[i].place, b->memory_slot_count);
        while (b->memory_slots[s] != 0) {
            s = (s + 1) & (unsigned)(b->memory_slot_count - 1);
        }
        b->memory_slots[s] = i + 1;
    }
}

static Vec3 friction_of(const Meeting *m) {
    double kt = CONTACT_BRISTLE_SHARE * m->stiffness, length = vec3_length(m->stretch);
    return vec3_scale(m->slips ? -kt * m->limit / length : -kt, m->stretch);
}

void barrier_drive(Barrier *b, double time_end, double dt) {
    for (int o = 0; o < b->def->obstacle_count; o++) {
        const ContactObstacle *obstacle = &b->def->obstacles[o];
        double ahead = contact_next_clock(obstacle, b->clocks[o], time_end, dt) - b->clocks[o];
        b->advance[o] = obstacle->moves ? fmax(0.0, ahead) : 0.0;
        b->next[o] = b->advance[o] > 0.0 ? contact_pose(obstacle, b->clocks[o] + b->advance[o])
                                         : b->poses[o];
        b->driven = b->driven || b->advance[o] > 0.0;
    }
}

double barrier_work(const Barrier *b) {
    double work = 0.0;
    for (int i = 0; i < b->now.count; i++) {
        const Meeting *m = &b->now.items[i];
        Vec3 force = vec3_axpy(friction_of(m), m->force, m->foot.normal);
        work += vec3_dot(force, m->carried);
    }
    return work;
}

double barrier_friction(const Barrier *b) {
    double taken = 0.0;
    for (int i = 0; i < b->now.count; i++) {
        taken -= vec3_dot(friction_of(&b->now.items[i]), b->now.items[i].slid);
    }
    return taken;
}

BarrierReport barrier_look(Barrier *b, const double *x) {
    load_cloth(b, x, b->x);
    meetings_find(b, b->x);
    BarrierReport report = {b->now.count, INFINITY, INFINITY};
    for (int i = 0; i < b->now.count; i++) {
        const Meeting *m = &b->now.items[i];
        bool self = m->obstacle < 0 && !at_mesh(b, m);
        double *gap = self ? &report.smallest_self_gap : &report.smallest_gap;
        *gap = fmin(*gap, m->foot.distance);
    }
    return report;
}

/* ---- energy, gradient, stiffness ---- */

double barrier_energy(const Barrier *b) {
    double energy = 0.0;
    for (int i = 0; i < b->now.count; i++) {
        energy += b->now.items[i].energy;
    }
    return energy;
}

void barrier_add_gradient(const Barrier *b, double *g) {
    for (int i = 0; i < b->now.count; i++) {
        const Meeting *m = &b->now.items[i];
        Vec3 force = vec3_axpy(friction_of(m), m->force, m->foot.normal);
        for (int k = 0; k < m->count; k++) {
            if (!is_cloth(b, m->place[k])) {
                continue;
            }
            double *at = g + 3 * (size_t)m->place[k];
            vec3_store(at, vec3_axpy(vec3_load(at), -m->foot.weight[k], force));
        }
    }
}

static void add_outer(double block[9], double s, Vec3 a) {
    double v[3] = {a.x, a.y, a.z};
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) {
            block[3 * r + c] += s * v[r] * v[c];
        }
    }
}

/* S of one contact */
static void stiffness_block(const Meeting *m, double block[9]) {
    double kt = CONTACT_BRISTLE_SHARE * m->stiffness, length = vec3_length(m->stretch);
    double s = m->friction == 0.0 ? 0.0 : m->slips ? kt * m->limit / length : kt;
    memset(block, 0, 9 * sizeof *block);
    block[0] = block[4] = block[8] = s;
    add_outer(block, m->curvature - s, m->foot.normal);
    if (m->slips && s > 0.0) {
        add_outer(block, -s, vec3_scale(1.0 / length, m->stretch));
    }
}

static void lump(Barrier *b, int meeting, int a, int c, double factor) {
    if (b->lumped_count == b->lumped_room) {
        b->lumped_room = 2 * b->lumped_room + 1024;
        b->lumped = arena_grow(b->arena, Lumped, b->lumped, b->lumped_count, b->lumped_room);
    }
    b->lumped[b->lumped_count++] = (Lumped){meeting, a, c, factor};
}

static void scaled(const double s[9], double factor, double block[9]) {
    for (int k = 0; k < 9; k++) {
        block[k] = factor * s[k];
    }
}

static void add_meeting(Barrier *b, int index, BarrierAdd *add, void *context) {
    const Meeting *m = &b->now.items[index];
    double s[9], block[9];
    stiffness_block(m, s);
    for (int k = 0; k < m->count; k++) {
        for (int l = k; l < m->count; l++) {
            double factor = m->foot.weight[k] * m->foot.weight[l];
            if (!is_cloth(b, m->place[k]) || !is_cloth(b, m->place[l])) {
                continue;
            }
            scaled(s, factor, block);
            if (m->tilt > 0.0) {
                add_outer(block, m->tilt * vec3_dot(m->gradient[k], m->gradient[l]),
                          m->foot.normal);
            } else if (factor == 0.0) {
                continue;
            }
            bool same_side = (k < m->first) == (l < m->first);
            if (same_side && add(context, m->place[k], m->place[l], block)) {
                continue;
            }
            scaled(s, fabs(factor), block);
            add(context, m->place[k], m->place[k], block);
            add(context, m->place[l], m->place[l], block);
            lump(b, index, m->place[k], m->place[l], factor);
        }
    }
}

void barrier_add_stiffness(Barrier *b, BarrierAdd *add, void *context) {
    b->lumped_count = 0;
    for (int i = 0; i < b->now.count; i++) {
        add_meeting(b, i, add, context);
    }
}

static Vec3 multiply(const double s[9], Vec3 p) {
    return vec3(s[0] * p.x + s[1] * p.y + s[2] * p.z, s[3] * p.x + s[4] * p.y + s[5] * p.z,
                s[6] * p.x + s[7] * p.y + s[8] * p.z);
}

static void add_scaled(double *y, int place, double factor, Vec3 p) {
    double *at = y + 3 * (size_t)place;
    vec3_store(at, vec3_axpy(vec3_load(at), factor, p));
}

bool barrier_add_lumped(const Barrier *b, const double *p, double *y) {
    double s[9];
    for (int i = 0; i < b->lumped_count; i++) {
        const Lumped *l = &b->lumped[i];
        if (i == 0 || b->lumped[i - 1].meeting != l->meeting) {
            stiffness_block(&b->now.items[l->meeting], s);
        }
        Vec3 sa = multiply(s, vec3_load(p + 3 * (size_t)l->a));
        Vec3 sb = multiply(s, vec3_load(p + 3 * (size_t)l->b));
        add_scaled(y, l->a, l->factor, sb);
        add_scaled(y, l->a, -fabs(l->factor), sa);
        add_scaled(y, l->b, l->factor, sa);
        add_scaled(y, l->b, -fabs(l->factor), sb);
    }
    return b->lumped_count > 0;
}

/* ---- the rest ---- */

void barrier_mark(const Barrier *b, unsigned char *flags) {
    for (int i = 0; i < b->now.count; i++) {
        const Meeting *m = &b->now.items[i];
        for (int k = 0; k < m->count; k++) {
            if (!is_cloth(b, m->place[k])) {
                continue;
            }
            flags[m->place[k]] = flags[m->place[k]] || m->foot.weight[k] != 0.0;
        }
    }
}

double barrier_clamp(Barrier *b, const double *x, double *dx, const unsigned char **changed) {
    ClampObstacles obstacles = {b->poses, b->next, b->clocks, b->driven ? b->advance : NULL};
    load_cloth(b, x, b->x);
    load_cloth(b, dx, b->dx);
    double smallest = clamp_motion(&b->clamp, &obstacles, b->held, b->x, b->dx);
    load_cloth(b, b->dx, dx);
    for (int o = 0; b->driven && o < b->def->obstacle_count; o++) {
        b->poses[o] = b->next[o];
        b->clocks[o] += b->advance[o];
        if (b->advance[o] > 0.0) {
            place_mesh(b, o);
        }
    }
    b->driven = false;
    if (changed) {
        *changed = b->clamp.changed;
    }
    return smallest;
}

void barrier_end(const Barrier *b, ContactMemory *memory) {
    size_t obstacles = (size_t)b->def->obstacle_count;
    memset(memory->bristles, 0,
           3 * (size_t)b->def->vertex_count * obstacles * sizeof *memory->bristles);
    memcpy(memory->poses, b->poses, obstacles * sizeof *b->poses);
    memcpy(memory->clocks, b->clocks, obstacles * sizeof *b->clocks);
    memory->pair_count = memory->touch_count = 0;
    for (int i = 0; i < b->now.count; i++) { /* those at obstacles come first */
        const Meeting *m = &b->now.items[i];
        double length = vec3_length(m->stretch);
        Vec3 t = length > m->limit ? vec3_scale(m->limit / length, m->stretch) : m->stretch;
        if (m->count == 1) {
            size_t at = (size_t)m->place[0] * obstacles + (size_t)m->obstacle;
            vec3_store(memory->bristles + 3 * at, t);
        } else if (vec3_dot(t, t) > 0.0 && memory->pair_count < memory->pair_room) {
            PairMemory *pair = &memory->pairs[memory->pair_count++];
            memcpy(pair->place, m->key, sizeof pair->place);
            vec3_store(pair->bristle, t);
            memory->touch_count += m->obstacle >= 0;
        }
    }
}

static CrossingMesh mesh_now(const Barrier *b, int obstacle) {
    const MeshDef *mesh = b->def->obstacles[obstacle].mesh;
    size_t first = 3 * (size_t)b->clamp.near.places.mesh_first[obstacle];
    return (CrossingMesh){mesh->vertex_count, mesh->triangle_count, b->x + first, mesh->triangles};
}

int barrier_count_crossings(const Barrier *b, const double *x) {
    const Surface *s = &b->clamp.near.places.surface;
    Arena scratch = {0};
    CrossingMesh cloth = {b->def->vertex_count, 0, x, s->triangles};
    for (int p = 0; p < b->def->panel_count; p++) {
        cloth.triangle_count += s->panels[p].triangle_count;
    }
    int64_t count = b->def->self ? crossing_count_self(&cloth, &scratch).count : 0;
    for (int o = 0; o < b->def->obstacle_count; o++) {
        if (b->def->obstacles[o].mesh) {
            CrossingMesh mesh = mesh_now(b, o);
            count += crossing_count_between(&cloth, &mesh, &scratch).count;
        } else {
            count += crossing_count_solid(&cloth, &b->def->obstacles[o].solid, b->poses[o]).count;
        }
    }
    arena_free(&scratch);
    return (int)count;
}
