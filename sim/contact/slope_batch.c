#include "sim/contact/slope_batch.h"

SlopeFit slope_fit(const SurfacePanel *panel, const SlopeNodes *nodes) {
    SlopeFit fit = {.h = {panel->h1, panel->h2}};
    int middle = nodes->slot[panel->nu * (panel->nv / 2) + panel->nu / 2];
    for (int a = 0; a < 3; a++) {
        fit.origin[a] = nodes->x[a][middle];
    }
    return fit;
}

void slope_blocks_begin(SlopeBlocks *blocks, SlopeFit *fit) {
    *blocks = (SlopeBlocks){0};
    for (int n = 0; n < 3 * SLOPE_NODES * SLOPE_NODES; n++) {
        int a = n % 3, m = n / 3 / SLOPE_NODES, c = n / 3 % SLOPE_NODES;
        fit->node[m][c][a] = blocks->node[m][c][a];
    }
    for (int k = 0; k < SLOPE_BATCH; k++) {
        blocks->cells[0][k] = blocks->cells[1][k] = 1.0f;
    }
    fit->cells[0] = blocks->cells[0], fit->cells[1] = blocks->cells[1];
    for (int r = 0; r < SLOPE_ROWS; r++) {
        fit->slopes.row[r] = blocks->slopes[r];
    }
}

void slope_blocks_place(SlopeBlocks *blocks, const SlopeFit *fit, int k, const SurfacePanel *panel,
                        const SlopeNodes *nodes, const int first[2], const int cells[2]) {
    blocks->cells[0][k] = (float)cells[0], blocks->cells[1][k] = (float)cells[1];
    for (int n = 0; n < SLOPE_NODES * SLOPE_NODES; n++) {
        int m = n / SLOPE_NODES, c = n % SLOPE_NODES;
        int i = first[0] + (c < cells[0] ? c : cells[0]), j = m < cells[1] ? m : cells[1];
        int s = nodes->slot[(first[1] + j) * panel->nu + (i < panel->nu ? i : i - panel->nu)];
        for (int a = 0; a < 3; a++) {
            blocks->node[m][c][a][k] = (float)(nodes->x[a][s] - fit->origin[a]);
        }
    }
}

SlopeField slope_field_create(int room, Arena *arena) {
    SlopeField field;
    for (int r = 0; r < SLOPE_ROWS; r++) {
        field.row[r] = arena_push(arena, float, room);
    }
    return field;
}
