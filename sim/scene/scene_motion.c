#include <math.h>
#include <string.h>

#include "sim/scene/scene_schema.h"

#define SHORTEST_MOTION 1e-6 /* [s] from start to end of a turn or move */
#define UNIT_TOLERANCE 1e-12 /* |v|^2 - 1 of what is a unit vector already: keeps its bits */

static const char *const ease_names[] = {"smooth", "linear", "", NULL};
enum { EASE_SMOOTH, EASE_LINEAR, EASE_OPEN };

/* the keys of a turn or a move */
typedef struct PieceKeys {
    const Yaml *axis, *by, *velocity;
    double rate;     /* [rad/s] */
    Vec3 centre;     /* [m] */
    double from, to; /* [s] */
    int ease;
} PieceKeys;

static void piece_default(void *object) {
    *(PieceKeys *)object =
        (PieceKeys){.rate = NAN, .centre = {NAN, NAN, NAN}, .to = NAN, .ease = EASE_OPEN};
}

#define FROM_TO_EASE                                                                               \
    {"from",     FIELD_NUMBER,   offsetof(PieceKeys, from), .unit = "s", .min = 0.0,               \
     .max = 1e6, .help = "start"},                                                                 \
        {"to",                                                                                     \
         FIELD_NUMBER,                                                                             \
         offsetof(PieceKeys, to),                                                                  \
         .unit = "s",                                                                              \
         .min = 0.0,                                                                               \
         .max = 1e6,                                                                               \
         .help = "end; default: the end of the film"},                                             \
        {"ease", FIELD_WORD, offsetof(PieceKeys, ease), .words = ease_names,                       \
         .help = "start and stop gently; default smooth, linear for a rate or velocity"},          \
    {                                                                                              \
        0                                                                                          \
    }

static const Field turn_fields[] = {
    {"axis", FIELD_RAW, offsetof(PieceKeys, axis), .required = true,
     .help = "x, y, z, -x, -y, -z or a vector"},
    {"by", FIELD_RAW, offsetof(PieceKeys, by), .help = "whole angle, 90 deg or 4 turns"},
    {"rate", FIELD_NUMBER, offsetof(PieceKeys, rate), .unit = "angle/s", .min = -1e5, .max = 1e5,
     .help = "turning speed, instead of by; without an end when there is no to"},
    {"centre", FIELD_VECTOR, offsetof(PieceKeys, centre), .unit = "m", .max = SCENE_FARTHEST,
     .help = "a point on the axis; default: where the cloth or obstacle starts"},
    FROM_TO_EASE};
static const Field move_fields[] = {
    {"by", FIELD_RAW, offsetof(PieceKeys, by), .help = "whole way: a vector, or a length on axis"},
    {"velocity", FIELD_RAW, offsetof(PieceKeys, velocity),
     .help = "a vector or a speed on axis, instead of by; without an end when there is no to"},
    {"axis", FIELD_RAW, offsetof(PieceKeys, axis), .help = "x, y, z, -x, -y, -z or a vector"},
    FROM_TO_EASE};
static const Schema turn_schema = {
    "turn", "a rotation over time", turn_fields, sizeof(PieceKeys), piece_default, 0};
static const Schema move_schema = {
    "move", "a shift over time", move_fields, sizeof(PieceKeys), piece_default, 0};

static const Field motion_fields[] = {{"turn", FIELD_RAW, offsetof(MotionKeys, turn),
                                       .group = &turn_schema, .help = "one turn or a list of them"},
                                      {"move", FIELD_RAW, offsetof(MotionKeys, move),
                                       .group = &move_schema, .help = "one move or a list of them"},
                                      {0}};
const Schema motion_schema = {.name = "motion",
                              .help = "turns and moves, done in the order of writing",
                              .fields = motion_fields,
                              .size = sizeof(MotionKeys)};

static Vec3 to_unit(Vec3 v) {
    return fabs(vec3_dot(v, v) - 1.0) < UNIT_TOLERANCE ? v : vec3_unit(v, vec3(0, 0, 1));
}

