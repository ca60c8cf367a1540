#include "sim/scene/scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/hash.h"
#include "sim/scene/scene_schema.h"

#define STANDARD_GRAVITY 9.81 /* [m/s2] */

ShapeDef shape_default(void) { return (ShapeDef){.kind = SHAPE_RECTANGLE}; }

ClothDef cloth_default(void) {
    return (ClothDef){.shape = shape_default(),
                      .fabric = fabric_unknown(),
                      .look = "teal-twill",
                      .model = "mlpg",
                      .nodes = {41, 41},
                      .grid_turn = NAN,
                      .pose = pose_identity(),
                      .bending_damping = 5e-3,
                      .membrane_damping = 1e-4,
                      .kinematics = KINEMATICS_GREEN,
                      .bending = BENDING_AUTO};
}

HandleDef handle_default(void) { return (HandleDef){.kind = HANDLE_HOLD, .release = INFINITY}; }

ObstacleDef obstacle_default(void) {
    return (ObstacleDef){.pose = pose_identity(), .friction = -1.0, .look = "clay"};
}

SolverDef solver_default(void) {
    return (SolverDef){.stepper = "auto",
                       .newton_iterations = 2,
                       .courant = 0.8,
                       .tolerance = 1e-5,
                       .sweeps = 20,
                       .self_contact = true,
                       .mass_scaling = true,
                       .lag = 1.0};
}

Scene scene_default(void) {
    Scene scene = {.film = film_default(),
                   .gravity = {0.0, 0.0, -STANDARD_GRAVITY},
                   .air = air_default(),
                   .solver = solver_default()};
    scene.film.frame_count = 120;
    return scene;
}

AirDef air_default(void) { return (AirDef){.across = 1.2, .along = 0.03}; }

static void air_set_default(void *object) { *(AirDef *)object = air_default(); }
static void solver_set_default(void *object) { *(SolverDef *)object = solver_default(); }
static void scene_set_default(void *object) { *(Scene *)object = scene_default(); }

static const Field air_fields[] = {
    {"drag", FIELD_NUMBER, offsetof(AirDef, drag), .unit = "kg/(m2 s)", .min = 0.0, .max = 1e3,
     .help = "force per area and relative velocity"},
    {"normal_drag", FIELD_NUMBER, offsetof(AirDef, normal_drag), .unit = "kg/(m2 s)", .min = 0.0,
     .max = 1e3, .help = "more of it across the cloth; lets a flag wave"},
    {"density", FIELD_NUMBER, offsetof(AirDef, density), .unit = "kg/m3", .min = 0.0, .max = 1e4,
     .help = "air at 20 degC: 1.2; its push grows with the square of the speed"},
    {"across", FIELD_NUMBER, offsetof(AirDef, across), .unit = "", .min = 0.0, .max = 10.0,
     .help = "coefficient of that push across the cloth"},
    {"along", FIELD_NUMBER, offsetof(AirDef, along), .unit = "", .min = 0.0, .max = 10.0,
     .help = "the same along it"},
    {"wind", FIELD_VECTOR, offsetof(AirDef, wind), .unit = "m/s", .max = 1e3,
     .help = "velocity of the air"},
    {0}};
static const Schema air_schema = {.name = "air",
                                  .help = "air",
                                  .fields = air_fields,
                                  .size = sizeof(AirDef),
                                  .set_default = air_set_default};

static const char *const contact_words[] = {"penalty", "impulses", NULL};
static const char *const phase_words[] = {"inertia", "breen", NULL};
static const char *const impulse_steppers[] = {"auto", "central", "symplectic_euler", NULL};

