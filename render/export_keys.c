/* Which frames of a motion to keep so that straight lines between them come near to the rest. */
#include <float.h>
#include <math.h>
#include <stdlib.h>

#include "render/export.h"
#include "sim/base/memory.h"

typedef struct Shapes {
    const float *x;
    const double *times;
    size_t number_count;
} Shapes;

/* Largest distance of a coordinate of the frames between a and b from the line between these. */
static double find_miss(const Shapes *shapes, int a, int b) {
    const float *first = shapes->x + shapes->number_count * (size_t)a;
    const float *last = shapes->x + shapes->number_count * (size_t)b;
    double span = shapes->times[b] - shapes->times[a];
    float miss = 0.0f;
    for (int i = a + 1; i < b; i++) {
        const float *now = shapes->x + shapes->number_count * (size_t)i;
        float part = (float)((shapes->times[i] - shapes->times[a]) / span);
        for (size_t n = 0; n < shapes->number_count; n++) {
            float d = fabsf(now[n] - (first[n] + part * (last[n] - first[n])));
            miss = d > miss ? d : miss;
        }
    }
    return miss;
}

/* A chain of the frames that are still kept. */
typedef struct Chain {
    int *before, *after; /* (frame_count) */
    double *cost;        /* (frame_count) the miss when this frame goes */
} Chain;

static int find_cheapest(const Chain *chain, int frame_count) {
    int best = -1;
    double least = DBL_MAX;
    for (int i = chain->after[0]; i < frame_count - 1; i = chain->after[i]) {
        if (chain->cost[i] < least) {
            least = chain->cost[i];
            best = i;
        }
    }
    return best;
}

static void update(const Shapes *shapes, Chain *chain, int frame_count, int i) {
    if (i > 0 && i < frame_count - 1) {
        chain->cost[i] = find_miss(shapes, chain->before[i], chain->after[i]);
    }
}

double export_choose_keys(const float *x, const double *times, int frame_count, size_t number_count,
                          int keep, int *chosen) {
    Shapes shapes = {x, times, number_count};
    Chain chain = {memory_zeroed((size_t)frame_count, sizeof(int)),
                   memory_zeroed((size_t)frame_count, sizeof(int)),
                   memory_zeroed((size_t)frame_count, sizeof(double))};
    ASSERT(keep >= 2 && keep <= frame_count);
    for (int i = 0; i < frame_count; i++) {
        chain.before[i] = i - 1;
        chain.after[i] = i + 1;
    }
    for (int i = 1; i < frame_count - 1; i++) {
        update(&shapes, &chain, frame_count, i);
    }
    for (int count = frame_count; count > keep; count--) {
        int out = find_cheapest(&chain, frame_count);
        int before = chain.before[out], after = chain.after[out];
        chain.after[before] = after;
        chain.before[after] = before;
        update(&shapes, &chain, frame_count, before);
        update(&shapes, &chain, frame_count, after);
    }
    double miss = 0.0;
    int count = 0;
    for (int i = 0; i < frame_count; i = chain.after[i]) {
        chosen[count++] = i;
        if (i + 1 < frame_count) {
            miss = fmax(miss, find_miss(&shapes, i, chain.after[i]));
        }
    }
    free(chain.before);
    free(chain.after);
    free(chain.cost);
    return miss;
}
