/* scene_schema.h: the parts of the scene reader, one file per part of the language.
 *
 * Inside sim/scene only; everybody else uses scene.h. */
#ifndef TOILE_SCENE_SCENE_SCHEMA_H
#define TOILE_SCENE_SCENE_SCHEMA_H

#include "sim/scene/scene.h"
#include "sim/scene/schema.h"
#include "sim/scene/source.h"

#define SCENE_MOST_NODES 4000000 /* of all cloths together; a typing error must not eat memory */
#define SCENE_FARTHEST 1e4       /* [m] no coordinate is larger */

/* What the parts share while a scene is read: Reader.context. */
typedef struct SceneContext {
    Scene *scene;
    Sources sources;
    const char *look; /* of cloths that do not say */
    double seconds;   /* [s] of the film */
    double node_sum;  /* nodes of the cloths so far */
} SceneContext;

static inline SceneContext *scene_context(const Reader *reader) { return reader->context; }

extern const Schema scene_schema, film_schema, camera_schema, cloth_schema, shape_schema,
    polygon_schema, garment_schema, handle_schema, reference_schema, obstacle_schema, mesh_schema,
    print_schema, motion_schema, pose_turn_schema, cloth_mesh_schema;

/* custom fields of scene_schema; `member` is the Scene */
FieldRead scene_read_film, scene_read_cloths, scene_read_handles, scene_read_obstacles,
    scene_read_references;
FieldPrint scene_print_film, scene_print_cloths, scene_print_handles, scene_print_obstacles,
    scene_print_references;

/* Index of the cloth of that name; false and a report at `value`. */
bool scene_find_cloth(Reader *reader, const Yaml *value, const char *name, int *cloth);

FieldRead shape_read; /* member: ShapeDef */
FieldPrint shape_print;
/* `outline` and `holes` of a polygon into shape->loop_count, loop_begin, outline. */
bool polygon_read(Reader *reader, const Yaml *outline, const Yaml *holes, ShapeDef *shape);
bool polygon_read_value(Reader *reader, const Yaml *value, ShapeDef *shape); /* both in a mapping */
/* Loops of a polygon: begin (loop_count + 1) in points, the outer one first. */
void outlines_print(FILE *out, int indent, const int *begin, int loop_count, const double *points);
bool garment_read(Reader *reader, const Yaml *value, ShapeDef *shape);
void garment_print(FILE *out, int indent, const ShapeDef *shape);
bool cloth_mesh_read(Reader *reader, const Yaml *value, ShapeDef *shape);
void cloth_mesh_print(FILE *out, int indent, const ShapeDef *shape);
double cloth_mesh_area(const MeshDef *mesh); /* [m2] in (u, v) */
void cloth_mesh_extents(const MeshDef *mesh, double extents[2]);
/* [m] from the point (u, v) to the panel, 0 on it */
double shape_distance(const ShapeDef *shape, const double point[2]);

FieldRead pose_turn_read; /* `turn` of a pose; member: Quat */
FieldPrint pose_turn_print;

/* `turn`, `move` and `motion` of a handle or an obstacle, each NULL when not given. */
typedef struct MotionKeys {
    const Yaml *turn, *move, *motion;
} MotionKeys;
bool motion_read(Reader *reader, const MotionKeys *keys, Vec3 centre, Motion *motion);
void motion_print(FILE *out, int indent, const Motion *motion);

/* `camera` and `cameras` of a film; the end of the film ends an orbit that does not say. */
bool camera_read(Reader *reader, const Yaml *value, Film *film);
bool cameras_read(Reader *reader, const Yaml *value, Film *film);
void camera_end(Film *film, double seconds);
void camera_print(FILE *out, int indent, const Film *film);

/* `backdrop` of a film: a file or a colour. */
bool backdrop_read(Reader *reader, const Yaml *value, const char *text, Film *film);
FieldRead print_read; /* `print` of a cloth; member: FilmPicture */
FieldPrint print_print;

/* `mesh` of an obstacle; animated: `motion: file`. NULL and a report. */
const MeshDef *mesh_read(Reader *reader, const Yaml *value, bool animated);
void mesh_print(FILE *out, int indent, const MeshDef *mesh);

/* x, -y, ... or a vector; unit length. */
bool axis_read(Reader *reader, const Yaml *value, Vec3 *axis);

void print_vector(FILE *out, Vec3 vector, const char *unit);

/* A name that can be part of `cloth.region`: a letter, then letters, digits, - and _. */
bool name_check(Reader *reader, const Yaml *key, const char *what);

#endif
