#include "sim/model/spring_net.h"

#include <math.h>

int spring_net_on_border(const Panel *panel, int i, int j, int axis) {
    return axis == 0 ? j == 0 || j == panel->nv - 1
                     : !panel->wrap && (i == 0 || i == panel->nu - 1);
}

void spring_net_add_threads(SpringNet *net, const Panel *panel, int axis, int reach, int kind) {
    bool wraps = axis == 0 && panel->wrap;
    int end_i = axis == 0 && !wraps ? panel->nu - reach : panel->nu;
    int end_j = axis == 1 ? panel->nv - reach : panel->nv;
    for (int j = 0; j < end_j; j++) {
        for (int i = 0; i < end_i; i++) {
            int to =
                axis == 0 ? j * panel->nu + (i + reach) % panel->nu : (j + reach) * panel->nu + i;
            net->springs[net->spring_count++] =
                (Spring){j * panel->nu + i, to, kind + spring_net_on_border(panel, i, j, axis)};
        }
    }
}

static Vec3 along(const Spring *spring, const double *x) {
    return vec3_sub(vec3_load(x + 3 * spring->b), vec3_load(x + 3 * spring->a));
}

double spring_net_energy(const SpringNet *net, const double *x) {
    double sum = 0.0;
    for (int k = 0; k < net->spring_count; k++) {
        const Spring *spring = &net->springs[k];
        sum += spring_energy(&net->kinds[spring->kind], vec3_length(along(spring, x)));
    }
    return sum;
}

void spring_net_add_gradient(const SpringNet *net, const double *x, double *gradient) {
    for (int k = 0; k < net->spring_count; k++) {
        const Spring *spring = &net->springs[k];
        Vec3 d = along(spring, x);
        double length = vec3_length(d);
        double pull = spring_tension(&net->kinds[spring->kind], length, NULL);
        /* two nodes in one place: no direction, no force */
        double share = length > 0.0 ? pull / length : 0.0;
        double *a = gradient + 3 * spring->a, *b = gradient + 3 * spring->b;
        a[0] -= share * d.x, a[1] -= share * d.y, a[2] -= share * d.z;
        b[0] += share * d.x, b[1] += share * d.y, b[2] += share * d.z;
    }
}

void spring_net_tension(const SpringNet *net, const double *x, double *tension) {
    for (int k = 0; k < net->spring_count; k++) {
        const Spring *spring = &net->springs[k];
        tension[k] = spring_tension(&net->kinds[spring->kind], vec3_length(along(spring, x)), NULL);
    }
}

void spring_net_predict(const SpringNet *net, const double *x_new, const double *dx,
                        double *tension) {
    for (int k = 0; k < net->spring_count; k++) {
        const Spring *spring = &net->springs[k];
        Vec3 moved = along(spring, dx), old = vec3_sub(along(spring, x_new), moved);
        double length = vec3_length(old), slope;
        tension[k] = spring_tension(&net->kinds[spring->kind], length, &slope);
        tension[k] += length > 0.0 ? slope * vec3_dot(old, moved) / length : 0.0;
    }
}

int spring_net_couple(const SpringNet *net, int *pairs) {
    int count = 0;
    for (int k = 0; k < net->spring_count; k++) {
        const Spring *spring = &net->springs[k];
        if (spring->a >= net->node_limit) {
            continue;
        }
        if (pairs) {
            pairs[2 * count] = spring->a, pairs[2 * count + 1] = spring->b;
        }
        count++;
    }
    return count;
}

void spring_net_bind(SpringNet *net, const BlockMatrix *matrix, int first, Arena *arena) {
    net->places = arena_push(arena, BlockPlace, 3 * net->spring_count);
    for (int k = 0; k < net->spring_count; k++) {
        int a = net->springs[k].a, b = net->springs[k].b;
        bool ghost = a >= net->node_limit;
        BlockPlace none = {-1, 0}, *places = net->places + 3 * k;
        places[0] = ghost ? none : block_matrix_place(matrix, first + a, first + a);
        places[1] = block_matrix_place(matrix, first + b, first + b);
        places[2] = ghost ? none : block_matrix_place(matrix, first + a, first + b);
    }
}

/* slope u u' + tension / length (I - u u'). What only pushes stands for bending, whose stiffness
 * across must not be negative. */
static void spring_block(const SpringKind *kind, Vec3 d, double tension, bool definite,
                         double block[9]) {
    double length = vec3_length(d), slope, across = tension / length;
    spring_tension(kind, length, &slope);
    across = definite || kind->pushes ? fmax(across, 0.0) : across;
    double u[3] = {d.x / length, d.y / length, d.z / length};
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) {
            block[3 * r + c] = (slope - across) * u[r] * u[c] + (r == c ? across : 0.0);
        }
    }
}

void spring_net_add_hessian(const SpringNet *net, const double *x, const double *tension,
                            bool definite, double *values) {
    for (int k = 0; k < net->spring_count; k++) {
        const Spring *spring = &net->springs[k];
        const BlockPlace *places = net->places + 3 * k;
        Vec3 d = along(spring, x);
        double block[9];
        if (vec3_dot(d, d) == 0.0) {
            continue;
        }
        spring_block(&net->kinds[spring->kind], d, tension[k], definite, block);
        block_add(values, places[1], block);
        if (places[0].base < 0) {
            continue;
        }
        block_add(values, places[0], block);
        for (int e = 0; e < 9; e++) {
            block[e] = -block[e];
        }
        block_add(values, places[2], block);
    }
}
