/* Forces on many vertices over a flat face at once (rest_batch.h): the same bits as one by one, at every
 * width. */
#include "sim/base/hash.h"
#include "sim/contact/force.h"
#include "sim/contact/rest_batch.h"
#include "tests/support/check.h"

#define BATCHES 2000

static const double dhat = 1e-3, dt = 1.3e-4, share = 0.5, stiffness = 0.3;

static double noise(int batch, int k, int what) {
    return hash_random(11, (uint64_t)((batch * REST_BATCH + k) * 16 + what)) - 0.5;
}

/* near and far, pressed into the steep part, rising and falling, sticking and sliding */
static void make_rows(int batch, RestRows *rows) {
    for (int k = 0; k < REST_BATCH; k++) {
        rows->distance[k] = dhat * (0.6 + 1.2 * noise(batch, k, 0));
        rows->mass[k] = 1e-5 * (1.0 + noise(batch, k, 1));
        for (int a = 0; a < 3; a++) {
            rows->v[a][k] = (k % 3 == 0 ? 1e-3 : 1.0) * noise(batch, k, 2 + a);
            rows->bristle[a][k] = (k % 5 == 0 ? 0.0 : 1e-4) * noise(batch, k, 5 + a);
        }
    }
}

static Vec3 row_vector(double (*rows)[REST_BATCH], int k) {
    return vec3(rows[0][k], rows[1][k], rows[2][k]);
}

/* what happens to the vertices: not at all, pushed in the steep part, let go while it rises, sliding */
enum { FREE, STEEP, LET_GO, SLIDING, CASES };

static void compare(const RestFace *face, int batch, const RestRows *found, int seen[CASES]) {
    RestRows rows;
    Vec3 normal = {face->normal[0], face->normal[1], face->normal[2]};
    make_rows(batch, &rows);
    for (int k = 0; k < REST_BATCH; k++) {
        Vec3 bristle = row_vector(rows.bristle, k), v = row_vector(rows.v, k);
        ContactForce one = contact_solid_force(stiffness, rows.distance[k], dhat, rows.mass[k],
                                               face->friction, normal, v, dt, share, &bristle);
        bool near = rows.distance[k] < dhat;
        Vec3 kept = near ? bristle : vec3(0.0, 0.0, 0.0);
        Vec3 friction = row_vector((double(*)[REST_BATCH])found->friction, k);
        ContactForce many = {.sum = vec3_axpy(friction, found->total[k], normal),
                             .damping = vec3_scale(found->damping[k], normal),
                             .friction = friction,
                             .stiffness = found->stiffness[k],
                             .approach = found->approach[k]};
        assert_memory_equal(&many, &one, sizeof one);
        Vec3 left = row_vector((double(*)[REST_BATCH])found->bristle, k);
        assert_memory_equal(&left, &kept, sizeof kept);
        seen[FREE] += !near;
        seen[STEEP] += rows.distance[k] < CONTACT_LOG_BELOW * dhat;
        seen[LET_GO] += near && found->total[k] == 0.0;
        seen[SLIDING] += near && vec3_length(friction) > 0.999 * face->friction * found->total[k];
    }
}

static void test_same_bits(void **unused) {
    (void)unused;
    RestKernel *kernels[] = {rest_kernel_scalar, rest_kernel_sse2, rest_kernel_avx2,
                             rest_kernel_avx512};
    RestFace face = {{0.6, 0.0, 0.8}, dhat, 0.3, stiffness, dt, share * dt};
    for (VectorWidth width = VECTOR_SCALAR; width < VECTOR_WIDTHS; width++) {
        int seen[CASES] = {0};
        for (int batch = 0; batch < BATCHES && vector_runs_here(width); batch++) {
            RestRows rows;
            make_rows(batch, &rows);
            kernels[width](&face, &rows, REST_BATCH / REST_VECTOR);
            compare(&face, batch, &rows, seen);
        }
        for (int k = 0; k < CASES && vector_runs_here(width); k++) {
            assert_true(seen[k] > BATCHES);
        }
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_same_bits)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
