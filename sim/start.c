#include "sim/start.h"

#include "sim/contact/flatness.h"
#include "sim/contact/push_out.h"
#include "sim/geom/untangle.h"

#define MOST_DEPTH 10.0 /* contact distances; deeper, moving out would tear at the cloth */
#define MOST_TURNS 8    /* of pulling apart and moving out */
#define UNTANGLED 0.2   /* contact distances that cloth pulled apart is left */

typedef struct Spot {
    const char *cloth, *where; /* in the scene */
    const double *material;    /* (u, v) of a corner of the triangle */
} Spot;

static Spot spot_of(const System *system, int place) {
    int c = 0;
    while (place >= system->first[c + 1]) {
        c++;
    }
    const Cloth *cloth = &system->cloths[c];
    const char *where = cloth->def->where ? cloth->def->where : system->scene->path;
    return (Spot){cloth->def->name, where, cloth->panel.material + 2 * (place - system->first[c])};
}

/* the first triangle of the cloth that crosses a mesh, or of a cloth that is inside as a whole; -1 */
static int crossing_with_mesh(const System *system, const State *state, int obstacle,
                              const CrossingMesh *cloth, Arena *scratch) {
    CrossingMesh mesh =
        system_obstacle_mesh(system, obstacle, state->contact.poses[obstacle], 0.0, scratch);
    Crossings found = crossing_count_between(cloth, &mesh, scratch);
    bool closed = system->contact.obstacles[obstacle].mesh->closed;
    for (int c = 0, at = 0; c < system->cloth_count && closed && found.count == 0; c++) {
        if (crossing_point_inside(&mesh, cloth->vertices + 3 * (size_t)system->first[c])) {
            return at;
        }
        at += system->cloths[c].panel.triangle_count;
    }
    return found.first[0];
}

static bool check_obstacles(const System *system, const State *state, const CrossingMesh *cloth,
                            Arena *scratch, Error *error) {
    for (int o = 0; o < system->contact.obstacle_count; o++) {
        const ContactObstacle *obstacle = &system->contact.obstacles[o];
        int triangle =
            obstacle->mesh
                ? crossing_with_mesh(system, state, o, cloth, scratch)
                : crossing_count_solid(cloth, &obstacle->solid, state->contact.poses[o]).first[0];
        if (triangle >= 0) {
            Spot spot = spot_of(system, cloth->triangles[3 * triangle]);
            return error_set(
                error, EXIT_BAD_INPUT,
                "%s: error: cloth '%s' crosses obstacle '%s' at the start, first at (%.4g, "
                "%.4g) m of its panel",
                spot.where, spot.cloth, system->scene->obstacles[o].name, spot.material[0],
                spot.material[1]);
        }
    }
    return true;
}

/* refuses cloth that crosses cloth and could not be pulled apart */
static bool check_cloth(const System *system, const CrossingMesh *cloth, Crossings crossings,
                        Error *error) {
    if (crossings.count == 0) {
        return true;
    }
    Spot a = spot_of(system, cloth->triangles[3 * crossings.first[0]]);
    Spot b = spot_of(system, cloth->triangles[3 * crossings.first[1]]);
    return error_set(
        error, EXIT_BAD_INPUT,
        "%s: error: cloth '%s' crosses cloth '%s' at the start too deep to be untangled, first "
        "at (%.4g, %.4g) m and (%.4g, %.4g) m of their panels; 'solver: {self_contact: "
        "false}' lets it",
        a.where, a.cloth, b.cloth, a.material[0], a.material[1], b.material[0], b.material[1]);
}

/* the vertex that is deepest in a solid */
typedef struct Deepest {
    int place, obstacle;
    double depth; /* [m] 0: none is inside */
} Deepest;

static Deepest find_deepest(const System *system, const State *state) {
    Deepest deepest = {0};
    for (int o = 0; o < system->contact.obstacle_count; o++) {
        const ContactObstacle *obstacle = &system->contact.obstacles[o];
        for (int i = 0; i < system->place_count && !obstacle->mesh; i++) {
            Vec3 normal, p = pose_unapply(state->contact.poses[o], vec3_load(state->x + 3 * i));
            double depth = -solid_distance(&obstacle->solid, p, &normal);
            if (depth > deepest.depth) {
                deepest = (Deepest){i, o, depth};
            }
        }
    }
    return deepest;
}

