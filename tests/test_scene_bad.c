/* Malformed scenes and fabrics: each gives its message, at its place, with its exit code. */
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "sim/scene/scene.h"
#include "tests/support/check.h"
#include "tests/support/shell.h"

static const char *const models[] = {"springs", "triangles", "particles", "mlpg", NULL};
static const char *const steppers[] = {"auto", "central", "bdf2", "static", NULL};
static const char *const looks[] = {"teal-twill", "clay", NULL};
static const SceneWords words = {models, steppers, looks};

typedef struct BadFile {
    const char *name; /* tests/bad/NAME.yaml */
    ExitCode code;
    const char *message; /* how a line of the error ends, or goes on */
} BadFile;

static const BadFile bad_files[] = {
    {"accuracy", EXIT_BAD_INPUT,
     "accuracy.yaml:6:15: error: 'accuracy' is 200 %; it must be 1e-05 .. 0.5"},
    {"alias", EXIT_BAD_INPUT,
     "alias.yaml:4:6: error: aliases (*name) are not supported; use 'include'"},
    {"anchor", EXIT_BAD_INPUT,
     "anchor.yaml:2:8: error: anchors (&name) are not supported; use 'include'"},
    {"annulus", EXIT_BAD_INPUT, "annulus.yaml:4:22: error: 'inner' is not smaller than 'radius'"},
    {"at-two", EXIT_BAD_INPUT,
     "at-two.yaml:6:9: error: 'at' wants a list of 3 numbers such as [0, 0, 1],"},
    {"bad-indent", EXIT_BAD_INPUT,
     "bad-indent.yaml:5:4: error: did not find expected key (while parsing a block"},
    {"binary", EXIT_BAD_INPUT,
     "binary.yaml:2:1: error: byte 0x7F is not UTF-8 text; is this a binary file?"},
    {"camera-point", EXIT_BAD_INPUT,
     "camera-point.yaml:2:16: error: 'eye' and 'target' are the same point"},
    {"camera-up", EXIT_BAD_INPUT,
     "camera-up.yaml:2:16: error: the camera looks along 'up'; choose another 'up'"},
    {"camera-word", EXIT_BAD_INPUT,
     "camera-word.yaml:2:16: error: 'camera' wants auto or a mapping of keys, found"},
    {"camera-keys-order", EXIT_BAD_INPUT,
     "camera-keys-order.yaml:2:48: error: 't' is 1 s, not after 1 s of the key before"},
    {"camera-keys-one", EXIT_BAD_INPUT,
     "camera-keys-one.yaml:2:23: error: 'keys' wants a list of 2 to 16 mappings"},
    {"camera-orbit", EXIT_BAD_INPUT,
     "camera-orbit.yaml:2:24: error: the orbit ends at 2 s before it starts at 3 s"},
    {"cameras-name", EXIT_BAD_INPUT,
     "cameras-name.yaml:2:18: error: 'my.top' cannot name a camera"},
    {"film-range", EXIT_BAD_INPUT, "film-range.yaml:2:15: error: 'range' goes from 2 to -2"},
    {"film-scale", EXIT_BAD_INPUT,
     "film-scale.yaml:2:20: error: 'show_scale' needs 'camera: {orthographic: true}'"},
    {"film-surface", EXIT_BAD_INPUT,
     "film-surface.yaml:2:17: error: 'splat' is not a surface; did you mean 'splats'?"},
    {"cloth-empty", EXIT_BAD_INPUT,
     "cloth-empty.yaml:2:8: error: 'cloth' wants a mapping of 1 .. 1000 names to"},
    {"cloth-name", EXIT_BAD_INPUT,
     "cloth-name.yaml:3:3: error: 'my.cloth' cannot name a cloth: a letter, then"},
    {"contact-stepper", EXIT_BAD_INPUT,
     "contact-stepper.yaml:6:19: error: contact by impulses needs the stepper central"},
    {"control", EXIT_BAD_INPUT,
     "control.yaml:2:8: error: there is a control character in this text"},
    {"deep", EXIT_BAD_INPUT, "deep.yaml:2:40: error: nested deeper than 32 levels"},
    {"duplicate-key", EXIT_BAD_INPUT,
     "duplicate-key.yaml:7:1: error: 'gravity' is here twice; the first one is in"},
    {"empty", EXIT_BAD_INPUT, "empty.yaml: error: the file is empty"},
    {"fabric-as-scene", EXIT_BAD_INPUT,
     "fabric-as-scene.yaml:1:1: error: a scene starts with 'toile: 1'; this is a"},
    {"fabric-bending-bare", EXIT_BAD_INPUT,
     "fabric-bending-bare.yaml:5:41: error: bending length 347.4 mm is stiffer than"},
    {"fabric-bending-dimension", EXIT_BAD_INPUT,
     "fabric-bending-dimension.yaml:5:41: error: 'warp' wants a bending rigidity [N"},
    {"fabric-bias", EXIT_BAD_INPUT,
     "fabric-bias.yaml:5:106: error: 'poisson' wants a plain number, but 'rad' is"},
    {"fabric-bias-low", EXIT_BAD_INPUT,
     "fabric-bias-low.yaml:5:79: error: bias 2.41 of the mean: no positive twisting"},
    {"fabric-bulk", EXIT_BAD_INPUT,
     "fabric-bulk.yaml:5:43: error: weight/thickness 4000 kg/m3 is denser than"},
    {"fabric-circle", EXIT_BAD_INPUT, "fabric-like-itself.yaml:2:7: error: a file needs itself: "},
    {"fabric-density", EXIT_BAD_INPUT,
     "fabric-density.yaml:5:22: error: 'weight' wants a weight per area [kg/m2],"},
    {"fabric-flag", EXIT_BAD_INPUT,
     "fabric-flag.yaml:5:46: error: 'mesured' is not a flag; did you mean 'measured'?"},
    {"fabric-friction", EXIT_BAD_INPUT,
     "fabric-friction.yaml:5:42: error: 'friction' is -0.1; it must be 0 .. 100"},
    {"fabric-hysteresis", EXIT_BAD_INPUT,
     "fabric-hysteresis.yaml:5:82: error: hysteresis 2HB/B 4.714e+06 1/m is high;"},
    {"fabric-in-file", EXIT_BAD_INPUT,
     "fabric-broken.yaml:5:34: error: 'flg' is not a key of 'measured number'; did you mean "
     "'flag'?"},
    {"fabric-isotropic-poisson", EXIT_BAD_INPUT,
     "fabric-isotropic-poisson.yaml:5:73: error: 'poisson' is 0.7; it must be -0.99"},
    {"fabric-like", EXIT_MISSING_INPUT,
     "fabric-like.yaml:5:20: error: no fabric is called 'velvet'; one of canvas,"},
    {"fabric-low", EXIT_BAD_INPUT,
     "fabric-low.yaml:5:30: error: 'weight' is not between its low and high"},
    {"fabric-missing-file", EXIT_MISSING_INPUT,
     "fabric-missing-file.yaml:5:13: error: there is no file '"},
    {"fabric-modulus", EXIT_BAD_INPUT,
     "fabric-modulus.yaml:5:60: error: stretch 1.2e+07 N/m is very stiff (fabrics:"},
    {"fabric-no-weight", EXIT_BAD_INPUT,
     "fabric-no-weight.yaml:5:5: error: a fabric needs its 'weight', such as 160"},
    {"fabric-poisson", EXIT_BAD_INPUT,
     "fabric-poisson.yaml:5:82: error: poisson 0.9 with stretch warp/weft = 0.3 is"},
    {"fabric-thickness", EXIT_BAD_INPUT,
     "fabric-thickness.yaml:5:43: error: 'thickness' is -0.4 mm; it must be 1e-06"},
    {"fabric-two-ways", EXIT_BAD_INPUT,
     "fabric-two-ways.yaml:5:49: error: 'bending' and 'bending_length' say the"},
    {"fabric-unknown", EXIT_MISSING_INPUT,
     "fabric-unknown.yaml:5:13: error: no fabric is called 'wool-tropicl'; did you mean "
     "'wool-tropical'?"},
    {"fabric-version", EXIT_BAD_INPUT,
     "fabric-of-the-future.yaml:1:15: error: written for toile-fabric '7', this is"},
    {"fabric-weight", EXIT_BAD_INPUT,
     "fabric-weight.yaml:5:22: error: weight 0.163 g/m2 is lighter than any woven fabric (fabrics: "
     "15 .. 900 g/m2); did you mean 163 g/m2?"},
    {"fabric-curve", EXIT_BAD_INPUT,
     "fabric-curve.yaml:7:63: error: a point of 'curve_warp' is a pair [curvature, moment], found"},
    {"fabric-curve-angle", EXIT_BAD_INPUT,
     "fabric-curve-angle.yaml:7:43: error: 'curve' needs a unit: '0.5' could be degrees or"},
    {"fabric-curve-falls", EXIT_BAD_INPUT,
     "fabric-curve-falls.yaml:7:72: error: 'curve_warp' must rise from point to point"},
    {"fabric-curve-one", EXIT_BAD_INPUT,
     "fabric-curve-one.yaml:7:44: error: 'curve_warp' wants a list of 2 to 32 pairs, found"},
    {"fabric-curve-unit", EXIT_BAD_INPUT, "fabric-curve-unit.yaml:7:72: error: "},
    {"fabric-widening", EXIT_BAD_INPUT,
     "fabric-widening.yaml:7:67: error: hysteresis_5 8 N/m: with this stiffness and"},
    {"fabric-weight-bare", EXIT_BAD_INPUT,
     "fabric-weight-bare.yaml:5:22: error: weight 1.63e+05 g/m2 is heavier than any woven fabric "
     "(fabrics: 15 .. 900 g/m2); did you mean 163 g/m2?"},
    {"film-is-text", EXIT_BAD_INPUT,
     "film-is-text.yaml:6:7: error: 'film' wants a mapping of keys, found 'long'"},
    {"film-no-value", EXIT_BAD_INPUT,
     "film-no-value.yaml:2:14: error: 'rate' wants a rate [1/s], found nothing"},
    {"fov-and-focal", EXIT_BAD_INPUT,
     "fov-and-focal.yaml:2:16: error: 'fov' and 'focal' say the same; give one of"},
    {"garment-clamp", EXIT_BAD_INPUT,
     "garment-clamp.yaml:11:12: error: a garment cannot be clamped; 'hold' it"},
    {"garment-corner", EXIT_BAD_INPUT,
     "garment-corner.yaml:9:18: error: 'front.1-4': corners of 'front' are numbered 0 .. 3, as in"},
    {"garment-region", EXIT_BAD_INPUT,
     "garment-region.yaml:11:11: error: 'left' is not a region of 'tube', a garment; one of"},
    {"gravity-map", EXIT_BAD_INPUT,
     "gravity-map.yaml:6:10: error: 'gravity' wants an acceleration [m/s2], found a"},
    {"gravity-unit", EXIT_BAD_INPUT,
     "gravity-unit.yaml:6:10: error: 'gravity' wants an acceleration [m/s2], but"},
    {"handle-axis-zero", EXIT_BAD_INPUT,
     "handle-axis-zero.yaml:7:36: error: 'axis' has no direction"},
    {"handle-both", EXIT_BAD_INPUT,
     "handle-both.yaml:7:5: error: 'hold' and 'clamp' exclude each other"},
    {"handle-circle", EXIT_BAD_INPUT,
     "handle-circle.yaml:7:27: error: this is 0.4 m off the panel: there is no node"},
    {"handle-clamp-corner", EXIT_BAD_INPUT,
     "handle-clamp-corner.yaml:7:13: error: a single node has no edge to clamp;"},
    {"handle-cloth", EXIT_BAD_INPUT,
     "handle-cloth.yaml:7:12: error: no cloth is called 'sheat'; did you mean 'sheet'?"},
    {"handle-ease", EXIT_BAD_INPUT,
     "handle-ease.yaml:7:29: error: a speed without 'to' cannot end gently: leave"},
    {"handle-nearest", EXIT_BAD_INPUT,
     "handle-nearest.yaml:7:28: error: this is 0.2 m off the panel: there is no"},
    {"handle-neither", EXIT_BAD_INPUT,
     "handle-neither.yaml:7:5: error: a handle needs 'hold' or 'clamp'"},
    {"handle-no-region", EXIT_BAD_INPUT,
     "handle-no-region.yaml:7:12: error: which nodes of 'sheet'? write sheet.top,"},
    {"handle-on-broken-cloth", EXIT_BAD_INPUT,
     "handle-on-broken-cloth.yaml:4:32: error: 'width' is -1 m; it must be 0.0001"},
    {"handle-rate-bare", EXIT_BAD_INPUT,
     "handle-rate-bare.yaml:7:45: error: 'rate' wants a turning speed [rad/s], but"},
    {"handle-region", EXIT_BAD_INPUT,
     "handle-region.yaml:7:12: error: 'topp' is not a region of 'sheet', a rectangle; did you mean "
     "'top'?"},
    {"handle-region-shape", EXIT_BAD_INPUT,
     "handle-region-shape.yaml:7:12: error: 'left' is not a region of 'sheet', a"},
    {"handle-release", EXIT_BAD_INPUT,
     "handle-release.yaml:7:77: error: released at 1 s, before its motion starts at"},
    {"handle-times", EXIT_BAD_INPUT,
     "handle-times.yaml:7:53: error: the motion ends at 2 s before it starts at 3 s"},
    {"handle-turn-both", EXIT_BAD_INPUT,
     "handle-turn-both.yaml:7:29: error: 'by' and 'rate' exclude each other"},
    {"handle-turn-length", EXIT_BAD_INPUT,
     "handle-turn-length.yaml:7:43: error: 'by' wants an angle [rad], but 'cm' is a"},
    {"handle-turn-nothing", EXIT_BAD_INPUT,
     "handle-turn-nothing.yaml:7:29: error: a turn needs 'by' (an angle) or 'rate'"},
    {"handle-twice", EXIT_BAD_INPUT,
     "handle-twice.yaml:8:12: error: these nodes are held already, at "},
    {"handles-map", EXIT_BAD_INPUT,
     "handles-map.yaml:6:10: error: 'handles' wants a list such as - {hold:"},
    {"include-broken", EXIT_BAD_INPUT, "tab.yaml:3:1: error: a tab cannot indent YAML; use spaces"},
    {"include-directory", EXIT_IO, "include-directory.yaml:6:10: error: '"},
    {"include-itself", EXIT_BAD_INPUT, "include-itself.yaml:6:10: error: a file needs itself: "},
    {"include-list", EXIT_BAD_INPUT,
     "list.yaml:1:1: error: an included file must be a mapping of keys, found a list"},
    {"include-map", EXIT_BAD_INPUT,
     "include-map.yaml:6:10: error: 'include' wants the name of a file, found a"},
    {"include-missing", EXIT_MISSING_INPUT, "include-missing.yaml:6:10: error: there is no file '"},
    {"jitter", EXIT_BAD_INPUT, "jitter.yaml:7:13: error: 'jitter' is 0.9; it must be 0 .. 0.4"},
    {"kinematics-word", EXIT_BAD_INPUT,
     "kinematics-word.yaml:6:17: error: 'grean' is not a kinematics; did you mean 'green'?"},
    {"sides-word", EXIT_BAD_INPUT,
     "sides-word.yaml:6:12: error: 'bound' is not a sides; did you mean 'bounded'?"},
    {"latin1", EXIT_BAD_INPUT,
     "latin1.yaml:2:7: error: byte 0xDF is not UTF-8 text; is this a binary file?"},
    {"list", EXIT_BAD_INPUT, "list.yaml:1:1: error: a scene is a mapping of keys, found a list"},
    {"list-key", EXIT_BAD_INPUT, "list-key.yaml:2:3: error: a key must be a word, found a list"},
    {"look-word", EXIT_BAD_INPUT,
     "look-word.yaml:6:11: error: 'teal-twil' is not a look; did you mean 'teal-twill'?"},
    {"merge-key", EXIT_BAD_INPUT,
     "merge-key.yaml:4:5: error: merge keys (<<) are not supported; use 'include'"},
    {"misplaced-key", EXIT_BAD_INPUT,
     "misplaced-key.yaml:6:5: error: 'stretch' is not a key of 'cloth'; it belongs"},
    {"model-word", EXIT_BAD_INPUT,
     "model-word.yaml:6:12: error: 'mlgp' is not a model; did you mean 'mlpg'?"},
    {"negative-seconds", EXIT_BAD_INPUT,
     "negative-seconds.yaml:2:17: error: 'seconds' is -2 s; it must be 0 .. 1e+06 s"},
    {"newton-fraction", EXIT_BAD_INPUT,
     "newton-fraction.yaml:6:29: error: 'newton_iterations' wants a whole number,"},
    {"no-cloth", EXIT_BAD_INPUT,
     "no-cloth.yaml:1:1: error: 'scene' needs 'cloth': pieces of cloth, each under"},
    {"no-shape", EXIT_BAD_INPUT, "no-shape.yaml:3:3: error: 'cloth' needs 'shape': the panel"},
    {"no-version", EXIT_BAD_INPUT, "no-version.yaml:1:1: error: a scene starts with 'toile: 1'"},
    {"nodes-and-spacing", EXIT_BAD_INPUT,
     "nodes-and-spacing.yaml:7:5: error: 'nodes' and 'spacing' exclude each other;"},
    {"nodes-few", EXIT_BAD_INPUT,
     "nodes-few.yaml:6:12: error: too few nodes: a cloth needs 3 in each direction"},
    {"nodes-few-around", EXIT_BAD_INPUT,
     "nodes-few-around.yaml:6:12: error: too few nodes: a sleeve needs 5 around and 3 along"},
    {"nodes-negative", EXIT_BAD_INPUT,
     "nodes-negative.yaml:6:12: error: 'nodes' wants two whole numbers such as 60 x"},
    {"nodes-on-disc", EXIT_BAD_INPUT,
     "nodes-on-disc.yaml:6:5: error: 'nodes' counts rows of a lattice; a disc has"},
    {"nodes-overflow", EXIT_BAD_INPUT,
     "nodes-overflow.yaml:6:12: error: 'nodes' is 99999999999999999999 x 3; both"},
    {"nodes-text", EXIT_BAD_INPUT,
     "nodes-text.yaml:6:12: error: 'nodes' wants two whole numbers such as 60 x 40,"},
    {"nodes-too-many", EXIT_BAD_INPUT,
     "nodes-too-many.yaml:6:12: error: 2.5e+07 nodes in all; at most 4 million fit"},
    {"obstacle-axis", EXIT_BAD_INPUT,
     "obstacle-axis.yaml:7:9: error: 'cylinder' needs 'length', or 'from' and 'to'"},
    {"obstacle-box", EXIT_BAD_INPUT,
     "obstacle-box.yaml:7:23: error: 'size' must be positive, at least 0.0001 m"},
    {"obstacle-ends", EXIT_BAD_INPUT,
     "obstacle-ends.yaml:7:9: error: 'from' and 'to' are the same point"},
    {"obstacle-friction", EXIT_BAD_INPUT,
     "obstacle-friction.yaml:7:44: error: 'friction' wants a plain number, found"},
    {"obstacle-none", EXIT_BAD_INPUT,
     "obstacle-none.yaml:7:3: error: 'ball' needs a solid: plane, sphere, box,"},
    {"obstacle-normal", EXIT_BAD_INPUT,
     "obstacle-normal.yaml:7:28: error: 'normal' has no direction"},
    {"obstacle-radius", EXIT_BAD_INPUT,
     "obstacle-radius.yaml:7:27: error: 'radius' is 0 cm; it must be 0.0001 .. 1000"},
    {"obstacle-rounding", EXIT_BAD_INPUT,
     "obstacle-rounding.yaml:7:52: error: 'rounding' is larger than half of the"},
    {"obstacle-two", EXIT_BAD_INPUT,
     "obstacle-two.yaml:7:10: error: 'plane' and 'sphere' exclude each other"},
    {"odd-size", EXIT_BAD_INPUT,
     "odd-size.yaml:2:14: error: 'size' is 1281 x 720; video needs even numbers"},
    {"only-comment", EXIT_BAD_INPUT, "only-comment.yaml: error: the file is empty"},
    {"polygon-crossing", EXIT_BAD_INPUT,
     "polygon-crossing.yaml:4:49: error: the outline crosses itself: the edge from"},
    {"polygon-hole-crossing", EXIT_BAD_INPUT,
     "polygon-hole-crossing.yaml:4:67: error: the outline crosses itself: the edge"},
    {"polygon-hole-outside", EXIT_BAD_INPUT,
     "polygon-hole-outside.yaml:4:67: error: this hole is not in the outline"},
    {"polygon-line", EXIT_BAD_INPUT,
     "polygon-line.yaml:4:49: error: the outline turns back on itself"},
    {"polygon-point", EXIT_BAD_INPUT,
     "polygon-point.yaml:4:41: error: 'outline' wants a list of 2 numbers such as"},
    {"polygon-repeat", EXIT_BAD_INPUT,
     "polygon-repeat.yaml:4:49: error: the same point twice in a row"},
    {"polygon-two-points", EXIT_BAD_INPUT,
     "polygon-two-points.yaml:4:32: error: an outline wants a list of at least 3"},
    {"quaternion-zero", EXIT_BAD_INPUT, "quaternion-zero.yaml:6:24: error: 'quaternion' is zero"},
    {"rate-dimension", EXIT_BAD_INPUT,
     "rate-dimension.yaml:2:14: error: 'rate' wants a rate [1/s], but 's' is a time"},
    {"reference-at", EXIT_BAD_INPUT, "reference-at.yaml:7:24: error: this is 0.2 m off the panel"},
    {"reference-cloth", EXIT_BAD_INPUT,
     "reference-cloth.yaml:7:13: error: no cloth is called 'shet'; did you mean"},
    {"reference-map", EXIT_BAD_INPUT,
     "reference-map.yaml:6:12: error: 'reference' wants a list of at most 1000"},
    {"reserved", EXIT_BAD_INPUT,
     "reserved.yaml:2:8: error: a character that YAML reserves (@ ` %) must be"},
    {"rest-word", EXIT_BAD_INPUT,
     "rest-word.yaml:4:57: error: 'rest' wants flat or curved, found 'bent'"},
    {"scattered-sleeve", EXIT_BAD_INPUT,
     "scattered-sleeve.yaml:6:5: error: only a rectangle can be 'scattered'"},
    {"scattered-yes", EXIT_BAD_INPUT,
     "scattered-yes.yaml:6:16: error: 'scattered' wants false or true, found 'yes'"},
    {"shape-missing", EXIT_BAD_INPUT,
     "shape-missing.yaml:4:13: error: 'rectangle' needs 'height': along v, the weft"},
    {"shape-two", EXIT_BAD_INPUT,
     "shape-two.yaml:4:12: error: 'shape' wants one of rectangle, sleeve, disc,"},
    {"shape-word", EXIT_BAD_INPUT,
     "shape-word.yaml:4:13: error: 'rectangel' is not a key of 'shape'; did you mean 'rectangle'?"},
    {"size-text", EXIT_BAD_INPUT,
     "size-text.yaml:2:14: error: 'size' wants two whole numbers such as 60 x 40,"},
    {"spacing-tiny", EXIT_BAD_INPUT,
     "spacing-tiny.yaml:6:14: error: 1e+10 nodes in all; at most 4 million fit"},
    {"step-negative", EXIT_BAD_INPUT,
     "step-negative.yaml:6:16: error: 'step' is -1/60 s; it must be 1e-09 .. 10 s"},
    {"stepper-word", EXIT_BAD_INPUT,
     "stepper-word.yaml:6:19: error: 'bdf3' is not a stepper; did you mean 'bdf2'?"},
    {"tab", EXIT_BAD_INPUT, "tab.yaml:3:1: error: a tab cannot indent YAML; use spaces"},
    {"tag", EXIT_BAD_INPUT,
     "tag.yaml:2:8: error: tags (!name) are not supported; leave the tag out"},
    {"text", EXIT_BAD_INPUT, "text.yaml:1:1: error: a scene is a mapping of keys, found 'hello'"},
    {"truncated", EXIT_BAD_INPUT,
     "truncated.yaml:5:1: error: did not find expected ',' or '}' (while parsing a"},
    {"turn-axis", EXIT_BAD_INPUT,
     "turn-axis.yaml:6:18: error: 'axis' wants x, y, z, -x, -y, -z or a vector,"},
    {"turn-bare-angle", EXIT_BAD_INPUT,
     "turn-bare-angle.yaml:6:25: error: 'by' needs a unit: '90' could be degrees or"},
    {"two-documents", EXIT_BAD_INPUT,
     "two-documents.yaml:6:1: error: a second document; a file holds one"},
    {"unclosed-quote", EXIT_BAD_INPUT,
     "unclosed-quote.yaml:3:1: error: found unexpected end of stream (while"},
    {"unknown-key", EXIT_BAD_INPUT,
     "unknown-key.yaml:6:1: error: 'gravty' is not a key of 'scene'; did you mean 'gravity'?"},
    {"unknown-key-nested", EXIT_BAD_INPUT,
     "unknown-key-nested.yaml:6:7: error: 'drga' is not a key of 'air'; did you mean 'drag'?"},
    {"utf16", EXIT_BAD_INPUT,
     "utf16.yaml:1:1: error: byte 0xFF is not UTF-8 text; is this a binary file?"},
    {"version-2", EXIT_BAD_INPUT,
     "version-2.yaml:1:8: error: written for toile '2', this is toile 1"},
    {"width-dimension", EXIT_BAD_INPUT,
     "width-dimension.yaml:4:32: error: 'width' wants a length [m], but 'N/m' is a"},
    {"width-hex", EXIT_BAD_INPUT,
     "width-hex.yaml:4:32: error: 'width' wants a length [m]; 'x10' is not a unit"},
    {"width-huge", EXIT_BAD_INPUT,
     "width-huge.yaml:4:32: error: 'width' is not a finite number: '1e999'"},
    {"width-inf", EXIT_BAD_INPUT,
     "width-inf.yaml:4:32: error: 'width' wants a length [m], found '.inf'"},
    {"width-list", EXIT_BAD_INPUT,
     "width-list.yaml:4:32: error: 'width' wants a length [m], found a list"},
    {"width-nan", EXIT_BAD_INPUT,
     "width-nan.yaml:4:32: error: 'width' wants a length [m], found 'nan'"},
    {"width-negative", EXIT_BAD_INPUT,
     "width-negative.yaml:4:32: error: 'width' is -20 cm; it must be 0.0001 .. 1000"},
    {"width-unit", EXIT_BAD_INPUT,
     "width-unit.yaml:4:32: error: 'width' wants a length [m]; 'cmm' is not a unit; did you mean "
     "'cm'?"},
    {"width-zero-division", EXIT_BAD_INPUT,
     "width-zero-division.yaml:4:32: error: 'width' is not a finite number: '1/0 m'"},
    {"wind", EXIT_BAD_INPUT, "wind.yaml:6:24: error: 'wind' wants a speed [m/s], found 'fast'"},
    {"zero-frames", EXIT_BAD_INPUT,
     "zero-frames.yaml:2:17: error: 'seconds' is 0 s: not one frame at 30 frames a"},
};
#define BAD_COUNT (sizeof bad_files / sizeof bad_files[0])

