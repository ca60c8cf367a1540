/* What two triangles leave to the surface drawn over them: see apart.h. */
#include <math.h>

#include "render/apart_parts.h"
#include "sim/geom/closest.h"

#define MARGIN 0.9     /* of the bounds: rounding, and what they leave out, has the rest */
#define GENTLE 0.02    /* slope that no fan of triangles contact lets be is sharp enough for */
#define TOUCHING 1e-12 /* sine, or part of a length: nearer triangles are drawn as they are */

static void lower(ApartTriangle *triangle, double most) {
    triangle->most = min2(triangle->most, max2(most, 0.0));
}

double apart_share(double loss) { return loss > MARGIN ? MARGIN / loss : 1.0; }

static double square_between(const float *from, const float *to) {
    double x = (double)to[0] - (double)from[0], y = (double)to[1] - (double)from[1];
    double z = (double)to[2] - (double)from[2];
    return x * x + y * y + z * z;
}

double apart_slope(const Apart *apart, int t) {
    const ApartTriangle *triangle = &apart->triangles[t];
    const float *e = apart_leaves(apart, t);
    int n = apart->pieces[t].level;
    double first = 0.0, second = 0.0; /* squares of steps along both sides */
    for (int j = 0; j < n; j++, e += 3) {
        const float *above = e + 3 * (n + 1 - j);
        for (int i = 0; i + j < n; i++, e += 3, above += 3) {
            first = max2(first, square_between(e, e + 3));
            second = max2(second, square_between(e, above));
        }
    }
    Vec3 p = vec3_sub(triangle->corner[1], triangle->corner[0]);
    Vec3 q = vec3_sub(triangle->corner[2], triangle->corner[0]);
    Vec3 r = vec3_sub(q, p), area = vec3_cross(p, q);
    double pp = vec3_dot(p, p), qq = vec3_dot(q, q), pq = fabs(vec3_dot(p, q));
    double det = vec3_dot(area, area), longest = max2(max2(pp, qq), vec3_dot(r, r));
    if (det <= TOUCHING * longest * longest) {
        return triangle->reach > 0.0 ? INFINITY : 0.0;
    }
    double trace = qq * first + 2.0 * pq * sqrt(first * second) + pp * second;
    return n * sqrt(trace / det) + triangle->reach * sqrt(longest / det);
}

/* ---- seen along a direction ---- */

/* A triangle on the plane across a direction: columns of the inverse of its sides [1/m]. */
typedef struct Flat {
    Vec3 x, y; /* unit axes of the plane */
    double inverse[2][2];
    double altitude; /* [m] smallest; 0: seen edge-on */
} Flat;

static Flat flatten(const ApartTriangle *triangle, Vec3 off) {
    Flat flat = {.altitude = 0.0};
    Vec3 other = fabs(off.x) < 0.6 ? vec3(1, 0, 0) : vec3(0, 1, 0);
    flat.x = vec3_unit(vec3_cross(off, other), vec3(0, 0, 0));
    flat.y = vec3_cross(off, flat.x);
    Vec3 p = vec3_sub(triangle->corner[1], triangle->corner[0]);
    Vec3 q = vec3_sub(triangle->corner[2], triangle->corner[0]);
    double p0 = vec3_dot(p, flat.x), p1 = vec3_dot(p, flat.y);
    double q0 = vec3_dot(q, flat.x), q1 = vec3_dot(q, flat.y), det = p0 * q1 - p1 * q0;
    double longest = max2(max2(p0 * p0 + p1 * p1, q0 * q0 + q1 * q1),
                          (q0 - p0) * (q0 - p0) + (q1 - p1) * (q1 - p1));
    if (fabs(det) > TOUCHING * longest) {
        flat.altitude = fabs(det) / sqrt(longest);
        flat.inverse[0][0] = q1 / det, flat.inverse[0][1] = -q0 / det;
        flat.inverse[1][0] = -p1 / det, flat.inverse[1][1] = p0 / det;
    }
    return flat;
}

static void seen(const Flat *flat, const float *from, const float *to, double d[2]) {
    double x = (double)to[0] - (double)from[0], y = (double)to[1] - (double)from[1];
    double z = (double)to[2] - (double)from[2];
    d[0] = x * flat->x.x + y * flat->x.y + z * flat->x.z;
    d[1] = x * flat->y.x + y * flat->y.y + z * flat->y.z;
}

