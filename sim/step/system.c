#include "sim/step/system.h"

#include <math.h>
#include <string.h>

const char statistic_names[] =
    "asleep\nsteps\nretries\nstep_length\nnewton_iterations\nfactorisations\nresidual\n"
    "kinetic\nelastic\ngravity\ncontact\nwork\nstretch\nbehind\nsmallest_gap\nsmallest_self_gap\n"
    "truncations\nimpulses\nlag\npairs\nevaluations\nrebuilds\nrounds\nzones\nzone_vertices\n"
    "friction\ndamping\nguard\nsides\nfabric\ndrag\nnumerical\napproach\ncpu\nseconds\ncontact_"
    "seconds\nsearch_seconds\n";

/* [m] skin beside half the cloth's thickness on either side; below it contact needs tiny steps */
#define LEAST_CONTACT_DISTANCE 1e-3
#define CONTACT_SPACING_SHARE 0.25 /* largest contact distance / spacing of a lattice */
#define STANDARD_GRAVITY 9.80665   /* [m/s2] for the weight scale of a scene without gravity */

static bool create_cloths(System *system, uint64_t seed, Error *error) {
    const Scene *scene = system->scene;
    system->cloth_count = scene->cloth_count;
    system->cloths = arena_push(system->arena, Cloth, scene->cloth_count);
    system->first = arena_push(system->arena, int, scene->cloth_count + 1);
    HandleDef *own = arena_push(system->arena, HandleDef, scene->handle_count);
    for (int c = 0; c < scene->cloth_count; c++) {
        int own_count = 0;
        for (int h = 0; h < scene->handle_count; h++) {
            if (scene->handles[h].cloth == c) {
                own[own_count++] = scene->handles[h];
            }
        }
        Cloth *cloth = &system->cloths[c];
        if (!cloth_create(cloth, &scene->cloths[c], own, own_count, seed + (uint64_t)c,
                          system->arena, error)) {
            return error_place(error, scene->cloths[c].where);
        }
        system->first[c + 1] = system->first[c] + cloth->node_count + cloth->ghost_count;
        system->node_count += cloth->node_count;
        system->history_count += cloth->history_count;
    }
    system->place_count = system->first[scene->cloth_count];
    return true;
}

static void fill_places(System *system) {
    const AirDef *air = &system->scene->air;
    int n = system->place_count;
    system->mass = arena_push(system->arena, double, n);
    system->area = arena_push(system->arena, double, n);
    system->damping = arena_push(system->arena, double, n);
    double *friction = arena_push(system->arena, double, n);
    double total = 0.0;
    for (int c = 0; c < system->cloth_count; c++) {
        const Cloth *cloth = &system->cloths[c];
        for (int i = 0; i < cloth->node_count + cloth->ghost_count; i++) {
            int place = system->first[c] + i;
            bool node = i < cloth->node_count;
            system->mass[place] = node ? cloth->mass[i] : 0.0;
            system->area[place] = node ? cloth->panel.area[i] : 0.0;
            system->damping[place] = cloth->def->damping + air->drag / cloth->material.density;
            friction[place] = cloth->material.friction;
            total += system->mass[place];
        }
    }
    double g = vec3_length(system->scene->gravity);
    system->weight = total * (g > 0.0 ? g : STANDARD_GRAVITY);
    system->contact.friction = friction;
    system->contact.mass = system->mass;
    system->contact.vertex_count = n;
}

static void create_obstacles(System *system) {
    const Scene *scene = system->scene;
    ContactObstacle *obstacles = arena_push(system->arena, ContactObstacle, scene->obstacle_count);
    for (int o = 0; o < scene->obstacle_count; o++) {
        const ObstacleDef *def = &scene->obstacles[o];
        bool by_itself = def->mesh && def->mesh->frame_count > 1;
        obstacles[o] = (ContactObstacle){.solid = def->solid,
                                         .mesh = def->mesh,
                                         .start = def->pose,
                                         .motion = &def->motion,
                                         .friction = def->friction,
                                         .moves = by_itself || def->motion.piece_count > 0};
    }
    system->contact.obstacle_count = scene->obstacle_count;
    system->contact.obstacles = obstacles;
}

/* [m] from the fabric or the scene; on a lattice below the spacing, or neighbours would push */
static double contact_distance(const System *system, const Cloth *cloth) {
    double wished = system->scene->solver.contact_distance;
    double distance =
        wished > 0.0 ? wished : fmax(LEAST_CONTACT_DISTANCE, cloth->material.thickness);
    double spacing = fmin(cloth->panel.h1, cloth->panel.h2);
    return fmin(distance, CONTACT_SPACING_SHARE * spacing);
}

