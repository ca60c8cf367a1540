/* Fuzzes what diff and compare read from strangers: PNG through libpng, JPEG, TIFF, EXR, BMP and videos
 * through FFmpeg. Whatever the bytes are, the answer is a picture whose pixels are all there, or a message.
 * The first byte chooses the kind of the file.
 * Needs clang -fsanitize=fuzzer; corpus: small pictures of each kind. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "render/image_exr.h"
#include "render/image_source.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static const char *const endings[] = {"png", "jpg", "tif", "exr", "bmp", "mp4"};
#define KINDS ((int)(sizeof endings / sizeof *endings))

/* A file is as it is itself, or no file of many bits. */
static void check_deep(const char *path) {
    double largest = 1.0;
    ASSERT(!exr_compare(path, path, &largest) || largest == 0.0);
    ASSERT(!image_compare_png16(path, path, &largest) || largest == 0.0);
}

static void check_picture(const char *path) {
    Image image;
    Error error = {0};
    check_deep(path);
    if (!image_read(path, &image, &error)) {
        ASSERT(error.text[0] && (error.code == EXIT_BAD_INPUT || error.code == EXIT_IO));
        return;
    }
    size_t count = IMAGE_CHANNELS * (size_t)image.width * (size_t)image.height;
    volatile unsigned sum = 0;
    ASSERT(image.width > 0 && image.height > 0);
    for (size_t i = 0; i < count; i += 97) {
        sum += image.rgba[i];
    }
    sum += image.rgba[count - 1];
    image_free(&image);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    static char paths[sizeof endings / sizeof *endings][64];
    if (size == 0) {
        return 0;
    }
    int kind = data[0] % KINDS;
    if (!paths[0][0]) {
        char folder[32] = "/tmp/toile_fuzz_XXXXXX";
        ASSERT(mkdtemp(folder));
        for (int i = 0; i < KINDS; i++) {
            snprintf(paths[i], sizeof paths[i], "%s/input.%s", folder, endings[i]);
        }
    }
    FILE *file = fopen(paths[kind], "wb");
    ASSERT(file && fwrite(data + 1, 1, size - 1, file) == size - 1);
    fclose(file);
    check_picture(paths[kind]);
    return 0;
}
