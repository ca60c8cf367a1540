#include "sim/model/yarn_table.h"

#include <math.h>

#include "sim/base/error.h"

/* slope at an inner knot between secants s0 over h0 and s1 over h1, both positive */
static double inner_slope(double h0, double s0, double h1, double s1) {
    double w0 = 2.0 * h1 + h0, w1 = h1 + 2.0 * h0;
    return (w0 + w1) / (w0 / s0 + w1 / s1);
}

/* at the origin, from the two intervals behind it; monotone */
static double first_slope(double h0, double s0, double h1, double s1) {
    double slope = ((2.0 * h0 + h1) * s0 - h0 * s1) / (h0 + h1);
    return fmax(0.0, fmin(slope, 3.0 * s0));
}

int yarn_table_create(int count, const double *at, const double *value, YarnTable *t) {
    int n = t->count = count + 1;
    double h[YARN_TABLE_MOST] = {0}, s[YARN_TABLE_MOST] = {0};
    ASSERT(count >= 1 && count < YARN_TABLE_MOST);
    t->at[0] = t->c[0][0] = t->work[0] = 0.0;
    for (int k = 1; k < n; k++) {
        t->at[k] = at[k - 1], t->c[k][0] = value[k - 1];
        h[k - 1] = t->at[k] - t->at[k - 1];
        s[k - 1] = (t->c[k][0] - t->c[k - 1][0]) / h[k - 1];
        if (!(s[k - 1] > 0.0)) {
            return k - 1;
        }
    }
    for (int k = 0; k < n; k++) {
        t->c[k][1] = k == n - 1 ? s[n - 2]
                     : k > 0    ? inner_slope(h[k - 1], s[k - 1], h[k], s[k])
                     : n > 2    ? first_slope(h[0], s[0], h[1], s[1])
                                : s[0];
    }
    for (int k = 0; k < n - 1; k++) {
        double m0 = t->c[k][1], m1 = t->c[k + 1][1];
        t->c[k][2] = (3.0 * s[k] - 2.0 * m0 - m1) / h[k];
        t->c[k][3] = (m0 + m1 - 2.0 * s[k]) / (h[k] * h[k]);
    }
    t->c[n - 1][2] = t->c[n - 1][3] = 0.0;
    for (int k = 1; k < n; k++) {
        t->work[k] = yarn_table_work(t, t->at[k]);
    }
    return -1;
}

/* index of the last knot below `at`, or 0 */
static int interval(const YarnTable *t, double at) {
    int k = 0;
    while (k + 1 < t->count && at > t->at[k + 1]) {
        k++;
    }
    return k;
}

double yarn_table_work(const YarnTable *t, double at) {
    int k = interval(t, at);
    const double *c = t->c[k];
    double d = at - t->at[k];
    return t->work[k] + d * (c[0] + d * (c[1] / 2.0 + d * (c[2] / 3.0 + d * c[3] / 4.0)));
}

/* integral of p(x - x0) cos x from x0 to x0 + d, by parts */
static double cosine_part(const double c[4], double x0, double d) {
    double p = c[0] + d * (c[1] + d * (c[2] + d * c[3]));
    double p1 = c[1] + d * (2.0 * c[2] + 3.0 * d * c[3]), p2 = 2.0 * c[2] + 6.0 * d * c[3];
    double p3 = 6.0 * c[3], x = x0 + d;
    double upper = (p - p2) * sin(x) + (p1 - p3) * cos(x);
    double lower = (c[0] - 2.0 * c[2]) * sin(x0) + (c[1] - p3) * cos(x0);
    return upper - lower;
}

double yarn_table_cosine_work(const YarnTable *t, double at) {
    double sum = 0.0;
    int last = interval(t, at);
    for (int k = 0; k <= last; k++) {
        double end = k == last ? at : t->at[k + 1];
        sum += cosine_part(t->c[k], t->at[k], end - t->at[k]);
    }
    return sum;
}

double yarn_table_stiffest(const YarnTable *t) {
    double most = 0.0, slope;
    for (int k = 0; k < t->count; k++) { /* slopes are parabolas: at the ends or in between */
        most = fmax(most, t->c[k][1]);
        double d = t->c[k][3] < 0.0 ? -t->c[k][2] / (3.0 * t->c[k][3]) : 0.0;
        if (k + 1 < t->count && d > 0.0 && d < t->at[k + 1] - t->at[k]) {
            yarn_table_value(t, t->at[k] + d, &slope);
            most = fmax(most, slope);
        }
    }
    return most;
}
