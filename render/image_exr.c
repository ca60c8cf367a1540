#include "render/image_exr.h"

#include <OpenEXR/openexr.h>
#include <stdlib.h>
#include <string.h>

ExrPicture exr_create(int width, int height) {
    size_t count = (size_t)width * (size_t)height;
    ExrPicture picture = {.width = width,
                          .height = height,
                          .rgba = calloc(4 * count, sizeof(float)),
                          .depth = calloc(count, sizeof(float)),
                          .normal = calloc(3 * count, sizeof(float)),
                          .uv = calloc(2 * count, sizeof(float)),
                          .id = calloc(count, sizeof(uint32_t))};
    ASSERT(picture.rgba && picture.depth && picture.normal && picture.uv && picture.id);
    return picture;
}

void exr_free(ExrPicture *picture) {
    free(picture->rgba);
    free(picture->depth);
    free(picture->normal);
    free(picture->uv);
    free(picture->id);
    *picture = (ExrPicture){0};
}

/* One channel: where its first number is, and how many bytes later the next pixel's. */
typedef struct Plane {
    const char *name;
    const void *first;
    int components; /* of the array that it stands in */
    exr_pixel_type_t stored;
    bool whole; /* uint32_t instead of float */
} Plane;

#define PLANES 11

static void list_planes(const ExrPicture *p, Plane planes[PLANES]) {
    const Plane all[PLANES] = {
        {"A", p->rgba + 3, 4, EXR_PIXEL_HALF, false},
        {"B", p->rgba + 2, 4, EXR_PIXEL_HALF, false},
        {"G", p->rgba + 1, 4, EXR_PIXEL_HALF, false},
        {"N.X", p->normal, 3, EXR_PIXEL_HALF, false},
        {"N.Y", p->normal + 1, 3, EXR_PIXEL_HALF, false},
        {"N.Z", p->normal + 2, 3, EXR_PIXEL_HALF, false},
        {"R", p->rgba, 4, EXR_PIXEL_HALF, false},
        {"Z", p->depth, 1, EXR_PIXEL_FLOAT, false},
        {"id", p->id, 1, EXR_PIXEL_UINT, true},
        {"uv.u", p->uv, 2, EXR_PIXEL_FLOAT, false},
        {"uv.v", p->uv + 1, 2, EXR_PIXEL_FLOAT, false},
    };
    memcpy(planes, all, sizeof all);
}

static void keep_quiet(exr_const_context_t context, exr_result_t code, const char *text) {
    (void)context, (void)code, (void)text;
}

static exr_context_initializer_t initializer(void) {
    exr_context_initializer_t init = EXR_DEFAULT_CONTEXT_INITIALIZER;
    init.error_handler_fn = keep_quiet;
    return init;
}

static exr_result_t write_header(exr_context_t file, const ExrPicture *picture,
                                 const Plane planes[PLANES], const ImageText *texts, int count) {
    int part;
    exr_result_t code = exr_add_part(file, "toile", EXR_STORAGE_SCANLINE, &part);
    if (code == EXR_ERR_SUCCESS) {
        code = exr_initialize_required_attr_simple(file, 0, picture->width, picture->height,
                                                   EXR_COMPRESSION_ZIP);
    }
    for (int i = 0; code == EXR_ERR_SUCCESS && i < PLANES; i++) {
        code = exr_add_channel(file, 0, planes[i].name, planes[i].stored, EXR_PERCEPTUALLY_LINEAR,
                               1, 1);
    }
    for (int i = 0; code == EXR_ERR_SUCCESS && i < count; i++) {
        code = exr_attr_set_string(file, 0, texts[i].key, texts[i].value);
    }
    return code == EXR_ERR_SUCCESS ? exr_write_header(file) : code;
}

