/* Scenes that are right: the numbers they give, defaults, includes, the effective scene. */
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "sim/scene/scene.h"
#include "tests/support/check.h"

#define HEAD "toile: 1\n"
#define SHEET                                                                                      \
    "cloth:\n  sheet:\n    shape: {rectangle: {width: 1 m, height: 50 cm}}\n    fabric: denim\n"

static Arena arena;

static int teardown(void **state) {
    (void)state;
    arena_free(&arena);
    return 0;
}

static Scene parse(const char *text) {
    Scene scene;
    Error error = {0};
    if (!scene_parse("made.yaml", text, strlen(text), NULL, &arena, &scene, &error)) {
        fail_msg("%s", error.text);
    }
    return scene;
}

static Scene read_asset(const char *name) {
    char path[256];
    Scene scene;
    Error error = {0};
    snprintf(path, sizeof path, TOILE_SOURCE_DIR "/assets/scenes/%s.yaml", name);
    if (!scene_read(path, NULL, &arena, &scene, &error)) {
        fail_msg("%s", error.text);
    }
    return scene;
}

static char *effective(const Scene *scene) {
    char *text = NULL;
    size_t bytes = 0;
    FILE *out = open_memstream(&text, &bytes);
    assert_non_null(out);
    scene_print_effective(scene, out);
    fclose(out);
    char *copy = arena_strdup(&arena, text);
    free(text);
    return copy;
}

static void check_vec(Vec3 v, double x, double y, double z) {
    CHECK_NEAR(v.x, x, 1e-12);
    CHECK_NEAR(v.y, y, 1e-12);
    CHECK_NEAR(v.z, z, 1e-12);
}

static void test_defaults(void **state) {
    (void)state;
    Scene scene = parse(HEAD SHEET);
    Film film = film_default();
    assert_int_equal(scene.film.frame_count, 120);
    CHECK_NEAR(scene.film.rate, film.rate, 0);
    assert_int_equal(scene.film.camera, CAMERA_AUTO);
    assert_true(isnan(scene.film.floor_height));
    check_vec(scene.gravity, 0, 0, -9.81);
    assert_int_equal(scene.cloth_count, 1);
    assert_string_equal(scene.cloths[0].model, "mlpg");
    assert_string_equal(scene.cloths[0].look, "teal-twill");
    assert_int_equal(scene.cloths[0].nodes[0], 41);
    CHECK_NEAR(scene.cloths[0].spacing, 0, 0);
    assert_string_equal(scene.solver.stepper, "auto");
    CHECK_NEAR(scene.solver.courant, 0.8, 0);
    assert_int_equal(scene.handle_count, 0);
    assert_string_equal(scene.title, "made");
    assert_int_equal(scene.warning_count, 0);
}

static void test_film(void **state) {
    (void)state;
    Scene scene = parse(HEAD SHEET "film:\n  rate: 24 fps\n  seconds: 2 s\n  size: 640 x 480\n"
                                   "  camera: {eye: [0, -3 m, 0], focal: 50 mm, up: [1, 0, 0],\n"
                                   "           orthographic: {px_per_mm: 4}}\n"
                                   "  look: cream\n  floor: -30 cm\n");
    assert_int_equal(scene.film.frame_count, 48);
    assert_int_equal(scene.film.width, 640);
    assert_int_equal(scene.film.height, 480);
    assert_int_equal(scene.film.camera, CAMERA_ORTHOGRAPHIC);
    CHECK_NEAR(scene.film.pixels_per_mm, 4, 0);
    CHECK_NEAR(scene.film.fov, 2 * atan(0.24), 1e-12);
    check_vec(scene.film.eye, 0, -3, 0);
    check_vec(scene.film.up, 1, 0, 0);
    CHECK_NEAR(scene.film.floor_height, -0.3, 1e-15);
    assert_string_equal(scene.cloths[0].look, "cream");
    assert_int_equal(parse(HEAD SHEET "film: {camera: auto, floor: false}\n").film.floor, false);
    scene = parse(HEAD SHEET "film: {camera: {eye: [0, -3 m, 0]}}\n");
    assert_int_equal(scene.film.camera, CAMERA_PERSPECTIVE);
    scene = parse(HEAD SHEET "film: {camera: {eye: [0, -3 m, 0], fit: true}}\n");
    assert_int_equal(scene.film.camera, CAMERA_AUTO);
}