static void test_bad_files(void **state) {
    (void)state;
    for (size_t i = 0; i < BAD_COUNT; i++) {
        char path[256];
        Arena arena = {0};
        Error error = {0};
        Scene scene;
        snprintf(path, sizeof path, TOILE_SOURCE_DIR "/tests/bad/%s.yaml", bad_files[i].name);
        bool ok = scene_read(path, &words, &arena, &scene, &error);
        if (ok || error.code != bad_files[i].code || !strstr(error.text, bad_files[i].message)) {
            fail_msg("%s: wanted %d '%s', got %d '%s'", bad_files[i].name, bad_files[i].code,
                     bad_files[i].message, error.code, ok ? "no error" : error.text);
        }
        arena_free(&arena);
    }
    printf("%zu malformed files\n", BAD_COUNT);
}

/* Every file of the folder is in the table or belongs to one that is. */
static void test_table_is_complete(void **state) {
    (void)state;
    char command[] = "ls " TOILE_SOURCE_DIR "/tests/bad/*.yaml | wc -l", line[32] = "";
    assert_int_equal(shell_run(command, line, sizeof line), 0);
    /* many.yaml, and three fabrics that scenes of the table use */
    assert_int_equal(atoi(line), BAD_COUNT + 4);
}

/* Reads a text; the error, "" for none. */
static Error parse(const char *text, size_t bytes) {
    Arena arena = {0};
    Error error = {0};
    Scene scene;
    scene_parse("made.yaml", text, bytes, &words, &arena, &scene, &error);
    arena_free(&arena);
    return error;
}

