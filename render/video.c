#include "render/video.h"
#include "render/srgb.h"

#include <libavcodec/avcodec.h>
#include <libavfilter/avfilter.h>
#include <libavfilter/buffersink.h>
#include <libavfilter/buffersrc.h>
#include <libavformat/avformat.h>
#include <libavutil/opt.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/memory.h"

#define GOP_FRAMES 60            /* frames between key frames: seeking stays quick */
#define RATE_DENOMINATOR 1001000 /* frame rates are fractions with at most this denominator */
#define FIXED_ONE (1 << 16)      /* unit of contrast and saturation in swscale */

/* veryfast crf 18: slower presets buy nothing on cloth; realtime VP9: the good one costs 8 times
 * as much for 20 % of the size. */
const VideoFormat video_formats[] = {
    {"mp4", "H.264, plays everywhere", "mp4", "libx264", "yuv420p", "preset=veryfast:crf=18",
     "movflags=+faststart", NULL, "", NULL},
    {"hevc.mp4", "HEVC, half the size", "mp4", "libx265", "yuv420p",
     "preset=fast:crf=20:x265-params=log-level=none\\:pools=none\\:frame-threads=1",
     "movflags=+faststart", NULL, "", NULL},
    {"av1.webm", "AV1, for web pages", "webm", "libaom-av1", "yuv420p",
     "usage=realtime:cpu-used=8:crf=26:b=0:row-mt=0", "", NULL, "", NULL},
    {"gif", "256 colours a picture, plays anywhere; 15 frames a second are enough", "gif", "gif",
     "pal8", "", "loop=0", "pal8", "",
     "split[a][b];[a]palettegen=stats_mode=single[p];"
     "[b][p]paletteuse=new=1:dither=bayer:bayer_scale=4"},
    {"prores.mov", "ProRes 422 HQ, for cutting", "mov", "prores_ks", "yuv422p10le",
     "profile=3:vendor=apl0", "", "yuva444p10le", "profile=4:alpha_bits=16", NULL},
    {"mov", "H.264 in a QuickTime file", "mov", "libx264", "yuv420p", "preset=veryfast:crf=18",
     "movflags=+faststart", NULL, "", NULL},
    {"webm", "VP9, for web pages", "webm", "libvpx-vp9", "yuv420p",
     "deadline=realtime:cpu-used=8:crf=24:b=0:row-mt=0", "", "yuva420p", "auto-alt-ref=0", NULL},
    {"mkv", "FFV1, nothing lost, for CI and archives", "matroska", "ffv1", "bgr0",
     "level=3:slices=4:slicecrc=1", "", "bgra", "", NULL},
    {"apng", "animated PNG, nothing lost", "apng", "apng", "rgb24", "pred=sub", "plays=0", "rgba",
     "", NULL},
};
const int video_format_count = sizeof video_formats / sizeof video_formats[0];

struct Video {
    AVFormatContext *muxer;
    AVCodecContext *encoder;
    AVStream *stream;
    AVPacket *packet;
    AVFrame *frame;
    struct SwsContext *scaler;
    AVFilterGraph *graph; /* in place of the scaler, or NULL */
    AVFilterContext *source, *sink;
    int64_t written;          /* frames */
    enum AVPixelFormat input; /* what pictures are handed over as */
    bool header;              /* of the file is written */
    char path[4096];
};

const VideoFormat *video_format_of(const char *path) {
    size_t length = strlen(path), longest = 0;
    const VideoFormat *found = NULL;
    for (int i = 0; i < video_format_count; i++) {
        size_t size = strlen(video_formats[i].ending);
        if (length > size + 1 && size > longest && path[length - size - 1] == '.' &&
            strcmp(path + length - size, video_formats[i].ending) == 0) {
            found = &video_formats[i];
            longest = size;
        }
    }
    return found;
}

