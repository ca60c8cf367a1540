/* output.h: where pictures go: a video, a numbered sequence, or one picture.
 *
 * Every file is written as NAME.part and renamed when it is whole. Files carry the key of what
 * they show, so a later call knows whether they are still valid, and never overwrites a file
 * that somebody else wrote.
 */
#ifndef TOILE_RENDER_OUTPUT_H
#define TOILE_RENDER_OUTPUT_H

#include "render/image_exr.h"
#include "render/video.h"

#define OUTPUT_PATH_SIZE 4096
#define OUTPUT_KEY_SIZE 48

typedef enum OutputKind { OUTPUT_VIDEO, OUTPUT_SEQUENCE, OUTPUT_PICTURE } OutputKind;

typedef struct OutputDef {
    char path[OUTPUT_PATH_SIZE]; /* a sequence: with one %0Nd for the frame number */
    OutputKind kind;
    int width, height; /* [px] */
    double rate;       /* [1/s] of a video */
    bool exr;          /* pictures are EXR files: output_write_exr */
    bool clear;        /* pictures have alpha */
    bool background;   /* encode in a thread of its own */
    bool force;        /* overwrite whatever is there */
} OutputDef;

/* What a path given on the command line means: x.mp4 and the like (video_formats); x%04d.png; x.png; a folder
 * (ends in / or has no ending) gets %04d.png. Errors: EXIT_USAGE. */
bool output_plan(const char *path, OutputDef *def, Error *error);

typedef enum OutputState {
    OUTPUT_ABSENT, /* nothing there */
    OUTPUT_STALE,  /* ours, but of something else */
    OUTPUT_VALID,  /* shows exactly this */
    OUTPUT_FOREIGN /* not written by toile */
} OutputState;

/* What is there now; frame: of a sequence. */
OutputState output_look(const OutputDef *def, int frame, uint64_t key);

/* False, with a message, when something foreign would be overwritten. */
bool output_may_write(const OutputDef *def, int frame, Error *error);

typedef struct Output Output;

/* Errors: EXIT_IO; as video_create. Creates the folder of a sequence. */
Output *output_create(const OutputDef *def, Error *error);

/* Adds a picture; it is copied. key: of this picture. Errors of earlier pictures may show here. */
bool output_write(Output *output, int frame, const Image *image, uint64_t key, Error *error);

/* The same for a picture for compositing, written at once. */
bool output_write_exr(Output *output, int frame, const ExrPicture *picture, uint64_t key,
                      Error *error);

/* Ends the output and frees. key: of the whole video. */
bool output_close(Output *output, uint64_t key, Error *error);

/* One picture from beginning to end; the size is that of the image. */
bool output_write_picture(const OutputDef *target, const Image *image, Error *error);

/* Removes what is not whole and frees. */
void output_abandon(Output *output);

#endif
