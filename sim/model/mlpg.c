#include "sim/model/mlpg.h"

#include <math.h>
#include <string.h>

#include "sim/model/side_bound.h"
#include "sim/model/stable.h"

double mlpg_hourglass(const Material *m, double h1, double h2, double factor) {
    double stretch = 0.5 * (m->c11 + m->c22), bend = 0.5 * (m->d11 + m->d22);
    return fmin(MLPG_HOURGLASS_SHARE * stretch, factor * bend / (h1 * h2));
}

static void create_sweep(const Cloth *cloth, SweepLattice *sweep) {
    const Panel *p = &cloth->panel;
    const Material *m = &cloth->material;
    *sweep = (SweepLattice){.nu = p->nu,
                            .nv = p->nv,
                            .stride = lanes_row_stride(p->nu),
                            .wrap = p->wrap,
                            .h1 = p->h1,
                            .h2 = p->h2,
                            .c11 = m->c11,
                            .c12 = m->c12,
                            .c22 = m->c22,
                            .c66 = m->c66,
                            .d11 = m->d11,
                            .d12 = m->d12,
                            .d22 = m->d22,
                            .d66 = m->d66};
    sweep->hourglass = mlpg_hourglass(m, p->h1, p->h2, MLPG_HOURGLASS_LATTICE);
    sweep->bounded = cloth->def->sides == SIDES_BOUNDED;
    sweep->rest1 = p->rest_curvature[0];
    sweep->rest2 = p->rest_curvature[1];
    sweep->rest = p->wrap && (sweep->rest1 != 0.0 || sweep->rest2 != 0.0);
    memcpy(sweep->clamp, cloth->clamp, sizeof sweep->clamp);
}

static bool create(Cloth *cloth, Arena *arena, Error *error) {
    const Panel *p = &cloth->panel;
    Mlpg *mlpg = arena_push(arena, Mlpg, 1);
    cloth->data = mlpg;
    bool lattice = p->nu > 0, rbf = cloth->bending == BENDING_RBF;
    int total = cloth->node_count + cloth->ghost_count;
    if (cloth->ghost_count > 0 && rbf && lattice) {
        return error_set(error, EXIT_BAD_INPUT,
                         "cloth '%s': a clamp needs 'bending: stencil' (or a hold)",
                         cloth->def->name);
    }
    if (lattice) {
        mlpg_lattice_membrane(cloth, &mlpg->membrane, arena);
        create_sweep(cloth, &mlpg->sweep);
    } else {
        mlpg_scattered_membrane(cloth, &mlpg->membrane, arena);
    }
    if (rbf) {
        mlpg_rbf_bending(cloth, &mlpg->samples, arena);
    } else {
        mlpg_lattice_bending(cloth, &mlpg->samples, arena);
    }
    mlpg->bending =
        bending_create(&mlpg->samples, total, cloth->node_count, p->rest_curvature, arena);
    mlpg->tangent = &mlpg->bending;
    if (rbf && lattice) {
        BendingSamples stencil;
        mlpg_lattice_bending(cloth, &stencil, arena);
        mlpg->tangent = arena_push(arena, Bending, 1);
        *mlpg->tangent = bending_create(&stencil, total, cloth->node_count, NULL, arena);
    }
    bool sweeps = lattice && !rbf && cloth->def->kinematics == KINEMATICS_GREEN;
    cloth->lattice = sweeps ? &mlpg->sweep : NULL;
    cloth->strain_count = mlpg->membrane.sample_count * mlpg->membrane.kind->strain_count;
    for (int i = 0; i < cloth->node_count; i++) {
        cloth->mass[i] = cloth->material.density * p->area[i];
    }
    return true;
}

static double energy(const Cloth *cloth, const double *x) {
    const Mlpg *mlpg = cloth->data;
    double sides = mlpg->sweep.bounded ? side_bound_energy(&mlpg->sweep, &mlpg->membrane, x) : 0.0;
    return strain_energy(&mlpg->membrane, x) + bending_energy(&mlpg->bending, x) + sides;
}

static void add_damped_gradient(const Cloth *cloth, const double *stretched, const double *bent,
                                double *gradient) {
    const Mlpg *mlpg = cloth->data;
    strain_add_gradient(&mlpg->membrane, stretched, gradient);
    bending_add_gradient(&mlpg->bending, bent, gradient);
    if (mlpg->sweep.bounded) {
        side_bound_add_gradient(&mlpg->sweep, &mlpg->membrane, stretched, gradient);
    }
}

static void add_gradient(const Cloth *cloth, const double *x, double *gradient) {
    add_damped_gradient(cloth, x, x, gradient);
}

static void add_rest_gradient(const Cloth *cloth, const double *x, double *gradient) {
    const Mlpg *mlpg = cloth->data;
    bending_add_rest_gradient(&mlpg->bending, x, gradient);
}

static void add_ghost_gradient(const Cloth *cloth, const double *x, double *gradient) {
    const Mlpg *mlpg = cloth->data;
    bending_add_border_gradient(&mlpg->bending, x, gradient);
}

static void stress(const Cloth *cloth, const double *x, double *out) {
    const Mlpg *mlpg = cloth->data;
    strain_stress(&mlpg->membrane, x, out);
}

static void predict_stress(const Cloth *cloth, const double *x_new, const double *dx, double *out) {
    const Mlpg *mlpg = cloth->data;
    strain_predict_stress(&mlpg->membrane, x_new, dx, out);
}

static int couple(const Cloth *cloth, int *pairs) {
    const Mlpg *mlpg = cloth->data;
    int count = strain_couple(&mlpg->membrane, pairs);
    return count + bending_couple(mlpg->tangent, pairs ? pairs + 2 * count : NULL);
}

static void bind_hessian(Cloth *cloth, const BlockMatrix *matrix, int first, Arena *arena) {
    Mlpg *mlpg = cloth->data;
    strain_bind(&mlpg->membrane, matrix, first, arena);
    bending_bind(mlpg->tangent, matrix, first, arena);
}

static void add_hessian(const Cloth *cloth, const double *x, const double *sigma, bool definite,
                        double *values) {
    const Mlpg *mlpg = cloth->data;
    strain_add_hessian(&mlpg->membrane, x, sigma, definite, values);
    bending_add_hessian(mlpg->tangent, x, values);
    if (mlpg->sweep.bounded) {
        side_bound_add_hessian(&mlpg->sweep, &mlpg->membrane, x, definite, values);
    }
}

static double stable_step(const Cloth *cloth) {
    const Mlpg *mlpg = cloth->data;
    return cloth->lattice ? sweep_stable_step(&mlpg->sweep, cloth->material.density)
                          : stable_step_by_power(cloth);
}

const ClothModel cloth_model_mlpg = {
    .name = "mlpg",
    .about = "meshless Kirchhoff-Love shell (Yuan, Chen, Gagalowicz, Liu 2008)",
    .lattice_bendings = 1u << BENDING_STENCIL | 1u << BENDING_RBF,
    .scattered_bendings = 1u << BENDING_RBF,
    .create = create,
    .energy = energy,
    .add_gradient = add_gradient,
    .add_damped_gradient = add_damped_gradient,
    .fastest = fastest_by_power,
    .add_rest_gradient = add_rest_gradient,
    .add_ghost_gradient = add_ghost_gradient,
    .stress = stress,
    .predict_stress = predict_stress,
    .couple = couple,
    .add_hessian = add_hessian,
    .bind_hessian = bind_hessian,
    .stable_step = stable_step,
};