/* reading the effective scene again gives the same hash and the same text */
static void check_effective(const Scene *scene) {
    const char *text = effective(scene);
    Scene again = parse(text);
    assert_string_equal(effective(&again), text);
    assert_true(again.hash == scene->hash);
}

static void test_cameras(void **state) {
    (void)state;
    Scene scene =
        parse(HEAD SHEET
              "film:\n  seconds: 3\n  surface: splats\n  range: [-2, 4]\n  blur: 0.5\n"
              "  blur_samples: 4\n  play: 15 1/s\n  title: \"A title\"\n  show_time: true\n"
              "  camera: {eye: [0, -3, 0], orbit: {by: 1/2 turn, from: 1 s}}\n"
              "  cameras:\n"
              "    top: {eye: [0, 0, 2], up: [0, 1, 0], orthographic: true, follow: true}\n"
              "    fly: {keys: [{t: 0, eye: [1, 0, 0]}, {t: 2, eye: [0, 1, 1], fov: 20 deg}]}\n");
    const Film *film = &scene.film;
    assert_int_equal(film->surface, FILM_SPLATS);
    CHECK_NEAR(film->range[0], -2, 0);
    CHECK_NEAR(film->range[1], 4, 0);
    CHECK_NEAR(film->blur, 0.5, 0);
    assert_int_equal(film->blur_samples, 4);
    CHECK_NEAR(film->play, 15, 0);
    assert_string_equal(film->title, "A title");
    assert_true(film->show_time && !film->show_scale);
    CHECK_NEAR(film->move.orbit, 3.14159265358979, 1e-12);
    CHECK_NEAR(film->move.orbit_begin, 1, 0);
    CHECK_NEAR(film->move.orbit_end, 3, 1e-12); /* with the film */
    assert_int_equal(film->view_count, 2);
    assert_string_equal(film->views[0].name, "top");
    assert_int_equal(film->views[0].camera, CAMERA_ORTHOGRAPHIC);
    assert_true(film->views[0].move.follow);
    const FilmView *fly = &film->views[1];
    assert_int_equal(fly->move.key_count, 2);
    assert_int_equal(fly->camera, CAMERA_PERSPECTIVE);
    CHECK_NEAR(fly->move.keys[0].fov, film_default().fov, 0); /* of the camera */
    CHECK_NEAR(fly->move.keys[1].fov, 0.34906585, 1e-7);
    check_vec(fly->move.keys[1].eye, 0, 1, 1);
    check_effective(&scene);
}

static void test_polygon(void **state) {
    (void)state;
    /* clockwise and closed; a hole that is anticlockwise: both are turned round */
    Scene scene = parse(HEAD "cloth:\n  p:\n    fabric: denim\n    shape:\n      polygon:\n"
                             "        outline: [[0, 0], [0, 1], [2, 1], [2, 0], [0, 0]]\n"
                             "        holes: [[[0.5, 0.5], [1, 0.5], [1, 75 cm]]]\n");
    const ShapeDef *shape = &scene.cloths[0].shape;
    double extents[2];
    shape_extents(shape, extents);
    assert_int_equal(shape->kind, SHAPE_POLYGON);
    assert_int_equal(shape->loop_count, 2);
    assert_int_equal(shape->loop_begin[1], 4);
    assert_int_equal(shape->loop_begin[2], 7);
    CHECK_NEAR(shape_area(shape), 2.0 - 0.0625, 1e-12);
    CHECK_NEAR(extents[0], 2, 0);
    CHECK_NEAR(extents[1], 1, 0);
    CHECK_NEAR(scene.cloths[0].spacing, 0.05, 1e-15);
}

