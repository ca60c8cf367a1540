#include "render/video.h"

#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
#include <libavutil/opt.h>
#include <libavutil/pixdesc.h>
#include <libswscale/swscale.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define GOP_FRAMES 60            /* frames between key frames: seeking stays quick */
#define RATE_DENOMINATOR 1001000 /* frame rates are fractions with at most this denominator */
#define FIXED_ONE (1 << 16)      /* unit of contrast and saturation in swscale */

/* veryfast crf 18: slower presets buy nothing on cloth; realtime VP9: the good one costs 8 times
 * as much for 20 % of the size. */
const VideoFormat video_formats[] = {
    {"mp4", "H.264, plays everywhere", "mp4", "libx264", "preset=veryfast:crf=18",
     "movflags=+faststart"},
    {"mov", "H.264 in a QuickTime file", "mov", "libx264", "preset=veryfast:crf=18",
     "movflags=+faststart"},
    {"webm", "VP9, for web pages", "webm", "libvpx-vp9",
     "deadline=realtime:cpu-used=8:crf=24:b=0:row-mt=0", ""},
};
const int video_format_count = sizeof video_formats / sizeof video_formats[0];

struct Video {
    AVFormatContext *muxer;
    AVCodecContext *encoder;
    AVStream *stream;
    AVPacket *packet;
    AVFrame *frame;
    struct SwsContext *scaler;
    int64_t written; /* frames */
    bool header;     /* of the file is written */
    char path[4096];
};

const VideoFormat *video_format_of(const char *path) {
    const char *dot = strrchr(path, '.');
    for (int i = 0; dot && i < video_format_count; i++) {
        if (strcmp(dot + 1, video_formats[i].ending) == 0) {
            return &video_formats[i];
        }
    }
    return NULL;
}

static bool fail(Error *error, const char *path, const char *what, int code) {
    char why[AV_ERROR_MAX_STRING_SIZE] = "";
    av_strerror(code, why, sizeof why);
    return error_set(error, EXIT_IO, "%s: %s: %s", path, what, why);
}

