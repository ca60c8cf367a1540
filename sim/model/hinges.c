#include "sim/model/hinges.h"

#include <limits.h>
#include <math.h>
#include <string.h>

#define FLATTEST 1e-12 /* squared sine of the angle at which a triangle has no normal */

/* ---- angles ---- */

static Vec3 corner(const HingeEdge *e, int k, const double *x) {
    Vec3 p = vec3_load(x + 3 * e->node[k]);
    if (k < 3 || e->node[4] < 0) {
        return p;
    }
    return vec3_scale(0.5, vec3_add(p, vec3_load(x + 3 * e->node[4])));
}

/* a triangle without a normal neither turns nor pushes */
static HingeTurn turn_of(const HingeEdge *e, const double *x) {
    Vec3 x0 = corner(e, 0, x), along = vec3_sub(corner(e, 1, x), x0);
    Vec3 left = vec3_sub(corner(e, 2, x), x0), right = vec3_sub(corner(e, 3, x), x0);
    Vec3 n1 = vec3_cross(along, left), n2 = vec3_cross(right, along);
    double l2 = vec3_dot(along, along), s1 = vec3_dot(n1, n1), s2 = vec3_dot(n2, n2);
    HingeTurn t = {.angle = -e->rest};
    if (s1 <= FLATTEST * l2 * vec3_dot(left, left) ||
        s2 <= FLATTEST * l2 * vec3_dot(right, right)) {
        return t;
    }
    double l = sqrt(l2), sine = -vec3_dot(vec3_cross(n1, n2), along) / l;
    t.angle = atan2(sine, vec3_dot(n1, n2)) - e->rest;
    t.up[0] = vec3_scale(l / s1, n1), t.up[1] = vec3_scale(l / s2, n2);
    t.foot[0] = vec3_dot(left, along) / l2, t.foot[1] = vec3_dot(right, along) / l2;
    return t;
}

/* d angle / d corners */
static void turn_gradient(const HingeTurn *t, Vec3 g[4]) {
    g[2] = t->up[0], g[3] = t->up[1];
    g[0] = vec3_add(vec3_scale(t->foot[0] - 1.0, g[2]), vec3_scale(t->foot[1] - 1.0, g[3]));
    g[1] = vec3_add(vec3_scale(-t->foot[0], g[2]), vec3_scale(-t->foot[1], g[3]));
}

static void times_d(const double d[6], const double k[3], double m[3]) {
    m[0] = d[0] * k[0] + d[1] * k[1] + d[2] * k[2];
    m[1] = d[1] * k[0] + d[3] * k[1] + d[4] * k[2];
    m[2] = d[2] * k[0] + d[4] * k[1] + d[5] * k[2];
}

/* A D k of an element; k [1/m] */
static void element_moment(const Hinges *h, const HingeElement *el, double k[3], double m[3]) {
    k[0] = k[1] = k[2] = 0.0;
    for (int e = 0; e < el->edge_count; e++) {
        const HingeEdge *edge = &h->edges[el->edge[e]];
        double turn = h->turns[el->edge[e]].angle;
        if (edge->director >= 0) {
            turn += el->side[e] * h->director[edge->director];
        }
        for (int c = 0; c < 3; c++) {
            k[c] += el->c[e][c] * turn;
        }
    }
    times_d(el->d, k, m);
}

static double edge_moment(const HingeElement *el, int e, const double m[3]) {
    return el->c[e][0] * m[0] + el->c[e][1] * m[1] + el->c[e][2] * m[2];
}

/* minus the derivative by psi where all are zero, times the inverse of the second derivative */
void hinges_find_directors(const Hinges *h) {
    memset(h->director, 0, (size_t)h->director_count * sizeof *h->director);
    double *right = h->moment;
    memset(right, 0, (size_t)h->director_count * sizeof *right);
    for (int i = 0; i < h->element_count; i++) {
        const HingeElement *el = &h->elements[i];
        double k[3], m[3];
        element_moment(h, el, k, m);
        for (int e = 0; e < el->edge_count; e++) {
            int director = h->edges[el->edge[e]].director;
            if (director >= 0) {
                right[director] -= el->side[e] * edge_moment(el, e, m);
            }
        }
    }
    triangular_solve(&h->elimination, right);
    memcpy(h->director, right, (size_t)h->director_count * sizeof *right);
}

static void find_angles(const Hinges *h, const double *x) {
    for (int e = 0; e < h->edge_count; e++) {
        h->turns[e] = turn_of(&h->edges[e], x);
    }
}

