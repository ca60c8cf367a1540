#include <math.h>
#include <string.h>

#include "sim/model/model.h"
#include "sim/model/yarn_friction.h"

/* one line a model */
#define MODELS(MODEL) MODEL(mlpg) MODEL(springs) MODEL(triangles) MODEL(particles)

#define DECLARE(name) extern const ClothModel cloth_model_##name;
#define LIST(name) &cloth_model_##name,
MODELS(DECLARE)
const ClothModel *const cloth_models[] = {MODELS(LIST) NULL};

const ClothModel *cloth_model_find(const char *name) {
    for (const ClothModel *const *model = cloth_models; *model; model++) {
        if (strcmp((*model)->name, name) == 0) {
            return *model;
        }
    }
    return NULL;
}

/* lattice borders that some handle clamps as a whole */
static void find_clamps(Cloth *cloth, const HandleDef *handles, int handle_count) {
    for (int h = 0; h < handle_count; h++) {
        RegionKind region = handles[h].region;
        if (handles[h].kind != HANDLE_CLAMP) {
            continue;
        }
        for (int side = 0; side < 4; side++) {
            bool all = region == REGION_BORDER;
            bool wrapped = cloth->panel.wrap && side < 2;
            cloth->clamp[side] |= !wrapped && (all || region == (RegionKind)(REGION_LEFT + side));
        }
    }
}

