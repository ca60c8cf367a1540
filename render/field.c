#include "render/field.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "sim/base/vec.h"

#define FLAT 1e-12 /* of the squared longest side: a triangle with less area tells nothing */

FieldMesh field_mesh_create(const StateLayout *layout, int cloth, Arena *arena) {
    int first = layout->vertex_begin[cloth], begin = layout->triangle_begin[cloth];
    FieldMesh mesh = {layout->vertex_begin[cloth + 1] - first,
                      layout->triangle_begin[cloth + 1] - begin, NULL, NULL, 0.0};
    int32_t *triangles = arena_push(arena, int32_t, 3 * (size_t)mesh.triangle_count);
    for (size_t i = 0; i < 3 * (size_t)mesh.triangle_count; i++) {
        triangles[i] = layout->triangles[3 * (size_t)begin + i] - first;
    }
    double *uv = arena_push(arena, double, 2 * (size_t)mesh.vertex_count);
    memcpy(uv, layout->vertex_material + 2 * (size_t)first,
           2 * sizeof *uv * (size_t)mesh.vertex_count);
    mesh.triangles = triangles;
    mesh.uv = uv;
    const int32_t *lattice = layout->lattice + 4 * cloth;
    if (lattice[2] == 1 && lattice[0] > 1) { /* one column more closes the panel */
        double low = INFINITY, high = -INFINITY;
        for (int i = 0; i < mesh.vertex_count; i++) {
            low = fmin(low, uv[2 * (size_t)i]);
            high = fmax(high, uv[2 * (size_t)i]);
        }
        mesh.period = (high - low) * lattice[0] / (lattice[0] - 1.0);
    }
    return mesh;
}

Field field_create(int vertex_count, Arena *arena) {
    return (Field){.normal = arena_push(arena, double, 3 * (size_t)vertex_count),
                   .strain = arena_push(arena, double, 3 * (size_t)vertex_count),
                   .curvature = arena_push(arena, double, 3 * (size_t)vertex_count),
                   .weight = arena_push(arena, double, vertex_count)};
}

/* Triangles count by their angle at a vertex [Thuermer, Wuethrich 1998: Computing vertex normals from
 * polygonal facets], so that the direction of diagonals does not show at borders. */
void field_find_normals(const FieldMesh *mesh, const double *x, Field *field) {
    memset(field->normal, 0, 3 * sizeof *field->normal * (size_t)mesh->vertex_count);
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int32_t *corner = mesh->triangles + 3 * (size_t)t;
        Vec3 p[3];
        for (int k = 0; k < 3; k++) {
            p[k] = vec3_load(x + 3 * (size_t)corner[k]);
        }
        Vec3 area = vec3_cross(vec3_sub(p[1], p[0]), vec3_sub(p[2], p[0]));
        Vec3 unit = vec3_unit(area, vec3(0, 0, 0));
        for (int k = 0; k < 3; k++) {
            Vec3 a = vec3_sub(p[(k + 1) % 3], p[k]), b = vec3_sub(p[(k + 2) % 3], p[k]);
            double angle = atan2(vec3_length(area), vec3_dot(a, b));
            double *normal = field->normal + 3 * (size_t)corner[k];
            vec3_store(normal, vec3_axpy(vec3_load(normal), angle, unit));
        }
    }
    for (int i = 0; i < mesh->vertex_count; i++) {
        double *normal = field->normal + 3 * (size_t)i;
        vec3_store(normal, vec3_unit(vec3_load(normal), vec3(0, 0, 0)));
    }
}

/* Derivatives of linear functions on a triangle. */
typedef struct Slopes {
    double inverse[4]; /* of the matrix of (u, v) differences, [1/m] */
    double area;       /* [m2] twice that on the panel */
} Slopes;

/* The difference of two u on a panel that closes on itself. */
static double wrap(double du, double period) {
    return period > 0.0 ? du - period * round(du / period) : du;
}

static bool find_slopes(const FieldMesh *mesh, const int32_t *corner, Slopes *slopes) {
    const double *a = mesh->uv + 2 * (size_t)corner[0];
    const double *b = mesh->uv + 2 * (size_t)corner[1];
    const double *c = mesh->uv + 2 * (size_t)corner[2];
    double u1 = wrap(b[0] - a[0], mesh->period), v1 = b[1] - a[1];
    double u2 = wrap(c[0] - a[0], mesh->period), v2 = c[1] - a[1];
    double area = u1 * v2 - u2 * v1, side = fmax(u1 * u1 + v1 * v1, u2 * u2 + v2 * v2);
    if (!(fabs(area) > FLAT * side)) {
        return false;
    }
    *slopes = (Slopes){{v2 / area, -v1 / area, -u2 / area, u1 / area}, fabs(area)};
    return true;
}

