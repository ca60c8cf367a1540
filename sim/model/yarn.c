#include "sim/model/yarn.h"

#include <math.h>
#include <stddef.h>

double yarn_value(const YarnCurve *c, double at, double *slope) {
    double unused;
    slope = slope ? slope : &unused;
    if (c->table) {
        return yarn_table_value(c->table, at, slope);
    }
    double first = c->slope + 2.0 * c->step / c->onset, bend = c->step / (c->onset * c->onset);
    if (at >= c->onset) {
        *slope = c->slope;
        return c->step + c->slope * at;
    }
    *slope = first - 2.0 * bend * at;
    return (first - bend * at) * at;
}

double yarn_stiffest(const YarnCurve *c) { /* yarns that stick are the stiffest */
    double sticks = c->step > 0.0 ? 2.0 * c->step / c->onset : 0.0;
    return c->table ? yarn_table_stiffest(c->table) : c->slope + sticks;
}

double yarn_work(const YarnCurve *c, double at) {
    if (c->table) {
        return yarn_table_work(c->table, at);
    }
    if (at >= c->onset) {
        return c->step * (at - c->onset / 3.0) + 0.5 * c->slope * at * at;
    }
    double first = c->slope + 2.0 * c->step / c->onset, bend = c->step / (c->onset * c->onset);
    return (0.5 * first - bend * at / 3.0) * at * at;
}

/* ---- trellis ---- */

/* integral of (first x - bend x^2) cos x from 0, without loss of digits in the first part */
static double work_before(double first, double bend, double x) {
    double s = sin(x), half = sin(0.5 * x);
    return first * (x * s - 2.0 * half * half) - bend * (x * x * s + 2.0 * x * cos(x) - 2.0 * s);
}

static double measured_work(const YarnCurve *c, double phi) {
    if (c->table) {
        return yarn_table_cosine_work(c->table, phi);
    }
    double first = c->slope + 2.0 * c->step / c->onset, bend = c->step / (c->onset * c->onset);
    if (phi <= c->onset) {
        return work_before(first, bend, phi);
    }
    double after = c->step * (sin(phi) - sin(c->onset)) + work_before(c->slope, 0.0, phi) -
                   work_before(c->slope, 0.0, c->onset);
    return work_before(first, bend, c->onset) + after;
}

static double measured_moment(const YarnCurve *c, double phi, double *slope) {
    double df, f = yarn_value(c, phi, &df);
    *slope = df * cos(phi) - f * sin(phi);
    return f * cos(phi);
}

/* the branch that closes up */
static void closing(const TrellisCurve *c, double phi, double out[3]) {
    double wide = SHEAR_LOCK - c->measured, d = phi - c->measured, left = SHEAR_LOCK - phi;
    out[0] = c->end[0] + c->end[1] * wide * d / left;
    out[1] = c->end[1] * wide * wide / (left * left);
    out[2] = c->end[2] + c->end[0] * d + c->end[1] * (wide * wide * log(wide / left) - wide * d);
}

TrellisCurve trellis_curve(YarnCurve force, double stiffest) {
    TrellisCurve c = {.force = force, .measured = SHEAR_MEASURED};
    if (force.table) {
        c.measured = force.table->at[force.table->count - 1];
    }
    c.end[0] = measured_moment(&force, c.measured, &c.end[1]);
    c.end[2] = measured_work(&force, c.measured);
    double share = fmin(1.0, sqrt(c.end[1] / stiffest));
    c.from = SHEAR_LOCK - share * (SHEAR_LOCK - c.measured);
    closing(&c, c.from, c.last);
    return c;
}

double trellis_moment(const TrellisCurve *c, double phi, double *slope) {
    double at[3], unused;
    slope = slope ? slope : &unused;
    if (phi <= c->measured) {
        return measured_moment(&c->force, phi, slope);
    }
    closing(c, fmin(phi, c->from), at);
    *slope = at[1];
    return at[0] + (phi > c->from ? at[1] * (phi - c->from) : 0.0);
}

double trellis_work(const TrellisCurve *c, double phi) {
    double at[3], d = fmax(phi - c->from, 0.0);
    if (phi <= c->measured) {
        return measured_work(&c->force, phi);
    }
    closing(c, fmin(phi, c->from), at);
    return at[2] + at[0] * d + 0.5 * at[1] * d * d;
}
