/* diff: metrics against ffmpeg and the published FLIP, profiles and thresholds, pictures of every kind,
 * sequences, videos, folders, states; the reports, --update, and the snippets of the README. */
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "render/diff.h"
#include "render/image_exr.h"
#include "render/image_source.h"
#include "tests/support/check.h"
#include "tests/support/drapes.h"
#include "tests/support/render_states.h"
#include "tests/support/shell.h"

#define GOLDEN TOILE_SOURCE_DIR "/tests/golden/"
#define WIDTH 96
#define HEIGHT 64

static char folder[] = "/tmp/toile_test_diff_XXXXXX";
static char program[4096], text[1 << 17];

static int shell(const char *command) {
    char whole[16384];
    snprintf(whole, sizeof whole, "cd %s && PATH=%s:$PATH && ( %s ) 2>&1", folder, program,
             command);
    return shell_run(whole, text, sizeof text);
}

static int diff(const char *arguments) {
    char command[8000];
    snprintf(command, sizeof command, "toile-render diff %s", arguments);
    return shell(command);
}

static const char *in_folder(const char *name) {
    static char paths[4][4200];
    static int next = 0;
    char *path = paths[next++ % 4];
    snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

static uint8_t *pixel(Image *image, int x, int y) {
    return image->rgba + IMAGE_CHANNELS * ((size_t)y * (size_t)image->width + (size_t)x);
}

/* A soft pattern; shift: to the right; every `change`th pixel is brighter by `by`. */
static Image make_picture(int shift, int change, int by) {
    Image image = image_create(WIDTH, HEIGHT);
    for (int i = 0; i < WIDTH * HEIGHT; i++) {
        double x = i % WIDTH - shift, y = i / WIDTH;
        for (int k = 0; k < 3; k++) {
            double value = 120 + 70 * sin(0.2 * x + k) * cos(0.15 * y - k);
            image.rgba[4 * i + k] = (uint8_t)(value + (change && i % change == 0 ? by : 0));
        }
        image.rgba[4 * i + 3] = 255;
    }
    return image;
}

static void write_picture(const char *name, int shift, int change, int by) {
    Image image = make_picture(shift, change, by);
    assert_true(image_write_png(in_folder(name), &image, NULL, 0, NULL));
    image_free(&image);
}

/* ---- metrics ---- */

/* A number after `key` in what ffmpeg prints. */
static double ffmpeg(const char *filter, const char *a, const char *b, const char *key) {
    char command[4096];
    snprintf(command, sizeof command,
             "ffmpeg -nostdin -hide_banner -i %s -i %s -lavfi "
             "'[0]format=gbrp[a];[1]format=gbrp[b];[a][b]%s' -f null -",
             a, b, filter);
    assert_int_equal(shell(command), 0);
    const char *at = strstr(text, key);
    assert_non_null(at);
    return atof(at + strlen(key));
}

static void test_ffmpeg_agrees(void **unused) {
    (void)unused;
    if (shell("command -v ffmpeg") != 0) {
        printf("SKIPPED: PSNR and SSIM against ffmpeg: not installed\n");
        return;
    }
    static const char *const names[] = {"shift.png", "brighter.png", "speckle.png"};
    Image a = make_picture(0, 0, 0);
    for (int i = 0; i < 3; i++) {
        Image b;
        assert_true(image_read(in_folder(names[i]), &b, NULL));
        double psnr = ffmpeg("psnr", "plain.png", names[i], "average:");
        double ssim = ffmpeg("ssim", "plain.png", names[i], "All:");
        CHECK_NEAR(image_compare(&a, &b).psnr, psnr, 5e-5);
        CHECK_NEAR(image_compare_blocks(&a, &b), ssim, 5e-6); /* its sums are in single precision */
        image_free(&b);
    }
    image_free(&a);
}

/* References: flip_evaluator 1.7 (the authors' program), LDR, default viewing distance, on the
 * pictures described. */
static void test_flip_agrees(void **unused) {
    (void)unused;
    Image a, b;
    assert_true(image_read(GOLDEN "ball.png", &a, NULL));
    b = image_create(a.width, a.height);
    for (int y = 0; y < a.height; y++) { /* two pixels to the right, around */
        for (int x = 0; x < a.width; x++) {
            memcpy(pixel(&b, (x + 2) % a.width, y), pixel(&a, x, y), 4);
        }
    }
    CHECK_NEAR(image_compare_flip(&a, &b, NULL), 0.028642, 2e-5);
    for (int i = 0; i < 4 * a.width * a.height; i++) { /* one level in ten brighter, in steps */
        b.rgba[i] = (uint8_t)(i % 4 == 3 ? 255 : (a.rgba[i] * 9 + 255) / 10);
    }
    CHECK_NEAR(image_compare_flip(&a, &b, NULL), 0.162320, 2e-5);
    CHECK_NEAR(image_compare_flip(&a, &a, NULL), 0.0, 0.0);
    image_free(&a);
    image_free(&b);
    /* black against white: nothing could differ more */
    Image black = image_create(32, 32), white = image_create(32, 32);
    memset(white.rgba, 255, 4 * 32 * 32);
    CHECK_NEAR(image_compare_flip(&black, &white, NULL), 0.967395, 2e-5);
    image_free(&black);
    image_free(&white);
}

/* ---- verdicts ---- */

static void test_profiles(void **unused) {
    (void)unused;
    assert_int_equal(diff("plain.png same.png --profile exact"), EXIT_OK);
    assert_int_equal(diff("plain.png one.png --profile exact"), EXIT_DIFFERS);
    assert_non_null(strstr(text, "largest 1 > 0 (exact)"));
    assert_int_equal(diff("plain.png one.png"), EXIT_OK);
    assert_int_equal(diff("plain.png brighter.png"), EXIT_DIFFERS); /* all by 1: the signed mean */
    assert_non_null(strstr(text, "mean 1 > 0.5 (golden)"));
    assert_int_equal(diff("plain.png speckle.png"), EXIT_DIFFERS);
    assert_non_null(strstr(text, "share 1.009 % > 0.2 % (golden)"));
    assert_int_equal(diff("plain.png speckle.png --profile look"), EXIT_OK);
    assert_int_equal(diff("plain.png shift.png --profile look"), EXIT_DIFFERS);
    assert_int_equal(diff("plain.png same.png --profile goldn"), EXIT_USAGE);
    assert_non_null(strstr(text, "did you mean 'golden'"));
    assert_int_equal(diff("plain.png"), EXIT_USAGE);
    assert_int_equal(diff("plain.png none.png"), EXIT_MISSING_INPUT);
}

static void write_text(const char *name, const char *words) {
    FILE *file = fopen(in_folder(name), "w");
    assert_non_null(file);
    fputs(words, file);
    fclose(file);
}

static void test_thresholds(void **unused) {
    (void)unused;
    write_text("loose", "# all of them\nprofile: golden\nshare: 2 %\npsnr: 30 dB\n\nssim: off\n");
    assert_int_equal(diff("plain.png speckle.png --thresholds loose"), EXIT_OK);
    write_text("named", "[speck*.png]\nshare: 0.02\npsnr: 20\nssim: 0.9\n[other.png]\nshare: 0\n");
    assert_int_equal(diff("plain.png speckle.png --thresholds named"), EXIT_OK);
    write_text("strict", "share: 0.02\npsnr: 20\nssim: 0.9\nflip: 0.000001\n");
    assert_int_equal(diff("plain.png speckle.png --thresholds strict"), EXIT_DIFFERS);
    assert_non_null(strstr(text, "flip"));
    write_text("step", "step: 40\nssim: off\npsnr: off\n");
    assert_int_equal(diff("plain.png speckle.png --thresholds step"), EXIT_OK);
    static const struct {
        const char *words, *message;
    } wrong[] = {{"share: 1\npsmr: 3\n", "w:2: 'psmr' is no threshold; did you mean 'psnr'?"},
                 {"share\n", "w:1: expected NAME: LIMIT"},
                 {"share: -1\n", "w:1: '-1' of share: expected a number, alone or in %"},
                 {"psnr: 3 m\n", "w:1: '3 m' of psnr"},
                 {"psnr: nan\n", "w:1: 'nan' of psnr"},
                 {"\n\n[open\n", "w:3: expected [PATTERN]"},
                 {"[a]\nprofile: look\n", "w:2: profile belongs before"},
                 {"profile: lok\n", "w:1: profile 'lok'"}};
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        write_text("w", wrong[i].words);
        assert_int_equal(diff("plain.png same.png --thresholds w"), EXIT_BAD_INPUT);
        assert_non_null(strstr(text, wrong[i].message));
    }
    assert_int_equal(diff("plain.png same.png --thresholds none"), EXIT_MISSING_INPUT);
}

