/* triangles.c: triangle meshes (after Baraff, Witkin 1998), with a membrane that is orthotropic and
 * does not depend on the mesh (St. Venant-Kirchhoff, constant strain), and bending by the turns of
 * edges (hinges.h): on lattices a curvature tensor, on other meshes Morley's, which is a plate on all.
 *
 * Lattices get one diagonal in every cell, all the same way: there the curvature tensor is exact.
 * Their two triangles share one membrane sample, as in mlpg.h, unless `membrane: triangles`:
 * constant strain triangles lock where cloth folds across them.
 */
#include <stdio.h>

#include "sim/model/hinges.h"
#include "sim/model/mlpg.h"
#include "sim/model/stable.h"
#include "sim/model/strain.h"

typedef struct Triangles {
    StrainSamples membrane;
    Hinges hinges;
} Triangles;

/* Eh h^2/B beyond which constant strain triangles hold folds open */
#define LOCKS_FROM 1e5

static const int *lattice_triangles(const Panel *p, int *count, Arena *arena) {
    int cells = p->wrap ? p->nu : p->nu - 1;
    int *triangles = arena_push(arena, int, 6 * cells * (p->nv - 1)), *out = triangles;
    for (int j = 0; j + 1 < p->nv; j++) {
        for (int i = 0; i < cells; i++, out += 6) {
            int a = j * p->nu + i, b = j * p->nu + (i + 1) % p->nu;
            out[0] = a, out[1] = b, out[2] = b + p->nu;
            out[3] = a, out[4] = b + p->nu, out[5] = a + p->nu;
        }
    }
    *count = 2 * cells * (p->nv - 1);
    return triangles;
}

/* one sample a triangle (of vertices): rows are the gradients of its hat functions */
static void constant_strain(const Cloth *cloth, const int *triangles, int count, StrainSamples *s,
                            Arena *arena) {
    const Panel *p = &cloth->panel;
    const Material *m = &cloth->material;
    *s = (StrainSamples){.kind = &strain_triangle,
                         .sample_count = count,
                         .start = arena_push(arena, int, count + 1),
                         .node = arena_push(arena, int, 3 * count),
                         .row = arena_push(arena, double, 6 * count),
                         .area = arena_push(arena, double, count),
                         .c11 = m->c11,
                         .c12 = m->c12,
                         .c22 = m->c22,
                         .c66 = m->c66,
                         .corotational = cloth->def->kinematics == KINEMATICS_COROTATIONAL,
                         .node_limit = cloth->node_count};
    for (int t = 0; t < count; t++) {
        const int *n = triangles + 3 * t;
        double side[3][2], area; /* opposite to each corner */
        for (int k = 0; k < 3; k++) {
            hinges_difference(p, n[(k + 1) % 3], n[(k + 2) % 3], side[k]);
        }
        area = 0.5 * (side[2][0] * -side[1][1] + side[2][1] * side[1][0]);
        for (int k = 0; k < 3; k++) {
            s->node[3 * t + k] = panel_node(p, n[k]);
            s->row[2 * (3 * t + k)] = -0.5 * side[k][1] / area;
            s->row[2 * (3 * t + k) + 1] = 0.5 * side[k][0] / area;
        }
        s->start[t + 1] = 3 * (t + 1);
        s->area[t] = area;
    }
}

static const char *note(const Cloth *cloth, bool pairs, Arena *arena) {
    const Material *m = &cloth->material;
    double lock = m->c11 * cloth->panel.h1 * cloth->panel.h1 / m->d11;
    char text[160];
    if (cloth->bending == BENDING_HINGE) {
        return "hinges are no plate: bending differs by direction up to three times, twist too";
    }
    if (pairs || lock < LOCKS_FROM) {
        return NULL;
    }
    snprintf(text, sizeof text,
             "Eh h^2/B is %.2g: triangles hold folds open from about %.0e on; use smaller ones",
             lock, LOCKS_FROM);
    return arena_strdup(arena, text);
}