/* `stepper` is read before */
static bool read_contact(Reader *reader, const Field *field, const Yaml *value, void *member) {
    const Field word = {field->key, FIELD_BOOL, .words = contact_words};
    const Scene *scene = scene_context(reader)->scene;
    if (!schema_read_field(reader, &word, value, member) || !*(bool *)member) {
        return *(bool *)member == false;
    }
    bool knows = false;
    for (const char *const *name = impulse_steppers; *name; name++) {
        knows = knows || strcmp(scene->solver.stepper, *name) == 0;
    }
    if (!knows) {
        return schema_error(reader, value,
                            "contact by impulses needs the stepper central or "
                            "symplectic_euler, not %s",
                            scene->solver.stepper);
    }
    return true;
}

static void print_contact(FILE *out, int indent, const Field *field, const void *member) {
    fprintf(out, "%*s%s: %s\n", indent, "", field->key, contact_words[*(const bool *)member]);
}

static const Field solver_fields[] = {
    {"stepper", FIELD_NAME, offsetof(SolverDef, stepper), .min = 1, .help = "how time advances"},
    {"step", FIELD_NUMBER, offsetof(SolverDef, step), .unit = "s", .min = 1e-9, .max = 10.0,
     .word = "auto", .word_value = 0.0, .help = "time step; 1/60 s, or 0.5 frame"},
    {"newton_iterations", FIELD_COUNT, offsetof(SolverDef, newton_iterations), .min = 1,
     .max = 1000, .help = "of an implicit step"},
    {"courant", FIELD_NUMBER, offsetof(SolverDef, courant), .unit = "", .min = 0.01, .max = 1.0,
     .help = "explicit step / its stability limit"},
    {"mass_scaling", FIELD_BOOL, offsetof(SolverDef, mass_scaling),
     .help = "central, symplectic_euler: more inertia for the shortest waves of a lattice, and "
             "longer steps"},
    {"tolerance", FIELD_NUMBER, offsetof(SolverDef, tolerance), .unit = "m", .min = 1e-12,
     .max = 0.1, .help = "rk45: how far the error of a step may carry a node within a frame"},
    {"sweeps", FIELD_COUNT, offsetof(SolverDef, sweeps), .min = 1, .max = 10000,
     .help = "three_phase: of random moves in the second phase of a step"},
    {"second_phase", FIELD_BOOL, offsetof(SolverDef, breen), .words = phase_words,
     .help = "three_phase: lowers energy and inertia; breen: energy alone, as published"},
    {"contact_distance", FIELD_NUMBER, offsetof(SolverDef, contact_distance), .unit = "m",
     .min = 1e-6, .max = 0.1, .word = "auto", .word_value = 0.0,
     .help = "distance kept between cloth and obstacles or cloth; auto: from the thickness"},
    {"self_contact", FIELD_BOOL, offsetof(SolverDef, self_contact),
     .help = "cloth meets itself and other cloth"},
    {"contact", FIELD_CUSTOM, offsetof(SolverDef, impulses), .words = contact_words,
     .read = read_contact, .print = print_contact,
     .help =
         "penalty, the default: a force law and planes; impulses: Bridson's, with impact zones"},
    {"lag", FIELD_NUMBER, offsetof(SolverDef, lag), .unit = "s", .min = 0.0, .max = 1e6,
     .help = "an obstacle farther behind its motion, since cloth is pinched, ends the run"},
    {0}};
static const Schema solver_schema = {.name = "solver",
                                     .help = "numerical choices",
                                     .fields = solver_fields,
                                     .size = sizeof(SolverDef),
                                     .set_default = solver_set_default};

static bool read_version(Reader *reader, const Field *field, const Yaml *value, void *member) {
    (void)reader, (void)field, (void)value, (void)member;
    return true; /* looked at before everything else */
}

static void print_version(FILE *out, int indent, const Field *field, const void *member) {
    (void)member;
    fprintf(out, "%*s%s: %d\n", indent, "", field->key, SCENE_VERSION);
}

