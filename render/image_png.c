/* PNG through libpng. */
#include <errno.h>
#include <png.h>
#include <stdlib.h>
#include <string.h>

#include "render/image.h"
#include "sim/base/memory.h"

#define COMPRESSION_LEVEL 1 /* zlib: 7 times faster than the default, 15 % larger */
#define LARGEST_SIDE 32768  /* [px] of a picture that is read */
#define MOST_PIXELS 200000000

typedef struct PngWriter {
    FILE *file;
    png_structp png;
    png_infop info;
    uint8_t *row;
} PngWriter;

static void set_texts(PngWriter *writer, const ImageText *texts, int count) {
    for (int i = 0; i < count; i++) {
        png_text text = {0};
        text.compression = PNG_TEXT_COMPRESSION_NONE;
        text.key = (png_charp)texts[i].key;
        text.text = (png_charp)texts[i].value;
        png_set_text(writer->png, writer->info, &text, 1);
    }
}

/* False when libpng gives up; it jumps back here. */
static bool write_rows(PngWriter *writer, const Image *image, const ImageText *texts, int count) {
    if (setjmp(png_jmpbuf(writer->png))) {
        return false;
    }
    png_structp png = writer->png;
    png_init_io(png, writer->file);
    png_set_IHDR(png, writer->info, (png_uint_32)image->width, (png_uint_32)image->height, 8,
                 image->clear ? PNG_COLOR_TYPE_RGBA : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB(png, writer->info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_set_compression_level(png, COMPRESSION_LEVEL);
    png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
    set_texts(writer, texts, count);
    png_write_info(png, writer->info);
    for (int y = 0; y < image->height; y++) {
        const uint8_t *from = image->rgba + (size_t)y * image->width * IMAGE_CHANNELS;
        size_t channels = image->clear ? IMAGE_CHANNELS : 3;
        for (size_t x = 0; x < (size_t)image->width; x++) {
            memcpy(writer->row + channels * x, from + IMAGE_CHANNELS * x, channels);
        }
        png_write_row(png, writer->row);
    }
    png_write_end(png, writer->info);
    return true;
}

bool image_put_png(FILE *out, const Image *image, const ImageText *texts, int text_count) {
    PngWriter writer = {.file = out};
    writer.png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    writer.info = writer.png ? png_create_info_struct(writer.png) : NULL;
    writer.row = memory_new(IMAGE_CHANNELS * (size_t)image->width);
    ASSERT(writer.info);
    bool good = write_rows(&writer, image, texts, text_count);
    png_destroy_write_struct(&writer.png, &writer.info);
    free(writer.row);
    return good;
}

bool image_write_png(const char *path, const Image *image, const ImageText *texts, int text_count,
                     Error *error) {
    FILE *file = fopen(path, "wb");
    if (!file) {
        return error_set_errno(error, EXIT_IO, "%s", path);
    }
    bool good = image_put_png(file, image, texts, text_count);
    errno = good ? 0 : errno;
    if (fclose(file) != 0 || !good) {
        return error_set_errno(error, EXIT_IO, "%s could not be written", path);
    }
    return true;
}

typedef struct PngReader {
    FILE *file;
    png_structp png;
    png_infop info;
    png_bytep *rows;
    char message[128];
} PngReader;

static void keep_message(png_structp png, png_const_charp message) {
    PngReader *reader = png_get_error_ptr(png);
    snprintf(reader->message, sizeof reader->message, "%s", message);
    png_longjmp(png, 1);
}

static void ignore_warning(png_structp png, png_const_charp message) {
    (void)png;
    (void)message;
}

static bool read_rows(PngReader *reader, Image *image) {
    if (setjmp(png_jmpbuf(reader->png))) {
        return false;
    }
    png_structp png = reader->png;
    png_init_io(png, reader->file);
    png_set_user_limits(png, LARGEST_SIDE, LARGEST_SIDE);
    png_read_info(png, reader->info);
    png_set_expand(png);
    png_set_scale_16(png);
    png_set_gray_to_rgb(png);
    png_set_add_alpha(png, 0xff, PNG_FILLER_AFTER);
    png_set_interlace_handling(png);
    png_read_update_info(png, reader->info);
    png_uint_32 width = png_get_image_width(png, reader->info);
    png_uint_32 height = png_get_image_height(png, reader->info);
    if ((uint64_t)width * height > MOST_PIXELS) {
        png_error(png, "it has too many pixels");
    }
    *image = image_create((int)width, (int)height);
    reader->rows = memory_new(sizeof *reader->rows * (size_t)image->height);
    for (int y = 0; y < image->height; y++) {
        reader->rows[y] = image->rgba + (size_t)y * image->width * IMAGE_CHANNELS;
    }
    png_read_image(png, reader->rows);
    png_read_end(png, reader->info);
    return true;
}

static bool reader_open(PngReader *reader, const char *path, Error *error) {
    *reader = (PngReader){.file = fopen(path, "rb")};
    if (!reader->file) {
        return error_set_errno(error, errno == ENOENT ? EXIT_MISSING_INPUT : EXIT_IO, "%s", path);
    }
    reader->png =
        png_create_read_struct(PNG_LIBPNG_VER_STRING, reader, keep_message, ignore_warning);
    reader->info = reader->png ? png_create_info_struct(reader->png) : NULL;
    ASSERT(reader->info);
    return true;
}

static void reader_close(PngReader *reader) {
    png_destroy_read_struct(&reader->png, &reader->info, NULL);
    free(reader->rows);
    fclose(reader->file);
}

bool image_read_png(const char *path, Image *image, Error *error) {
    PngReader reader;
    *image = (Image){0};
    if (!reader_open(&reader, path, error)) {
        return false;
    }
    bool good = read_rows(&reader, image);
    if (!good) {
        image_free(image);
        error_set(error, EXIT_BAD_INPUT, "%s is no good PNG picture: %s", path, reader.message);
    }
    reader_close(&reader);
    return good;
}

/* ---- 16 bits a channel ---- */

typedef struct DeepImage {
    int width, height;
    uint16_t *rgba; /* (height x width x IMAGE_CHANNELS) */
} DeepImage;

/* False too for a file of fewer bits. */
static bool read_deep_rows(PngReader *reader, DeepImage *image) {
    if (setjmp(png_jmpbuf(reader->png))) {
        return false;
    }
    png_structp png = reader->png;
    png_init_io(png, reader->file);
    png_set_user_limits(png, LARGEST_SIDE, LARGEST_SIDE);
    png_read_info(png, reader->info);
    if (png_get_bit_depth(png, reader->info) != 16) {
        return false;
    }
    png_set_expand(png);
    png_set_gray_to_rgb(png);
    png_set_add_alpha(png, 0xffff, PNG_FILLER_AFTER);
    png_set_swap(png); /* to the order of this machine, little end first */
    png_set_interlace_handling(png);
    png_read_update_info(png, reader->info);
    uint64_t width = png_get_image_width(png, reader->info);
    uint64_t height = png_get_image_height(png, reader->info);
    if (width * height > MOST_PIXELS) {
        png_error(png, "it has too many pixels");
    }
    image->width = (int)width;
    image->height = (int)height;
    image->rgba = memory_zeroed(width * height * IMAGE_CHANNELS, sizeof *image->rgba);
    reader->rows = memory_new(sizeof *reader->rows * height);
    for (uint64_t y = 0; y < height; y++) {
        reader->rows[y] = (png_bytep)(image->rgba + y * width * IMAGE_CHANNELS);
    }
    png_read_image(png, reader->rows);
    png_read_end(png, reader->info);
    return true;
}

static bool read_deep(const char *path, DeepImage *image) {
    PngReader reader;
    *image = (DeepImage){0};
    if (!reader_open(&reader, path, NULL)) {
        return false;
    }
    bool good = read_deep_rows(&reader, image);
    reader_close(&reader);
    return good;
}

bool image_compare_png16(const char *path_a, const char *path_b, double *largest) {
    DeepImage a, b = {0};
    bool good = read_deep(path_a, &a) && read_deep(path_b, &b) && a.width == b.width &&
                a.height == b.height;
    int most = 0;
    for (size_t i = 0; good && i < IMAGE_CHANNELS * (size_t)a.width * (size_t)a.height; i++) {
        int d = abs((int)a.rgba[i] - (int)b.rgba[i]);
        most = d > most ? d : most;
    }
    free(a.rgba);
    free(b.rgba);
    *largest = most / 65535.0;
    return good;
}

static bool read_texts(PngReader *reader, png_textp *texts, int *count) {
    if (setjmp(png_jmpbuf(reader->png))) {
        return false;
    }
    png_init_io(reader->png, reader->file);
    png_read_info(reader->png, reader->info);
    png_get_text(reader->png, reader->info, texts, count);
    return true;
}

bool image_read_png_text(const char *path, const char *key, char *text, int size) {
    PngReader reader;
    if (!reader_open(&reader, path, NULL)) {
        return false;
    }
    png_textp texts = NULL;
    int count = 0;
    bool found = false;
    if (read_texts(&reader, &texts, &count)) {
        for (int i = 0; i < count && !found; i++) {
            if (strcmp(texts[i].key, key) == 0) {
                snprintf(text, (size_t)size, "%s", texts[i].text);
                found = true;
            }
        }
    }
    reader_close(&reader);
    return found;
}

void image_print_versions(FILE *out) { fprintf(out, "libpng %s\n", png_get_libpng_ver(NULL)); }
