#include "sim/contact/slope_batch.h"

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

SlopeField slope_field_create(int room, Arena *arena) {
    SlopeField field;
    for (int r = 0; r < SLOPE_ROWS; r++) {
        field.row[r] = arena_push(arena, float, room);
    }
    return field;
}