static bool read_gravity(Reader *reader, const Field *field, const Yaml *value, void *member) {
    double numbers[3] = {0.0, 0.0, 0.0};
    bool ok =
        value->kind == YAML_LIST
            ? schema_read_vector(reader, field->key, field->unit, field->max, value, numbers, 3)
            : schema_read_number(reader, field->key, field->unit, field->min, field->max, value,
                                 &numbers[2]);
    if (ok) {
        numbers[2] = value->kind == YAML_LIST ? numbers[2] : 0.0 - numbers[2];
        *(Vec3 *)member = vec3_load(numbers);
    }
    return ok;
}

static void print_gravity(FILE *out, int indent, const Field *field, const void *member) {
    schema_print_key(out, indent, field->key);
    print_vector(out, *(const Vec3 *)member, field->unit);
    fputc('\n', out);
}

static const Field scene_fields[] = {
    {"toile", FIELD_CUSTOM, .read = read_version, .print = print_version, .required = true,
     .help = "version of the scene language: 1"},
    {"title", FIELD_TEXT, offsetof(Scene, title), .help = "default: the file name"},
    {"film", FIELD_CUSTOM, .group = &film_schema, .read = scene_read_film,
     .print = scene_print_film, .help = "what the film shows"},
    {"cloth", FIELD_CUSTOM, .group = &cloth_schema, .read = scene_read_cloths,
     .print = scene_print_cloths, .required = true, .help = "pieces of cloth, each under a name"},
    {"handles", FIELD_CUSTOM, .group = &handle_schema, .read = scene_read_handles,
     .print = scene_print_handles, .help = "a list: nodes that are held, moved, let go"},
    {"obstacles", FIELD_CUSTOM, .group = &obstacle_schema, .read = scene_read_obstacles,
     .print = scene_print_obstacles, .help = "solids that cloth meets, each under a name"},
    {"reference", FIELD_CUSTOM, .group = &reference_schema, .read = scene_read_references,
     .print = scene_print_references, .help = "a list: exact places, with which study compares"},
    {"gravity", FIELD_CUSTOM, offsetof(Scene, gravity), .unit = "m/s2", .min = -1e4, .max = 1e4,
     .read = read_gravity, .print = print_gravity,
     .help = "downwards, or a vector; default 9.81 m/s2"},
    {"air", FIELD_GROUP, offsetof(Scene, air), .group = &air_schema, .help = "air"},
    {"solver", FIELD_GROUP, offsetof(Scene, solver), .group = &solver_schema,
     .help = "numerical choices"},
    {0}};
const Schema scene_schema = {.name = "scene",
                             .help = "a scene",
                             .fields = scene_fields,
                             .size = sizeof(Scene),
                             .set_default = scene_set_default};

bool name_check(Reader *reader, const Yaml *key, const char *what) {
    static const char allowed[] =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_";
    bool letter = (key->text[0] | 32) >= 'a' && (key->text[0] | 32) <= 'z';
    size_t length = strlen(key->text);
    return (letter && length <= 63 && strspn(key->text, allowed) == length) ||
           schema_error(reader, key,
                        "'%s' cannot name %s: a letter, then letters, digits, - "
                        "and _, at most 63",
                        report_quote(reader->report, key->text), what);
}

/* "scenes/sleeve.yaml" -> "sleeve" */
static const char *title_from_path(Arena *arena, const char *path) {
    const char *slash = strrchr(path, '/');
    char *title = arena_strdup(arena, slash ? slash + 1 : path);
    char *dot = strrchr(title, '.');
    if (dot && dot != title) {
        *dot = '\0';
    }
    return title;
}

static bool check_version(Reader *reader, const Yaml *tree) {
    if (tree->kind != YAML_MAP) {
        return schema_error(reader, tree, "a scene is a mapping of keys, found %s",
                            yaml_describe(tree, reader->report));
    }
    const Yaml *version = yaml_find(tree, "toile");
    if (!version) {
        return schema_error(reader, tree, "a scene starts with 'toile: %d'%s", SCENE_VERSION,
                            yaml_find(tree, "toile-fabric") ? "; this is a fabric" : "");
    }
    return yaml_is(version, "1") ||
           schema_error(reader, version, "written for toile %s, this is toile %d",
                        yaml_describe(version, reader->report), SCENE_VERSION);
}