/* True if pictures keep their red, green and blue. */
static bool keeps_rgb(enum AVPixelFormat format) {
    return (av_pix_fmt_desc_get(format)->flags & AV_PIX_FMT_FLAG_RGB) != 0;
}

static bool fail(Error *error, const char *path, const char *what, int code) {
    char why[AV_ERROR_MAX_STRING_SIZE] = "";
    av_strerror(code, why, sizeof why);
    return error_set(error, EXIT_IO, "%s: %s: %s", path, what, why);
}

static bool open_encoder(Video *video, const VideoFormat *format, int width, int height,
                         double rate, bool clear, Error *error) {
    const AVCodec *codec = avcodec_find_encoder_by_name(format->encoder);
    if (!codec) {
        return error_set(error, EXIT_MISSING_INPUT, "this FFmpeg has no encoder %s for .%s files",
                         format->encoder, format->ending);
    }
    AVCodecContext *encoder = video->encoder = avcodec_alloc_context3(codec);
    ASSERT(encoder);
    AVRational frames = av_d2q(rate, RATE_DENOMINATOR);
    encoder->width = width;
    encoder->height = height;
    encoder->pix_fmt = av_get_pix_fmt(clear ? format->clear_format : format->pixel_format);
    encoder->time_base = av_inv_q(frames);
    encoder->framerate = frames;
    encoder->gop_size = GOP_FRAMES;
    bool rgb = keeps_rgb(encoder->pix_fmt);
    encoder->color_range = rgb ? AVCOL_RANGE_JPEG : AVCOL_RANGE_MPEG;
    encoder->colorspace = rgb ? AVCOL_SPC_RGB : AVCOL_SPC_BT709;
    encoder->color_primaries = AVCOL_PRI_BT709;
    encoder->color_trc = rgb ? AVCOL_TRC_IEC61966_2_1 : AVCOL_TRC_BT709;
    encoder->thread_count = 1;
    if (codec->id == AV_CODEC_ID_HEVC) {
        encoder->codec_tag = MKTAG('h', 'v', 'c', '1'); /* what Apple's players look for */
    }
    encoder->flags |= AV_CODEC_FLAG_BITEXACT;
    if (video->muxer->oformat->flags & AVFMT_GLOBALHEADER) {
        encoder->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
    }
    AVDictionary *options = NULL;
    av_dict_parse_string(&options, format->options, "=", ":", 0);
    av_dict_parse_string(&options, clear ? format->clear_options : "", "=", ":", 0);
    int code = avcodec_open2(encoder, codec, &options);
    av_dict_free(&options);
    return code >= 0 || fail(error, video->path, "the encoder does not start", code);
}

static bool start_file(Video *video, const VideoFormat *format, Error *error) {
    AVStream *stream = video->stream = avformat_new_stream(video->muxer, NULL);
    ASSERT(stream);
    stream->time_base = video->encoder->time_base;
    stream->avg_frame_rate = video->encoder->framerate;
    avcodec_parameters_from_context(stream->codecpar, video->encoder);
    video->muxer->flags |= AVFMT_FLAG_BITEXACT;
    av_dict_set(&video->muxer->metadata, "comment", "toile", 0);
    if (video->input == AV_PIX_FMT_RGBA) { /* WebM: alpha stands beside the pictures */
        av_dict_set(&stream->metadata, "alpha_mode", "1", 0);
    }
    int code = avio_open(&video->muxer->pb, video->path, AVIO_FLAG_WRITE);
    if (code < 0) {
        return fail(error, video->path, "cannot be written", code);
    }
    AVDictionary *options = NULL;
    av_dict_parse_string(&options, format->muxer_options, "=", ":", 0);
    code = avformat_write_header(video->muxer, &options);
    av_dict_free(&options);
    video->header = code >= 0;
    return video->header || fail(error, video->path, "cannot be written", code);
}