static void test_sizes_and_alpha(void **unused) {
    (void)unused;
    assert_int_equal(diff("plain.png small.png"), EXIT_BAD_INPUT);
    assert_non_null(strstr(text, "sizes differ: 96 x 64 and 48 x 32; --resize"));
    assert_int_equal(diff("plain.png small.png --resize --profile lossy"), EXIT_DIFFERS);
    /* what is clear has no colour; a changed alpha is a change */
    if (shell("ffmpeg -nostdin -v error -y -i plain.png -vf "
              "format=rgba,colorchannelmixer=aa=0 clear1.png && ffmpeg -nostdin -v error -y -i "
              "shift.png "
              "-vf format=rgba,colorchannelmixer=aa=0 clear2.png") != 0) {
        printf("SKIPPED: alpha: ffmpeg is not installed\n");
        return;
    }
    assert_int_equal(diff("clear1.png clear2.png --profile exact"), EXIT_OK);
    assert_int_equal(diff("plain.png clear1.png --profile look"), EXIT_DIFFERS);
    assert_int_equal(diff("black.png clear1.png --profile exact"), EXIT_DIFFERS);
}

/* ---- kinds of input ---- */

static void test_videos(void **unused) {
    (void)unused;
    const char *make = "rm -rf seq && mkdir seq && for i in 0 1 2 3 4 5 6 7 8 9 10 11; do cp "
                       "plain.png seq/$i.png; done && cp shift.png seq/5.png && "
                       "ffmpeg -nostdin -v error -y -i seq/%d.png -pix_fmt gbrp -c:v ffv1 "
                       "-color_range pc all.mkv && ffmpeg -nostdin -v error -y -i seq/%d.png "
                       "-frames:v 7 -pix_fmt yuv444p -vf scale=out_color_matrix=bt709:out_range=tv "
                       "-colorspace bt709 -color_range tv -crf 12 short.mp4";
    if (shell(make) != 0) {
        printf("SKIPPED: videos: ffmpeg is not installed: %s\n", text);
        return;
    }
    /* without loss it is the sequence again, whose numbers are in order: 2 before 10 */
    assert_int_equal(diff("seq/%d.png all.mkv --profile exact"), EXIT_OK);
    assert_non_null(strstr(text, "0 of 12 frames differ"));
    assert_int_equal(diff("seq/%d.png short.mp4 --profile lossy"), EXIT_DIFFERS);
    assert_non_null(strstr(text, "b ends after 7 frames, the other one goes on"));
    assert_non_null(strstr(text, "0 of 7 frames differ"));
    assert_int_equal(shell("cp -r seq seq2 && cp plain.png seq2/5.png"), 0);
    assert_int_equal(diff("seq2/%d.png all.mkv"), EXIT_DIFFERS);
    assert_non_null(strstr(text, "1 of 12 frames differ"));
    assert_int_equal(shell("head -c 9000 all.mkv > torn.mkv"), 0);
    assert_int_equal(diff("seq/%d.png plain.png"), EXIT_DIFFERS);
    assert_int_not_equal(diff("seq/%d.png torn.mkv --profile exact"), EXIT_OK);
    assert_int_equal(diff("loose all.mkv"), EXIT_BAD_INPUT); /* text is no video */
}