static void check_made(const char *text, const char *message) {
    Error error = parse(text, strlen(text));
    assert_int_equal(error.code, EXIT_BAD_INPUT);
    if (!strstr(error.text, message)) {
        fail_msg("wanted '%s', got '%s'", message, error.text);
    }
}

static void test_ten_errors_in_file_order(void **state) {
    (void)state;
    Arena arena = {0};
    Error error = {0};
    Scene scene;
    int count = 0, last = 0;
    assert_false(
        scene_read(TOILE_SOURCE_DIR "/tests/bad/many.yaml", &words, &arena, &scene, &error));
    for (const char *p = error.text; (p = strstr(p, "many.yaml:")); count++) {
        int line = atoi(p += strlen("many.yaml:"));
        assert_true(line >= last);
        last = line;
    }
    assert_int_equal(count, 10);
    assert_non_null(strstr(error.text, "... and 5 more"));
    arena_free(&arena);
}

static void test_source_line_and_caret(void **state) {
    (void)state;
    const char *scene = "toile: 1\ncloth:\n  a: {shape: {disc: {radius: 8 s}}, fabric: denim}\n";
    const char *whole = "made.yaml:3:30: error: 'radius' wants a length [m], but 's' is a time\n"
                        "    a: {shape: {disc: {radius: 8 s}}, fabric: denim}\n"
                        "                               ^";
    Error error = parse(scene, strlen(scene));
    assert_string_equal(error.text, whole);
}