/* sRGB picture -> what the encoder takes, BT.709 limited range or RGB. */
static void open_scaler(Video *video, int width, int height) {
    int flags = SWS_BICUBIC | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INP | SWS_BITEXACT;
    video->scaler = sws_getContext(width, height, video->input, width, height,
                                   video->encoder->pix_fmt, flags, NULL, NULL, NULL);
    ASSERT(video->scaler);
    const int *table = sws_getCoefficients(SWS_CS_ITU709);
    int full = keeps_rgb(video->encoder->pix_fmt);
    sws_setColorspaceDetails(video->scaler, table, 1, table, full, 0, FIXED_ONE, FIXED_ONE);
}

/* A chain of FFmpeg's filters from RGB0 pictures to what the encoder takes. */
static bool open_filter(Video *video, const VideoFormat *format, int width, int height,
                        Error *error) {
    char source[128];
    AVFilterGraph *graph = video->graph = avfilter_graph_alloc();
    AVFilterInOut *in = avfilter_inout_alloc(), *out = avfilter_inout_alloc();
    ASSERT(graph && in && out);
    AVRational base = video->encoder->time_base;
    graph->nb_threads = 1;
    snprintf(source, sizeof source, "video_size=%dx%d:pix_fmt=%d:time_base=%d/%d:pixel_aspect=1/1",
             width, height, video->input, base.num, base.den);
    int code = avfilter_graph_create_filter(&video->source, avfilter_get_by_name("buffer"), "in",
                                            source, NULL, graph);
    if (code >= 0) {
        code = avfilter_graph_create_filter(&video->sink, avfilter_get_by_name("buffersink"), "out",
                                            NULL, NULL, graph);
    }
    *out = (AVFilterInOut){.name = av_strdup("in"), .filter_ctx = video->source};
    *in = (AVFilterInOut){.name = av_strdup("out"), .filter_ctx = video->sink};
    if (code >= 0) {
        code = avfilter_graph_parse_ptr(graph, format->filter, &in, &out, NULL);
    }
    if (code >= 0) {
        code = avfilter_graph_config(graph, NULL);
    }
    avfilter_inout_free(&in);
    avfilter_inout_free(&out);
    return code >= 0 || fail(error, video->path, "the filters do not start", code);
}

Video *video_create(const char *path, const VideoFormat *format, int width, int height, double rate,
                    bool clear, Error *error) {
    av_log_set_level(AV_LOG_ERROR);
    Video *video = memory_zeroed(1, sizeof *video);
    ASSERT(width % 2 == 0 && height % 2 == 0 && (!clear || format->clear_format));
    video->input = clear ? AV_PIX_FMT_RGBA : AV_PIX_FMT_RGB0;
    snprintf(video->path, sizeof video->path, "%s", path);
    int code = avformat_alloc_output_context2(&video->muxer, NULL, format->muxer, path);
    if (code < 0) {
        fail(error, path, "no such file format", code);
        video_abandon(video);
        return NULL;
    }
    if (!open_encoder(video, format, width, height, rate, clear, error) ||
        !start_file(video, format, error)) {
        video_abandon(video);
        return NULL;
    }
    if (format->filter && !open_filter(video, format, width, height, error)) {
        video_abandon(video);
        return NULL;
    }
    if (!format->filter) {
        open_scaler(video, width, height);
    }
    video->packet = av_packet_alloc();
    AVFrame *frame = video->frame = av_frame_alloc();
    ASSERT(video->packet && frame);
    frame->format = format->filter ? video->input : video->encoder->pix_fmt;
    frame->width = width;
    frame->height = height;
    code = av_frame_get_buffer(frame, 0);
    ASSERT(code >= 0);
    return video;
}

/* Sends a picture (NULL: the end) and writes what comes out. */
static bool encode(Video *video, AVFrame *frame, Error *error) {
    int code = avcodec_send_frame(video->encoder, frame);
    while (code >= 0) {
        code = avcodec_receive_packet(video->encoder, video->packet);
        if (code == AVERROR(EAGAIN) || code == AVERROR_EOF) {
            return true;
        }
        if (code >= 0) {
            video->packet->stream_index = video->stream->index;
            video->packet->duration = 1;
            av_packet_rescale_ts(video->packet, video->encoder->time_base,
                                 video->stream->time_base);
            code = av_interleaved_write_frame(video->muxer, video->packet);
        }
    }
    return fail(error, video->path, "writing failed", code);
}