static void test_picture_formats(void **unused) {
    (void)unused;
    if (shell(
            "ffmpeg -nostdin -v error -y -i plain.png -pix_fmt yuvj444p -q:v 1 plain.jpg && "
            "ffmpeg -nostdin -v error -y -i plain.png -pix_fmt rgb48be deep.png && "
            "ffmpeg -nostdin -v error -y -i plain.png plain.tiff && "
            "ffmpeg -nostdin -v error -y -i plain.png -vf zscale=t=linear,format=gbrpf32le "
            "plain.exr || ffmpeg -nostdin -v error -y -i plain.png -pix_fmt gbrpf32le plain.exr") !=
        0) {
        printf("SKIPPED: formats of pictures: ffmpeg is not installed: %s\n", text);
        return;
    }
    assert_int_equal(diff("plain.png deep.png"), EXIT_OK); /* ffmpeg rounds */
    assert_int_equal(diff("plain.png plain.tiff --profile exact"), EXIT_OK);
    assert_int_equal(diff("plain.png plain.jpg --profile lossy"), EXIT_OK);
    assert_int_equal(diff("plain.exr plain.exr --profile exact"), EXIT_OK);
    /* damaged ones are named, whatever their kind */
    assert_int_equal(shell("head -c 900 plain.jpg > torn.jpg; head -c 300 plain.png > torn.png; "
                           "head -c 500 plain.tiff > torn.tiff; : > empty.jpg"),
                     0);
    static const char *const bad[] = {"torn.jpg", "torn.png", "torn.tiff", "empty.jpg"};
    for (int i = 0; i < 4; i++) {
        char arguments[64];
        snprintf(arguments, sizeof arguments, "plain.png %s", bad[i]);
        assert_int_equal(diff(arguments), EXIT_BAD_INPUT);
        assert_non_null(strstr(text, bad[i]));
    }
}