/* Takes in the gradient of e on a drawn triangle. */
static void add_strain(const Flat *flat, const float *base, const float *one, const float *two,
                       ApartStrain *strain) {
    double a[2], b[2];
    seen(flat, base, one, a);
    seen(flat, base, two, b);
    double j00 = a[0] * flat->inverse[0][0] + b[0] * flat->inverse[1][0];
    double j01 = a[0] * flat->inverse[0][1] + b[0] * flat->inverse[1][1];
    double j10 = a[1] * flat->inverse[0][0] + b[1] * flat->inverse[1][0];
    double j11 = a[1] * flat->inverse[0][1] + b[1] * flat->inverse[1][1];
    double half = 0.5 * (j00 - j11), shear = 0.5 * (j01 + j10);
    strain->loss = max2(strain->loss, sqrt(half * half + shear * shear) - 0.5 * (j00 + j11));
    strain->size = max2(strain->size, sqrt(j00 * j00 + j01 * j01 + j10 * j10 + j11 * j11));
}

/* Corners may have different g: d(g e) = g de + e dg, and |dg/ds| <= g / altitude. */
ApartStrain apart_strain(const Apart *apart, int t, Vec3 off) {
    static const float zero[3] = {0, 0, 0};
    Flat flat = flatten(&apart->triangles[t], off);
    const float *e = apart_leaves(apart, t);
    int n = apart->pieces[t].level;
    ApartStrain strain = {0.0, 0.0};
    double reach = 0.0;
    if (apart->triangles[t].reach == 0.0 || flat.altitude == 0.0) {
        return apart->triangles[t].reach == 0.0 ? strain : (ApartStrain){INFINITY, INFINITY};
    }
    for (int j = 0; j < n; j++, e += 3) {
        const float *above = e + 3 * (n + 1 - j);
        for (int i = 0; i + j < n; i++, e += 3, above += 3) {
            double d[2];
            add_strain(&flat, e, e + 3, above, &strain);
            if (i + j + 1 < n) {
                add_strain(&flat, above + 3, above, e + 3, &strain);
            }
            seen(&flat, zero, e, d);
            reach = max2(reach, d[0] * d[0] + d[1] * d[1]);
        }
    }
    double more = sqrt(reach) / flat.altitude;
    return (ApartStrain){n * strain.loss + more, n * strain.size + more};
}

/* g that lets the drawn vertices of a triangle get `room` [m] beyond `base` along `out`. */
static double share_of_plane(const Apart *apart, int t, Vec3 out, Vec3 base, double room) {
    const ApartTriangle *triangle = &apart->triangles[t];
    const float *e = apart_leaves(apart, t);
    int n = apart->pieces[t].level;
    double along[3], inverse = 1.0 / max2(n, 1), most = 1.0;
    if (triangle->reach == 0.0) {
        return 1.0;
    }
    for (int k = 0; k < 3; k++) {
        along[k] = min2(vec3_dot(out, vec3_sub(triangle->corner[k], base)), room);
    }
    for (int j = 0; j <= n; j++) {
        for (int i = 0; i + j <= n; i++, e += 3) {
            double step = out.x * (double)e[0] + out.y * (double)e[1] + out.z * (double)e[2];
            double at = inverse * ((n - i - j) * along[0] + i * along[1] + j * along[2]);
            double free = MARGIN * (room - at);
            most = step > 0.0 && most * step > free ? free / step : most;
        }
    }
    return most;
}

/* [m] how far the smooth surface over a triangle comes beyond `base` along `out`; 0: nowhere. */
static double find_need(const Apart *apart, int t, Vec3 out, Vec3 base) {
    const ApartTriangle *triangle = &apart->triangles[t];
    const float *e = apart_leaves(apart, t);
    int n = apart->pieces[t].level;
    double along[3], inverse = 1.0 / max2(n, 1), most = 0.0;
    for (int k = 0; k < 3; k++) {
        along[k] = vec3_dot(out, vec3_sub(triangle->corner[k], base));
    }
    for (int j = 0; j <= n && triangle->reach > 0.0; j++) {
        for (int i = 0; i + j <= n; i++, e += 3) {
            double step = out.x * (double)e[0] + out.y * (double)e[1] + out.z * (double)e[2];
            double at = inverse * ((n - i - j) * along[0] + i * along[1] + j * along[2]);
            most = max2(most, at + step);
        }
    }
    return most;
}

/* ---- no common corner ---- */

typedef struct Way {
    Vec3 from, to;
    double square; /* [m2] */
} Way;

static void shorten(Way *way, Vec3 from, Vec3 to) {
    Vec3 d = vec3_sub(to, from);
    double square = vec3_dot(d, d);
    if (square < way->square) {
        *way = (Way){from, to, square};
    }
}

