#include "render/apart.h"

#include <string.h>

#include "render/apart_parts.h"
#include "sim/base/error.h"

#define WHOLE (1.0 - 1e-9) /* from here on g is 1: rounding of its interpolation */
#define BOX_GROWTH 1.001   /* of |e|: boxes are no tighter than the bounds */

/* The first vertex at the same node, for every vertex; itself where W says more than that. */
static const int32_t *join_vertices(const StateLayout *l, Arena *arena) {
    int32_t *join = arena_push(arena, int32_t, l->vertex_count);
    int32_t *first = arena_push(arena, int32_t, l->node_count); /* vertex of a node, + 1 */
    for (int i = l->vertex_count - 1; i >= 0; i--) {
        int row = l->w_count ? l->w_start[i] : 0;
        join[i] = i;
        if (l->w_count && l->w_start[i + 1] - row == 1 && l->w_value[row] == 1.0) {
            first[l->w_column[row]] = i + 1;
        }
    }
    for (int i = 0; i < l->vertex_count && l->w_count; i++) {
        int row = l->w_start[i];
        if (l->w_start[i + 1] - row == 1 && l->w_value[row] == 1.0) {
            join[i] = first[l->w_column[row]] - 1;
        }
    }
    return join;
}

/* Neighbours on the panel stay neighbours, so the tree is that of the panels, one above the other. */
static BoxTree create_tree(const StateLayout *l, Arena *arena) {
    Vec3 *centres = arena_push(arena, Vec3, l->triangle_count);
    double extent = 0.0;
    for (int i = 0; i < 2 * l->vertex_count; i++) {
        extent = fmax(extent, fabs(l->vertex_material[i]));
    }
    for (int c = 0; c < l->cloth_count; c++) {
        for (int t = l->triangle_begin[c]; t < l->triangle_begin[c + 1]; t++) {
            for (int k = 0; k < 3; k++) {
                const double *uv = l->vertex_material + 2 * (size_t)l->triangles[3 * (size_t)t + k];
                centres[t] = vec3_add(centres[t], vec3(uv[0] / 3.0, uv[1] / 3.0, extent * c));
            }
        }
    }
    return box_tree_create(centres, l->triangle_count, arena);
}

/* Sides of the triangles on their panel, across the seam of a closed one too. */
static void find_sides(const StateLayout *l, const SurfacePart *parts, Apart *apart) {
    for (int c = 0; c < l->cloth_count; c++) {
        double period = parts[c].around ? parts[c].size[0] : 0.0;
        for (int t = l->triangle_begin[c]; t < l->triangle_begin[c + 1]; t++) {
            const int32_t *corner = apart->pieces[t].corner;
            for (int k = 0; k < 4; k++) {
                double d = l->vertex_material[2 * (size_t)corner[1 + k / 2] + k % 2] -
                           l->vertex_material[2 * (size_t)corner[0] + k % 2];
                bool across = k % 2 == 0 && 2.0 * fabs(d) > period && period > 0.0;
                apart->sides[t][k] = across ? d - copysign(period, d) : d;
            }
        }
    }
}

Apart *apart_create(const StateLayout *layout, const SurfacePart *parts, const Piece *pieces,
                    Arena *arena) {
    Apart *apart = arena_push(arena, Apart, 1);
    int count = layout->triangle_count;
    apart->triangle_count = count;
    apart->vertex_count = layout->vertex_count;
    apart->pieces = pieces;
    apart->join = join_vertices(layout, arena);
    apart->triangles = arena_push(arena, ApartTriangle, count);
    apart->first_leave = arena_push(arena, int, count + 1);
    for (int t = 0; t < count; t++) {
        apart->first_leave[t + 1] = apart->first_leave[t] + piece_vertex_count(&pieces[t]);
    }
    apart->leaves = arena_push(arena, float, 3 * (size_t)apart->first_leave[count]);
    apart->most = arena_push(arena, double, layout->vertex_count);
    apart->boxes = arena_push(arena, Box, count);
    apart->sides = arena_alloc(arena, sizeof *apart->sides * (size_t)count);
    apart->frames = arena_alloc(arena, sizeof *apart->frames * (size_t)layout->vertex_count);
    apart->areas = arena_push(arena, double, layout->vertex_count);
    find_sides(layout, parts, apart);
    apart_find_seams(apart, arena);
    apart->tree = create_tree(layout, arena);
    return apart;
}

/* ---- a triangle ---- */

/* The corners in the order of their numbers: a place on an edge has the same bits in both triangles. */
static void sort_corners(const Piece *piece, int order[3]) {
    const int32_t *c = piece->corner;
    order[0] = 0, order[1] = 1, order[2] = 2;
    for (int pass = 0; pass < 3; pass++) {
        int *one = order + pass % 2, *two = one + 1;
        if (c[*one] > c[*two]) {
            int swapped = *one;
            *one = *two, *two = swapped;
        }
    }
}