/* Derivatives along u and v of what has the values f (vertex_count x 3) at the corners. */
static void derive(const Slopes *slopes, const int32_t *corner, const double *f, Vec3 *fu,
                   Vec3 *fv) {
    Vec3 a = vec3_load(f + 3 * (size_t)corner[0]);
    Vec3 ab = vec3_sub(vec3_load(f + 3 * (size_t)corner[1]), a);
    Vec3 ac = vec3_sub(vec3_load(f + 3 * (size_t)corner[2]), a);
    *fu = vec3_axpy(vec3_scale(slopes->inverse[0], ab), slopes->inverse[1], ac);
    *fv = vec3_axpy(vec3_scale(slopes->inverse[2], ab), slopes->inverse[3], ac);
}

static void find_triangle(const int32_t *corner, const Slopes *slopes, const double *x,
                          const double *normal, double strain[3], double curvature[3]) {
    Vec3 xu, xv, nu, nv;
    derive(slopes, corner, x, &xu, &xv);
    derive(slopes, corner, normal, &nu, &nv);
    double warp = vec3_length(xu), weft = vec3_length(xv), both = warp * weft;
    double sine = both > 0.0 ? vec3_dot(xu, xv) / both : 0.0;
    strain[0] = warp - 1.0;
    strain[1] = weft - 1.0;
    strain[2] = asin(fmax(-1.0, fmin(1.0, sine)));
    curvature[0] = -vec3_dot(nu, xu);
    curvature[1] = -vec3_dot(nv, xv);
    curvature[2] = -0.5 * (vec3_dot(nu, xv) + vec3_dot(nv, xu));
}

void field_find_areas(const FieldMesh *mesh, double *area) {
    memset(area, 0, sizeof *area * (size_t)mesh->vertex_count);
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int32_t *corner = mesh->triangles + 3 * (size_t)t;
        Slopes slopes;
        for (int k = 0; k < 3 && find_slopes(mesh, corner, &slopes); k++) {
            area[corner[k]] += slopes.area / 6.0;
        }
    }
}

void field_compute(const FieldMesh *mesh, const double *x, Field *field) {
    size_t count = (size_t)mesh->vertex_count;
    field_find_normals(mesh, x, field);
    memset(field->strain, 0, 3 * sizeof *field->strain * count);
    memset(field->curvature, 0, 3 * sizeof *field->curvature * count);
    memset(field->weight, 0, sizeof *field->weight * count);
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int32_t *corner = mesh->triangles + 3 * (size_t)t;
        Slopes slopes;
        double strain[3], curvature[3];
        if (!find_slopes(mesh, corner, &slopes)) {
            continue;
        }
        find_triangle(corner, &slopes, x, field->normal, strain, curvature);
        for (int k = 0; k < 3; k++) {
            field->weight[corner[k]] += slopes.area;
            for (int c = 0; c < 3; c++) {
                field->strain[3 * (size_t)corner[k] + c] += slopes.area * strain[c];
                field->curvature[3 * (size_t)corner[k] + c] += slopes.area * curvature[c];
            }
        }
    }
    for (size_t i = 0; i < count; i++) {
        double scale = field->weight[i] > 0.0 ? 1.0 / field->weight[i] : 0.0;
        for (int c = 0; c < 3; c++) {
            field->strain[3 * i + c] *= scale;
            field->curvature[3 * i + c] *= scale;
        }
    }
}

/* The mean over a triangle of |e* - e|^2, exact for linear e*: by the middles of its sides. */
static double find_error(const int32_t *corner, const double *means, const double strain[3]) {
    static const double share[3] = {1.0, 1.0, 0.5};
    double sum = 0.0;
    for (int k = 0; k < 3; k++) {
        const double *a = means + 3 * (size_t)corner[k],
                     *b = means + 3 * (size_t)corner[(k + 1) % 3];
        for (int c = 0; c < 3; c++) {
            double off = 0.5 * (a[c] + b[c]) - strain[c];
            sum += share[c] * off * off / 3.0;
        }
    }
    return sum;
}

void field_find_errors(const FieldMesh *mesh, const double *x, Field *field, double *error) {
    field_compute(mesh, x, field);
    memset(error, 0, sizeof *error * (size_t)mesh->vertex_count);
    for (int t = 0; t < mesh->triangle_count; t++) {
        const int32_t *corner = mesh->triangles + 3 * (size_t)t;
        Slopes slopes;
        double strain[3], curvature[3];
        if (find_slopes(mesh, corner, &slopes)) {
            find_triangle(corner, &slopes, x, field->normal, strain, curvature);
            double square = find_error(corner, field->strain, strain);
            for (int k = 0; k < 3; k++) {
                error[corner[k]] += slopes.area * square;
            }
        }
    }
    for (int i = 0; i < mesh->vertex_count; i++) {
        error[i] = field->weight[i] > 0.0 ? sqrt(error[i] / field->weight[i]) : 0.0;
    }
}