static bool open_encoder(Video *video, const VideoFormat *format, int width, int height,
                         double rate, Error *error) {
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
    encoder->pix_fmt = AV_PIX_FMT_YUV420P;
    encoder->time_base = av_inv_q(frames);
    encoder->framerate = frames;
    encoder->gop_size = GOP_FRAMES;
    encoder->color_range = AVCOL_RANGE_MPEG;
    encoder->colorspace = AVCOL_SPC_BT709;
    encoder->color_primaries = AVCOL_PRI_BT709;
    encoder->color_trc = AVCOL_TRC_BT709;
    encoder->thread_count = 1;
    encoder->flags |= AV_CODEC_FLAG_BITEXACT;
    if (video->muxer->oformat->flags & AVFMT_GLOBALHEADER) {
        encoder->flags |= AV_CODEC_FLAG_GLOBAL_HEADER;
    }
    AVDictionary *options = NULL;
    av_dict_parse_string(&options, format->options, "=", ":", 0);
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

/* sRGB picture -> BT.709 limited range. */
static void open_scaler(Video *video, int width, int height) {
    int flags = SWS_BICUBIC | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INP | SWS_BITEXACT;
    video->scaler = sws_getContext(width, height, AV_PIX_FMT_RGB0, width, height,
                                   AV_PIX_FMT_YUV420P, flags, NULL, NULL, NULL);
    ASSERT(video->scaler);
    const int *table = sws_getCoefficients(SWS_CS_ITU709);
    sws_setColorspaceDetails(video->scaler, table, 1, table, 0, 0, FIXED_ONE, FIXED_ONE);
}

Video *video_create(const char *path, const VideoFormat *format, int width, int height, double rate,
                    Error *error) {
    av_log_set_level(AV_LOG_ERROR);
    Video *video = calloc(1, sizeof *video);
    ASSERT(video && width % 2 == 0 && height % 2 == 0);
    snprintf(video->path, sizeof video->path, "%s", path);
    int code = avformat_alloc_output_context2(&video->muxer, NULL, format->muxer, path);
    if (code < 0) {
        fail(error, path, "no such file format", code);
        video_abandon(video);
        return NULL;
    }
    if (!open_encoder(video, format, width, height, rate, error) ||
        !start_file(video, format, error)) {
        video_abandon(video);
        return NULL;
    }
    open_scaler(video, width, height);
    video->packet = av_packet_alloc();
    AVFrame *frame = video->frame = av_frame_alloc();
    ASSERT(video->packet && frame);
    frame->format = AV_PIX_FMT_YUV420P;
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

bool video_write(Video *video, const Image *image, Error *error) {
    ASSERT(image->width == video->frame->width && image->height == video->frame->height);
    int code = av_frame_make_writable(video->frame);
    ASSERT(code >= 0);
    const uint8_t *rows[1] = {image->rgba};
    int stride[1] = {IMAGE_CHANNELS * image->width};
    sws_scale(video->scaler, rows, stride, 0, image->height, video->frame->data,
              video->frame->linesize);
    video->frame->pts = video->written++;
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
    av_frame_free(&video->frame);
    av_packet_free(&video->packet);
    avcodec_free_context(&video->encoder);
    avformat_free_context(video->muxer);
    free(video);
}

bool video_close(Video *video, const char *comment, Error *error) {
    bool good = encode(video, NULL, error);
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

/* ---- looking at a video ---- */

typedef struct Probe {
    AVFormatContext *file;
    AVCodecContext *decoder;
    AVPacket *packet;
    AVFrame *frame;
    VideoInfo *info;
    int wanted;
    Image *image;
} Probe;

static void take_picture(Probe *probe) {
    AVFrame *frame = probe->frame;
    *probe->image = image_create(frame->width, frame->height);
    struct SwsContext *scaler = sws_getContext(
        frame->width, frame->height, frame->format, frame->width, frame->height, AV_PIX_FMT_RGB0,
        SWS_BICUBIC | SWS_ACCURATE_RND | SWS_FULL_CHR_H_INT, NULL, NULL, NULL);
    ASSERT(scaler);
    const int *table = sws_getCoefficients(SWS_CS_ITU709);
    sws_setColorspaceDetails(scaler, table, 0, table, 1, 0, FIXED_ONE, FIXED_ONE);
    uint8_t *rows[1] = {probe->image->rgba};
    int stride[1] = {IMAGE_CHANNELS * frame->width};
    sws_scale(scaler, (const uint8_t *const *)frame->data, frame->linesize, 0, frame->height, rows,
              stride);
    sws_freeContext(scaler);
}

static void drain(Probe *probe) {
    while (avcodec_receive_frame(probe->decoder, probe->frame) >= 0) {
        if (probe->info->frames == probe->wanted && probe->image) {
            take_picture(probe);
        }
        probe->info->frames++;
    }
}

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

static bool probe_stream(Probe *probe, const char *path, Error *error) {
    const AVCodec *codec = NULL;
    int code = avformat_find_stream_info(probe->file, NULL);
    int number = av_find_best_stream(probe->file, AVMEDIA_TYPE_VIDEO, -1, -1, &codec, 0);
    if (code < 0 || number < 0) {
        return error_set(error, EXIT_BAD_INPUT, "%s: there is no video in it", path);
    }
    AVStream *stream = probe->file->streams[number];
    describe(stream, probe->info);
    probe->decoder = avcodec_alloc_context3(codec);
    ASSERT(probe->decoder);
    probe->decoder->thread_count = 1;
    avcodec_parameters_to_context(probe->decoder, stream->codecpar);
    if (avcodec_open2(probe->decoder, codec, NULL) < 0) {
        return error_set(error, EXIT_BAD_INPUT, "%s: cannot be decoded", path);
    }
    while (av_read_frame(probe->file, probe->packet) >= 0) {
        if (probe->packet->stream_index == number &&
            avcodec_send_packet(probe->decoder, probe->packet) >= 0) {
            drain(probe);
        }
        av_packet_unref(probe->packet);
    }
    avcodec_send_packet(probe->decoder, NULL);
    drain(probe);
    return true;
}

bool video_probe(const char *path, VideoInfo *info, int frame, Image *image, Error *error) {
    av_log_set_level(AV_LOG_QUIET);
    *info = (VideoInfo){0};
    Probe probe = {.info = info, .wanted = frame, .image = image};
    int code = avformat_open_input(&probe.file, path, NULL, NULL);
    if (code < 0) {
        return error_set(error, code == AVERROR(ENOENT) ? EXIT_MISSING_INPUT : EXIT_BAD_INPUT,
                         "%s: is no video that can be read", path);
    }
    probe.packet = av_packet_alloc();
    probe.frame = av_frame_alloc();
    ASSERT(probe.packet && probe.frame);
    bool good = probe_stream(&probe, path, error);
    info->index_first = index_is_first(path);
    av_packet_free(&probe.packet);
    av_frame_free(&probe.frame);
    avcodec_free_context(&probe.decoder);
    avformat_close_input(&probe.file);
    return good;
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
