#include <stdlib.h>
#include <string.h>

#include "sim/scene/scene_schema.h"

#define MOST_PANELS 1000
#define MOST_SEAMS 10000
#define PANEL_GAP 0.25 /* of a panel's width, between it and the next on the common plane */

typedef struct GarmentKeys {
    const Yaml *panels, *seams;
    double oval;
} GarmentKeys;

static const Field panel_fields[] = {
    {"NAME", FIELD_RAW, 0, .group = &polygon_schema, .help = "front, back, ... in their order"},
    {0}};
static const Schema panels_schema = {
    .name = "panels", .help = "panels by name", .fields = panel_fields};
static void garment_keys_default(void *object) {
    *(GarmentKeys *)object = (GarmentKeys){.oval = 1.0};
}
static const Field garment_fields[] = {
    {"panels", FIELD_RAW, offsetof(GarmentKeys, panels), .group = &panels_schema, .required = true,
     .help = "by name; they stand around z from the start, the first faces -y"},
    {"seams", FIELD_RAW, offsetof(GarmentKeys, seams), .required = true,
     .help = "[[front.1-2, back.0-3], ...]: rows of corners, numbered from 0, that become one"},
    {"oval", FIELD_NUMBER, offsetof(GarmentKeys, oval), .unit = "", .min = 0.1, .max = 10.0,
     .help = "depth / width of the ring at the start"},
    {0}};
const Schema garment_schema = {.name = "garment",
                               .help = "flat panels sewn into a ring",
                               .fields = garment_fields,
                               .size = sizeof(GarmentKeys),
                               .set_default = garment_keys_default};

/* ---- panels ---- */

/* was the outline turned round? The first point stays; the second then becomes the last. */
static bool was_reversed(Reader *reader, const Yaml *outline, const double *second) {
    double written[2];
    const Yaml *value = outline->first->next;
    return schema_read_vector(reader, "outline", "m", SCENE_FARTHEST, value, written, 2) &&
           (written[0] != second[0] || written[1] != second[1]);
}

static bool read_panel(Reader *reader, const Yaml *map, ShapeDef *panel, GarmentPanel *def) {
    if (!name_check(reader, map->key, "a panel") || !polygon_read_value(reader, map, panel)) {
        return false;
    }
    def->name = map->key->text;
    def->reversed = was_reversed(reader, yaml_find(map, "outline"), panel->outline + 2);
    return true;
}

/* side by side in the shape, each at least a gap to the right of the one before */
static void join_panels(Reader *reader, const ShapeDef *own, GarmentDef *garment, ShapeDef *shape) {
    int loops = 0, points = 0, at = 0;
    for (int p = 0; p < garment->panel_count; p++) {
        loops += own[p].loop_count;
        points += own[p].loop_begin[own[p].loop_count];
    }
    int *begin = arena_push(reader->arena, int, loops + 1);
    double *outline = arena_push(reader->arena, double, 2 * points), right = 0.0;
    double *pattern = arena_push(reader->arena, double, 2 * points);
    for (int p = 0; p < garment->panel_count; p++) {
        const ShapeDef *panel = &own[p];
        GarmentPanel *def = &garment->panels[p];
        int count = panel->loop_begin[panel->loop_count];
        double low = panel->outline[0], extents[2];
        for (int i = 0; i < panel->loop_begin[1]; i++) {
            low = panel->outline[2 * i] < low ? panel->outline[2 * i] : low;
        }
        shape_extents(panel, extents);
        double shift = p == 0 ? 0.0 : right + PANEL_GAP * extents[0] - low;
        right = low + shift + extents[0];
        def->loop_begin = shape->loop_count;
        memcpy(pattern + 2 * at, panel->outline, 2 * (size_t)count * sizeof *pattern);
        for (int i = 0; i < count; i++) {
            outline[2 * (at + i)] = panel->outline[2 * i] + shift;
            outline[2 * (at + i) + 1] = panel->outline[2 * i + 1];
        }
        for (int l = 0; l < panel->loop_count; l++) {
            begin[++shape->loop_count] = at + panel->loop_begin[l + 1];
        }
        def->loop_end = shape->loop_count;
        at += count;
    }
    shape->loop_begin = begin;
    shape->outline = outline;
    garment->pattern = pattern;
}

static bool read_panels(Reader *reader, const Yaml *map, GarmentDef *garment, ShapeDef *shape) {
    if (map->kind != YAML_MAP || map->count == 0 || map->count > MOST_PANELS) {
        return schema_error(reader, map,
                            "'panels' wants a mapping of 1 .. %d names to outlines, found %s",
                            MOST_PANELS, yaml_describe(map, reader->report));
    }
    ShapeDef *own = arena_push(reader->arena, ShapeDef, map->count);
    garment->panels = arena_push(reader->arena, GarmentPanel, map->count);
    for (const Yaml *value = map->first; value; value = value->next) {
        int p = garment->panel_count++;
        own[p] = (ShapeDef){.kind = SHAPE_POLYGON};
        if (!read_panel(reader, value, &own[p], &garment->panels[p])) {
            return false;
        }
    }
    join_panels(reader, own, garment, shape);
    return true;
}

/* ---- seams ---- */

static int find_panel(Reader *reader, const Yaml *value, const char *name,
                      const GarmentDef *garment) {
    const char **names = arena_push(reader->arena, const char *, garment->panel_count + 1);
    for (int p = 0; p < garment->panel_count; p++) {
        names[p] = garment->panels[p].name;
        if (strcmp(names[p], name) == 0) {
            return p;
        }
    }
    schema_error(reader, value, "no panel is called '%s'%s", report_quote(reader->report, name),
                 schema_suggest(reader, name, names));
    return -1;
}

