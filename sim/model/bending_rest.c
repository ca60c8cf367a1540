#include "sim/model/bending_rest.h"

#include <string.h>

#include "sim/base/vec.h"

/* copies a sample with the entries of equal nodes added up */
static void merge_sample(const BendingSamples *from, int sample, BendingSamples *to) {
    int begin = to->entry_count;
    for (int e = from->start[sample]; e < from->start[sample + 1]; e++) {
        const BendingEntry *add = &from->entries[e];
        int k = begin;
        while (k < to->entry_count && to->entries[k].node != add->node) {
            k++;
        }
        BendingEntry *sum = &to->entries[k];
        if (k == to->entry_count) {
            *sum = (BendingEntry){.node = add->node};
            to->entry_count++;
        }
        sum->g11 += add->g11, sum->g22 += add->g22, sum->g12 += add->g12;
        sum->f1 += add->f1, sum->f2 += add->f2;
    }
    to->start[sample + 1] = to->entry_count;
}

void bending_rest_set(BendingRest *r, int sample, const double w[4], const double k0[3]) {
    double *m = r->moment[sample];
    r->energy -= 0.5 * r->turning[sample];
    m[0] = w[0] * k0[0] + w[1] * k0[1];
    m[1] = w[1] * k0[0] + w[2] * k0[1];
    m[2] = w[3] * k0[2];
    r->turning[sample] = m[0] * k0[0] + m[1] * k0[1] + m[2] * k0[2];
    r->energy += 0.5 * r->turning[sample];
}

BendingRest *bending_rest_create(const BendingSamples *samples, int solved_count,
                                 const double rest_curvature[3], Arena *arena) {
    BendingRest *r = arena_push(arena, BendingRest, 1);
    int count = samples->sample_count;
    r->solved_count = solved_count;
    r->samples.sample_count = count;
    r->samples.start = arena_push(arena, int, count + 1);
    r->samples.entries = arena_push(arena, BendingEntry, samples->start[count]);
    r->moment = (double(*)[3])arena_alloc(arena, sizeof(double[3]) * (size_t)count);
    r->turning = arena_push(arena, double, count);
    r->border = arena_push(arena, int, count);
    for (int i = 0; i < count; i++) {
        merge_sample(samples, i, &r->samples);
        bending_rest_set(r, i, samples->weight[i], rest_curvature);
        bool inside = true;
        for (int e = r->samples.start[i]; e < r->samples.start[i + 1]; e++) {
            inside = inside && r->samples.entries[e].node < solved_count;
        }
        r->border[r->border_count] = i;
        r->border_count += !inside;
    }
    return r;
}

/* normal and bent direction of one sample */
typedef struct RestState {
    Vec3 f1, f2, normal, q; /* q = M1 k11 + M2 k22 */
    double size;            /* |F1 x F2| */
} RestState;

static double moment_row(const BendingRest *r, int sample, const BendingEntry *entry) {
    const double *m = r->moment[sample];
    return m[0] * entry->g11 + m[1] * entry->g22 + m[2] * entry->g12;
}

static RestState rest_state(const BendingRest *r, int sample, const double *x) {
    RestState state = {0};
    for (int e = r->samples.start[sample]; e < r->samples.start[sample + 1]; e++) {
        const BendingEntry *entry = &r->samples.entries[e];
        Vec3 p = vec3_load(x + 3 * (size_t)entry->node);
        state.f1 = vec3_axpy(state.f1, entry->f1, p);
        state.f2 = vec3_axpy(state.f2, entry->f2, p);
        state.q = vec3_axpy(state.q, moment_row(r, sample, entry), p);
    }
    Vec3 cross = vec3_cross(state.f1, state.f2);
    state.size = vec3_length(cross);
    state.normal = vec3_unit(cross, vec3(0, 0, 0));
    return state;
}

/* does the sample act at all? twist samples have no rest moment, collapsed ones no normal */
static bool acts(const BendingRest *r, int sample, const RestState *state) {
    return r->turning[sample] != 0.0 && state->size > 0.0;
}

double bending_rest_energy(const BendingRest *r, const double *x) {
    double energy = r->energy;
    for (int i = 0; i < r->samples.sample_count; i++) {
        RestState state = rest_state(r, i, x);
        energy -= vec3_dot(state.normal, state.q);
    }
    return energy;
}

/* of the nodes from `first` on */
static void add_sample_gradient(const BendingRest *r, int sample, const double *x, int first,
                                double *gradient) {
    RestState s = rest_state(r, sample, x);
    if (!acts(r, sample, &s)) {
        return;
    }
    /* d(n . q) = n . dq + y . (dF1 x F2 + F1 x dF2),  y = (I - n n') q / |F1 x F2| */
    Vec3 y = vec3_scale(1.0 / s.size, vec3_axpy(s.q, -vec3_dot(s.normal, s.q), s.normal));
    Vec3 by_f1 = vec3_cross(s.f2, y), by_f2 = vec3_cross(y, s.f1);
    for (int e = r->samples.start[sample]; e < r->samples.start[sample + 1]; e++) {
        const BendingEntry *entry = &r->samples.entries[e];
        if (entry->node < first) {
            continue;
        }
        Vec3 d = vec3_scale(moment_row(r, sample, entry), s.normal);
        d = vec3_axpy(vec3_axpy(d, entry->f1, by_f1), entry->f2, by_f2);
        double *out = gradient + 3 * (size_t)entry->node;
        out[0] -= d.x, out[1] -= d.y, out[2] -= d.z;
    }
}