/* a panel that is written clockwise is turned round, and the corners of its seams with it */
static void test_garment(void **state) {
    (void)state;
    Scene scene =
        parse(HEAD "cloth:\n  skirt:\n    fabric: denim\n    shape:\n      garment:\n"
                   "        panels:\n"
                   "          front: {outline: [[0.1, 0], [0.4, 0], [0.3, 1], [0.2, 1]]}\n"
                   "          back: {outline: [[0, 0], [0.1, 1], [0.2, 1], [0.3, 0]],\n"
                   "                 holes: [[[0.14, 0.5], [0.16, 0.5], [0.15, 0.6]]]}\n"
                   "        seams: [[front.1-2, back.0-1], [back.3-2, front.0-3]]\n"
                   "        oval: 70 %\n");
    const ShapeDef *shape = &scene.cloths[0].shape;
    const GarmentDef *garment = shape->garment;
    assert_int_equal(shape->kind, SHAPE_GARMENT);
    assert_int_equal(shape->loop_count, 3);
    CHECK_NEAR(shape_area(shape), 0.4 - 0.001, 1e-12);
    CHECK_NEAR(garment->oval, 0.7, 1e-15);
    assert_true(!garment->panels[0].reversed && garment->panels[1].reversed);
    assert_int_equal(garment->panels[1].loop_begin, 1);
    assert_int_equal(garment->panels[1].loop_end, 3);
    /* back.0-1 is the side from (0, 0) to (0.1, 1), somewhere to the right of the front */
    const GarmentSeam *seam = &garment->seams[0];
    assert_int_equal(seam->panel[1], 1);
    const double *a = shape->outline + 2 * seam->corner[1][0];
    const double *b = shape->outline + 2 * seam->corner[1][1];
    CHECK_NEAR(a[1], 0, 0);
    CHECK_NEAR(b[1], 1, 0);
    CHECK_NEAR(b[0] - a[0], 0.1, 1e-15);
    assert_true(a[0] > 0.4);
    check_effective(&scene);
}

static void test_cloth(void **state) {
    (void)state;
    Scene scene = parse(HEAD SHEET "    nodes: 21x11\n    at: [1 cm, 2 cm, 3 cm]\n"
                                   "    turn: [{axis: x, by: 90 deg}, {axis: z, by: 1/4 turn}]\n"
                                   "    velocity: [0, 0, -1 m/s]\n    noise: 0.2 mm\n"
                                   "    damping: 2 1/s\n    kinematics: corotational\n"
                                   "    bending: rbf\n    model: springs\n    look: clay\n");
    const ClothDef *cloth = &scene.cloths[0];
    assert_int_equal(cloth->nodes[0], 21);
    assert_int_equal(cloth->nodes[1], 11);
    check_vec(cloth->pose.shift, 0.01, 0.02, 0.03);
    /* y goes to z by the first turn, x to y by the second */
    check_vec(quat_rotate(cloth->pose.turn, vec3(0, 1, 0)), 0, 0, 1);
    check_vec(quat_rotate(cloth->pose.turn, vec3(1, 0, 0)), 0, 1, 0);
    check_vec(cloth->velocity, 0, 0, -1);
    CHECK_NEAR(cloth->noise, 2e-4, 1e-18);
    CHECK_NEAR(cloth->damping, 2, 0);
    assert_int_equal(cloth->kinematics, KINEMATICS_COROTATIONAL);
    assert_int_equal(cloth->bending, BENDING_RBF);
    assert_string_equal(cloth->model, "springs");
}

static void test_spacing(void **state) {
    (void)state;
    Scene scene = parse(
        HEAD "cloth:\n"
             "  a: {shape: {sleeve: {radius: 8 cm, length: 30 cm, rest: curved}}, fabric: denim,\n"
             "      spacing: 1 cm}\n"
             "  b: {shape: {disc: {radius: 15 cm}}, fabric: denim}\n"
             "  c: {shape: {annulus: {radius: 15 cm, inner: 9 cm}}, fabric: denim, spacing: 4 mm}\n"
             "  d: {shape: {rectangle: {width: 1 m, height: 1 m, rest_curvature: [0, 5 1/m]}},\n"
             "      fabric: denim, scattered: true, jitter: 25 %}\n");
    assert_int_equal(scene.cloth_count, 4);
    assert_true(scene.cloths[0].shape.rest_curved);
    assert_int_equal(scene.cloths[0].nodes[0], 50);
    assert_int_equal(scene.cloths[0].nodes[1], 31);
    CHECK_NEAR(scene.cloths[1].spacing, 0.3 / 40, 1e-15);
    CHECK_NEAR(scene.cloths[2].spacing, 0.004, 1e-15);
    CHECK_NEAR(shape_area(&scene.cloths[2].shape), PI * (0.0225 - 0.0081), 1e-12);
    CHECK_NEAR(scene.cloths[3].spacing, 1.0 / 40, 1e-15);
    CHECK_NEAR(scene.cloths[3].jitter, 0.25, 1e-15);
    CHECK_NEAR(scene.cloths[3].shape.rest_curvature[1], 5, 0);
}