static void create_surfaces(System *system) {
    SurfacePanel *panels = arena_push(system->arena, SurfacePanel, system->cloth_count);
    double *distance = arena_push(system->arena, double, system->place_count);
    double *start = arena_push(system->arena, double, 3 * system->place_count);
    for (int c = 0; c < system->cloth_count; c++) {
        const Cloth *cloth = &system->cloths[c];
        const Panel *p = &cloth->panel;
        int first = system->first[c];
        panels[c] = (SurfacePanel){.first = first,
                                   .vertex_count = cloth->node_count,
                                   .triangle_count = p->triangle_count,
                                   .triangles = p->triangles,
                                   .material = p->material,
                                   .nu = p->nu,
                                   .nv = p->nv,
                                   .wrap = p->wrap,
                                   .h1 = p->h1,
                                   .h2 = p->h2,
                                   .distance = contact_distance(system, cloth)};
        for (int i = 0; i < cloth->node_count; i++) {
            panels[c].mass += cloth->mass[i] / cloth->node_count;
        }
        cloth_start(cloth, start + 3 * (size_t)first);
        for (int i = first; i < system->first[c + 1]; i++) {
            distance[i] = panels[c].distance;
        }
        system->contact.distance = fmax(system->contact.distance, panels[c].distance);
    }
    system->contact.self = system->scene->solver.self_contact;
    system->contact.impulses = system->scene->solver.impulses;
    system->contact.panel_count = system->cloth_count;
    system->contact.panels = panels;
    system->contact.vertex_distance = distance;
    system->contact.start = start;
}

CrossingMesh system_mesh(const System *system, const double *x, Arena *arena) {
    int count = 0, at = 0;
    for (int c = 0; c < system->cloth_count; c++) {
        count += system->cloths[c].panel.triangle_count;
    }
    int32_t *triangles = arena_push(arena, int32_t, 3 * count);
    for (int c = 0; c < system->cloth_count; c++) {
        const Panel *panel = &system->cloths[c].panel;
        for (int k = 0; k < 3 * panel->triangle_count; k++) {
            triangles[at++] = system->first[c] + panel->triangles[k];
        }
    }
    return (CrossingMesh){system->place_count, count, x, triangles};
}

CrossingMesh system_obstacle_mesh(const System *system, int obstacle, Pose pose, double clock,
                                  Arena *arena) {
    const MeshDef *def = system->contact.obstacles[obstacle].mesh;
    double *x = arena_push(arena, double, 3 * (size_t)def->vertex_count);
    mesh_positions(def, clock, x);
    for (int i = 0; i < def->vertex_count; i++) {
        vec3_store(x + 3 * i, pose_apply(pose, vec3_load(x + 3 * i)));
    }
    return (CrossingMesh){def->vertex_count, def->triangle_count, x, def->triangles};
}

bool system_has_contact(const System *system) {
    return system->contact.self || system->contact.obstacle_count > 0;
}

/* a clamp takes the ghosts of its border nodes along */
static int add_ghosts(const Cloth *cloth, const HandleDef *def, const unsigned char *marks,
                      int first, int *places) {
    int count = 0;
    for (int g = 0; def->kind == HANDLE_CLAMP && g < cloth->ghost_count; g++) {
        const Ghost *ghost = &cloth->ghosts[g];
        bool side = ghost->side < 0 || def->region == REGION_BORDER ||
                    def->region == (RegionKind)(REGION_LEFT + ghost->side);
        if (side && marks[ghost->border]) {
            places[count++] = first + cloth->node_count + g;
        }
    }
    return count;
}

static bool create_handle(System *system, const HandleDef *def, const double *start, Handle *handle,
                          Error *error) {
    const Cloth *cloth = &system->cloths[def->cloth];
    const char *where = def->where ? def->where : system->scene->path;
    int first = system->first[def->cloth];
    ArenaMark mark = arena_mark(system->arena);
    unsigned char *marks = arena_push(system->arena, unsigned char, cloth->node_count);
    int count = panel_select(&cloth->panel, def, marks);
    if (count == 0) {
        arena_rewind(system->arena, mark);
        return error_set(error, EXIT_BAD_INPUT,
                         "%s: error: this handle holds no node of cloth '%s'", where,
                         cloth->def->name);
    }
    if (def->kind == HANDLE_CLAMP && isfinite(def->release)) {
        return error_set(error, EXIT_BAD_INPUT, "%s: error: a clamp cannot be released; use 'hold'",
                         where);
    }
    int *places = arena_push(system->arena, int, count + cloth->ghost_count);
    int at = 0;
    for (int i = 0; i < cloth->node_count; i++) {
        if (marks[i]) {
            places[at++] = first + i;
        }
    }
    at += add_ghosts(cloth, def, marks, first, places + at);
    double *from = arena_push(system->arena, double, 3 * at);
    for (int i = 0; i < at; i++) {
        memcpy(from + 3 * i, start + 3 * (size_t)places[i], 3 * sizeof *from);
    }
    *handle = (Handle){def, at, places, from};
    return true;
}