bool axis_read(Reader *reader, const Yaml *value, Vec3 *axis) {
    static const char *const words[] = {"x", "y", "z", "-x", "-y", "-z", NULL};
    double v[3] = {0.0, 0.0, 0.0};
    if (value->kind == YAML_TEXT) {
        int i = 0;
        while (words[i] && strcmp(words[i], value->text) != 0) {
            i++;
        }
        if (!words[i]) {
            return schema_error(reader, value,
                                "'axis' wants x, y, z, -x, -y, -z or a vector, found %s",
                                yaml_describe(value, reader->report));
        }
        v[i % 3] = i < 3 ? 1.0 : -1.0;
    } else if (!schema_read_vector(reader, "axis", "", 1e9, value, v, 3)) {
        return false;
    }
    Vec3 found = vec3_load(v);
    if (vec3_length(found) < 1e-9) {
        return schema_error(reader, value, "'axis' has no direction");
    }
    *axis = to_unit(found);
    return true;
}

/* times, and whether it never ends */
static bool read_times(Reader *reader, const Yaml *map, const PieceKeys *keys, bool speed,
                       MotionPiece *piece) {
    bool smooth = keys->ease == EASE_SMOOTH || (keys->ease == EASE_OPEN && !speed);
    piece->from = keys->from;
    piece->to = isnan(keys->to) ? scene_context(reader)->seconds : keys->to;
    piece->smooth = smooth;
    piece->endless = speed && isnan(keys->to);
    if (piece->endless) {
        piece->to = keys->from + 1.0;
    }
    if (piece->endless && smooth) {
        return schema_error(reader, map,
                            "a speed without 'to' cannot end gently: leave out 'ease' "
                            "or say 'to'");
    }
    if (piece->to - piece->from < SHORTEST_MOTION) {
        return schema_error(reader, yaml_find(map, "from") ? yaml_find(map, "from") : map,
                            "the motion ends at %g s before it starts at %g s", piece->to,
                            piece->from);
    }
    return true;
}

static bool read_turn(Reader *reader, const Yaml *map, Vec3 centre, MotionPiece *piece) {
    PieceKeys keys;
    piece_default(&keys);
    if (!schema_read(reader, &turn_schema, map, &keys) ||
        !axis_read(reader, keys.axis, &piece->axis)) {
        return false;
    }
    bool speed = !isnan(keys.rate);
    if (speed == (keys.by != NULL)) {
        return schema_error(reader, map,
                            speed ? "'by' and 'rate' exclude each other"
                                  : "a turn needs 'by' (an angle) or 'rate'");
    }
    double angle = keys.rate;
    if (!read_times(reader, map, &keys, speed, piece) ||
        (!speed && !schema_read_number(reader, "by", "angle", -1e6, 1e6, keys.by, &angle))) {
        return false;
    }
    piece->kind = MOTION_TURN;
    piece->angle = speed && !piece->endless ? angle * (piece->to - piece->from) : angle;
    piece->centre = isnan(keys.centre.x) ? centre : keys.centre;
    return true;
}

/* a vector, or a number along the axis */
static bool read_way(Reader *reader, const char *name, const char *unit, const PieceKeys *keys,
                     const Yaml *value, Vec3 *way) {
    double numbers[3], length;
    if (!keys->axis) {
        if (!schema_read_vector(reader, name, unit, SCENE_FARTHEST, value, numbers, 3)) {
            return false;
        }
        *way = vec3_load(numbers);
        return true;
    }
    if (!axis_read(reader, keys->axis, way) ||
        !schema_read_number(reader, name, unit, -SCENE_FARTHEST, SCENE_FARTHEST, value, &length)) {
        return false;
    }
    *way = vec3_scale(length, *way);
    return true;
}

static bool read_move(Reader *reader, const Yaml *map, MotionPiece *piece) {
    PieceKeys keys;
    piece_default(&keys);
    if (!schema_read(reader, &move_schema, map, &keys)) {
        return false;
    }
    bool speed = keys.velocity != NULL;
    if (speed == (keys.by != NULL)) {
        return schema_error(reader, map,
                            speed ? "'by' and 'velocity' exclude each other"
                                  : "a move needs 'by' (a vector) or 'velocity'");
    }
    piece->kind = MOTION_MOVE;
    if (!read_times(reader, map, &keys, speed, piece) ||
        !read_way(reader, speed ? "velocity" : "by", speed ? "m/s" : "m", &keys,
                  speed ? keys.velocity : keys.by, &piece->by)) {
        return false;
    }
    if (speed && !piece->endless) {
        piece->by = vec3_scale(piece->to - piece->from, piece->by);
    }
    return true;
}