/* corner `number` of the outline as written, in the numbers of the shape */
static int corner_of(const ShapeDef *shape, const GarmentPanel *panel, int number) {
    int begin = shape->loop_begin[panel->loop_begin];
    int count = shape->loop_begin[panel->loop_begin + 1] - begin;
    return begin + (panel->reversed ? (count - number) % count : number);
}

/* "front.1-2-3": neighbouring corners of one panel */
static bool read_row(Reader *reader, const Yaml *value, const ShapeDef *shape,
                     const GarmentDef *garment, GarmentSeam *seam, int side) {
    char *name = value->kind == YAML_TEXT ? arena_strdup(reader->arena, value->text) : NULL;
    char *at = name ? strchr(name, '.') : NULL;
    if (!at) {
        return schema_error(reader, value, "a seam wants panel.corner-corner, front.1-2, found %s",
                            yaml_describe(value, reader->report));
    }
    *at++ = '\0';
    seam->panel[side] = find_panel(reader, value, name, garment);
    if (seam->panel[side] < 0) {
        return false;
    }
    const GarmentPanel *panel = &garment->panels[seam->panel[side]];
    int begin = shape->loop_begin[panel->loop_begin], most = 1, count = 0;
    int corners = shape->loop_begin[panel->loop_begin + 1] - begin;
    for (const char *c = at; *c; c++) {
        most += *c == '-';
    }
    int *row = arena_push(reader->arena, int, most);
    for (char *end = at; count < most; at = end + 1) {
        long number = strtol(at, &end, 10);
        if (end == at || *at < '0' || *at > '9' || (*end && *end != '-') || number >= corners) {
            return schema_error(
                reader, value, "'%s': corners of '%s' are numbered 0 .. %d, as in %s.0-1",
                report_quote(reader->report, value->text), panel->name, corners - 1, panel->name);
        }
        row[count] = corner_of(shape, panel, (int)number);
        int step = count ? abs(row[count] - row[count - 1]) : 1;
        if (step != 1 && step != corners - 1) {
            return schema_error(reader, value, "corner %ld does not follow the one before it",
                                number);
        }
        count++;
    }
    if (count < 2) {
        return schema_error(reader, value, "a seam runs from corner to corner, as in %s.0-1",
                            panel->name);
    }
    seam->corner[side] = row;
    if (side == 1 && seam->corner_count != count) {
        return schema_error(reader, value, "%d edges cannot be sewn to %d; write all corners",
                            count - 1, seam->corner_count - 1);
    }
    seam->corner_count = count;
    return true;
}

static bool read_seams(Reader *reader, const Yaml *list, const ShapeDef *shape,
                       GarmentDef *garment) {
    if (list->kind != YAML_LIST || list->count > MOST_SEAMS) {
        return schema_error(reader, list, "'seams' wants a list such as [[a.1-2, b.0-3]], found %s",
                            yaml_describe(list, reader->report));
    }
    garment->seams = arena_push(reader->arena, GarmentSeam, list->count);
    for (const Yaml *value = list->first; value; value = value->next) {
        GarmentSeam *seam = &garment->seams[garment->seam_count++];
        if (value->kind != YAML_LIST || value->count != 2) {
            return schema_error(reader, value, "a seam wants two rows, [front.1-2, back.0-3]");
        }
        seam->line = value->place.line;
        if (!read_row(reader, value->first, shape, garment, seam, 0) ||
            !read_row(reader, value->first->next, shape, garment, seam, 1)) {
            return false;
        }
    }
    return true;
}

bool garment_read(Reader *reader, const Yaml *value, ShapeDef *shape) {
    GarmentKeys keys;
    GarmentDef *garment = arena_push(reader->arena, GarmentDef, 1);
    garment_keys_default(&keys);
    if (!schema_read(reader, &garment_schema, value, &keys) ||
        !read_panels(reader, keys.panels, garment, shape) ||
        !read_seams(reader, keys.seams, shape, garment)) {
        return false;
    }
    garment->oval = keys.oval;
    shape->garment = garment;
    return true;
}

/* ---- printing ---- */

static void print_row(FILE *out, const ShapeDef *shape, const GarmentSeam *seam, int side) {
    const GarmentPanel *panel = &shape->garment->panels[seam->panel[side]];
    int begin = shape->loop_begin[panel->loop_begin];
    fprintf(out, "%s.", panel->name);
    for (int i = 0; i < seam->corner_count; i++) {
        fprintf(out, "%s%d", i ? "-" : "", seam->corner[side][i] - begin);
    }
}

void garment_print(FILE *out, int indent, const ShapeDef *shape) {
    const GarmentDef *garment = shape->garment;
    fprintf(out, "%*spanels:\n", indent, "");
    for (int p = 0; p < garment->panel_count; p++) {
        const GarmentPanel *panel = &garment->panels[p];
        fprintf(out, "%*s%s:\n", indent + 2, "", panel->name);
        outlines_print(out, indent + 4, shape->loop_begin + panel->loop_begin,
                       panel->loop_end - panel->loop_begin, garment->pattern);
    }
    fprintf(out, "%*sseams:\n", indent, "");
    for (int s = 0; s < garment->seam_count; s++) {
        fprintf(out, "%*s- [", indent + 2, "");
        print_row(out, shape, &garment->seams[s], 0);
        fputs(", ", out);
        print_row(out, shape, &garment->seams[s], 1);
        fputs("]\n", out);
    }
    schema_print_key(out, indent, "oval");
    schema_print_number(out, garment->oval);
    fputc('\n', out);
}