static void test_handles(void **state) {
    (void)state;
    Scene scene =
        parse(HEAD SHEET
              "    at: [0, 0, 1 m]\n"
              "  tube: {shape: {sleeve: {radius: 8 cm, length: 30 cm}}, fabric: denim}\n"
              "handles:\n"
              "  - {hold: [sheet.top-left, sheet.top-right], release: 2 s}\n"
              "  - {clamp: sheet.left, turn: {axis: -y, by: 90 deg, from: 1 s, to: 3 s}}\n"
              "  - {hold: sheet, nearest: [50 cm, 25 cm],\n"
              "     move: {axis: x, by: 10 cm, to: 2 s, ease: linear}}\n"
              "  - {hold: sheet, circle: {centre: [0.5, 0.25], radius: 5 cm}}\n"
              "  - {hold: tube.start}\n"
              "  - {hold: tube.end, move: [{by: [0, 0, 1]}, {velocity: [0, 0, 2], from: 1 s}],\n"
              "     turn: {axis: z, rate: 36 deg/s}}\n");
    assert_int_equal(scene.handle_count, 7);
    const HandleDef *handles = scene.handles;
    assert_int_equal(handles[0].region, REGION_TOP_LEFT);
    assert_int_equal(handles[1].region, REGION_TOP_RIGHT);
    assert_non_null(strstr(handles[1].where, ":9:"));
    CHECK_NEAR(handles[0].release, 2, 0);
    assert_int_equal(handles[2].kind, HANDLE_CLAMP);
    check_vec(handles[2].motion.pieces[0].axis, 0, -1, 0);
    check_vec(handles[2].motion.pieces[0].centre, 0, 0, 1);
    CHECK_NEAR(handles[2].motion.pieces[0].angle, PI / 2, 1e-15);
    assert_true(handles[2].motion.pieces[0].smooth);
    assert_true(isinf(handles[2].release));
    assert_int_equal(handles[3].region, REGION_NEAREST);
    CHECK_NEAR(handles[3].point[0], 0.5, 1e-15);
    assert_false(handles[3].motion.pieces[0].smooth);
    check_vec(motion_pose(&handles[3].motion, 1).shift, 0.05, 0, 0);
    assert_int_equal(handles[4].region, REGION_CIRCLE);
    CHECK_NEAR(handles[4].radius, 0.05, 1e-15);
    assert_int_equal(handles[5].region, REGION_BOTTOM);
    assert_int_equal(handles[6].cloth, 1);
    const Motion *motion = &handles[6].motion;
    assert_int_equal(motion->piece_count, 3);
    assert_int_equal(motion->pieces[0].kind, MOTION_MOVE);
    CHECK_NEAR(motion->pieces[0].to, 4, 0); /* the end of the film */
    assert_true(motion->pieces[1].endless);
    assert_int_equal(motion->pieces[2].kind, MOTION_TURN);
    CHECK_NEAR(motion_pose(motion, 11).shift.z, 1 + 2 * 10, 1e-12);
    CHECK_NEAR(motion_pose(motion, 10).turn.w, cos(PI), 1e-12);
}

