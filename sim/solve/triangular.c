#include "sim/solve/triangular.h"

void triangular_solve(const Triangular *l, double *b) {
    double *y = l->work;
    for (int j = 0; j < l->count; j++) {
        y[j] = b[l->order[j]];
    }
    for (int j = 0; j < l->count; j++) {
        int k = l->start[j];
        y[j] /= l->value[k];
        for (k++; k < l->start[j + 1]; k++) {
            y[l->row[k]] -= l->value[k] * y[j];
        }
    }
    for (int j = l->count - 1; j >= 0; j--) {
        double sum = y[j];
        for (int k = l->start[j] + 1; k < l->start[j + 1]; k++) {
            sum -= l->value[k] * y[l->row[k]];
        }
        y[j] = sum / l->value[l->start[j]];
    }
    for (int j = 0; j < l->count; j++) {
        b[l->order[j]] = y[j];
    }
}