/* one character of "wool" in Greek: columns count characters, and long lines are cut */
static void test_caret_in_long_lines(void **state) {
    (void)state;
    char text[4096] = "toile: 1\ntitle: \"";
    for (int i = 0; i < 500; i++) {
        strcat(text, "\xCE\xBC");
    }
    strcat(text, "\" oops\n");
    Error error = parse(text, strlen(text));
    assert_non_null(strstr(error.text, "made.yaml:2:511: error: "));
    assert_true(strlen(error.text) < 600);
}

static void test_large_files(void **state) {
    (void)state;
    char path[] = "/tmp/toile_test_large_XXXXXX";
    int file = mkstemp(path);
    assert_true(file >= 0);
    assert_int_equal(ftruncate(file, 100 << 20), 0);
    close(file);
    Arena arena = {0};
    Error error = {0};
    Scene scene;
    assert_false(scene_read(path, &words, &arena, &scene, &error));
    assert_int_equal(error.code, EXIT_BAD_INPUT);
    assert_non_null(strstr(error.text, "larger than 16 MiB"));
    assert_true(arena.bytes_peak < 1 << 20);
    arena_free(&arena);
    unlink(path);
}

/* `count` copies of `piece` between two texts */
static char *repeat(const char *before, const char *piece, int count, const char *after) {
    size_t bytes = strlen(before) + strlen(piece) * (size_t)count + strlen(after) + 1;
    char *text = malloc(bytes), *end = text;
    assert_non_null(text);
    end = stpcpy(end, before);
    for (int i = 0; i < count; i++) {
        end = stpcpy(end, piece);
    }
    stpcpy(end, after);
    return text;
}