/* Through the filters, which may keep a picture until the next one or the end (NULL) comes. */
static bool filter(Video *video, AVFrame *frame, Error *error) {
    int code = av_buffersrc_write_frame(video->source, frame);
    AVFrame *out = av_frame_alloc();
    ASSERT(out);
    bool good = code >= 0 || fail(error, video->path, "filtering failed", code);
    while (good && (code = av_buffersink_get_frame(video->sink, out)) >= 0) {
        good = encode(video, out, error);
        av_frame_unref(out);
    }
    av_frame_free(&out);
    return good && (code == AVERROR(EAGAIN) || code == AVERROR_EOF ||
                    fail(error, video->path, "filtering failed", code));
}

bool video_write(Video *video, const Image *image, Error *error) {
    ASSERT(image->width == video->frame->width && image->height == video->frame->height);
    int code = av_frame_make_writable(video->frame);
    ASSERT(code >= 0);
    const uint8_t *rows[1] = {image->rgba};
    int stride[1] = {IMAGE_CHANNELS * image->width};
    video->frame->pts = video->written++;
    if (video->graph) {
        for (int y = 0; y < image->height; y++) {
            memcpy(video->frame->data[0] + (ptrdiff_t)y * video->frame->linesize[0],
                   image->rgba + (size_t)y * (size_t)stride[0], (size_t)stride[0]);
        }
        return filter(video, video->frame, error);
    }
    sws_scale(video->scaler, rows, stride, 0, image->height, video->frame->data,
              video->frame->linesize);
    return encode(video, video->frame, error);
}

void video_abandon(Video *video) {
    if (!video) {
        return;
    }
    if (video->muxer) {
        avio_closep(&video->muxer->pb);
    }
    sws_freeContext(video->scaler);
    avfilter_graph_free(&video->graph);
    av_frame_free(&video->frame);
    av_packet_free(&video->packet);
    avcodec_free_context(&video->encoder);
    avformat_free_context(video->muxer);
    free(video);
}

bool video_close(Video *video, const char *comment, Error *error) {
    bool good = (!video->graph || filter(video, NULL, error)) && encode(video, NULL, error);
    if (good) {
        if (comment) { /* mp4 writes its metadata at the end */
            av_dict_set(&video->muxer->metadata, "comment", comment, 0);
        }
        int code = av_write_trailer(video->muxer);
        int closed = avio_closep(&video->muxer->pb);
        code = code < 0 ? code : closed;
        good = code >= 0 || fail(error, video->path, "writing failed", code);
    }
    video_abandon(video);
    return good;
}

bool video_read_comment(const char *path, char *text, int size) {
    av_log_set_level(AV_LOG_QUIET);
    AVFormatContext *file = NULL;
    bool found = false;
    if (avformat_open_input(&file, path, NULL, NULL) >= 0) {
        const AVDictionaryEntry *entry = av_dict_get(file->metadata, "comment", NULL, 0);
        found = entry != NULL;
        snprintf(text, (size_t)size, "%s", entry ? entry->value : "");
        avformat_close_input(&file);
    }
    return found;
}

/* ---- reading ---- */

struct VideoReader {
    char path[4096];
    AVFormatContext *file;
    AVCodecContext *decoder;
    AVPacket *packet;
    AVFrame *frame;
    struct SwsContext *scaler;
    int stream, orientation;
    bool ended; /* the decoder was told that nothing more comes */
};

/* The light from which on each code of sRGB is the nearest; the first is 1. */
static void find_steps(float steps[255]) {
    for (int i = 0; i < 255; i++) {
        steps[i] = (float)srgb_light((i + 0.5) / 255.0);
    }
}