static void find_turns(const Hinges *h, const double *x) {
    find_angles(h, x);
    if (h->director_count > 0) {
        hinges_find_directors(h);
    }
}

double hinges_energy(const Hinges *h, const double *x) {
    double energy = 0.0;
    find_turns(h, x);
    for (int i = 0; i < h->element_count; i++) {
        double k[3], m[3];
        element_moment(h, &h->elements[i], k, m);
        energy += 0.5 * (k[0] * m[0] + k[1] * m[1] + k[2] * m[2]);
    }
    return energy;
}

static void add_corner(const HingeEdge *e, int k, double share, Vec3 g, double *gradient) {
    if (k == 3 && e->node[4] >= 0) {
        share *= 0.5;
        double *second = gradient + 3 * (size_t)e->node[4];
        vec3_store(second, vec3_axpy(vec3_load(second), share, g));
    }
    double *first = gradient + 3 * (size_t)e->node[k];
    vec3_store(first, vec3_axpy(vec3_load(first), share, g));
}

void hinges_add_gradient(const Hinges *h, const double *x, double *gradient) {
    find_turns(h, x);
    memset(h->moment, 0, (size_t)h->edge_count * sizeof *h->moment);
    for (int i = 0; i < h->element_count; i++) {
        const HingeElement *el = &h->elements[i];
        double k[3], m[3];
        element_moment(h, el, k, m);
        for (int e = 0; e < el->edge_count; e++) {
            h->moment[el->edge[e]] += edge_moment(el, e, m);
        }
    }
    for (int e = 0; e < h->edge_count; e++) {
        Vec3 g[4];
        turn_gradient(&h->turns[e], g);
        for (int k = 0; k < 4; k++) {
            add_corner(&h->edges[e], k, h->moment[e], g[k], gradient);
        }
    }
}

int hinges_couple(const Hinges *h, int *pairs) {
    int count = 0;
    for (int i = 0; i < h->element_count; i++) {
        const HingeElement *el = &h->elements[i];
        count += block_pairs(el->node, el->node_count, INT_MAX, pairs ? pairs + 2 * count : NULL);
    }
    return count;
}

void hinges_bind(Hinges *h, const BlockMatrix *matrix, int first, Arena *arena) {
    h->places =
        arena_push(arena, BlockPlace, HINGE_NODES * (HINGE_NODES + 1) / 2 * h->element_count);
    int at = 0;
    for (int i = 0; i < h->element_count; i++) {
        HingeElement *el = &h->elements[i];
        el->place = at;
        at += block_places(matrix, el->node, el->node_count, INT_MAX, first, h->places + at);
    }
}

/* rows of J: d curvature / d nodes */
static void element_rows(const Hinges *h, const HingeElement *el, double j[3][3 * HINGE_NODES]) {
    memset(j, 0, 9 * HINGE_NODES * sizeof(double));
    for (int e = 0; e < el->edge_count; e++) {
        Vec3 g[4];
        turn_gradient(&h->turns[el->edge[e]], g);
        for (int k = 0; k < 4; k++) {
            int at = el->local[e][k];
            for (int c = 0; c < 3 && at >= 0; c++) {
                double share = el->tangent[e] * el->c[e][c];
                j[c][3 * at] += share * g[k].x;
                j[c][3 * at + 1] += share * g[k].y;
                j[c][3 * at + 2] += share * g[k].z;
            }
        }
    }
}

void hinges_add_hessian(const Hinges *h, const double *x, double *values) {
    find_angles(h, x);
    for (int i = 0; i < h->element_count; i++) {
        const HingeElement *el = &h->elements[i];
        double j[3][3 * HINGE_NODES], dj[3 * HINGE_NODES][3] = {{0}};
        element_rows(h, el, j);
        for (int k = 0; k < 3 * el->node_count; k++) {
            double column[3] = {j[0][k], j[1][k], j[2][k]};
            times_d(el->d, column, dj[k]);
        }
        int place = el->place;
        for (int a = 0; a < el->node_count; a++) {
            for (int b = 0; b <= a; b++, place++) {
                double block[9];
                for (int r = 0; r < 3; r++) {
                    for (int c = 0; c < 3; c++) {
                        const double *d = dj[3 * b + c];
                        int row = 3 * a + r;
                        block[3 * r + c] = j[0][row] * d[0] + j[1][row] * d[1] + j[2][row] * d[2];
                    }
                }
                block_add(values, h->places[place], block);
            }
        }
    }
}
