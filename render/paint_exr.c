/* The picture of a linear painter, and what its G-buffer says, as numbers. */
#include <math.h>
#include <stdlib.h>

#include "render/passes.h"
#include "sim/base/memory.h"

/* A normal from its word (common.glsl: octahedral_decode). */
static Vec3 normal_of(uint32_t word) {
    double x = fmax((int16_t)(word & 0xffff) / 32767.0, -1.0);
    double y = fmax((int16_t)(word >> 16) / 32767.0, -1.0);
    double z = 1.0 - fabs(x) - fabs(y), fold = fmax(-z, 0.0);
    x += x >= 0.0 ? -fold : fold;
    y += y >= 0.0 ? -fold : fold;
    return vec3_unit(vec3(x, y, z), vec3(0, 0, 1));
}

static void set_pixel(const Painter *painter, const uint32_t word[4], int id, size_t at,
                      ExrPicture *picture) {
    const Camera *camera = &painter->stage.camera;
    const float *depth = painter->stage.block.depth;
    union {
        uint32_t bits;
        float number;
    } window = {word[1]};
    Vec3 n = normal_of(word[0]);
    picture->id[at] = (uint32_t)id;
    picture->depth[at] =
        (depth[0] + depth[1] * window.number) / (depth[2] + depth[3] * window.number);
    picture->normal[3 * at] = (float)vec3_dot(n, camera->right);
    picture->normal[3 * at + 1] = (float)vec3_dot(n, camera->up);
    picture->normal[3 * at + 2] = (float)-vec3_dot(n, camera->forward);
    if (id <= painter->def.cloth_count && painter->looks[id - 1]->quantity == QUANTITY_NONE) {
        const float steps = 2097151.0f; /* UV_STEPS of common.glsl */
        picture->uv[2 * at] = (float)(word[2] >> 11) / steps;
        picture->uv[2 * at + 1] = (float)(word[3] >> 11) / steps;
    }
}

void paint_read_exr(Painter *painter, ExrPicture *picture) {
    const Targets *t = &painter->targets;
    int width = t->full.width, height = t->full.height, samples = painter->def.quality->samples;
    size_t count = (size_t)t->layer.width * (size_t)t->layer.height;
    ASSERT(painter->def.linear && picture->width == width && picture->height == height);
    uint32_t *words = memory_new(4 * sizeof *words * count);
    uint8_t *things = memory_new(count);
    gl.BindFramebuffer(GL_FRAMEBUFFER, t->picture_target);
    gl.ReadPixels(0, 0, width, height, GL_RGBA, GL_FLOAT, picture->rgba);
    gl.BindFramebuffer(GL_FRAMEBUFFER, t->words_target);
    gl.ReadPixels(0, 0, t->layer.width, t->layer.height, GL_RGBA_INTEGER, GL_UNSIGNED_INT, words);
    gl.ReadPixels(0, 0, t->layer.width, t->layer.height, GL_STENCIL_INDEX, GL_UNSIGNED_BYTE,
                  things);
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            size_t at = (size_t)y * (size_t)width + (size_t)x; /* the layer's rows go up */
            size_t from = (size_t)(height - 1 - y) * (size_t)samples * (size_t)t->layer.width +
                          (size_t)x * (size_t)samples;
            int id = things[from] & STENCIL_THING;
            picture->depth[at] = EXR_NOTHING;
            picture->id[at] = 0;
            for (int k = 0; k < 3; k++) {
                picture->normal[3 * at + (size_t)k] = 0.0f;
                picture->uv[2 * at + (size_t)(k % 2)] = 0.0f;
                picture->motion[2 * at + (size_t)(k % 2)] = 0.0f;
            }
            if (id > 0) {
                set_pixel(painter, words + 4 * from, id, at, picture);
            }
        }
    }
    free(words);
    free(things);
}