static bool create(Cloth *cloth, Arena *arena, Error *error) {
    const Panel *p = &cloth->panel;
    MembraneKind membrane = cloth->def->membrane;
    Triangles *t = arena_push(arena, Triangles, 1);
    const int *triangles = p->vertex_triangles;
    int count = p->triangle_count;
    bool pairs = p->nu > 0 && membrane != MEMBRANE_TRIANGLES;
    cloth->data = t;
    if (membrane == MEMBRANE_PAIRS && !pairs) {
        return error_set(error, EXIT_BAD_INPUT,
                         "cloth '%s': 'membrane: pairs' needs a lattice, this cloth has scattered "
                         "nodes",
                         cloth->def->name);
    }
    if (p->nu > 0) {
        triangles = lattice_triangles(p, &count, arena);
    }
    if (pairs) {
        mlpg_lattice_membrane(cloth, &t->membrane, arena);
    } else {
        constant_strain(cloth, triangles, count, &t->membrane, arena);
    }
    if (!hinges_create(cloth, triangles, count, cloth->bending, arena, &t->hinges)) {
        return error_set(error, EXIT_BAD_INPUT,
                         "cloth '%s': some triangles are too thin for 'bending: morley'; 'tensor' "
                         "may have them",
                         cloth->def->name);
    }
    cloth->note = note(cloth, pairs, arena);
    cloth->strain_count = t->membrane.sample_count * t->membrane.kind->strain_count;
    for (int i = 0; i < cloth->node_count; i++) {
        cloth->mass[i] = cloth->material.density * p->area[i];
    }
    return true;
}

static double energy(const Cloth *cloth, const double *x) {
    const Triangles *t = cloth->data;
    return strain_energy(&t->membrane, x) + hinges_energy(&t->hinges, x);
}

static void add_damped_gradient(const Cloth *cloth, const double *stretched, const double *bent,
                                double *gradient) {
    const Triangles *t = cloth->data;
    strain_add_gradient(&t->membrane, stretched, gradient);
    hinges_add_gradient(&t->hinges, bent, gradient);
}

static void add_gradient(const Cloth *cloth, const double *x, double *gradient) {
    add_damped_gradient(cloth, x, x, gradient);
}

static Fastest fastest(const Cloth *cloth) {
    const Material *m = &cloth->material;
    return cloth->panel.nu > 0 ? fastest_of_lattice(cloth, m->d11, m->d22)
                               : fastest_by_power(cloth);
}

static void stress(const Cloth *cloth, const double *x, double *out) {
    const Triangles *t = cloth->data;
    strain_stress(&t->membrane, x, out);
}

static void predict_stress(const Cloth *cloth, const double *x_new, const double *dx, double *out) {
    const Triangles *t = cloth->data;
    strain_predict_stress(&t->membrane, x_new, dx, out);
}

static int couple(const Cloth *cloth, int *pairs) {
    const Triangles *t = cloth->data;
    int count = strain_couple(&t->membrane, pairs);
    return count + hinges_couple(&t->hinges, pairs ? pairs + 2 * count : NULL);
}

static void bind_hessian(Cloth *cloth, const BlockMatrix *matrix, int first, Arena *arena) {
    Triangles *t = cloth->data;
    strain_bind(&t->membrane, matrix, first, arena);
    hinges_bind(&t->hinges, matrix, first, arena);
}

static void add_hessian(const Cloth *cloth, const double *x, const double *sigma, bool definite,
                        double *values) {
    const Triangles *t = cloth->data;
    strain_add_hessian(&t->membrane, x, sigma, definite, values);
    hinges_add_hessian(&t->hinges, x, values);
}

const ClothModel cloth_model_triangles = {
    .name = "triangles",
    .about = "triangles with a curvature tensor, or hinges (after Baraff, Witkin 1998)",
    .lattice_bendings = 1u << BENDING_TENSOR | 1u << BENDING_HINGE,
    .scattered_bendings = 1u << BENDING_MORLEY | 1u << BENDING_TENSOR | 1u << BENDING_HINGE,
    .seams = true,
    .create = create,
    .energy = energy,
    .add_gradient = add_gradient,
    .add_damped_gradient = add_damped_gradient,
    .fastest = fastest,
    .stress = stress,
    .predict_stress = predict_stress,
    .couple = couple,
    .add_hessian = add_hessian,
    .bind_hessian = bind_hessian,
    .stable_step = stable_step_by_power,
};