/* The code of linear light: how many steps are not above it, by halving; NaN is black. */
static uint8_t code_of(const float steps[255], float light) {
    int low = 0, high = 255;
    while (low < high) {
        int middle = (low + high) / 2;
        bool above = light >= steps[middle];
        low = above ? middle + 1 : low;
        high = above ? high : middle;
    }
    return (uint8_t)low;
}

/* Planes of 32-bit floats in linear light: green, blue, red, alpha. */
static void take_floats(const AVFrame *frame, Image *image) {
    static const int plane_of[4] = {2, 0, 1, 3};
    float steps[255];
    find_steps(steps);
    bool alpha = frame->format == AV_PIX_FMT_GBRAPF32LE;
    for (int y = 0; y < image->height; y++) {
        uint8_t *out = image->rgba + IMAGE_CHANNELS * (size_t)y * (size_t)image->width;
        for (int k = 0; k < 4; k++) {
            int plane = plane_of[k];
            const float *row =
                k < 3 || alpha
                    ? (const float *)(const void *)(frame->data[plane] +
                                                    (ptrdiff_t)y * frame->linesize[plane])
                    : NULL;
            for (int x = 0; x < image->width; x++) {
                float value = !row ? 1.0f : row[x] > 0.0f ? fminf(row[x], 1.0f) : 0.0f;
                out[IMAGE_CHANNELS * x + k] =
                    k < 3 ? code_of(steps, value) : (uint8_t)(255.0f * value + 0.5f);
            }
        }
    }
}

/* Any other format through swscale, by the colours that the file claims. */
static bool take_pixels(VideoReader *reader, Image *image) {
    const AVFrame *frame = reader->frame;
    uint64_t flags = av_pix_fmt_desc_get(frame->format)->flags;
    bool alpha = flags & AV_PIX_FMT_FLAG_ALPHA, rgb = flags & AV_PIX_FMT_FLAG_RGB;
    bool pal = frame->format == AV_PIX_FMT_PAL8;
    reader->scaler = sws_getCachedContext(
        reader->scaler, frame->width, frame->height, frame->format, frame->width, frame->height,
        alpha || pal ? AV_PIX_FMT_RGBA : AV_PIX_FMT_RGB0,
        SWS_BICUBIC | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT, NULL, NULL, NULL);
    if (!reader->scaler) {
        return false;
    }
    /* deep RGB goes through YUV inside of swscale: back by the same matrix */
    bool jpeg = rgb || frame->color_range == AVCOL_RANGE_JPEG;
    int space = rgb || frame->colorspace == AVCOL_SPC_BT709 ? SWS_CS_ITU709 : SWS_CS_ITU601;
    sws_setColorspaceDetails(reader->scaler, sws_getCoefficients(space), jpeg,
                             sws_getCoefficients(SWS_CS_ITU709), 1, 0, FIXED_ONE, FIXED_ONE);
    uint8_t *rows[1] = {image->rgba};
    int stride[1] = {IMAGE_CHANNELS * frame->width};
    sws_scale(reader->scaler, (const uint8_t *const *)frame->data, frame->linesize, 0,
              frame->height, rows, stride);
    for (size_t i = 0; !alpha && !pal && i < (size_t)frame->width * (size_t)frame->height; i++) {
        image->rgba[IMAGE_CHANNELS * i + 3] = 255;
    }
    return true;
}

static bool take_picture(VideoReader *reader, Image *image) {
    const AVFrame *frame = reader->frame;
    const AVDictionaryEntry *held = av_dict_get(frame->metadata, "Orientation", NULL, 0);
    int orientation = held ? atoi(held->value) : 1;
    reader->orientation = orientation >= 1 && orientation <= 8 ? orientation : 1;
    *image = image_create(frame->width, frame->height);
    if (frame->format == AV_PIX_FMT_GBRPF32LE || frame->format == AV_PIX_FMT_GBRAPF32LE) {
        take_floats(frame, image);
        return true;
    }
    if (!take_pixels(reader, image)) {
        image_free(image);
        return false;
    }
    return true;
}