static void test_folders(void **unused) {
    (void)unused;
    assert_int_equal(shell("rm -rf fa fb; mkdir -p fa/deep fb/deep; cp plain.png fa/; cp same.png "
                           "fb/plain.png; cp plain.png fa/deep/x.png; cp shift.png fb/deep/x.png; "
                           "echo 1 > fa/notes.txt; echo 2 > fb/notes.txt; cp plain.png fb/new.png; "
                           "cp plain.png fa/gone.png; touch fa/.hidden fb/junk.part"),
                     0);
    assert_int_equal(diff("fa fb --json"), EXIT_DIFFERS);
    assert_non_null(strstr(text, "\"items\": 5, \"items_differ\": 4"));
    assert_non_null(strstr(text, "\"name\": \"notes.txt\", \"differs\": true, \"trouble\": "
                                 "\"differs at byte 0\""));
    assert_non_null(strstr(text, "\"trouble\": \"is missing in a\""));
    assert_non_null(strstr(text, "\"trouble\": \"is missing in b\""));
    assert_int_equal(diff("fa fa"), EXIT_OK);
    assert_int_equal(shell("mkdir -p none1 none2"), 0);
    assert_int_equal(diff("none1 none2"), EXIT_MISSING_INPUT);
}

static void test_states(void **unused) {
    (void)unused;
    assert_true(render_states_write("sleeve", in_folder("a.states"), 0, 4, 10, NULL, true, NULL));
    assert_true(render_states_write("sleeve", in_folder("b.states"), 0, 4, 10, NULL, true, NULL));
    assert_true(
        render_states_write("sleeve", in_folder("later.states"), 1, 4, 10, NULL, true, NULL));
    assert_true(
        render_states_write("sleeve", in_folder("finer.states"), 0, 4, 12, NULL, true, NULL));
    assert_true(
        render_states_write("sleeve", in_folder("long.states"), 0, 5, 10, NULL, true, NULL));
    assert_int_equal(diff("a.states b.states --profile exact"), EXIT_OK);
    assert_int_equal(diff("a.states later.states"), EXIT_DIFFERS);
    assert_int_equal(diff("a.states finer.states"), EXIT_DIFFERS);
    assert_non_null(strstr(text, "the meshes differ"));
    assert_int_equal(diff("a.states long.states"), EXIT_DIFFERS);
    assert_non_null(strstr(text, "a has 4 frames, b has 5"));
    assert_int_equal(diff("a.states plain.png"), EXIT_USAGE);
    /* a run is a folder with states, too */
    assert_int_equal(shell("mkdir -p r1 r2; cp a.states r1/run.states; cp a.states r2/run.states"),
                     0);
    assert_int_equal(diff("r1 r2 --profile exact"), EXIT_OK);
}

