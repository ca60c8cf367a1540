/* springs.c: springs between lattice nodes (Provot 1995; Choi, Ko 2002), with constants from the
 * measured fabric.
 *
 * Membrane: structural springs along the threads, two diagonals in every cell. Homogenised,
 *     C11 = ks1 + kd a,  C22 = ks2 + kd / a,  C12 = C66 = kd,   a = (h1/h2)^2,
 * so the moduli E1, E2, G of the fabric are met and its Poisson ratio is not. A compressed
 * structural spring gives way like a buckled strip; one that is stretched beyond the limit of the
 * fabric stiffens, if wished (spring_law.h).
 * Bending: "stencil" takes the curvature at three nodes and the twist of a cell (bending.h);
 * "choi_ko", "chord" and "provot" are springs between second neighbours.
 */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "sim/model/mlpg.h"
#include "sim/model/model.h"
#include "sim/model/spring_net.h"
#include "sim/model/stable.h"

#define PROVOT_ANGLE 0.2 /* [rad] at which a linear bend spring has the moment of the fabric */
/* line of a pushing spring / line of the threads between the same nodes: the larger, the smaller
 * the turn from which it pushes with full force, and the shorter the explicit step */
#define PUSH_SHARE 1.0
#define PROVOT_LIMIT 0.1 /* strain, where the fabric states none */

/* structural: 2 axis + border; then the diagonals; bend: BEND + 4 axis + 2 wall + border */
enum { DIAGONAL = 4, BEND = 5, KINDS = 13 };

typedef struct Springs {
    SpringKind kinds[KINDS];
    SpringNet net;
    bool second;     /* second neighbours bend */
    bool curvature;  /* the tangent has that of `bending` */
    Bending bending; /* the residual, unless second neighbours bend */
    double push;     /* [1/s2] largest stiffness / mass that springs at rest do not show: of
                        pushing ones, and of those stretched beyond the limit */
} Springs;

/* ---- constants from the fabric ---- */

typedef struct Constants {
    double structural[2], diagonal; /* [N/m] per width */
    double c11, c12, c22;           /* [N/m] of the lattice */
} Constants;

static Constants homogenise(const Material *m, double h1, double h2) {
    double g = m->c66, a = h1 * h1 / (h2 * h2);
    double e1 = m->c11 - m->c12 * m->c12 / m->c22, e2 = m->c22 - m->c12 * m->c12 / m->c11;
    double q = e1 * e2, p = 0.5 * (2.0 * g * g + q + sqrt(q * (q + 4.0 * g * g)));
    double f = 1.0 - g * g / p; /* 1 - nu12 nu21 of the lattice */
    Constants c = {.c11 = e1 / f, .c12 = g, .c22 = e2 / f, .diagonal = g};
    c.structural[0] = c.c11 - g * a;
    c.structural[1] = c.c22 - g / a;
    return c;
}

static const BuckleLaw *law_of(BuckleKind kind) {
    switch (kind) {
    case BUCKLE_ARC:
        return &buckle_arc;
    case BUCKLE_QUARTIC:
        return &buckle_quartic;
    case BUCKLE_ELASTICA:
        return &buckle_elastica;
    default:
        return NULL;
    }
}

/* spring between second neighbours on a strip of the given width */
static SpringKind bend_kind(const Cloth *cloth, double h, double width, double rigidity,
                            double line) {
    double bw = rigidity * width;
    if (cloth->bending == BENDING_PROVOT) {
        double half = 0.5 * PROVOT_ANGLE;
        double k = bw * PROVOT_ANGLE / (2.0 * h * h * h * (1.0 - cos(half)) * sin(half));
        return spring_kind(2.0 * h, k, NULL, 0.0);
    }
    const BuckleLaw *law = law_of(cloth->def->buckling);
    law = cloth->bending == BENDING_CHORD ? &buckle_chord : law ? law : &buckle_arc;
    /* a small turn psi has the moment bw psi/h: (k/2h) f(0) psi^2/8 = bw psi^2/(2h) */
    double k = 8.0 * bw / law->force(0.0);
    SpringKind kind = spring_kind(2.0 * h, PUSH_SHARE * line, law, k);
    kind.pushes = true;
    return kind;
}