static void check_repeated(const char *before, const char *piece, int count, const char *after,
                           const char *message) {
    char *text = repeat(before, piece, count, after);
    check_made(text, message);
    free(text);
}

static void test_hostile_sizes(void **state) {
    (void)state;
    check_repeated("toile: 1\ntitle: ", "[", 1000000, "", "nested deeper than 32");
    check_repeated("toile: 1\ntitle: ", "{a: ", 100000, "", "nested deeper than 32");
    check_repeated("toile: 1\ntitle: [", "1,", 500000, "]", "more than 400000 values");
    check_repeated("toile: 1\ntitle: ", "a", 8000000, "\nfilm: 3\n", "'film' wants a mapping");
    check_repeated("toile: 1\nair: {drag: ", "9", 100000, "}\n", "is not a finite number");
    check_repeated("toile: 1\nair: {drag: 1 ", "(", 100000, "m}\n", "is not a unit");
    check_repeated("toile: 1\nair: {drag: 1 ", "m", 100000, "}\n", "is not a unit");
}

static void test_many_keys(void **state) {
    (void)state;
    char *text = malloc(100000), *end = text;
    assert_non_null(text);
    end += sprintf(end, "toile: 1\n");
    for (int i = 0; i < 5000; i++) {
        end += sprintf(end, "key%d: 1\n", i);
    }
    check_made(text, "a mapping with more than 4096 keys");
    free(text);
}

