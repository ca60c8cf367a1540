#include "render/quantity.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "render/field.h"

#define RANGE_PART 0.99     /* of the vertices: a few wild ones do not wash out the rest */
#define ROUND_EPSILON 1e-9  /* relative: 0.5 computed is 0.5 */
#define RANGE_SMALLEST 1e-6 /* [units of the legend] cloth without strain is not noise */

const Quantity quantities[QUANTITY_COUNT] = {
    [QUANTITY_NONE] = {"", "", 1.0, NULL},
    [QUANTITY_STRAIN_WARP] = {"warp strain", "%", 100.0, &colormap_diverging},
    [QUANTITY_STRAIN_WEFT] = {"weft strain", "%", 100.0, &colormap_diverging},
    [QUANTITY_SHEAR] = {"shear angle", "\302\260", 57.295779513082321, &colormap_diverging},
    [QUANTITY_CURVATURE] = {"mean curvature", "1/m", 1.0, &colormap_diverging},
    [QUANTITY_SPEED] = {"speed", "m/s", 1.0, &colormap_sequential},
    [QUANTITY_ERROR] = {"error of strain", "%", 100.0, &colormap_sequential},
    [QUANTITY_CONTACT] = {"contact force per area", "Pa", 1.0, &colormap_sequential},
};

static void find_speeds(const StateLayout *layout, const StateFrame *frame, int cloth,
                        Arena *scratch, double *values) {
    double *v = arena_push(scratch, double, 3 * (size_t)layout->vertex_count);
    state_surface(layout, frame->v, v);
    for (int i = layout->vertex_begin[cloth]; i < layout->vertex_begin[cloth + 1]; i++) {
        *values++ = vec3_length(vec3_load(v + 3 * (size_t)i));
    }
}

/* A vertex has a third of the cloth in each of its triangles. */
static void find_pressures(const StateLayout *layout, const StateFrame *frame, int cloth,
                           Arena *scratch, double *values) {
    double *s = arena_push(scratch, double, 3 * (size_t)layout->vertex_count);
    FieldMesh mesh = field_mesh_create(layout, cloth, scratch);
    double *area = arena_push(scratch, double, (size_t)mesh.vertex_count);
    state_surface(layout, frame->contact_force, s);
    field_find_areas(&mesh, area);
    for (int i = 0; i < mesh.vertex_count; i++) {
        double force = vec3_length(vec3_load(s + 3 * ((size_t)layout->vertex_begin[cloth] + i)));
        values[i] = area[i] > 0.0 ? force / area[i] : 0.0;
    }
}

bool quantity_is_kept(QuantityKind kind, const StateFrame *frame, Error *error) {
    return kind != QUANTITY_CONTACT || frame->contact_force ||
           error_set(error, EXIT_BAD_INPUT,
                     "look " FILM_LOOK_CONTACT ": the run holds no forces of contacts; simulate a "
                     "scene with 'look: " FILM_LOOK_CONTACT "'");
}

static void find_fields(QuantityKind kind, const StateLayout *layout, const StateFrame *frame,
                        int cloth, Arena *scratch, double *values) {
    double *s = arena_push(scratch, double, 3 * (size_t)layout->vertex_count);
    state_surface(layout, frame->x, s);
    FieldMesh mesh = field_mesh_create(layout, cloth, scratch);
    Field field = field_create(mesh.vertex_count, scratch);
    if (kind == QUANTITY_ERROR) {
        field_find_errors(&mesh, s + 3 * (size_t)layout->vertex_begin[cloth], &field, values);
        return;
    }
    field_compute(&mesh, s + 3 * (size_t)layout->vertex_begin[cloth], &field);
    for (int i = 0; i < mesh.vertex_count; i++) {
        const double *strain = field.strain + 3 * (size_t)i;
        const double *curvature = field.curvature + 3 * (size_t)i;
        values[i] = kind == QUANTITY_STRAIN_WARP   ? strain[0]
                    : kind == QUANTITY_STRAIN_WEFT ? strain[1]
                    : kind == QUANTITY_SHEAR       ? strain[2]
                                                   : 0.5 * (curvature[0] + curvature[1]);
    }
}

void quantity_compute(QuantityKind kind, const StateLayout *layout, const StateFrame *frame,
                      int cloth, Arena *scratch, double *values) {
    ArenaMark mark = arena_mark(scratch);
    if (kind == QUANTITY_SPEED) {
        find_speeds(layout, frame, cloth, scratch, values);
    } else if (kind == QUANTITY_CONTACT) {
        find_pressures(layout, frame, cloth, scratch, values);
    } else {
        find_fields(kind, layout, frame, cloth, scratch, values);
    }
    arena_rewind(scratch, mark);
}

static int compare_numbers(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* What RANGE_PART of the absolute values that are not 0 do not exceed; sorts them. */
static double reach_of(double *values, int count) {
    int used = 0;
    for (int i = 0; i < count; i++) {
        values[used] = fabs(values[i]);
        used += values[used] > 0.0;
    }
    qsort(values, (size_t)used, sizeof *values, compare_numbers);
    return used > 0 ? values[(int)(RANGE_PART * (used - 1))] : 0.0;
}

double quantity_round_up(double number) {
    if (!(number > 0.0) || !isfinite(number)) {
        return 1.0;
    }
    static const double steps[] = {1.0, 1.2, 1.6, 2.0, 2.4, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0};
    double power = pow(10.0, floor(log10(number))), part = number / power;
    int i = 0;
    while (part > steps[i] * (1.0 + ROUND_EPSILON) && steps[i] < 10.0) {
        i++;
    }
    return power * steps[i];
}

bool quantity_find_range(QuantityKind kind, Run *run, const QuantityKind *kinds,
                         QuantityRange *range, Error *error) {
    StateFrame frame;
    StateLayout layout;
    int layout_index;
    double reach = 0.0;
    Arena scratch = {0};
    bool good = true;
    for (int i = 0; good && i < state_frame_count(run->reader); i++) {
        good = state_read_frame(run->reader, i, &frame, &layout, &layout_index, error);
        for (int cloth = 0; good && cloth < layout.cloth_count; cloth++) {
            int count = layout.vertex_begin[cloth + 1] - layout.vertex_begin[cloth];
            good = kinds[cloth] != kind || quantity_is_kept(kind, &frame, error);
            if (good && kinds[cloth] == kind) {
                ArenaMark mark = arena_mark(&scratch);
                double *values = arena_push(&scratch, double, (size_t)count);
                quantity_compute(kind, &layout, &frame, cloth, &scratch, values);
                reach = fmax(reach, reach_of(values, count));
                arena_rewind(&scratch, mark);
            }
        }
    }
    arena_free(&scratch);
    const Quantity *quantity = &quantities[kind];
    double high =
        quantity_round_up(fmax(reach * quantity->scale, RANGE_SMALLEST)) / quantity->scale;
    *range = (QuantityRange){quantity->map->diverging ? -high : 0.0, high};
    return good;
}