static void create_kinds(Cloth *cloth, const Constants *c, Springs *s) {
    const Panel *p = &cloth->panel;
    const Material *m = &cloth->material;
    const ClothDef *def = cloth->def;
    double h[2] = {p->h1, p->h2}, rigidity[2] = {m->d11, m->d22};
    for (int k = 0; k < 4; k++) {
        int axis = k / 2;
        double width = h[1 - axis] * (k % 2 ? 0.5 : 1.0);
        s->kinds[k] = spring_kind(h[axis], c->structural[axis] * width / h[axis],
                                  law_of(def->buckling), rigidity[axis] * width);
        if (def->stiffening > 0.0 && isfinite(def->fabric.stretch_limit.value)) {
            s->kinds[k].limit = sqrt(1.0 + 2.0 * def->fabric.stretch_limit.value) - 1.0;
            s->kinds[k].stiffen = def->stiffening * c->structural[axis] * width / h[axis];
            double mass = m->density * h[axis] * width;
            s->push = fmax(s->push, s->kinds[k].stiffen / mass);
        }
    }
    double diagonal = hypot(p->h1, p->h2);
    s->kinds[DIAGONAL] =
        spring_kind(diagonal, c->diagonal * diagonal * diagonal / (2.0 * p->h1 * p->h2), NULL, 0.0);
    for (int k = 0; k < 8 && s->second; k++) {
        int axis = k / 4;
        double width = h[1 - axis] * (k % 2 ? 0.5 : 1.0);
        /* a wall turns the first segment over half a length */
        double wall = k / 2 % 2 ? 2.0 : 1.0;
        double line = c->structural[axis] * width / (2.0 * h[axis]);
        SpringKind kind = bend_kind(cloth, h[axis], width, wall * rigidity[axis], line);
        s->kinds[BEND + k] = kind;
        double mass = m->density * h[axis] * width;
        s->push = fmax(s->push, kind.stiffness / mass);
    }
}

/* ---- the springs of a lattice ---- */

static void add_diagonals(const Panel *p, SpringNet *net) {
    int cells = p->wrap ? p->nu : p->nu - 1;
    for (int j = 0; j + 1 < p->nv; j++) {
        for (int i = 0; i < cells; i++) {
            int a = j * p->nu + i, b = j * p->nu + (i + 1) % p->nu;
            net->springs[net->spring_count++] = (Spring){a, b + p->nu, DIAGONAL};
            net->springs[net->spring_count++] = (Spring){b, a + p->nu, DIAGONAL};
        }
    }
}