/* How far the smooth surface leaves the triangle at its drawn vertices. */
static void find_leaves(const Piece *piece, ApartTriangle *triangle, const SurfaceVertex *vertices,
                        float *e) {
    int n = piece->level, order[3];
    double inverse = 1.0 / n, most = 0.0, rise = 0.0, fall = 0.0;
    Vec3 normal = triangle->normal;
    float *first = e, *second = e + 3 * n, *third = e + 3 * (piece_vertex_count(piece) - 1);
    sort_corners(piece, order);
    Vec3 a = triangle->corner[order[0]], b = triangle->corner[order[1]];
    Vec3 c = triangle->corner[order[2]];
    for (int j = 0; j <= n; j++) {
        const SurfaceVertex *vertex = vertices + piece_vertex(piece, 0, j);
        for (int i = 0; i + j <= n; i++, vertex += piece->step[0], e += 3) {
            double w[3] = {(n - i - j) * inverse, i * inverse, j * inverse};
            double wa = w[order[0]], wb = w[order[1]], wc = w[order[2]];
            double x = (double)vertex->position[0] - (wa * a.x + wb * b.x + wc * c.x);
            double y = (double)vertex->position[1] - (wa * a.y + wb * b.y + wc * c.y);
            double z = (double)vertex->position[2] - (wa * a.z + wb * b.z + wc * c.z);
            e[0] = (float)x, e[1] = (float)y, e[2] = (float)z;
            double up = x * normal.x + y * normal.y + z * normal.z;
            most = max2(most, x * x + y * y + z * z);
            rise = max2(rise, up), fall = max2(fall, -up);
        }
    }
    for (int k = 0; k < 3; k++) { /* at the corners e is nothing but rounding */
        first[k] = second[k] = third[k] = 0.0f;
    }
    triangle->reach = sqrt(most);
    triangle->rise = rise, triangle->fall = fall;
}

static void place_triangle(const Apart *apart, int t, const double *s,
                           const SurfaceVertex *vertices) {
    const Piece *piece = &apart->pieces[t];
    ApartTriangle *triangle = &apart->triangles[t];
    for (int k = 0; k < 3; k++) {
        triangle->corner[k] = vec3_load(s + 3 * (size_t)piece->corner[k]);
    }
    Vec3 area = vec3_cross(vec3_sub(triangle->corner[1], triangle->corner[0]),
                           vec3_sub(triangle->corner[2], triangle->corner[0]));
    triangle->normal = vec3_unit(area, vec3(0, 0, 0));
    triangle->reach = triangle->slope = triangle->rise = triangle->fall = 0.0;
    triangle->most = 1.0;
    if (piece->level > 1) { /* else drawn are its corners */
        find_leaves(piece, triangle, vertices, apart_leaves(apart, t));
    }
}

/* What a triangle asks for by itself, and its box. */
static void bound_triangle(const Apart *apart, int t) {
    ApartTriangle *triangle = &apart->triangles[t];
    if (triangle->reach > 0.0) {
        triangle->slope = apart_slope(apart, t);
        if (apart_share(triangle->slope) < 1.0) { /* within its plane it must not fold over */
            triangle->most = apart_share(apart_strain(apart, t, triangle->normal).loss);
        }
    }
    Box box = box_empty();
    for (int k = 0; k < 3; k++) {
        box_add(&box, triangle->corner[k]);
    }
    double growth = BOX_GROWTH * triangle->reach;
    Vec3 margin = vec3(growth, growth, growth);
    apart->boxes[t] = (Box){vec3_sub(box.low, margin), vec3_add(box.high, margin)};
}

static void meet(int a, int b, void *context) { apart_limit(context, a, b); }

/* ---- all of it ---- */

/* g of the corners: the least of their triangles. */
static void find_corners(Apart *apart) {
    for (int i = 0; i < apart->vertex_count; i++) {
        apart->most[i] = 1.0;
    }
    for (int t = 0; t < apart->triangle_count; t++) {
        for (int k = 0; k < 3; k++) {
            double *most = &apart->most[apart->join[apart->pieces[t].corner[k]]];
            *most = min2(*most, apart->triangles[t].most);
        }
    }
}

/* Mean derivatives of the triangles around each corner: between them they are as smooth as can be. */
static void find_frames(Apart *apart) {
    memset(apart->frames, 0, sizeof *apart->frames * (size_t)apart->vertex_count);
    memset(apart->areas, 0, sizeof *apart->areas * (size_t)apart->vertex_count);
    for (int t = 0; t < apart->triangle_count; t++) {
        const Vec3 *x = apart->triangles[t].corner;
        const double *m = apart->sides[t];
        Vec3 p = vec3_sub(x[1], x[0]), q = vec3_sub(x[2], x[0]);
        double area = m[0] * m[3] - m[1] * m[2], side = copysign(1.0, area);
        Vec3 du = vec3_axpy(vec3_scale(side * m[3], p), -side * m[1], q);
        Vec3 dv = vec3_axpy(vec3_scale(side * m[0], q), -side * m[2], p);
        for (int k = 0; k < 3; k++) {
            int corner = apart->pieces[t].corner[k];
            apart->frames[corner][0] = vec3_add(apart->frames[corner][0], du);
            apart->frames[corner][1] = vec3_add(apart->frames[corner][1], dv);
            apart->areas[corner] += fabs(area);
        }
    }
    for (int i = 0; i < apart->vertex_count; i++) {
        double inverse = apart->areas[i] > 0.0 ? 1.0 / apart->areas[i] : 0.0;
        apart->frames[i][0] = vec3_scale(inverse, apart->frames[i][0]);
        apart->frames[i][1] = vec3_scale(inverse, apart->frames[i][1]);
    }
}