static bool open_decoder(VideoReader *reader, Error *error) {
    const AVCodec *codec = NULL;
    int code = avformat_find_stream_info(reader->file, NULL);
    int number = av_find_best_stream(reader->file, AVMEDIA_TYPE_VIDEO, -1, -1, &codec, 0);
    if (code < 0 || number < 0) {
        return error_set(error, EXIT_BAD_INPUT, "%s: there is no video in it", reader->path);
    }
    reader->stream = number;
    reader->decoder = avcodec_alloc_context3(codec);
    ASSERT(reader->decoder);
    reader->decoder->thread_count = 1;
    reader->decoder->max_pixels = VIDEO_MOST_PIXELS;
    if (codec->id != AV_CODEC_ID_TIFF) { /* whose decoder takes every unknown tag for damage */
        reader->decoder->err_recognition |= AV_EF_EXPLODE;
    }
    avcodec_parameters_to_context(reader->decoder, reader->file->streams[number]->codecpar);
    return avcodec_open2(reader->decoder, codec, NULL) >= 0 ||
           error_set(error, EXIT_BAD_INPUT, "%s: cannot be decoded", reader->path);
}

VideoReader *video_open(const char *path, Error *error) {
    av_log_set_level(AV_LOG_QUIET);
    VideoReader *reader = memory_zeroed(1, sizeof *reader);
    snprintf(reader->path, sizeof reader->path, "%s", path);
    reader->orientation = 1;
    int code = avformat_open_input(&reader->file, path, NULL, NULL);
    reader->packet = av_packet_alloc();
    reader->frame = av_frame_alloc();
    ASSERT(reader->packet && reader->frame);
    if (code == AVERROR(EACCES) || code == AVERROR(EPERM)) {
        error_set(error, EXIT_IO, "%s: %s", path, strerror(AVUNERROR(code)));
    } else if (code < 0) {
        error_set(error, code == AVERROR(ENOENT) ? EXIT_MISSING_INPUT : EXIT_BAD_INPUT,
                  "%s: is no video or picture that can be read", path);
    }
    if (code < 0 || !open_decoder(reader, error)) {
        video_reader_close(reader);
        return NULL;
    }
    return reader;
}

/* Gives the decoder the next packet of the stream, or tells it that there is none. */
static bool feed(VideoReader *reader) {
    while (av_read_frame(reader->file, reader->packet) >= 0) {
        bool ours = reader->packet->stream_index == reader->stream;
        int code = ours ? avcodec_send_packet(reader->decoder, reader->packet) : 0;
        av_packet_unref(reader->packet);
        if (ours) {
            return code >= 0;
        }
    }
    reader->ended = true;
    return avcodec_send_packet(reader->decoder, NULL) >= 0;
}

VideoNext video_next(VideoReader *reader, Image *image, Error *error) {
    for (;;) {
        int code = avcodec_receive_frame(reader->decoder, reader->frame);
        if (code == AVERROR_EOF) {
            return VIDEO_END;
        }
        bool good = code >= 0 ? !(reader->frame->flags & AV_FRAME_FLAG_CORRUPT) &&
                                    take_picture(reader, image)
                              : code == AVERROR(EAGAIN) && !reader->ended && feed(reader);
        if (!good) {
            error_set(error, EXIT_BAD_INPUT, "%s: is damaged, or larger than %d pixels",
                      reader->path, VIDEO_MOST_PIXELS);
            return VIDEO_WRONG;
        }
        if (code >= 0) {
            return VIDEO_PICTURE;
        }
    }
}

int video_orientation(const VideoReader *reader) { return reader->orientation; }