/* `deepest`: before cloth was moved out. What pierces it flies far when that is tried, which says nothing. */
static bool check_depth(const System *system, const Deepest *deepest, const PushOut *out,
                        Error *error) {
    double most = MOST_DEPTH * system->contact.distance;
    if (out->way <= most) {
        return true;
    }
    Spot spot = spot_of(system, deepest->depth > 0.0 ? deepest->place : out->farthest);
    if (deepest->depth > 0.0) {
        return error_set(
            error, EXIT_BAD_INPUT,
            "%s: error: cloth '%s' starts inside obstacle '%s', %.3g mm deep at (%.4g, %.4g) m "
            "of its panel; toile moves cloth out by at most %.3g mm",
            spot.where, spot.cloth, system->scene->obstacles[deepest->obstacle].name,
            1e3 * deepest->depth, spot.material[0], spot.material[1], 1e3 * most);
    }
    return error_set(
        error, EXIT_BAD_INPUT,
        "%s: error: cloth '%s' is pierced by an obstacle at the start, near (%.4g, %.4g) m of "
        "its panel; to move it out would take more than %.3g mm",
        spot.where, spot.cloth, spot.material[0], spot.material[1], 1e3 * most);
}

/* Is every cloth flat, and its box apart from those of others? Most starts are so: far cheaper than to count. */
static bool is_apart(const ContactDef *def, const double *x, Arena *scratch) {
    Box *box = arena_push(scratch, Box, def->panel_count);
    Points places = {x};
    for (int a = 0; a < def->panel_count; a++) {
        const SurfacePanel *panel = &def->panels[a];
        if (!flatness_is_graph(panel, &places)) {
            return false;
        }
        box[a] = box_empty();
        for (int i = panel->first; i < panel->first + panel->vertex_count; i++) {
            box_add(&box[a], point_at(&places, i));
        }
        for (int b = 0; b < a; b++) {
            if (box_distance(&box[a], &box[b]) <= 0.0) {
                return false;
            }
        }
    }
    return true;
}

static Crossings count_crossings(const System *system, const double *x, Arena *scratch) {
    if (!system->contact.self || is_apart(&system->contact, x, scratch)) {
        return (Crossings){0, {-1, -1}};
    }
    CrossingMesh cloth = system_mesh(system, x, scratch);
    return crossing_count_self(&cloth, scratch);
}

/* Cloth that crosses cloth is pulled apart, as far as that goes; returns the vertices moved. */
static int untangle_cloth(const System *system, const unsigned char *held, double *x,
                          Arena *scratch) {
    CrossingMesh cloth = system_mesh(system, x, scratch);
    double distance = system->contact.distance;
    Untangled result =
        untangle(&cloth, held, UNTANGLED * distance, MOST_DEPTH * distance, x, scratch);
    return result.done ? result.moved : 0;
}

bool start_make_legal(const System *system, State *state, StartMoves *moves, Error *error) {
    Arena scratch = {0};
    unsigned char *held = arena_push(&scratch, unsigned char, system->place_count);
    system_mark_held(system, 0.0, held);
    Deepest deepest = find_deepest(system, state);
    PushOut out = push_out(&system->contact, state->contact.poses, held, state->x);
    moves->pushed_out = out.moved;
    moves->untangled = 0;
    Crossings crossings = count_crossings(system, state->x, &scratch);
    for (int k = 0; k < MOST_TURNS && crossings.count > 0; k++) { /* one may undo the other */
        int moved = untangle_cloth(system, held, state->x, &scratch);
        if (moved == 0) {
            break;
        }
        moves->untangled = moved > moves->untangled ? moved : moves->untangled;
        PushOut again = push_out(&system->contact, state->contact.poses, held, state->x);
        out = again.way > out.way ? again : out;
        crossings = count_crossings(system, state->x, &scratch);
    }
    CrossingMesh cloth = system_mesh(system, state->x, &scratch);
    bool ok = check_depth(system, &deepest, &out, error) &&
              check_obstacles(system, state, &cloth, &scratch, error) &&
              check_cloth(system, &cloth, crossings, error);
    arena_free(&scratch);
    return ok;
}