/* the pieces under one key: a mapping or a list of mappings */
static bool read_pieces(Reader *reader, const Yaml *value, bool turn, Vec3 centre,
                        MotionPiece *pieces, int *count) {
    bool ok = true;
    const Yaml *first = value->kind == YAML_LIST ? value->first : value;
    for (const Yaml *map = first; map; map = map == value ? NULL : map->next) {
        MotionPiece *piece = &pieces[(*count)++];
        ok = (turn ? read_turn(reader, map, centre, piece) : read_move(reader, map, piece)) && ok;
    }
    return ok;
}

static int count_pieces(const Yaml *value) {
    return !value ? 0 : value->kind == YAML_LIST ? value->count : 1;
}

static bool is_before(const Yaml *a, const Yaml *b) {
    Place p = a->place, q = b->place;
    return p.line != q.line ? p.line < q.line : p.column < q.column;
}

/* turns and moves of one mapping, in the order in which the two keys are written */
static bool read_both(Reader *reader, const Yaml *turn, const Yaml *move, Vec3 centre,
                      MotionPiece *pieces, int *count) {
    bool turn_first = turn && (!move || is_before(turn, move));
    const Yaml *order[2] = {turn_first ? turn : move, turn_first ? move : turn};
    bool ok = true;
    for (int i = 0; i < 2; i++) {
        ok =
            (!order[i] || read_pieces(reader, order[i], order[i] == turn, centre, pieces, count)) &&
            ok;
    }
    return ok;
}

/* motion: {turn: ..., move: ...}, or a list of such mappings */
static bool read_steps(Reader *reader, const Yaml *value, Vec3 centre, Motion *motion) {
    const Yaml *first = value->kind == YAML_LIST ? value->first : value;
    int count = 0, limit = 0;
    bool ok = true;
    for (int pass = 0; pass < 2; pass++) {
        MotionPiece *pieces = pass ? arena_push(reader->arena, MotionPiece, limit) : NULL;
        for (const Yaml *map = first; map; map = map == value ? NULL : map->next) {
            MotionKeys keys = {0};
            if (pass == 0) {
                ok = schema_read(reader, &motion_schema, map, &keys) && ok;
            } else {
                keys = (MotionKeys){yaml_find(map, "turn"), yaml_find(map, "move"), NULL};
                ok = read_both(reader, keys.turn, keys.move, centre, pieces, &count) && ok;
            }
            limit += count_pieces(keys.turn) + count_pieces(keys.move);
        }
        if (!ok) {
            return false;
        }
        *motion = (Motion){count, pieces};
    }
    return true;
}

bool motion_read(Reader *reader, const MotionKeys *keys, Vec3 centre, Motion *motion) {
    if (keys->motion && (keys->turn || keys->move)) {
        return schema_error(reader, keys->motion->key,
                            "'motion' and '%s' exclude each other; put all into 'motion'",
                            keys->turn ? "turn" : "move");
    }
    if (keys->motion) {
        return read_steps(reader, keys->motion, centre, motion);
    }
    int count = 0, limit = count_pieces(keys->turn) + count_pieces(keys->move);
    MotionPiece *pieces = arena_push(reader->arena, MotionPiece, limit);
    bool ok = read_both(reader, keys->turn, keys->move, centre, pieces, &count);
    *motion = (Motion){count, pieces};
    return ok;
}

void print_vector(FILE *out, Vec3 vector, const char *unit) {
    double numbers[3] = {vector.x, vector.y, vector.z};
    for (int i = 0; i < 3; i++) {
        fputs(i ? ", " : "[", out);
        schema_print_quantity(out, numbers[i], unit);
    }
    fputc(']', out);
}

static void print_piece(FILE *out, const MotionPiece *piece) {
    bool turn = piece->kind == MOTION_TURN;
    if (turn) {
        fputs("turn: {axis: ", out);
        print_vector(out, piece->axis, "");
        fputs(piece->endless ? ", rate: " : ", by: ", out);
        schema_print_quantity(out, piece->angle, piece->endless ? "angle/s" : "angle");
        fputs(", centre: ", out);
        print_vector(out, piece->centre, "m");
    } else {
        fputs(piece->endless ? "move: {velocity: " : "move: {by: ", out);
        print_vector(out, piece->by, piece->endless ? "m/s" : "m");
    }
    fputs(", from: ", out);
    schema_print_quantity(out, piece->from, "s");
    if (!piece->endless) {
        fputs(", to: ", out);
        schema_print_quantity(out, piece->to, "s");
    }
    fprintf(out, ", ease: %s}\n", ease_names[piece->smooth ? EASE_SMOOTH : EASE_LINEAR]);
}