/* Points the encoder at rows from y on. */
static void point_at(exr_encode_pipeline_t *encoder, const ExrPicture *picture,
                     const Plane planes[PLANES], int y) {
    for (int c = 0; c < encoder->channel_count; c++) {
        exr_coding_channel_info_t *channel = &encoder->channels[c];
        for (int i = 0; i < PLANES; i++) {
            const Plane *plane = &planes[i];
            if (strcmp(channel->channel_name, plane->name) == 0) {
                int bytes = 4 * plane->components;
                channel->user_bytes_per_element = 4;
                channel->user_data_type =
                    (uint16_t)(plane->whole ? EXR_PIXEL_UINT : EXR_PIXEL_FLOAT);
                channel->user_pixel_stride = bytes;
                channel->user_line_stride = bytes * picture->width;
                channel->encode_from_ptr =
                    (const uint8_t *)plane->first + (size_t)y * (size_t)channel->user_line_stride;
            }
        }
    }
}

static exr_result_t write_rows(exr_context_t file, const ExrPicture *picture,
                               const Plane planes[PLANES]) {
    exr_encode_pipeline_t encoder = EXR_ENCODE_PIPELINE_INITIALIZER;
    int32_t step = 0;
    exr_result_t code = exr_get_scanlines_per_chunk(file, 0, &step);
    for (int y = 0; code == EXR_ERR_SUCCESS && y < picture->height; y += step) {
        exr_chunk_info_t chunk;
        code = exr_write_scanline_chunk_info(file, 0, y, &chunk);
        if (code == EXR_ERR_SUCCESS) {
            code = y == 0 ? exr_encoding_initialize(file, 0, &chunk, &encoder)
                          : exr_encoding_update(file, 0, &chunk, &encoder);
        }
        if (code == EXR_ERR_SUCCESS) {
            point_at(&encoder, picture, planes, y);
            code =
                y == 0 ? exr_encoding_choose_default_routines(file, 0, &encoder) : EXR_ERR_SUCCESS;
        }
        code = code == EXR_ERR_SUCCESS ? exr_encoding_run(file, 0, &encoder) : code;
    }
    exr_encoding_destroy(file, &encoder);
    return code;
}

bool exr_write(const char *path, const ExrPicture *picture, const ImageText *texts, int text_count,
               Error *error) {
    Plane planes[PLANES];
    exr_context_t file = NULL;
    exr_context_initializer_t init = initializer();
    list_planes(picture, planes);
    exr_result_t code = exr_start_write(&file, path, EXR_WRITE_FILE_DIRECTLY, &init);
    if (code == EXR_ERR_SUCCESS) {
        exr_set_longname_support(file, 1);
        code = write_header(file, picture, planes, texts, text_count);
    }
    code = code == EXR_ERR_SUCCESS ? write_rows(file, picture, planes) : code;
    exr_result_t closed = file ? exr_finish(&file) : EXR_ERR_SUCCESS;
    code = code == EXR_ERR_SUCCESS ? closed : code;
    return code == EXR_ERR_SUCCESS || error_set(error, EXIT_IO, "%s could not be written: %s", path,
                                                exr_get_error_code_as_string(code));
}

bool exr_read_text(const char *path, const char *key, char *text, int size) {
    exr_context_t file = NULL;
    exr_context_initializer_t init = initializer();
    const char *value = NULL;
    int32_t length = 0;
    bool good = exr_start_read(&file, path, &init) == EXR_ERR_SUCCESS &&
                exr_attr_get_string(file, 0, key, &length, &value) == EXR_ERR_SUCCESS && value &&
                length < size;
    if (good) {
        memcpy(text, value, (size_t)length);
        text[length] = '\0';
    }
    if (file) {
        exr_finish(&file);
    }
    return good;
}

void exr_print_versions(FILE *out) {
    int major, minor, patch;
    const char *extra;
    exr_get_library_version(&major, &minor, &patch, &extra);
    fprintf(out, "OpenEXR %d.%d.%d\n", major, minor, patch);
}
