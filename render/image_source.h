/* image_source.h: pictures one after the other, whatever holds them.
 *
 *   a picture        .png, and what FFmpeg decodes: JPEG, EXR, TIFF, WebP, ...
 *   a video          mp4, mov, webm, mkv, gif, y4m, ...
 *   a sequence       NAME%04d.png: all files whose number is there, in rising order
 *   a folder         its pictures, by name
 */
#ifndef TOILE_RENDER_IMAGE_SOURCE_H
#define TOILE_RENDER_IMAGE_SOURCE_H

#include "render/video.h"
#include "sim/base/arena.h"

typedef struct ImageSource {
    Arena arena;
    int file_count;
    char **files; /* (file_count) of a picture, a sequence or a folder */
    int next;
    VideoReader *video; /* or NULL */
    int orientation;    /* of the last picture, as in EXIF */
} ImageSource;

/* Errors: EXIT_MISSING_INPUT, EXIT_BAD_INPUT, EXIT_USAGE. */
bool image_source_open(ImageSource *source, const char *path, Error *error);
VideoNext image_source_next(ImageSource *source, Image *image, Error *error);
/* The file of the last picture; NULL out of a video. */
const char *image_source_file(const ImageSource *source);
void image_source_close(ImageSource *source);

/* Reads one picture of any kind as it is meant to be seen (EXIF turns are carried out). */
bool image_read(const char *path, Image *image, Error *error);

/* Turns and mirrors as EXIF says, 1 to 8; the old image is freed. */
void image_orient(Image *image, int orientation);

bool image_is_picture(const char *path); /* by its ending */
bool image_is_video(const char *path);

#endif