/* 40 includes a file deep, and every file of 256 */
static void test_include_chain(void **state) {
    (void)state;
    char folder[] = "/tmp/toile_test_include_XXXXXX", path[64];
    assert_non_null(mkdtemp(folder));
    for (int i = 0; i < 12; i++) {
        snprintf(path, sizeof path, "%s/%d.yaml", folder, i);
        FILE *out = fopen(path, "w");
        assert_non_null(out);
        fprintf(out, "toile: 1\ninclude: %d.yaml\n", i + 1);
        fclose(out);
    }
    Arena arena = {0};
    Error error = {0};
    Scene scene;
    snprintf(path, sizeof path, "%s/0.yaml", folder);
    assert_false(scene_read(path, &words, &arena, &scene, &error));
    assert_int_equal(error.code, EXIT_BAD_INPUT);
    assert_non_null(strstr(error.text, "files within files nested deeper than 8"));
    arena_free(&arena);
    for (int i = 0; i < 12; i++) {
        snprintf(path, sizeof path, "%s/%d.yaml", folder, i);
        unlink(path);
    }
    rmdir(folder);
}

static void test_missing(void **state) {
    (void)state;
    static const struct {
        const char *path;
        ExitCode code;
    } files[] = {{"/nowhere/scene.yaml", EXIT_MISSING_INPUT}, {"/tmp", EXIT_IO}};
    for (int i = 0; i < 2; i++) {
        Arena arena = {0};
        Error error = {0};
        Scene scene;
        assert_false(scene_read(files[i].path, NULL, &arena, &scene, &error));
        assert_int_equal(error.code, files[i].code);
        assert_non_null(strstr(error.text, files[i].path));
        arena_free(&arena);
    }
}