/* The number after "key": of the last row in JSON. */
static double last_number(const char *key) {
    const char *found = NULL, *at = text;
    while ((at = strstr(at, key)) != NULL) {
        at += strlen(key);
        found = at;
    }
    assert_non_null(found);
    return atof(found + 1);
}

/* Files that hold more than 8 bits are the same only when all of it is. */
static void test_deep_files(void **unused) {
    (void)unused;
    ExrPicture picture = exr_create(40, 30);
    for (int i = 0; i < 40 * 30; i++) {
        picture.rgba[4 * i] = picture.rgba[4 * i + 3] = 0.5f;
        picture.depth[i] = 2.0f;
        picture.id[i] = 7;
    }
    assert_true(exr_write(in_folder("deep-a.exr"), &picture, NULL, 0, NULL));
    picture.depth[777] += 0.25f; /* no colour changes */
    assert_true(exr_write(in_folder("deep-b.exr"), &picture, NULL, 0, NULL));
    assert_int_equal(diff("deep-a.exr deep-a.exr --profile exact"), EXIT_OK);
    assert_int_equal(diff("deep-a.exr deep-b.exr"), EXIT_OK); /* golden asks for what is seen */
    assert_int_equal(diff("deep-a.exr deep-b.exr --profile exact --json"), EXIT_DIFFERS);
    assert_true(last_number("\"deep\"") == 0.25);
    picture.depth[777] = INFINITY;
    assert_true(exr_write(in_folder("deep-b.exr"), &picture, NULL, 0, NULL));
    assert_int_equal(diff("deep-a.exr deep-b.exr --profile exact"), EXIT_DIFFERS);
    exr_free(&picture);
    /* 16-bit PNG, one step of 65535 apart: the same in 8 bits */
    assert_int_equal(
        shell("ffmpeg -nostdin -v error -y -f lavfi -i color=gray:size=40x30 -frames:v 1 "
              "-vf format=rgb48be,geq=r=20000:g=20000:b=20000 deep-a.png; "
              "ffmpeg -nostdin -v error -y -f lavfi -i color=gray:size=40x30 -frames:v 1 "
              "-vf format=rgb48be,geq=r=20001:g=20000:b=20000 deep-b.png"),
        0);
    assert_int_equal(diff("deep-a.png deep-a.png --profile exact"), EXIT_OK);
    assert_int_equal(diff("deep-a.png deep-b.png"), EXIT_OK);
    assert_int_equal(diff("deep-a.png deep-b.png --profile exact --json"), EXIT_DIFFERS);
    assert_true(fabs(last_number("\"deep\"") - 1 / 65535.0) < 1e-7);
}

static void write_drape(const char *name, double mean, int folds, int rings) {
    DrapeShape shape = drape_shape_default();
    shape.a[6] = 0;
    shape.a[0] = mean;
    shape.a[folds] = 0.01;
    shape.rings = rings;
    assert_true(drape_shape_write(&shape, in_folder(name)));
}

static void test_geometry(void **unused) {
    (void)unused;
    DrapeShape shape = drape_shape_default();
    double dc = drape_shape_dc(&shape);
    shape.a[0] = 0.1205;
    double wider = drape_shape_dc(&shape) - dc;
    write_drape("six.states", 0.12, 6, 30);
    write_drape("coarse.states", 0.12, 6, 24);
    write_drape("wide.states", 0.1205, 6, 30);
    write_drape("five.states", 0.12, 5, 30);
    /* another mesh of the same drape */
    assert_int_equal(diff("six.states coarse.states --profile geometry"), EXIT_OK);
    assert_int_equal(diff("six.states coarse.states"), EXIT_DIFFERS);
    /* half a millimetre more all around */
    assert_true(wider > 0.55 && wider < 1.0);
    assert_int_equal(diff("six.states wide.states --profile geometry --json"), EXIT_DIFFERS);
    assert_true(fabs(last_number("\"drape\"") - wider) < 0.05);
    assert_true(fabs(last_number("\"outline\"") - 0.0005 / 0.15) < 0.0008);
    assert_non_null(strstr(text, "drape 0."));
    /* the same coefficient in five folds */
    assert_int_equal(diff("six.states five.states --profile geometry --json"), EXIT_DIFFERS);
    assert_true(last_number("\"nodes\"") == 1.0);
    assert_true(last_number("\"outline\"") > 0.01);
    /* no support: nothing to measure */
    assert_int_equal(diff("a.states b.states --profile geometry"), EXIT_BAD_INPUT);
    assert_non_null(strstr(text, "no support"));
}