/* from each ghost to the node beyond its border node */
static void add_walls(const Cloth *cloth, SpringNet *net) {
    const Panel *p = &cloth->panel;
    static const int inward[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
    for (int g = 0; g < cloth->ghost_count; g++) {
        const Ghost *ghost = &cloth->ghosts[g];
        int i = ghost->border % p->nu, j = ghost->border / p->nu, axis = ghost->side / 2;
        int node = (j + inward[ghost->side][1]) * p->nu + i + inward[ghost->side][0];
        int kind = BEND + 4 * axis + 2 + spring_net_on_border(p, i, j, axis);
        net->springs[net->spring_count++] = (Spring){cloth->node_count + g, node, kind};
    }
}

static void create_springs(const Cloth *cloth, Springs *s, Arena *arena) {
    const Panel *p = &cloth->panel;
    SpringNet *net = &s->net;
    *net = (SpringNet){.kinds = s->kinds,
                       .springs = arena_push(arena, Spring, 6 * p->node_count + cloth->ghost_count),
                       .node_limit = cloth->node_count};
    for (int axis = 0; axis < 2; axis++) {
        spring_net_add_threads(net, p, axis, 1, 2 * axis);
    }
    add_diagonals(p, net);
    for (int axis = 0; axis < 2 && s->second; axis++) {
        spring_net_add_threads(net, p, axis, 2, BEND + 4 * axis);
    }
    if (s->second) {
        add_walls(cloth, net);
    }
}

/* lengths that no step may leave behind: of threads and diagonals */
static void create_limits(Cloth *cloth, const Springs *s, Arena *arena) {
    double green = cloth->def->fabric.stretch_limit.value;
    double strain = isfinite(green) ? sqrt(1.0 + 2.0 * green) - 1.0 : PROVOT_LIMIT;
    SpringLimit *limits = arena_push(arena, SpringLimit, s->net.spring_count);
    for (int k = 0; k < s->net.spring_count && cloth->def->limit_rounds >= 1.0; k++) {
        const Spring *spring = &s->net.springs[k];
        if (spring->kind <= DIAGONAL) {
            limits[cloth->spring_limit_count++] =
                (SpringLimit){spring->a, spring->b, (1.0 + strain) * s->kinds[spring->kind].rest};
        }
    }
    cloth->spring_limits = limits;
}

/* what the lattice cannot have of this fabric */
static const char *note(const Cloth *cloth, const Constants *c, const Springs *s, Arena *arena) {
    const Material *m = &cloth->material;
    char text[320];
    int at =
        snprintf(text, sizeof text, "springs fix the Poisson ratio: nu12 %.2g, the fabric %.2g",
                 c->c12 / c->c22, m->c12 / m->c22);
    if (m->d12 != 0.0) {
        at += snprintf(text + at, sizeof text - (size_t)at, "; bending D12 %.2g N m is left out",
                       m->d12);
    }
    if (s->second) {
        /* a turn psi shortens the chord by psi^2/8; the share where the strip takes over */
        double d = fmax(s->kinds[BEND].onset, s->kinds[BEND + 4].onset);
        at += snprintf(text + at, sizeof text - (size_t)at, "; twist D66 %.2g N m is left out",
                       m->d66);
        if (isfinite(d)) {
            snprintf(text + at, sizeof text - (size_t)at,
                     "; turns of threads below %.2g rad a node meet less than their bending",
                     sqrt(8.0 * d));
        }
    }
    return arena_strdup(arena, text);
}

static bool create(Cloth *cloth, Arena *arena, Error *error) {
    const Panel *p = &cloth->panel;
    Constants c = homogenise(&cloth->material, p->h1, p->h2);
    if (c.structural[0] <= 0.0 || c.structural[1] <= 0.0) {
        return error_set(error, EXIT_BAD_INPUT,
                         "cloth '%s': springs cannot have a shear stiffness of %.3g N/m beside "
                         "moduli of %.3g and %.3g N/m on cells of %.3g x %.3g mm",
                         cloth->def->name, cloth->material.c66, cloth->material.c11,
                         cloth->material.c22, 1e3 * p->h1, 1e3 * p->h2);
    }
    Springs *s = arena_push(arena, Springs, 1);
    cloth->data = s;
    s->second = cloth->bending != BENDING_STENCIL;
    s->curvature = cloth->bending != BENDING_PROVOT; /* whose flat cloth has no stiffness */
    bool curved = p->rest_curvature[0] != 0.0 || p->rest_curvature[1] != 0.0;
    if (s->second && curved) {
        return error_set(error, EXIT_BAD_INPUT,
                         "cloth '%s': springs between second neighbours know flat cloth only; "
                         "rest curvature needs 'bending: stencil'",
                         cloth->def->name);
    }
    create_kinds(cloth, &c, s);
    cloth->note = note(cloth, &c, s, arena);
    cloth->material.c11 = c.c11, cloth->material.c12 = c.c12, cloth->material.c22 = c.c22;
    cloth->material.d12 = 0.0;
    cloth->material.d66 = s->second ? 0.0 : cloth->material.d66;
    create_springs(cloth, s, arena);
    create_limits(cloth, s, arena);
    BendingSamples samples;
    mlpg_lattice_bending(cloth, &samples, arena);
    s->bending = bending_create(&samples, cloth->node_count + cloth->ghost_count, cloth->node_count,
                                p->rest_curvature, arena);
    cloth->strain_count = s->net.spring_count;
    for (int i = 0; i < cloth->node_count; i++) {
        cloth->mass[i] = cloth->material.density * p->area[i];
    }
    return true;
}

/* ---- energy and its derivatives ---- */

static double energy(const Cloth *cloth, const double *x) {
    const Springs *s = cloth->data;
    return spring_net_energy(&s->net, x) + (s->second ? 0.0 : bending_energy(&s->bending, x));
}

static void add_damped_gradient(const Cloth *cloth, const double *stretched, const double *bent,
                                double *gradient) {
    const Springs *s = cloth->data;
    spring_net_add_gradient(&s->net, stretched, gradient);
    if (!s->second) {
        bending_add_gradient(&s->bending, bent, gradient);
    }
}

static Fastest fastest(const Cloth *cloth) {
    return fastest_of_lattice(cloth, cloth->material.d11, cloth->material.d22);
}

static void add_gradient(const Cloth *cloth, const double *x, double *gradient) {
    add_damped_gradient(cloth, x, x, gradient);
}

static void stress(const Cloth *cloth, const double *x, double *out) {
    const Springs *s = cloth->data;
    spring_net_tension(&s->net, x, out);
}

static void predict_stress(const Cloth *cloth, const double *x_new, const double *dx, double *out) {
    const Springs *s = cloth->data;
    spring_net_predict(&s->net, x_new, dx, out);
}

static int couple(const Cloth *cloth, int *pairs) {
    const Springs *s = cloth->data;
    int count = spring_net_couple(&s->net, pairs);
    return count +
           (s->curvature ? bending_couple(&s->bending, pairs ? pairs + 2 * count : NULL) : 0);
}

static void bind_hessian(Cloth *cloth, const BlockMatrix *matrix, int first, Arena *arena) {
    Springs *s = cloth->data;
    spring_net_bind(&s->net, matrix, first, arena);
    if (s->curvature) {
        bending_bind(&s->bending, matrix, first, arena);
    }
}

/* the push of second neighbours is bending: the curvature has its stiffness across */
static void add_hessian(const Cloth *cloth, const double *x, const double *sigma, bool definite,
                        double *values) {
    const Springs *s = cloth->data;
    spring_net_add_hessian(&s->net, x, sigma, definite, values);
    if (s->curvature) {
        bending_add_hessian(&s->bending, x, values);
    }
}

/* where springs give way their force has a kink, and explicit steps near the limit gain energy on it;
 * at half the limit they keep it */
#define KINK_SHARE 0.5

/* a pushing spring works on one side only, which the power method at the start may not see: its
 * fastest wave, two nodes up and two down, is added */
static double stable_step(const Cloth *cloth) {
    const Springs *s = cloth->data;
    double power = stable_step_by_power(cloth);
    bool kinks =
        isfinite(s->kinds[0].onset) || isfinite(s->kinds[2].onset) || s->kinds[0].stiffen > 0.0;
    return (kinks ? KINK_SHARE : 1.0) * 2.0 / sqrt(4.0 / (power * power) + 4.0 * s->push);
}

const ClothModel cloth_model_springs = {
    .name = "springs",
    .about = "springs along threads and diagonals, buckling ones (Provot 1995; Choi, Ko 2002)",
    .lattice_bendings =
        1u << BENDING_STENCIL | 1u << BENDING_CHOI_KO | 1u << BENDING_CHORD | 1u << BENDING_PROVOT,
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
    .stable_step = stable_step,
};