/* Mixes `share` of b with the rest of a; unit when both are. */
static void mix(float a[3], const float b[3], double share, bool unit) {
    Vec3 p = vec3((double)a[0], (double)a[1], (double)a[2]);
    Vec3 q = vec3((double)b[0], (double)b[1], (double)b[2]);
    Vec3 sum = vec3_axpy(vec3_scale(1.0 - share, p), share, q);
    sum = unit ? vec3_unit(sum, q) : sum;
    a[0] = (float)sum.x, a[1] = (float)sum.y, a[2] = (float)sum.z;
}

/* A drawn vertex at barycentric place w, corners in `order`; e: where the smooth surface is from there. */
static bool move_vertex(const Apart *apart, int t, const int order[3], const double w[3],
                        const float e[3], bool sewn, SurfaceVertex *vertex) {
    const Piece *piece = &apart->pieces[t];
    double share = 0.0, du[3], dv[3];
    Vec3 p = {0, 0, 0}, u = {0, 0, 0}, v = {0, 0, 0};
    for (int k = 0; k < 3; k++) {
        int own = order[k], corner = piece->corner[own];
        share += w[own] * apart->most[apart->join[corner]];
        p = vec3_axpy(p, w[own], apart->triangles[t].corner[own]);
        u = vec3_axpy(u, w[own], apart->frames[corner][0]);
        v = vec3_axpy(v, w[own], apart->frames[corner][1]);
    }
    if (share >= WHOLE && !sewn) {
        return false;
    }
    vertex->position[0] = (float)(p.x + share * (double)e[0]);
    vertex->position[1] = (float)(p.y + share * (double)e[1]);
    vertex->position[2] = (float)(p.z + share * (double)e[2]);
    if (share >= WHOLE) {
        return true;
    }
    SurfaceVertex frame;
    vec3_store(du, u);
    vec3_store(dv, v);
    resample_set_frame(&frame, du, dv, apart->derivatives);
    mix(vertex->normal, frame.normal, 1.0 - share, !apart->derivatives);
    mix(vertex->tangent, frame.tangent, 1.0 - share, !apart->derivatives);
    return true;
}

static bool is_limited(const Apart *apart, int t) {
    const int32_t *corner = apart->pieces[t].corner;
    for (int k = 0; k < 3 && apart->pieces[t].level > 1; k++) {
        if (apart->most[apart->join[corner[k]]] < 1.0) {
            return true;
        }
    }
    return false;
}

static void move_triangle(const Apart *apart, int t, Surface *surface) {
    const Piece *piece = &apart->pieces[t];
    const float *e = apart_leaves(apart, t);
    int n = piece->level, order[3];
    double inverse = 1.0 / n;
    sort_corners(piece, order);
    for (int j = 0; j <= n; j++) {
        for (int i = 0; i + j <= n; i++, e += 3) {
            double w[3] = {(n - i - j) * inverse, i * inverse, j * inverse};
            int at = piece_vertex(piece, i, j);
            if (!surface
                     ->moved[at]) { /* another triangle with this vertex gives it the same place */
                bool sewn = apart_is_sewn(apart, t, i, j);
                surface->moved[at] =
                    move_vertex(apart, t, order, w, e, sewn, &surface->vertices[at]);
            }
        }
    }
}

bool apart_move(Apart *apart, const double *s, bool derivatives, Surface *surface) {
    bool moved = false, framed = false;
    apart->derivatives = derivatives;
    memset(surface->moved, 0, (size_t)surface->vertex_count);
    for (int t = 0; t < apart->triangle_count; t++) {
        place_triangle(apart, t, s, surface->vertices);
    }
    apart_sew(apart);
    for (int t = 0; t < apart->triangle_count; t++) {
        bound_triangle(apart, t);
    }
    box_tree_refit(&apart->tree, apart->boxes);
    box_tree_pairs(&apart->tree, 0.0, meet, apart);
    find_corners(apart);
    for (int t = 0; t < apart->triangle_count; t++) {
        bool limited = is_limited(apart, t);
        if (limited && !framed) {
            find_frames(apart);
            framed = true;
        }
        if (limited || apart->triangles[t].sewn) {
            move_triangle(apart, t, surface);
            moved = true;
        }
    }
    return moved;
}
