/* video.h: films and what strangers' pictures hold, through FFmpeg's libraries; the only file that
 * knows them.
 *
 * Colours are BT.709, limited range, tagged so on the stream, or sRGB as drawn where nothing is lost
 * (mkv, apng); pictures are 4:2:0 but for ProRes (4:2:2, 10 bit). One encoder
 * thread and bit-exact flags: the same pictures give the same file.
 */
#ifndef TOILE_RENDER_VIDEO_H
#define TOILE_RENDER_VIDEO_H

#include "render/image.h"

typedef struct VideoFormat {
    const char *ending; /* of the file name, without the dot */
    const char *about;
    const char *muxer, *encoder;
    const char *pixel_format; /* as FFmpeg calls it */
    const char *options;      /* of the encoder: "key=value:key=value" */
    const char *muxer_options;
    const char *clear_format;  /* pixel_format of pictures with alpha; NULL: it has none */
    const char *clear_options; /* besides the others */
    const char *filter; /* graph of libavfilter from RGB0 pictures to pixel_format; NULL: none */
} VideoFormat;

extern const VideoFormat video_formats[];
extern const int video_format_count;

/* By the end of a file name: the longest that fits (.prores.mov before .mov); NULL if it is no video. */
const VideoFormat *video_format_of(const char *path);

typedef struct Video Video;

/* Starts a file. Width and height must be even. clear: pictures have alpha, not premultiplied (the format must have a
 * clear_format). Errors: EXIT_IO; EXIT_MISSING_INPUT when FFmpeg was built without the encoder. */
Video *video_create(const char *path, const VideoFormat *format, int width, int height, double rate,
                    bool clear, Error *error);
bool video_write(Video *video, const Image *image, Error *error);
/* Ends the file and frees; comment: its metadata entry, may be NULL (mp4 only). */
bool video_close(Video *video, const char *comment, Error *error);
/* Frees without ending the file. */
void video_abandon(Video *video);

/* The comment of a video file into text (size bytes); false if there is none. */
bool video_read_comment(const char *path, char *text, int size);

/* What a player would find in a file. */
typedef struct VideoInfo {
    int width, height, frames; /* decoded frames */
    double rate;               /* [1/s] */
    char codec[32], pixel_format[32], range[16], space[16], primaries[16], transfer[16];
    bool index_first; /* mp4: the index stands before the pictures (fast start) */
} VideoInfo;

/* Decodes a whole file; if frame >= 0, also gives that picture. Errors: EXIT_MISSING_INPUT,
 * EXIT_BAD_INPUT. */
bool video_probe(const char *path, VideoInfo *info, int frame, Image *image, Error *error);

/* ---- reading pictures one after the other: videos, and pictures of other kinds than PNG ---- */

typedef struct VideoReader VideoReader;

typedef enum VideoNext { VIDEO_PICTURE, VIDEO_END, VIDEO_WRONG } VideoNext;

/* Errors: EXIT_MISSING_INPUT, EXIT_BAD_INPUT (nothing that FFmpeg decodes). */
VideoReader *video_open(const char *path, Error *error);
/* The next picture as 8-bit sRGB; *image is made here. Linear light (EXR) gets the curve of sRGB.
 * VIDEO_WRONG: damaged (EXIT_BAD_INPUT). */
VideoNext video_next(VideoReader *reader, Image *image, Error *error);
/* How a camera was held: 1 upright, 2 to 8 as in EXIF; of the last picture. */
int video_orientation(const VideoReader *reader);
void video_reader_close(VideoReader *reader);

/* Most pixels of a picture that is read: larger ones would only eat memory. */
#define VIDEO_MOST_PIXELS 200000000

/* A picture in another size (bicubic). */
Image video_resize(const Image *image, int width, int height);

/* Versions of the libraries, one line each. */
void video_print_versions(FILE *out);

#endif