void bending_rest_add_gradient(const BendingRest *r, const double *x, double *gradient) {
    for (int i = 0; i < r->samples.sample_count; i++) {
        add_sample_gradient(r, i, x, 0, gradient);
    }
}

void bending_rest_add_border_gradient(const BendingRest *r, const double *x, double *gradient) {
    for (int k = 0; k < r->border_count; k++) {
        add_sample_gradient(r, r->border[k], x, r->solved_count, gradient);
    }
}

int bending_rest_couple(const BendingRest *r, int *pairs) {
    int count = 0;
    for (int i = 0; i < r->samples.sample_count; i++) {
        for (int a = r->samples.start[i]; a < r->samples.start[i + 1]; a++) {
            for (int b = r->samples.start[i]; b < a && r->turning[i] != 0.0; b++) {
                int row = r->samples.entries[a].node, column = r->samples.entries[b].node;
                if (row >= r->solved_count || column >= r->solved_count) {
                    continue;
                }
                if (pairs) {
                    pairs[2 * count] = row;
                    pairs[2 * count + 1] = column;
                }
                count++;
            }
        }
    }
    return count;
}

void bending_rest_bind(BendingRest *r, const BlockMatrix *matrix, int first, Arena *arena) {
    const BendingSamples *s = &r->samples;
    r->place_start = arena_push(arena, int, s->sample_count + 1);
    for (int i = 0; i < s->sample_count; i++) {
        int n = s->start[i + 1] - s->start[i];
        r->place_start[i + 1] = r->place_start[i] + n * (n + 1) / 2;
    }
    r->places = arena_push(arena, BlockPlace, r->place_start[s->sample_count]);
    BlockPlace *place = r->places;
    for (int i = 0; i < s->sample_count; i++) {
        for (int a = s->start[i]; a < s->start[i + 1]; a++) {
            for (int b = s->start[i]; b <= a; b++, place++) {
                int row = s->entries[a].node, column = s->entries[b].node;
                bool solved =
                    r->turning[i] != 0.0 && row < r->solved_count && column < r->solved_count;
                *place = solved ? block_matrix_place(matrix, first + row, first + column)
                                : (BlockPlace){-1, 0};
            }
        }
    }
}

/* dn / dx of a node: (I - n n') (f2 [F1 x] - f1 [F2 x]) / |F1 x F2|, row-major */
static void normal_row(const RestState *s, const BendingEntry *entry, double d[9]) {
    Vec3 w = vec3_sub(vec3_scale(entry->f2, s->f1), vec3_scale(entry->f1, s->f2));
    double cross[9] = {0, -w.z, w.y, w.z, 0, -w.x, -w.y, w.x, 0};
    double n[3] = {s->normal.x, s->normal.y, s->normal.z};
    for (int c = 0; c < 3; c++) {
        double along = n[0] * cross[c] + n[1] * cross[3 + c] + n[2] * cross[6 + c];
        for (int r = 0; r < 3; r++) {
            d[3 * r + c] = (cross[3 * r + c] - n[r] * along) / s->size;
        }
    }
}

/* what 1/2 A D |k - k0 n|^2 adds to the constant matrix: with q the moment rows and Dn = dn/dx,
 *   - q_a Dn_b - Dn_a' q_b + (A k0 D k0) Dn_a' Dn_b */
static void add_sample(const BendingRest *r, int sample, const RestState *state, double *values) {
    const BendingSamples *s = &r->samples;
    const BlockPlace *place = r->places + r->place_start[sample];
    for (int a = s->start[sample]; a < s->start[sample + 1]; a++) {
        double da[9], db[9], qa = moment_row(r, sample, &s->entries[a]);
        normal_row(state, &s->entries[a], da);
        for (int b = s->start[sample]; b <= a; b++, place++) {
            if (place->base < 0) {
                continue;
            }
            double block[9], qb = moment_row(r, sample, &s->entries[b]);
            normal_row(state, &s->entries[b], db);
            for (int i = 0; i < 3; i++) {
                for (int j = 0; j < 3; j++) {
                    double both = da[i] * db[j] + da[3 + i] * db[3 + j] + da[6 + i] * db[6 + j];
                    block[3 * i + j] =
                        r->turning[sample] * both - qa * db[3 * i + j] - qb * da[3 * j + i];
                }
            }
            block_add(values, *place, block);
        }
    }
}

void bending_rest_add_hessian(const BendingRest *r, const double *x, double *values) {
    for (int i = 0; i < r->samples.sample_count; i++) {
        RestState state = rest_state(r, i, x);
        if (acts(r, i, &state)) {
            add_sample(r, i, &state, values);
        }
    }
}