/* ---- reports ---- */

static void test_reports(void **unused) {
    (void)unused;
    assert_int_equal(diff("fa fb -o report --quiet"), EXIT_DIFFERS);
    assert_int_equal(shell("python3 -m json.tool report/diff.json > /dev/null"), 0);
    assert_int_equal(shell("python3 -c 'import xml.etree.ElementTree as t; r = t.parse("
                           "\"report/junit.xml\").getroot(); print(r.get(\"tests\"), "
                           "r.get(\"failures\"), len(r.findall(\".//failure\")), "
                           "len(r.findall(\".//testcase\")))'"),
                     0);
    assert_string_equal(text, "5 4 4 5\n");
    Image strip, heat, a;
    assert_true(image_read(in_folder("report/side-by-side.png"), &strip, NULL));
    assert_true(image_read(in_folder("report/difference.png"), &heat, NULL));
    assert_true(image_read(in_folder("fa/deep/x.png"), &a, NULL));
    assert_int_equal(strip.width, 3 * WIDTH + 16);
    assert_memory_equal(pixel(&strip, 40, 20), pixel(&a, 40, 20), 4);
    assert_memory_equal(pixel(&strip, 2 * WIDTH + 16 + 33, 20), pixel(&heat, 33, 20), 4);
    image_free(&strip);
    image_free(&heat);
    image_free(&a);
    assert_int_equal(shell("grep -c 'src=\"http' report/diff.html"), 1); /* grep: none */
    assert_int_equal(diff("plain.png shift.png -o /dev/null/x"), EXIT_IO);
}

static void test_page(void **unused) {
    (void)unused;
    if (shell("command -v chromium") != 0) {
        printf("SKIPPED: the page in a browser: chromium is not installed\n");
        return;
    }
    assert_int_equal(diff("plain.png shift.png -o page --quiet"), EXIT_DIFFERS);
    /* moves the slider and reads back where the second picture begins */
    assert_int_equal(
        shell(
            "sed -i 's|</body>|<script>const s = document.querySelector(\"input\"); s.value = 20; "
            "s.dispatchEvent(new Event(\"input\")); document.title = "
            "document.querySelector(\".b\").style.clipPath + "
            "document.querySelector(\".a\").naturalWidth;</script></body>|' page/diff.html && "
            "chromium --headless --no-sandbox --disable-gpu --virtual-time-budget=3000 --dump-dom "
            "\"file://$PWD/page/diff.html\""),
        0);
    assert_non_null(strstr(text, "data-ready=\"1\""));
    assert_non_null(strstr(text, "<title>inset(0px 0px 0px 20%)96</title>"));
}

static void test_update(void **unused) {
    (void)unused;
    assert_int_equal(shell("rm -rf ga gb; cp -r fa ga; cp -r fb gb"), 0);
    assert_int_equal(diff("ga gb --update"), EXIT_OK);
    assert_non_null(strstr(text, "git add ga/deep/x.png ga/new.png ga/notes.txt\n"));
    assert_non_null(strstr(text, "# ga/gone.png is not made any more"));
    assert_int_equal(shell("cmp ga/deep/x.png gb/deep/x.png && rm ga/gone.png"), 0);
    assert_int_equal(diff("ga gb"), EXIT_OK);
    assert_int_equal(diff("ga gb --update"), EXIT_OK);
    assert_non_null(strstr(text, "nothing to accept"));
}