/* the pose of an obstacle carries the solid's own frame to the world */
static void test_obstacles(void **state) {
    (void)state;
    Scene scene = parse(
        HEAD SHEET
        "obstacles:\n"
        "  rod: {cylinder: {radius: 3 cm, from: [-1, 0, 0], to: [1, 0, 0]}, friction: 0.3}\n"
        "  wall: {plane: {normal: [1, 0, 0]}, at: [-2, 0, 0]}\n"
        "  crate: {box: {size: [1, 2, 3], rounding: 10 cm}, turn: {axis: z, by: 90 deg}}\n"
        "  spike: {cone: {radius: 1, length: 2}, look: teal-twill}\n"
        "  ball: {sphere: {radius: 5 cm}, at: [0, 0, 1],\n"
        "         motion: [{move: {by: [1, 0, 0], to: 1 s}}, {turn: {axis: z, by: 1 turn}}]}\n"
        "  pill: {capsule: {radius: 5 cm, length: 10 cm}, motion: {turn: {axis: x, rate: 1 "
        "turn/s}}}\n");
    assert_int_equal(scene.obstacle_count, 6);
    const ObstacleDef *o = scene.obstacles;
    assert_int_equal(o[0].solid.kind, SOLID_CYLINDER);
    CHECK_NEAR(o[0].solid.half.z, 1, 1e-15);
    check_vec(pose_apply(o[0].pose, vec3(0, 0, 1)), 1, 0, 0);
    CHECK_NEAR(o[0].friction, 0.3, 0);
    CHECK_NEAR(o[1].friction, -1, 0);
    check_vec(quat_rotate(o[1].pose.turn, vec3(0, 0, 1)), 1, 0, 0);
    check_vec(o[1].pose.shift, -2, 0, 0);
    check_vec(o[2].solid.half, 0.5, 1, 1.5);
    check_vec(quat_rotate(o[2].pose.turn, vec3(1, 0, 0)), 0, 1, 0);
    assert_string_equal(o[3].look, "teal-twill");
    assert_string_equal(o[2].look, "clay");
    assert_int_equal(o[4].motion.piece_count, 2);
    check_vec(o[4].motion.pieces[1].centre, 0, 0, 1);
    assert_true(o[5].motion.pieces[0].endless);
    CHECK_NEAR(o[5].motion.pieces[0].angle, 2 * PI, 1e-12);
}

static void test_rest(void **state) {
    (void)state;
    Scene scene =
        parse(HEAD SHEET "title: a film\ngravity: [0, 1 m/s2, 0]\n"
                         "air: {drag: 0.02 kg/(m2 s), wind: [2 m/s, 0, 0]}\n"
                         "solver: {stepper: bdf2, step: 0.5 frame, newton_iterations: 3,\n"
                         "         courant: 70 %, contact_distance: 1 mm}\n");
    assert_string_equal(scene.title, "a film");
    check_vec(scene.gravity, 0, 1, 0);
    CHECK_NEAR(scene.air.drag, 0.02, 1e-15);
    check_vec(scene.air.wind, 2, 0, 0);
    assert_string_equal(scene.solver.stepper, "bdf2");
    CHECK_NEAR(scene.solver.step, 1.0 / 60.0, 1e-15);
    assert_int_equal(scene.solver.newton_iterations, 3);
    CHECK_NEAR(scene.solver.courant, 0.7, 1e-15);
    CHECK_NEAR(scene.solver.contact_distance, 1e-3, 1e-15);
    assert_false(scene.solver.impulses);
    assert_true(parse(HEAD SHEET "solver: {contact: impulses}\n").solver.impulses);
    check_vec(parse(HEAD SHEET "gravity: 1.62 m/s2\n").gravity, 0, 0, -1.62);
}

/* the same scene in other clothes: CRLF, a byte order mark, JSON, quotes */
static void test_writings(void **state) {
    (void)state;
    static const char *const texts[] = {
        "toile: 1\r\ncloth:\r\n  sheet:\r\n    shape: {disc: {radius: 10 cm}}\r\n"
        "    fabric: denim\r\n",
        "\xEF\xBB\xBFtoile: 1\ncloth: {sheet: {fabric: denim, shape: {disc: {radius: 100 mm}}}}\n",
        "{\"toile\": 1, \"cloth\": {\"sheet\": {\"shape\": {\"disc\": {\"radius\": \"0.1 m\"}},\n"
        "\"fabric\": \"denim\"}}}",
        "# a comment\n---\ntoile: 1\ncloth:\n  sheet:\n    shape:\n      disc:\n        radius: "
        "0.1\n"
        "    fabric: 'denim'\n...\n"};
    uint64_t hash = parse(texts[0]).hash;
    for (int i = 1; i < 4; i++) {
        assert_true(parse(texts[i]).hash == hash);
    }
    CHECK_NEAR(parse(texts[1]).cloths[0].shape.radius, 0.1, 1e-15);
}

static void write_file(const char *path, const char *text) {
    FILE *out = fopen(path, "w");
    assert_non_null(out);
    fputs(text, out);
    fclose(out);
}