void video_reader_close(VideoReader *reader) {
    if (reader) {
        sws_freeContext(reader->scaler);
        av_packet_free(&reader->packet);
        av_frame_free(&reader->frame);
        avcodec_free_context(&reader->decoder);
        avformat_close_input(&reader->file);
        free(reader);
    }
}

Image video_resize(const Image *image, int width, int height) {
    Image out = image_create(width, height);
    struct SwsContext *scaler =
        sws_getContext(image->width, image->height, AV_PIX_FMT_RGBA, width, height, AV_PIX_FMT_RGBA,
                       SWS_BICUBIC | SWS_ACCURATE_RND | SWS_BITEXACT, NULL, NULL, NULL);
    ASSERT(scaler);
    const uint8_t *rows[1] = {image->rgba};
    uint8_t *to[1] = {out.rgba};
    int stride[1] = {IMAGE_CHANNELS * image->width}, to_stride[1] = {IMAGE_CHANNELS * width};
    sws_scale(scaler, rows, stride, 0, image->height, to, to_stride);
    sws_freeContext(scaler);
    return out;
}

/* ---- looking at a video ---- */

static void set_text(char *out, size_t size, const char *text) {
    snprintf(out, size, "%s", text ? text : "unknown");
}

static void describe(const AVStream *stream, VideoInfo *info) {
    const AVCodecParameters *p = stream->codecpar;
    info->width = p->width;
    info->height = p->height;
    info->rate = av_q2d(stream->avg_frame_rate);
    set_text(info->codec, sizeof info->codec, avcodec_get_name(p->codec_id));
    set_text(info->pixel_format, sizeof info->pixel_format, av_get_pix_fmt_name(p->format));
    set_text(info->range, sizeof info->range, av_color_range_name(p->color_range));
    set_text(info->space, sizeof info->space, av_color_space_name(p->color_space));
    set_text(info->primaries, sizeof info->primaries, av_color_primaries_name(p->color_primaries));
    set_text(info->transfer, sizeof info->transfer, av_color_transfer_name(p->color_trc));
}

/* Whether "moov" comes before "mdat" among the boxes of an mp4 file. */
static bool index_is_first(const char *path) {
    FILE *file = fopen(path, "rb");
    unsigned char head[8];
    bool first = false;
    while (file && fread(head, 1, 8, file) == 8 && memcmp(head + 4, "mdat", 4) != 0) {
        first = first || memcmp(head + 4, "moov", 4) == 0;
        long size = (long)head[0] << 24 | head[1] << 16 | head[2] << 8 | head[3];
        if (size < 8 || fseek(file, size - 8, SEEK_CUR) != 0) {
            break;
        }
    }
    if (file) {
        fclose(file);
    }
    return first;
}

bool video_probe(const char *path, VideoInfo *info, int frame, Image *image, Error *error) {
    *info = (VideoInfo){0};
    VideoReader *reader = video_open(path, error);
    if (!reader) {
        return false;
    }
    describe(reader->file->streams[reader->stream], info);
    info->index_first = index_is_first(path);
    Image now;
    VideoNext next;
    while ((next = video_next(reader, &now, error)) == VIDEO_PICTURE) {
        if (info->frames++ == frame && image) {
            *image = now;
        } else {
            image_free(&now);
        }
    }
    video_reader_close(reader);
    return next == VIDEO_END;
}

void video_print_versions(FILE *out) {
    const struct {
        const char *name;
        unsigned version;
    } libraries[] = {{"libavformat", avformat_version()},
                     {"libavcodec", avcodec_version()},
                     {"libswscale", swscale_version()},
                     {"libavutil", avutil_version()}};
    fprintf(out, "FFmpeg %s\n", av_version_info());
    for (size_t i = 0; i < sizeof libraries / sizeof *libraries; i++) {
        unsigned v = libraries[i].version;
        fprintf(out, "%s %u.%u.%u\n", libraries[i].name, v >> 16, v >> 8 & 255, v & 255);
    }
}