/* No truncation of a good scene crashes; most are errors, none is a bug. */
static void test_every_truncation(void **state) {
    (void)state;
    char text[8192];
    FILE *in = fopen(TOILE_SOURCE_DIR "/assets/scenes/truncheon.yaml", "rb");
    assert_non_null(in);
    size_t bytes = fread(text, 1, sizeof text, in);
    fclose(in);
    for (size_t cut = 0; cut <= bytes; cut += 7) {
        Error error = parse(text, cut);
        assert_true(error.code == EXIT_OK || error.code == EXIT_BAD_INPUT ||
                    error.code == EXIT_MISSING_INPUT);
        assert_true((error.code == EXIT_OK) == (error.text[0] == '\0'));
    }
}

static void test_fabric_errors(void **state) {
    (void)state;
    static const struct {
        const char *name;
        ExitCode code;
        const char *message;
    } fabrics[] = {
        {"denym", EXIT_MISSING_INPUT, "no fabric is called 'denym'; did you mean 'denim'?"},
        {"", EXIT_MISSING_INPUT, "no fabric is called ''"},
        {"../scenes/sleeve", EXIT_MISSING_INPUT, "there is no file '../scenes/sleeve'"},
        {TOILE_SOURCE_DIR "/tests/bad/fabric-broken.yaml", EXIT_BAD_INPUT,
         "fabric-broken.yaml:5:34: error: 'flg' is not a key"},
        {TOILE_SOURCE_DIR "/tests/bad/list.yaml", EXIT_BAD_INPUT,
         "list.yaml:1:1: error: a fabric file starts with 'toile-fabric: 1'"},
    };
    for (size_t i = 0; i < sizeof fabrics / sizeof fabrics[0]; i++) {
        Arena arena = {0};
        Error error = {0};
        Fabric fabric;
        assert_false(fabric_read(fabrics[i].name, &arena, &fabric, &error));
        assert_int_equal(error.code, fabrics[i].code);
        if (!strstr(error.text, fabrics[i].message)) {
            fail_msg("wanted '%s', got '%s'", fabrics[i].message, error.text);
        }
        arena_free(&arena);
    }
}

int main(void) {
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bad_files),
        cmocka_unit_test(test_table_is_complete),
        cmocka_unit_test(test_ten_errors_in_file_order),
        cmocka_unit_test(test_source_line_and_caret),
        cmocka_unit_test(test_caret_in_long_lines),
        cmocka_unit_test(test_large_files),
        cmocka_unit_test(test_hostile_sizes),
        cmocka_unit_test(test_many_keys),
        cmocka_unit_test(test_include_chain),
        cmocka_unit_test(test_missing),
        cmocka_unit_test(test_every_truncation),
        cmocka_unit_test(test_fabric_errors),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