/* what the file says wins; mappings merge; a shape is replaced as a whole */
static void test_include(void **state) {
    (void)state;
    char folder[] = "/tmp/toile_test_scene_XXXXXX", base[64], mine[64], cloth[64];
    assert_non_null(mkdtemp(folder));
    snprintf(base, sizeof base, "%s/base.yaml", folder);
    snprintf(mine, sizeof mine, "%s/mine.yaml", folder);
    snprintf(cloth, sizeof cloth, "%s/cloth.yaml", folder);
    write_file(base, HEAD SHEET "    nodes: 21 x 11\nair: {drag: 0.1}\ngravity: 1\n");
    write_file(cloth, "toile-fabric: 1\nlike: wool-tropical\nfriction: 0.5\n");
    write_file(mine, HEAD "include: base.yaml\ngravity: 2\nair: {wind: [1, 0, 0]}\n"
                          "cloth: {sheet: {shape: {disc: {radius: 9 cm}}, fabric: cloth.yaml}}\n");
    Scene scene;
    Error error = {0};
    bool ok = scene_read(mine, NULL, &arena, &scene, &error);
    /* the nodes of the base belong to a lattice, which a disc is not */
    assert_false(ok);
    assert_non_null(strstr(error.text, "base.yaml:6:5: error: 'nodes' counts rows of a lattice"));
    write_file(base, HEAD SHEET "    damping: 4\nair: {drag: 0.1}\ngravity: 1\n");
    memset(&error, 0, sizeof error);
    if (!scene_read(mine, NULL, &arena, &scene, &error)) {
        fail_msg("%s", error.text);
    }
    CHECK_NEAR(scene.gravity.z, -2, 0);
    CHECK_NEAR(scene.air.drag, 0.1, 0);
    CHECK_NEAR(scene.air.wind.x, 1, 0);
    assert_int_equal(scene.cloths[0].shape.kind, SHAPE_DISC);
    CHECK_NEAR(scene.cloths[0].damping, 4, 0);
    CHECK_NEAR(scene.cloths[0].fabric.friction.value, 0.5, 0);
    CHECK_NEAR(scene.cloths[0].fabric.weight.value, 0.1629, 1e-12);
    assert_string_equal(scene.cloths[0].fabric.name, "wool-tropical");
    uint64_t hash = scene.hash;
    write_file(base, HEAD SHEET "    damping: 5\nair: {drag: 0.1}\ngravity: 1\n");
    assert_true(scene_read(mine, NULL, &arena, &scene, &error));
    assert_true(scene.hash != hash);
    unlink(base), unlink(mine), unlink(cloth), rmdir(folder);
}

static const char *const assets[] = {"sleeve",    "sleeve-paper",  "buckling",  "hanging",
                                     "truncheon", "hanging-small", "cantilever"};
#define ASSET_COUNT (sizeof assets / sizeof assets[0])

static void test_effective(void **state) {
    (void)state;
    for (size_t i = 0; i < ASSET_COUNT; i++) {
        Scene scene = read_asset(assets[i]);
        check_effective(&scene);
    }
    Scene scene = parse(
        HEAD
        "title: \"a: 'b' \\\"c\\\" \\\\ \\t\"\n"
        "film: {rate: 29.97, seconds: 1.3 s, floor: 0.1, camera: {orthographic: true}}\n"
        "cloth:\n"
        "  a: {shape: {polygon: {outline: [[0, 0], [1, 0], [0.3, 1/3]],\n"
        "      holes: [[[0.3, 0.1], [0.4, 0.1], [0.35, 0.15]],\n"
        "              [[0.5, 0.05], [0.55, 0.05], [0.5, 0.1]]]}},\n"
        "      fabric: {weight: 160 g/m2, bending_length: 21 mm, drape: [{dc: 40 %}, {dc: 0.5}]},\n"
        "      turn: {axis: [1, 2, 3], by: 77 deg}, accuracy: 1 %}\n"
        "  b: {shape: {sleeve: {radius: 1/3, length: 0.7}}, spacing: 7 mm, look: clay,\n"
        "      fabric: {weight: 100 g/m2, isotropic: {stretch: 1e4, poisson: 0.3, bending: "
        "0.1 N m}}}\n"
        "handles:\n"
        "  - {hold: a.inner, release: 1/3 s}\n"
        "  - {hold: a, nearest: [0.1, 0.05]}\n"
        "  - {clamp: a, circle: {centre: [0.3, 0.2], radius: 1/7}}\n"
        "  - clamp: b.end\n"
        "    motion:\n"
        "      - turn: {axis: [1, 1, 1], by: 100 deg, from: 0.1 s, to: 0.7 s, ease: linear}\n"
        "      - move: {velocity: [1, 0, 0]}\n"
        "      - turn: {axis: z, rate: 100 deg/s, from: 0.3 s}\n"
        "obstacles:\n"
        "  wall: {plane: {normal: [1, 1, 1]}, turn: {axis: [3, 2, 1], by: 10 deg}}\n"
        "  rod: {capsule: {radius: 3 cm, from: [0, 1, 2], to: [3, 1, 0.7]}, friction: 0.2,\n"
        "        motion: {move: {by: [1, 1, 0]}}}\n"
        "  egg: {box: {size: [1, 2, 3], rounding: 1/7}}\n");
    check_effective(&scene);
}