static bool create_handles(System *system, Error *error) {
    const Scene *scene = system->scene;
    system->handle_count = scene->handle_count;
    system->handles = arena_push(system->arena, Handle, scene->handle_count);
    double *start = arena_push(system->arena, double, 3 * system->place_count);
    Vec3 low = {INFINITY, INFINITY, INFINITY}, high = {-INFINITY, -INFINITY, -INFINITY};
    for (int c = 0; c < system->cloth_count; c++) {
        cloth_start(&system->cloths[c], start + 3 * (size_t)system->first[c]);
    }
    for (int i = 0; i < system->place_count; i++) {
        Vec3 x = vec3_load(start + 3 * i);
        low = vec3(fmin(low.x, x.x), fmin(low.y, x.y), fmin(low.z, x.z));
        high = vec3(fmax(high.x, x.x), fmax(high.y, x.y), fmax(high.z, x.z));
    }
    system->size = vec3_length(vec3_sub(high, low));
    for (int h = 0; h < scene->handle_count; h++) {
        if (!create_handle(system, &scene->handles[h], start, &system->handles[h], error)) {
            return false;
        }
    }
    return true;
}

bool system_create(System *system, const Scene *scene, uint64_t seed, Arena *arena, Error *error) {
    *system = (System){.scene = scene, .arena = arena};
    if (!create_cloths(system, seed, error)) {
        return false;
    }
    fill_places(system);
    create_obstacles(system);
    create_surfaces(system);
    if (system_has_contact(system)) {
        system->contact.reference_step = scene->solver.courant * system_stable_step(system);
    }
    return create_handles(system, error);
}

long system_crossings(const System *system, const State *state) {
    Arena arena = {0};
    CrossingMesh mesh = system_mesh(system, state->x, &arena);
    long crossings = (long)crossing_count_self(&mesh, &arena).count;
    for (int o = 0; o < system->contact.obstacle_count; o++) {
        Pose pose = state->contact.poses[o];
        const ContactObstacle *obstacle = &system->contact.obstacles[o];
        if (obstacle->mesh) {
            CrossingMesh other =
                system_obstacle_mesh(system, o, pose, state->contact.clocks[o], &arena);
            crossings += (long)crossing_count_between(&mesh, &other, &arena).count;
            crossings += obstacle->mesh->closed && crossing_point_inside(&other, mesh.vertices);
        } else {
            crossings += (long)crossing_count_solid(&mesh, &obstacle->solid, pose).count;
        }
    }
    arena_free(&arena);
    return crossings;
}

static bool shows_contact(const System *system) {
    bool shows = false;
    for (int c = 0; c < system->cloth_count; c++) {
        shows = shows || strcmp(system->cloths[c].def->look, FILM_LOOK_CONTACT) == 0;
    }
    return shows;
}

State state_allocate(const System *system, Arena *arena) {
    int n = 3 * system->place_count, o = system->contact.obstacle_count;
    int pairs = system_has_contact(system) ? CONTACT_MEMORY_PER_VERTEX * system->node_count : 0;
    return (State){.x = arena_push(arena, double, n),
                   .v = arena_push(arena, double, n),
                   .x_before = arena_push(arena, double, n),
                   .v_before = arena_push(arena, double, n),
                   .history = arena_push(arena, double, system->history_count),
                   .contact_force = shows_contact(system) ? arena_push(arena, double, n) : NULL,
                   .contact = {.poses = arena_push(arena, Pose, o),
                               .clocks = arena_push(arena, double, o),
                               .bristles = arena_push(arena, double, n *o),
                               .pairs = arena_push(arena, PairMemory, pairs),
                               .pair_room = pairs}};
}