void motion_print(FILE *out, int indent, const Motion *motion) {
    if (motion->piece_count > 0) {
        fprintf(out, "%*smotion:\n", indent, "");
    }
    for (int i = 0; i < motion->piece_count; i++) {
        fprintf(out, "%*s- ", indent + 2, "");
        print_piece(out, &motion->pieces[i]);
    }
}

/* `turn` of a pose: it has no time */
typedef struct PoseTurnKeys {
    const Yaml *axis, *by, *quaternion;
} PoseTurnKeys;

static const Field pose_turn_fields[] = {
    {"axis", FIELD_RAW, offsetof(PoseTurnKeys, axis), .help = "x, y, z, -x, -y, -z or a vector"},
    {"by", FIELD_RAW, offsetof(PoseTurnKeys, by), .help = "angle, 90 deg"},
    {"quaternion", FIELD_RAW, offsetof(PoseTurnKeys, quaternion),
     .help = "[w, x, y, z], in place of axis and by"},
    {0}};
const Schema pose_turn_schema = {.name = "turn",
                                 .help = "how it is turned at the start",
                                 .fields = pose_turn_fields,
                                 .size = sizeof(PoseTurnKeys)};

static bool read_quaternion(Reader *reader, const Yaml *value, Quat *turn) {
    double q[4], square = 0.0;
    if (value->kind != YAML_LIST || value->count != 4) {
        return schema_error(reader, value, "'quaternion' wants four numbers [w, x, y, z]");
    }
    const Yaml *item = value->first;
    for (int i = 0; i < 4; i++, item = item->next) {
        if (!schema_read_number(reader, "quaternion", "", -1e9, 1e9, item, &q[i])) {
            return false;
        }
        square += q[i] * q[i];
    }
    if (!(square > 1e-12)) {
        return schema_error(reader, value, "'quaternion' is zero");
    }
    double scale = fabs(square - 1.0) < UNIT_TOLERANCE ? 1.0 : 1.0 / sqrt(square);
    *turn = (Quat){scale * q[0], scale * q[1], scale * q[2], scale * q[3]};
    return true;
}

static bool read_pose_turn(Reader *reader, const Yaml *map, Quat *turn) {
    PoseTurnKeys keys = {0};
    Vec3 axis;
    double angle;
    if (!schema_read(reader, &pose_turn_schema, map, &keys)) {
        return false;
    }
    if (keys.quaternion && !keys.axis && !keys.by) {
        return read_quaternion(reader, keys.quaternion, turn);
    }
    if (!keys.axis || !keys.by || keys.quaternion) {
        return schema_error(reader, map, "'turn' needs 'axis' and 'by', or a 'quaternion'");
    }
    if (!axis_read(reader, keys.axis, &axis) ||
        !schema_read_number(reader, "by", "angle", -1e3, 1e3, keys.by, &angle)) {
        return false;
    }
    *turn = quat_from_axis_angle(axis, angle);
    return true;
}

bool pose_turn_read(Reader *reader, const Field *field, const Yaml *value, void *member) {
    (void)field;
    Quat *whole = member;
    bool ok = true;
    const Yaml *first = value->kind == YAML_LIST ? value->first : value;
    for (const Yaml *map = first; map && ok; map = map == value ? NULL : map->next) {
        Quat turn;
        ok = read_pose_turn(reader, map, &turn);
        if (ok) {
            *whole = map == first ? turn : quat_multiply(turn, *whole);
        }
    }
    return ok;
}

void pose_turn_print(FILE *out, int indent, const Field *field, const void *member) {
    const Quat *turn = member;
    double numbers[4] = {turn->w, turn->x, turn->y, turn->z};
    if (numbers[0] == 1.0) {
        return;
    }
    schema_print_key(out, indent, field->key);
    fputs("{quaternion: ", out);
    for (int i = 0; i < 4; i++) {
        fputs(i ? ", " : "[", out);
        schema_print_number(out, numbers[i]);
    }
    fputs("]}\n", out);
}