static void lattice_ghosts(Cloth *cloth, Arena *arena) {
    const Panel *p = &cloth->panel;
    Ghost *ghosts = arena_push(arena, Ghost, 2 * (p->nu + p->nv));
    static const double out[4][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
    for (int side = 0; side < 4; side++) {
        int count = side < 2 ? p->nv : p->nu;
        for (int k = 0; cloth->clamp[side] && k < count; k++) {
            int border = side < 2 ? k * p->nu + (side == 0 ? 0 : p->nu - 1)
                                  : (side == 2 ? 0 : p->nv - 1) * p->nu + k;
            ghosts[cloth->ghost_count++] = (Ghost){border, side, {out[side][0], out[side][1]}};
        }
    }
    cloth->ghosts = ghosts;
}

/* one ghost for every border node that a clamp holds, along the mean of its two border sides;
 * at the end of a clamped stretch along the clamped side alone */
static void scattered_ghosts(Cloth *cloth, const HandleDef *handles, int handle_count,
                             Arena *arena) {
    const Panel *p = &cloth->panel;
    int border = p->outline_begin[p->loop_count];
    unsigned char *marks = arena_push(arena, unsigned char, p->node_count);
    Ghost *ghosts = arena_push(arena, Ghost, border);
    for (int h = 0; h < handle_count; h++) {
        if (handles[h].kind == HANDLE_CLAMP) {
            panel_select(p, &handles[h], marks);
        }
    }
    for (int l = 0; l < p->loop_count; l++) {
        int begin = p->outline_begin[l], count = p->outline_begin[l + 1] - begin;
        for (int k = 0; k < count; k++) {
            int node = begin + k;
            int ends[3] = {begin + (k + count - 1) % count, node, begin + (k + 1) % count};
            double out[2] = {0, 0};
            for (int side = 0; marks[node] && side < 2; side++) {
                const double *a = p->material + 2 * ends[side];
                const double *b = p->material + 2 * ends[side + 1];
                if (marks[ends[side]] && marks[ends[side + 1]]) {
                    double length = hypot(b[0] - a[0], b[1] - a[1]);
                    out[0] += (b[1] - a[1]) / length, out[1] -= (b[0] - a[0]) / length;
                }
            }
            double size = hypot(out[0], out[1]);
            if (size > 0.0) {
                ghosts[cloth->ghost_count++] = (Ghost){node, -1, {out[0] / size, out[1] / size}};
            }
        }
    }
    cloth->ghosts = ghosts;
}

/* the words of a set of BendingKind, "stencil, rbf" */
static const char *list_bendings(unsigned set, Arena *arena) {
    char *text = arena_push(arena, char, 16 * BENDING_COUNT);
    for (int k = 0; k < BENDING_COUNT; k++) {
        if (set & 1u << k) {
            strcat(text, *text ? ", " : "");
            strcat(text, bending_words[k]);
        }
    }
    return text;
}

/* the form of bending that the model shall use */
static bool choose_bending(Cloth *cloth, Arena *arena, Error *error) {
    const ClothModel *model = cloth->model;
    bool lattice = cloth->panel.nu > 0;
    unsigned known = lattice ? model->lattice_bendings : model->scattered_bendings;
    const char *nodes = lattice ? "on lattices" : "on scattered nodes";
    cloth->bending = cloth->def->bending;
    if (known == 0) {
        return error_set(error, EXIT_BAD_INPUT, "cloth '%s': model '%s' does not work %s",
                         cloth->def->name, model->name, nodes);
    }
    if (cloth->bending != BENDING_AUTO && !(known & 1u << cloth->bending)) {
        return error_set(error, EXIT_BAD_INPUT,
                         "cloth '%s': model '%s' knows no 'bending: %s' %s; it knows %s",
                         cloth->def->name, model->name, bending_words[cloth->bending], nodes,
                         list_bendings(known, arena));
    }
    for (int k = BENDING_COUNT - 1; k > 0 && cloth->def->bending == BENDING_AUTO; k--) {
        cloth->bending = known & 1u << k ? (BendingKind)k : cloth->bending;
    }
    return true;
}

bool cloth_create(Cloth *cloth, const ClothDef *def, const HandleDef *handles, int handle_count,
                  uint64_t seed, Arena *arena, Error *error) {
    *cloth = (Cloth){.def = def, .model = cloth_model_find(def->model)};
    if (!cloth->model) {
        return error_set(error, EXIT_BAD_INPUT, "cloth '%s': no model is called '%s'", def->name,
                         def->model);
    }
    if (!panel_create(def, seed, arena, &cloth->panel, error)) {
        return false;
    }
    if (cloth->panel.vertex_node && !cloth->model->seams) {
        return error_set(error, EXIT_BAD_INPUT,
                         "cloth '%s': model '%s' has no seams and no meshes; 'triangles' has",
                         def->name, def->model);
    }
    if (!choose_bending(cloth, arena, error)) {
        return false;
    }
    cloth->material = fabric_material(&def->fabric);
    cloth->node_count = cloth->panel.node_count;
    cloth->mass = arena_push(arena, double, cloth->node_count);
    if (cloth->panel.nu > 0) {
        find_clamps(cloth, handles, handle_count);
        lattice_ghosts(cloth, arena);
    } else {
        scattered_ghosts(cloth, handles, handle_count, arena);
    }
    if (!cloth->model->create(cloth, arena, error) ||
        (def->hysteresis && !yarn_friction_attach(cloth, arena, error))) {
        return false;
    }
    if ((def->fifth_power || def->repel) && strcmp(def->model, "particles") != 0) {
        return error_set(error, EXIT_BAD_INPUT,
                         "cloth '%s': '%s' is for model 'particles', not '%s'", def->name,
                         def->repel ? "repel" : "threads: breen", def->model);
    }
    if (def->sides == SIDES_BOUNDED && !(cloth->lattice && cloth->lattice->bounded)) {
        return error_set(error, EXIT_BAD_INPUT,
                         "cloth '%s': 'sides: bounded' needs model 'mlpg' on a lattice, with "
                         "'bending: stencil' and 'kinematics: green', without hysteresis",
                         def->name);
    }
    return true;
}

void cloth_start(const Cloth *cloth, double *x) {
    const Panel *p = &cloth->panel;
    for (int i = 0; i < cloth->node_count; i++) {
        vec3_store(x + 3 * i, pose_apply(cloth->def->pose, vec3_load(p->start + 3 * i)));
    }
    for (int g = 0; g < cloth->ghost_count; g++) {
        const Ghost *ghost = &cloth->ghosts[g];
        Vec3 border = vec3_load(p->start + 3 * ghost->border);
        /* material axes in the panel's frame; on a sleeve only v-borders can be clamped */
        Vec3 out = p->wrap ? vec3(0, 0, ghost->out[1]) : vec3(ghost->out[0], ghost->out[1], 0);
        double h = ghost->side == 0 || ghost->side == 1 ? p->h1 : p->h2;
        vec3_store(x + 3 * (cloth->node_count + g),
                   pose_apply(cloth->def->pose, vec3_axpy(border, h, out)));
    }
}
