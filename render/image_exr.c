#include "render/image_exr.h"

#include <OpenEXR/openexr.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/memory.h"

ExrPicture exr_create(int width, int height) {
    size_t count = (size_t)width * (size_t)height;
    ExrPicture picture = {.width = width,
                          .height = height,
                          .rgba = memory_zeroed(4 * count, sizeof(float)),
                          .depth = memory_zeroed(count, sizeof(float)),
                          .normal = memory_zeroed(3 * count, sizeof(float)),
                          .motion = memory_zeroed(2 * count, sizeof(float)),
                          .uv = memory_zeroed(2 * count, sizeof(float)),
                          .id = memory_zeroed(count, sizeof(uint32_t))};
    return picture;
}

void exr_free(ExrPicture *picture) {
    free(picture->rgba);
    free(picture->depth);
    free(picture->normal);
    free(picture->motion);
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

#define PLANES 13

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
        {"motion.x", p->motion, 2, EXR_PIXEL_FLOAT, false},
        {"motion.y", p->motion + 1, 2, EXR_PIXEL_FLOAT, false},
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

/* ---- reading, to compare ---- */

#define MOST_SIDE 65536 /* [px] larger files only eat memory */

typedef struct Reader {
    exr_context_t file;
    int width, height;
    const exr_attr_chlist_t *channels;
} Reader;

static bool open_reader(Reader *reader, const char *path) {
    exr_context_initializer_t init = initializer();
    exr_storage_t storage;
    exr_attr_box2i_t window;
    *reader = (Reader){0};
    if (exr_start_read(&reader->file, path, &init) != EXR_ERR_SUCCESS ||
        exr_get_storage(reader->file, 0, &storage) != EXR_ERR_SUCCESS ||
        storage != EXR_STORAGE_SCANLINE ||
        exr_get_data_window(reader->file, 0, &window) != EXR_ERR_SUCCESS ||
        exr_get_channels(reader->file, 0, &reader->channels) != EXR_ERR_SUCCESS) {
        return false;
    }
    for (int i = 0; i < reader->channels->num_channels; i++) {
        const exr_attr_chlist_entry_t *channel = &reader->channels->entries[i];
        if (channel->x_sampling != 1 || channel->y_sampling != 1) {
            return false; /* colour at half resolution: other programs' */
        }
    }
    reader->width = window.max.x - window.min.x + 1;
    reader->height = window.max.y - window.min.y + 1;
    return reader->width > 0 && reader->height > 0 && reader->width <= MOST_SIDE &&
           reader->height <= MOST_SIDE;
}

static void aim(exr_decode_pipeline_t *decoder, const char *name, const Reader *reader, int row,
                float *values) {
    for (int c = 0; c < decoder->channel_count; c++) {
        exr_coding_channel_info_t *channel = &decoder->channels[c];
        bool wanted = strcmp(channel->channel_name, name) == 0;
        channel->decode_to_ptr =
            wanted ? (uint8_t *)(values + (size_t)row * (size_t)reader->width) : NULL;
        channel->user_pixel_stride = 4;
        channel->user_line_stride = 4 * reader->width;
        channel->user_bytes_per_element = 4;
        channel->user_data_type = EXR_PIXEL_FLOAT;
    }
}

/* One channel as floats (height x width). */
static bool read_channel(const Reader *reader, const char *name, float *values) {
    exr_decode_pipeline_t decoder = EXR_DECODE_PIPELINE_INITIALIZER;
    exr_attr_box2i_t window;
    int32_t step = 0;
    exr_result_t code = exr_get_scanlines_per_chunk(reader->file, 0, &step);
    code = code == EXR_ERR_SUCCESS ? exr_get_data_window(reader->file, 0, &window) : code;
    for (int row = 0; code == EXR_ERR_SUCCESS && step > 0 && row < reader->height; row += step) {
        exr_chunk_info_t chunk;
        code = exr_read_scanline_chunk_info(reader->file, 0, window.min.y + row, &chunk);
        if (code == EXR_ERR_SUCCESS) {
            code = row == 0 ? exr_decoding_initialize(reader->file, 0, &chunk, &decoder)
                            : exr_decoding_update(reader->file, 0, &chunk, &decoder);
        }
        if (code == EXR_ERR_SUCCESS) {
            aim(&decoder, name, reader, row, values);
            code = row == 0 ? exr_decoding_choose_default_routines(reader->file, 0, &decoder)
                            : EXR_ERR_SUCCESS;
        }
        code = code == EXR_ERR_SUCCESS ? exr_decoding_run(reader->file, 0, &decoder) : code;
    }
    exr_decoding_destroy(reader->file, &decoder);
    return code == EXR_ERR_SUCCESS && step > 0;
}

static bool same_shape(const Reader *a, const Reader *b) {
    bool same = a->width == b->width && a->height == b->height &&
                a->channels->num_channels == b->channels->num_channels;
    for (int i = 0; same && i < a->channels->num_channels; i++) {
        const exr_attr_chlist_entry_t *p = &a->channels->entries[i], *q = &b->channels->entries[i];
        same = strcmp(p->name.str, q->name.str) == 0;
    }
    return same;
}

static double difference(float a, float b) {
    if (a == b || (isnan(a) && isnan(b))) {
        return 0.0;
    }
    return isfinite(a) && isfinite(b) ? fabs((double)a - (double)b) : INFINITY;
}

static bool compare_channels(const Reader *a, const Reader *b, double *largest) {
    size_t count = (size_t)a->width * (size_t)a->height;
    float *of_a = memory_zeroed(count, sizeof *of_a), *of_b = memory_zeroed(count, sizeof *of_b);
    bool good = of_a && of_b;
    *largest = 0.0;
    for (int c = 0; good && c < a->channels->num_channels; c++) {
        const char *name = a->channels->entries[c].name.str;
        good = read_channel(a, name, of_a) && read_channel(b, name, of_b);
        for (size_t i = 0; good && i < count; i++) {
            *largest = fmax(*largest, difference(of_a[i], of_b[i]));
        }
    }
    free(of_a);
    free(of_b);
    return good;
}

bool exr_compare(const char *path_a, const char *path_b, double *largest) {
    Reader a, b = {0};
    bool good = open_reader(&a, path_a) && open_reader(&b, path_b);
    if (good && !same_shape(&a, &b)) {
        *largest = INFINITY;
    } else if (good) {
        good = compare_channels(&a, &b, largest);
    }
    if (a.file) {
        exr_finish(&a.file);
    }
    if (b.file) {
        exr_finish(&b.file);
    }
    return good;
}

void exr_print_versions(FILE *out) {
    int major, minor, patch;
    const char *extra;
    exr_get_library_version(&major, &minor, &patch, &extra);
    fprintf(out, "OpenEXR %d.%d.%d\n", major, minor, patch);
}