static uint64_t hash_scene(const Scene *scene) {
    char *text = NULL;
    size_t bytes = 0;
    FILE *out = open_memstream(&text, &bytes);
    ASSERT(out);
    Scene nameless = *scene;
    nameless.title = NULL; /* a renamed file is the same scene */
    scene_print_effective(&nameless, out);
    fclose(out);
    uint64_t hash = hash_bytes(text, bytes);
    free(text);
    return hash;
}

/* where the stepper stands, or the solver; NULL: neither is given */
static const char *find_stepper(const Report *report, const Yaml *tree) {
    const Yaml *solver = yaml_find(tree, "solver");
    const Yaml *stepper = solver && solver->kind == YAML_MAP ? yaml_find(solver, "stepper") : NULL;
    const Yaml *value = stepper ? stepper : solver;
    return value ? report_where(report, value->place) : NULL;
}

static bool read_source(const Source *source, const SceneWords *words, SceneContext *context,
                        Error *error) {
    Scene *scene = context->scene;
    Report *report = context->sources.report;
    Reader reader = {.arena = report->arena,
                     .report = report,
                     .frame_seconds = 1.0 / scene->film.rate,
                     .root = &scene_schema,
                     .context = context};
    if (words) {
        reader.names[0] = words->models;
        reader.names[1] = words->steppers;
        reader.names[2] = words->looks;
    }
    const Yaml *tree = source ? source_tree(&context->sources, source) : NULL;
    if (tree && check_version(&reader, tree)) {
        schema_read(&reader, &scene_schema, tree, scene);
        scene->solver.where = find_stepper(report, tree);
    }
    if (!report_finish(report, error)) {
        return false;
    }
    ASSERT(source); /* else there was an error */
    scene->path = source->path;
    scene->text = source->text;
    scene->title = scene->title ? scene->title : title_from_path(report->arena, source->path);
    scene->warning_count = report->warning_count;
    scene->warnings = report_warnings(report);
    scene->hash = hash_scene(scene);
    return true;
}

/* NULL text: read the file */
static bool read_scene(const char *path, const char *text, size_t bytes, const SceneWords *words,
                       Arena *arena, Scene *scene, Error *error) {
    Report report = {.arena = arena};
    *scene = scene_default();
    SceneContext context = {.scene = scene,
                            .sources = {.arena = arena, .report = &report},
                            .look = cloth_default().look,
                            .seconds = scene->film.frame_count / scene->film.rate};
    const Source *source = text ? source_from_text(&context.sources, path, text, bytes)
                                : source_read(&context.sources, path, (Place){0});
    return read_source(source, words, &context, error);
}

bool scene_read(const char *path, const SceneWords *words, Arena *arena, Scene *scene,
                Error *error) {
    return read_scene(path, NULL, 0, words, arena, scene, error);
}

bool scene_parse(const char *path, const char *text, size_t bytes, const SceneWords *words,
                 Arena *arena, Scene *scene, Error *error) {
    return read_scene(path, text, bytes, words, arena, scene, error);
}

void scene_print_reference(FILE *out) {
    fputs("A scene is YAML: metres, kilograms, seconds, z up. Every quantity may carry a unit "
          "(30 cm, 1/60 s, 72 deg/s,\n4 turns, 118 gf*cm2/cm); a bare number is SI, a bare angle "
          "an error; `frame` is the time of a film frame.\nAny mapping may have `include: FILE`: "
          "the keys of FILE hold where none is given. A number of a fabric may be\na mapping: "
          "{value: 41 N/m, flag: estimated, from: analogy, low: 20 N/m, high: 60 N/m, note: "
          "...}.\n\n"
          "key                     type                default       meaning\n\n",
          out);
    schema_print_reference(out, 0, &scene_schema);
}

void scene_print_effective(const Scene *scene, FILE *out) {
    schema_print(out, 0, &scene_schema, scene);
}