/* The shortest way from a to b, which do not cross. */
static Way find_way(const ApartTriangle *a, const ApartTriangle *b) {
    Way way = {.square = INFINITY};
    const Vec3 *p = a->corner, *q = b->corner;
    for (int k = 0; k < 3; k++) {
        double w[3];
        closest_on_triangle(p[k], q[0], q[1], q[2], w);
        shorten(&way, p[k], vec3_axpy(vec3_axpy(vec3_scale(w[0], q[0]), w[1], q[1]), w[2], q[2]));
        closest_on_triangle(q[k], p[0], p[1], p[2], w);
        shorten(&way, vec3_axpy(vec3_axpy(vec3_scale(w[0], p[0]), w[1], p[1]), w[2], p[2]), q[k]);
        for (int m = 0; m < 3; m++) {
            Vec3 p1 = p[(k + 1) % 3], q1 = q[(m + 1) % 3];
            double u, v, sine2;
            closest_on_segments(p[k], p1, q[m], q1, &u, &v, &sine2);
            shorten(&way, vec3_axpy(p[k], u, vec3_sub(p1, p[k])),
                    vec3_axpy(q[m], v, vec3_sub(q1, q[m])));
        }
    }
    return way;
}

/* Is all that may be drawn over b on one side of all that may be drawn over a? */
static bool is_beyond(const ApartTriangle *a, const ApartTriangle *b) {
    double side[3];
    for (int k = 0; k < 3; k++) {
        side[k] = vec3_dot(a->normal, vec3_sub(b->corner[k], a->corner[0]));
    }
    return min2(side[0], min2(side[1], side[2])) > a->rise + b->reach ||
           max2(side[0], max2(side[1], side[2])) < -a->fall - b->reach;
}

/* Are they farther than `reach` from each other along the line between their middles? */
static bool are_far(const ApartTriangle *a, const ApartTriangle *b, double reach) {
    const Vec3 *p = a->corner, *q = b->corner;
    Vec3 way = vec3_sub(vec3_add(vec3_add(q[0], q[1]), q[2]), vec3_add(vec3_add(p[0], p[1]), p[2]));
    double one = max2(vec3_dot(way, p[0]), max2(vec3_dot(way, p[1]), vec3_dot(way, p[2])));
    double two = min2(vec3_dot(way, q[0]), min2(vec3_dot(way, q[1]), vec3_dot(way, q[2])));
    double gap = max2(two - one, 0.0);
    return gap * gap > reach * reach * vec3_dot(way, way);
}

static void limit_apart(Apart *apart, int i, int j) {
    ApartTriangle *a = &apart->triangles[i], *b = &apart->triangles[j];
    double reach = a->reach + b->reach;
    if ((a->most <= 0.0 && b->most <= 0.0) || reach == 0.0 || are_far(a, b, reach) ||
        is_beyond(a, b) || is_beyond(b, a)) {
        return;
    }
    Way way = find_way(a, b);
    double length = sqrt(way.square);
    if (length > reach) {
        return;
    }
    Vec3 out = vec3_unit(vec3_sub(way.to, way.from), vec3(0, 0, 0));
    Vec3 back = vec3_scale(-1.0, out);
    double need = find_need(apart, i, out, way.from), other = find_need(apart, j, back, way.to);
    if (need + other > MARGIN * length) {
        double room = length * need / (need + other);
        lower(a, share_of_plane(apart, i, out, way.from, room));
        lower(b, share_of_plane(apart, j, back, way.to, length - room));
    }
}

/* ---- a common corner ---- */

typedef struct Rays {
    Vec3 a, b; /* unit */
    double cosine;
} Rays;

static void narrow(Rays *rays, Vec3 a, Vec3 b) {
    double cosine = vec3_dot(a, b);
    if (cosine > rays->cosine) {
        *rays = (Rays){a, b, cosine};
    }
}

/* Where ray r is nearest to the inside of the sector from s to t; false: at its border. */
static bool project_ray(Vec3 r, Vec3 s, Vec3 t, Vec3 *foot) {
    Vec3 normal = vec3_unit(vec3_cross(s, t), vec3(0, 0, 0));
    *foot = vec3_unit(vec3_axpy(r, -vec3_dot(r, normal), normal), s);
    return vec3_dot(vec3_cross(s, *foot), normal) > 0.0 &&
           vec3_dot(vec3_cross(*foot, t), normal) > 0.0;
}