static void test_assets(void **state) {
    (void)state;
    for (size_t i = 0; i < ASSET_COUNT; i++) {
        Scene scene = read_asset(assets[i]);
        double seconds = scene.film.frame_count / scene.film.rate;
        assert_string_equal(scene.title, assets[i]);
        assert_int_equal(scene.warning_count, 0);
        assert_true(seconds >= 4 && seconds <= 8);
    }
    Scene paper = read_asset("sleeve-paper");
    Material material = fabric_material(&paper.cloths[0].fabric);
    CHECK_NEAR(material.c11, 1e4 / 0.91, 1e-8);
    CHECK_NEAR(material.c66, 1e4 / 2.6, 1e-8);
    CHECK_NEAR(material.d66, 0.35e-5, 1e-18);
}

/* every key that the reader knows is in the reference, and every row says something */
static void test_reference(void **state) {
    (void)state;
    char *text = NULL;
    size_t bytes = 0;
    FILE *out = open_memstream(&text, &bytes);
    assert_non_null(out);
    scene_print_reference(out);
    fclose(out);
    static const char *const keys[] = {"toile ",
                                       "px_per_mm",
                                       "rest_curvature",
                                       "outline",
                                       "isotropic",
                                       "hysteresis",
                                       "bending_length",
                                       "nearest",
                                       "quaternion",
                                       "velocity",
                                       "rounding",
                                       "courant",
                                       "newton_iterations",
                                       "wind",
                                       "release",
                                       "green, corotational",
                                       "30 1/s",
                                       "1280 x 720",
                                       "auto, stencil, rbf"};
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++) {
        if (!strstr(text, keys[i])) {
            fail_msg("'%s' is not in the reference", keys[i]);
        }
    }
    for (char *line = strtok(text, "\n"); line; line = strtok(NULL, "\n")) {
        assert_true(strlen(line) <= 140);
    }
    free(text);
}

static void test_warnings(void **state) {
    (void)state;
    Scene scene = parse(HEAD "cloth:\n  a:\n    shape: {disc: {radius: 10 cm}}\n"
                             "    fabric: {weight: 12 g/m2, thickness: 0.05 mm}\n");
    assert_int_equal(scene.warning_count, 3);
    assert_non_null(strstr(scene.warnings[0], "made.yaml:5:13: warning: fabric estimated from"));
    assert_non_null(strstr(scene.warnings[1], "does not say bending, stretch, shear, friction"));
    assert_non_null(strstr(scene.warnings[2], "weight 12 g/m2 is lighter than any woven fabric"));
}

#define TEST(name) cmocka_unit_test_teardown(name, teardown)

int main(void) {
    const struct CMUnitTest tests[] = {
        TEST(test_defaults),  TEST(test_film),   TEST(test_cameras),   TEST(test_polygon),
        TEST(test_garment),   TEST(test_cloth),  TEST(test_spacing),   TEST(test_handles),
        TEST(test_obstacles), TEST(test_rest),   TEST(test_writings),  TEST(test_include),
        TEST(test_effective), TEST(test_assets), TEST(test_reference), TEST(test_warnings),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