void state_copy(const System *system, State *to, const State *from) {
    size_t n = 3 * (size_t)system->place_count, o = (size_t)system->contact.obstacle_count;
    to->time = from->time;
    to->step_before = from->step_before;
    to->calm = from->calm;
    to->scaled = from->scaled;
    to->hidden = from->hidden;
    memcpy(to->history, from->history, (size_t)system->history_count * sizeof *to->history);
    memcpy(to->x, from->x, n * sizeof *to->x);
    memcpy(to->v, from->v, n * sizeof *to->v);
    memcpy(to->x_before, from->x_before, n * sizeof *to->x);
    memcpy(to->v_before, from->v_before, n * sizeof *to->x);
    memcpy(to->contact.poses, from->contact.poses, o * sizeof *to->contact.poses);
    memcpy(to->contact.clocks, from->contact.clocks, o * sizeof *to->contact.clocks);
    memcpy(to->contact.bristles, from->contact.bristles, n * o * sizeof *to->contact.bristles);
    if (from->contact_force) {
        memcpy(to->contact_force, from->contact_force, n * sizeof *to->contact_force);
    }
    to->contact.approach = from->contact.approach;
    to->unguarded = from->unguarded;
    to->contact.stiffness = from->contact.stiffness;
    to->contact.solid_stiffness = from->contact.solid_stiffness;
    to->contact.touch_count = from->contact.touch_count;
    to->contact.pair_count = from->contact.pair_count;
    memcpy(to->contact.pairs, from->contact.pairs,
           (size_t)from->contact.pair_count * sizeof *to->contact.pairs);
}

void state_start(const System *system, State *state) {
    state->time = state->step_before = state->calm = state->scaled = state->hidden = 0.0;
    state->unguarded = INFINITY;
    memset(state->history, 0, (size_t)system->history_count * sizeof *state->history);
    for (int c = 0; c < system->cloth_count; c++) {
        const Cloth *cloth = &system->cloths[c];
        double *x = state->x + 3 * (size_t)system->first[c];
        double *v = state->v + 3 * (size_t)system->first[c];
        cloth_start(cloth, x);
        for (int i = 0; i < cloth->node_count; i++) {
            vec3_store(v + 3 * i, cloth->def->velocity);
        }
    }
    for (int o = 0; o < system->contact.obstacle_count; o++) {
        state->contact.poses[o] = contact_pose(&system->contact.obstacles[o], 0.0);
        state->contact.clocks[o] = 0.0;
    }
    for (int h = 0; h < system->handle_count; h++) {
        for (int i = 0; i < system->handles[h].count; i++) {
            memset(state->v + 3 * (size_t)system->handles[h].places[i], 0, 3 * sizeof(double));
        }
    }
}

void system_load_history(const System *system, const State *state) {
    const double *from = state->history;
    for (int c = 0; c < system->cloth_count; c++) {
        int count = system->cloths[c].history_count;
        if (count > 0) {
            memcpy(system->cloths[c].history, from, (size_t)count * sizeof *from);
        }
        from += count;
    }
}

void system_store_history(const System *system, State *state) {
    double *to = state->history;
    for (int c = 0; c < system->cloth_count; c++) {
        int count = system->cloths[c].history_count;
        if (count > 0) {
            memcpy(to, system->cloths[c].history, (size_t)count * sizeof *to);
        }
        to += count;
    }
}

void system_commit(const System *system, State *state) {
    for (int c = 0; c < system->cloth_count && system->history_count > 0; c++) {
        Cloth *cloth = &system->cloths[c];
        if (cloth->model->commit) {
            cloth->model->commit(cloth, state->x + 3 * (size_t)system->first[c]);
        }
    }
    system_store_history(system, state);
}

void system_mark_held(const System *system, double time, unsigned char *held) {
    memset(held, 0, (size_t)system->place_count);
    for (int c = 0; c < system->cloth_count; c++) {
        const Cloth *cloth = &system->cloths[c];
        memset(held + system->first[c] + cloth->node_count, 1, (size_t)cloth->ghost_count);
    }
    for (int h = 0; h < system->handle_count; h++) {
        const Handle *handle = &system->handles[h];
        for (int i = 0; i < handle->count && time <= handle->def->release; i++) {
            held[handle->places[i]] = 1;
        }
    }
}

void system_place_held(const System *system, double time, double *x) {
    for (int h = 0; h < system->handle_count; h++) {
        const Handle *handle = &system->handles[h];
        if (time > handle->def->release) {
            continue;
        }
        Pose pose = motion_pose(&handle->def->motion, time);
        for (int i = 0; i < handle->count; i++) {
            Vec3 p = pose_apply(pose, vec3_load(handle->start + 3 * i));
            vec3_store(x + 3 * (size_t)handle->places[i], p);
        }
    }
}