/* The two nearest rays out of the common corner, one in each triangle. */
static Rays find_rays(const ApartTriangle *a, int ka, const ApartTriangle *b, int kb) {
    Rays rays = {.cosine = -2.0};
    Vec3 p[2], q[2], foot;
    for (int m = 0; m < 2; m++) {
        p[m] = vec3_unit(vec3_sub(a->corner[(ka + 1 + m) % 3], a->corner[ka]), vec3(0, 0, 0));
        q[m] = vec3_unit(vec3_sub(b->corner[(kb + 1 + m) % 3], b->corner[kb]), vec3(0, 0, 0));
    }
    for (int m = 0; m < 2; m++) {
        narrow(&rays, p[m], q[0]);
        narrow(&rays, p[m], q[1]);
        if (project_ray(p[m], q[0], q[1], &foot)) {
            narrow(&rays, p[m], foot);
        }
        if (project_ray(q[m], p[0], p[1], &foot)) {
            narrow(&rays, foot, q[m]);
        }
    }
    return rays;
}

/* The same seen along the middle of both normals, where slopes are less. */
static double share_of_fan(const Apart *apart, int i, int ki, int j, int kj) {
    ApartTriangle a = apart->triangles[i], b = apart->triangles[j];
    Vec3 off = vec3_unit(vec3_add(a.normal, b.normal), vec3(0, 0, 0));
    if (vec3_dot(a.normal, b.normal) <= 0.0) {
        return 0.0;
    }
    for (int k = 0; k < 3; k++) {
        a.corner[k] = vec3_axpy(a.corner[k], -vec3_dot(off, a.corner[k]), off);
        b.corner[k] = vec3_axpy(b.corner[k], -vec3_dot(off, b.corner[k]), off);
    }
    Rays rays = find_rays(&a, ki, &b, kj);
    double sine = sqrt(max2(0.5 * (1.0 - rays.cosine), 0.0));
    double size = max2(apart_strain(apart, i, off).size, apart_strain(apart, j, off).size);
    return size > 0.0 ? MARGIN * sine / size : 1.0;
}

static void limit_fan(Apart *apart, int i, int ki, int j, int kj) {
    ApartTriangle *a = &apart->triangles[i], *b = &apart->triangles[j];
    double slope = max2(a->slope, b->slope);
    if (slope < GENTLE) {
        return;
    }
    Rays rays = find_rays(a, ki, b, kj);
    double sine = sqrt(max2(0.5 * (1.0 - rays.cosine), 0.0)); /* of half their angle */
    if (slope <= MARGIN * sine) {
        return;
    }
    Vec3 out = vec3_unit(vec3_sub(rays.b, rays.a), vec3(0, 0, 0));
    double one = share_of_plane(apart, i, out, a->corner[ki], 0.0);
    double two = share_of_plane(apart, j, vec3_scale(-1.0, out), b->corner[kj], 0.0);
    double both =
        MARGIN * sine / slope; /* places r1, r2 from the corner are sine (r1 + r2) apart */
    if (min2(one, two) < 1.0) {
        both = max2(both, share_of_fan(apart, i, ki, j, kj));
    }
    bool plane = min2(one, two) > both;
    lower(a, plane ? one : both);
    lower(b, plane ? two : both);
}

/* ---- a common edge ---- */

static void limit_fold(Apart *apart, int i, int j) {
    ApartTriangle *a = &apart->triangles[i], *b = &apart->triangles[j];
    double half = sqrt(max2(0.5 * (1.0 + vec3_dot(a->normal, b->normal)), 0.0)); /* cos(f/2) */
    if (max2(a->slope, b->slope) <= MARGIN * half) {
        return;
    }
    Vec3 middle = vec3_unit(vec3_add(a->normal, b->normal), vec3(0, 0, 0));
    double share =
        apart_share(max2(apart_strain(apart, i, middle).loss, apart_strain(apart, j, middle).loss));
    lower(a, share);
    lower(b, share);
}

void apart_limit(Apart *apart, int a, int b) {
    const int32_t *p = apart->pieces[a].corner, *q = apart->pieces[b].corner;
    int shared = 0, ka = 0, kb = 0;
    for (int k = 0; k < 3; k++) {
        for (int m = 0; m < 3; m++) {
            if (apart->join[p[k]] == apart->join[q[m]]) {
                shared++;
                ka = k, kb = m;
            }
        }
    }
    if (shared == 0) {
        limit_apart(apart, a, b);
    } else if (shared == 1) {
        limit_fan(apart, a, ka, b, kb);
    } else {
        limit_fold(apart, a, b);
    }
}