/* The commands of a snippet of the README, as its CI would run them: what is indented below `head`. */
static void run_snippet(const char *file, const char *head, int expected) {
    char command[2048];
    snprintf(
        command, sizeof command,
        "awk -v file='%s' -v head='%s' 'index($0, file) { inside = 1 } /^```$/ { inside = 0 } "
        "inside && on { match($0, /^ */); if (RLENGTH <= depth) { on = 0 } else { "
        "sub(/^ *(- )?/, \"\"); print } } inside && index($0, head) { match($0, /^ */); depth = "
        "RLENGTH; on = 1 }' " TOILE_SOURCE_DIR "/README.md > snippet.sh && test -s snippet.sh && "
        "cat snippet.sh && sh -e snippet.sh",
        file, head);
    int code = shell(command);
    if (code != expected) {
        printf("%s\n", text);
    }
    assert_int_equal(code, expected);
}

static void test_snippets(void **unused) {
    (void)unused;
    assert_int_equal(
        shell("mkdir -p bin tests/golden build/pictures; ln -sf $(command -v toile-render) "
              "bin/toile; printf '#!/bin/sh\\n' > make-pictures; chmod +x "
              "make-pictures; cp plain.png tests/golden/a.png; cp plain.png "
              "build/pictures/a.png"),
        0);
    char path[4300];
    snprintf(path, sizeof path, "%s/bin:%s", folder, getenv("PATH"));
    setenv("PATH", path, 1);
    static const char *const ci[][2] = {{".github/workflows", "run: |"},
                                        {".gitlab-ci.yml", "script:"}};
    for (int i = 0; i < 2; i++) {
        assert_int_equal(shell("rm -rf build/diff; cp plain.png build/pictures/a.png"), 0);
        run_snippet(ci[i][0], ci[i][1], EXIT_OK);
        assert_int_equal(shell("cp shift.png build/pictures/a.png"), 0);
        run_snippet(ci[i][0], ci[i][1], EXIT_DIFFERS);
        assert_int_equal(shell("test -s build/diff/junit.xml && test -s build/diff/diff.html"), 0);
    }
}

int main(int argc, char **argv) {
    (void)argc;
    char *absolute = realpath(argv[0], NULL),
         *slash = absolute ? strstr(absolute, "/tests/") : NULL;
    if (!slash || !mkdtemp(folder)) {
        fprintf(stderr, "test_diff: must be started as build/CONFIG/tests/test_diff\n");
        return 1;
    }
    snprintf(program, sizeof program, "%.*s", (int)(slash - absolute), absolute);
    free(absolute);
    write_picture("plain.png", 0, 0, 0);
    write_picture("same.png", 0, 0, 0);
    write_picture("one.png", 0, 5000, 1);
    write_picture("shift.png", 3, 0, 0);
    write_picture("brighter.png", 0, 1, 1);
    write_picture("speckle.png", 0, 100, 9);
    Image small = image_create(48, 32), black = image_create(WIDTH, HEIGHT);
    image_write_png(in_folder("small.png"), &small, NULL, 0, NULL);
    image_write_png(in_folder("black.png"), &black, NULL, 0, NULL);
    image_free(&small);
    image_free(&black);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_ffmpeg_agrees),
        cmocka_unit_test(test_flip_agrees),
        cmocka_unit_test(test_profiles),
        cmocka_unit_test(test_thresholds),
        cmocka_unit_test(test_sizes_and_alpha),
        cmocka_unit_test(test_videos),
        cmocka_unit_test(test_picture_formats),
        cmocka_unit_test(test_folders),
        cmocka_unit_test(test_states),
        cmocka_unit_test(test_geometry),
        cmocka_unit_test(test_deep_files),
        cmocka_unit_test(test_reports),
        cmocka_unit_test(test_page),
        cmocka_unit_test(test_update),
        cmocka_unit_test(test_snippets),
    };
    int failed = cmocka_run_group_tests(tests, NULL, NULL);
    char command[4200];
    snprintf(command, sizeof command, "rm -rf %s", folder);
    return system(command) == 0 ? failed : 1;
}