/* [m] length of half the sum of two opposite sides */
static double mean_side(const double *x, int from1, int to1, int from2, int to2) {
    Vec3 one = vec3_sub(vec3_load(x + 3 * (size_t)to1), vec3_load(x + 3 * (size_t)from1));
    Vec3 two = vec3_sub(vec3_load(x + 3 * (size_t)to2), vec3_load(x + 3 * (size_t)from2));
    return 0.5 * vec3_length(vec3_add(one, two));
}

double system_stretch(const System *system, const double *x, int *cloth) {
    double most = 0.0;
    *cloth = 0;
    for (int c = 0; c < system->cloth_count; c++) {
        const Panel *panel = &system->cloths[c].panel;
        int nu = panel->nu, first = system->first[c];
        for (int j = 0; j + 1 < panel->nv; j++) {
            for (int i = 0; i < (panel->wrap ? nu : nu - 1); i++) {
                int a = first + j * nu + i, b = first + j * nu + (i + 1) % nu;
                double u = mean_side(x, a, b, a + nu, b + nu) / panel->h1 - 1.0;
                double v = mean_side(x, a, a + nu, b, b + nu) / panel->h2 - 1.0;
                *cloth = fmax(u, v) > most ? c : *cloth;
                most = fmax(most, fmax(u, v));
            }
        }
    }
    return most;
}

double system_behind(const System *system, const double *x, double time, double *scratch,
                     int *place) {
    double most = 0.0;
    *place = 0;
    memcpy(scratch, x, 3 * (size_t)system->place_count * sizeof *x);
    system_place_held(system, time, scratch);
    for (int i = 0; i < system->place_count; i++) {
        Vec3 way = vec3_sub(vec3_load(scratch + 3 * (size_t)i), vec3_load(x + 3 * (size_t)i));
        *place = vec3_length(way) > most ? i : *place;
        most = fmax(most, vec3_length(way));
    }
    return most;
}

double system_elastic_energy(const System *system, const double *x) {
    double energy = 0.0;
    for (int c = 0; c < system->cloth_count; c++) {
        const Cloth *cloth = &system->cloths[c];
        energy += cloth->model->energy(cloth, x + 3 * (size_t)system->first[c]);
    }
    return energy;
}

void system_add_gradient(const System *system, const double *x, double *gradient) {
    for (int c = 0; c < system->cloth_count; c++) {
        const Cloth *cloth = &system->cloths[c];
        size_t at = 3 * (size_t)system->first[c];
        cloth->model->add_gradient(cloth, x + at, gradient + at);
    }
}

double system_kinetic_energy(const System *system, const double *v, const unsigned char *held) {
    double energy = 0.0;
    for (int i = 0; i < system->place_count; i++) {
        Vec3 a = vec3_load(v + 3 * i);
        energy += held[i] ? 0.0 : 0.5 * system->mass[i] * vec3_dot(a, a);
    }
    return energy;
}

double system_gravity_energy(const System *system, const double *x, const unsigned char *held) {
    double energy = 0.0;
    for (int i = 0; i < system->place_count; i++) {
        double height = -vec3_dot(system->scene->gravity, vec3_load(x + 3 * i));
        energy += held[i] ? 0.0 : system->mass[i] * height;
    }
    return energy;
}

double system_stable_step(const System *system) {
    double step = INFINITY;
    for (int c = 0; c < system->cloth_count; c++) {
        step = fmin(step, system->cloths[c].model->stable_step(&system->cloths[c]));
    }
    return step;
}

bool system_is_scalable(const System *system, const Cloth *cloth) {
    const SweepLattice *l = cloth->lattice;
    return l && system->scene->solver.mass_scaling && !system->contact.impulses &&
           l->nu >= SWEEP_LEAST_SCALED && l->nv >= SWEEP_LEAST_SCALED;
}

double system_stiffening(const System *system, const double *x, double stable) {
    double most = 1.0;
    for (int c = 0; c < system->cloth_count; c++) {
        const Cloth *cloth = &system->cloths[c];
        if (cloth->lattice) {
            double share = stable / cloth->model->stable_step(cloth); /* of a lattice: a formula */
            double own = sweep_stiffening(cloth->lattice, x + 3 * system->first[c]);
            most = fmax(most, share * share * own);
        }
    }
    return most;
}

double system_scaled_step(const System *system) {
    double step = INFINITY;
    for (int c = 0; c < system->cloth_count; c++) {
        const Cloth *cloth = &system->cloths[c];
        if (system_is_scalable(system, cloth)) {
            SweepLattice scaled = *cloth->lattice;
            scaled.scaled = true;
            step = fmin(step, sweep_stable_step(&scaled, cloth->material.density));
        } else {
            step = fmin(step, cloth->model->stable_step(cloth));
        }
    }
    return step;
}
