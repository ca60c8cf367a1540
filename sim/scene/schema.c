#include "sim/scene/schema.h"

#include <math.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/text.h"
#include "sim/base/vec.h"
#include "sim/scene/units.h"

#define SUGGESTION_SIZE 400 /* [byte] */

bool schema_error(Reader *reader, const Yaml *value, const char *format, ...) {
    char message[512];
    if (value->broken) {
        return false;
    }
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    return report_error(reader->report, value->place, EXIT_BAD_INPUT, "%s", message);
}

const char *schema_suggest(Reader *reader, const char *word, const char *const *words) {
    char *text = arena_push(reader->arena, char, SUGGESTION_SIZE);
    const char *nearest = text_nearest(word, words);
    if (nearest) {
        snprintf(text, SUGGESTION_SIZE, "; did you mean '%s'?", nearest);
        return text;
    }
    size_t used = 0;
    for (int i = 0; words[i] && used < SUGGESTION_SIZE; i++) {
        used += (size_t)snprintf(text + used, SUGGESTION_SIZE - used, "%s%s",
                                 i ? ", " : "; one of ", words[i]);
    }
    return text;
}

const Field *schema_find(const Schema *schema, const char *key) {
    const Field *field = schema->fields;
    while (field->key && strcmp(field->key, key) != 0) {
        field++;
    }
    return field->key ? field : NULL;
}

/* the key under which `key` would be right, anywhere inside `schema` */
static const char *find_owner(const Schema *schema, const char *owner, const char *key) {
    if (owner && schema_find(schema, key)) {
        return owner;
    }
    for (const Field *field = schema->fields; field->key; field++) {
        const char *found = field->group ? find_owner(field->group, field->key, key) : NULL;
        if (found) {
            return found;
        }
    }
    return NULL;
}

static void complain_key(Reader *reader, const Schema *schema, const Yaml *key) {
    const char *keys[64];
    int count = 0;
    for (const Field *field = schema->fields; field->key && count < 63; field++) {
        keys[count++] = field->key;
    }
    keys[count] = NULL;
    const char *hint = "", *owner = NULL;
    if (!text_nearest(key->text, keys)) {
        owner = reader->root ? find_owner(reader->root, NULL, key->text) : NULL;
    }
    if (owner) {
        schema_error(reader, key, "'%s' is not a key of '%s'; it belongs under '%s'",
                     report_quote(reader->report, key->text), schema->name, owner);
        return;
    }
    hint = schema_suggest(reader, key->text, keys);
    schema_error(reader, key, "'%s' is not a key of '%s'%s",
                 report_quote(reader->report, key->text), schema->name, hint);
}

static bool want_text(Reader *reader, const char *name, const char *wanted, const Yaml *value) {
    return (value->kind == YAML_TEXT && value->text[0] && !value->broken) ||
           schema_error(reader, value, "'%s' wants %s, found %s", name, wanted,
                        yaml_describe(value, reader->report));
}

static void print_limits(char *text, size_t size, const char *unit, double min, double max) {
    char si[24] = "";
    if (unit[0]) {
        snprintf(si, sizeof si, " %.*s", (int)strcspn(unit, "|"), unit);
        char *angle = strstr(si, "angle");
        if (angle) {
            memmove(angle + 3, angle + 5, strlen(angle + 5) + 1);
            memcpy(angle, "rad", 3);
        }
    }
    if (isinf(max)) {
        snprintf(text, size, "it must be at least %g%s", min, si);
    } else if (isinf(min)) {
        snprintf(text, size, "it must be at most %g%s", max, si);
    } else {
        snprintf(text, size, "it must be %g .. %g%s", min, max, si);
    }
}

bool schema_read_number(Reader *reader, const char *name, const char *unit, double min, double max,
                        const Yaml *value, double *number) {
    double found;
    char want[UNITS_WANTED_SIZE];
    UnitsProblem problem;
    if (!want_text(reader, name, units_wanted(unit, want), value)) {
        return false;
    }
    const char *quote = report_quote(reader->report, value->text);
    if (!units_read(value->text, unit, reader->frame_seconds, &found, &problem)) {
        return schema_error(reader, value, "'%s' %s", name,
                            report_quote_long(reader->report, problem.text));
    }
    if (!(found >= min && found <= max)) {
        char limits[96];
        print_limits(limits, sizeof limits, unit, min, max);
        return schema_error(reader, value, "'%s' is %s; %s", name, quote, limits);
    }
    *number = found;
    return true;
}

bool schema_read_vector(Reader *reader, const char *name, const char *unit, double limit,
                        const Yaml *value, double *numbers, int count) {
    double found[3];
    ASSERT(count <= 3);
    if (value->kind != YAML_LIST || value->count != count) {
        return schema_error(reader, value, "'%s' wants a list of %d numbers such as %s, found %s",
                            name, count, count == 3 ? "[0, 0, 1]" : "[0, 1]",
                            value->kind == YAML_LIST ? "another count"
                                                     : yaml_describe(value, reader->report));
    }
    bool ok = true;
    const Yaml *item = value->first;
    for (int i = 0; i < count; i++, item = item->next) {
        ok = schema_read_number(reader, name, unit, -limit, limit, item, &found[i]) && ok;
    }
    if (ok) {
        memcpy(numbers, found, sizeof found[0] * (size_t)count);
    }
    return ok;
}

/* whole digits only, at most a million */
static size_t read_digits(const char *text, int *count) {
    size_t digits = strspn(text, "0123456789");
    *count = digits > 0 && digits <= 9 ? atoi(text) : -1;
    return digits;
}

static bool read_count(Reader *reader, const Field *field, const Yaml *value, int *count) {
    int found;
    if (!want_text(reader, field->key, "a whole number", value)) {
        return false;
    }
    size_t digits = read_digits(value->text, &found);
    if (digits == 0 || value->text[digits]) {
        return schema_error(reader, value, "'%s' wants a whole number, found %s", field->key,
                            yaml_describe(value, reader->report));
    }
    if (found < field->min || found > field->max) {
        return schema_error(reader, value, "'%s' is %s; it must be %g .. %g", field->key,
                            report_quote(reader->report, value->text), field->min, field->max);
    }
    *count = found;
    return true;
}

static bool read_grid(Reader *reader, const Field *field, const Yaml *value, int *grid) {
    int found[2] = {-1, -1};
    bool ok = value->kind == YAML_TEXT;
    if (ok) {
        const char *p = value->text;
        p += read_digits(p, &found[0]);
        p += strspn(p, " ");
        ok = *p == 'x' || *p == 'X';
        p += ok;
        p += strspn(p, " ");
        size_t digits = ok ? read_digits(p, &found[1]) : 0;
        ok = digits > 0 && !p[digits];
    }
    if (!ok) {
        return schema_error(reader, value, "'%s' wants two whole numbers such as 60 x 40, found %s",
                            field->key, yaml_describe(value, reader->report));
    }
    for (int i = 0; i < 2; i++) {
        if (found[i] < field->min || found[i] > field->max) {
            return schema_error(reader, value, "'%s' is %s; both must be %g .. %g", field->key,
                                report_quote(reader->report, value->text), field->min, field->max);
        }
    }
    memcpy(grid, found, sizeof found);
    return true;
}

static bool read_word(Reader *reader, const Field *field, const Yaml *value, int *index) {
    if (!want_text(reader, field->key, "a word", value)) {
        return false;
    }
    for (int i = 0; field->words[i]; i++) {
        if (strcmp(field->words[i], value->text) == 0) {
            *index = i;
            return true;
        }
    }
    return schema_error(reader, value, "'%s' is not a %s%s",
                        report_quote(reader->report, value->text), field->key,
                        schema_suggest(reader, value->text, field->words));
}

static bool read_name(Reader *reader, const Field *field, const Yaml *value, const char **name) {
    const char *const *names = reader->names[(int)field->min];
    if (!want_text(reader, field->key, "a name", value)) {
        return false;
    }
    for (int i = 0; names && names[i]; i++) {
        if (strcmp(names[i], value->text) == 0) {
            *name = names[i];
            return true;
        }
    }
    if (names) {
        return schema_error(reader, value, "'%s' is not a %s%s",
                            report_quote(reader->report, value->text), field->key,
                            schema_suggest(reader, value->text, names));
    }
    *name = value->text;
    return true;
}

static bool read_bool(Reader *reader, const Field *field, const Yaml *value, bool *flag) {
    static const char *const truth[] = {"false", "true", NULL};
    const char *const *words = field->words ? field->words : truth;
    for (int i = 0; i < 2; i++) {
        if (yaml_is(value, words[i]) && !(value->quoted && words == truth)) {
            *flag = i;
            return true;
        }
    }
    return schema_error(reader, value, "'%s' wants %s or %s, found %s", field->key, words[0],
                        words[1], yaml_describe(value, reader->report));
}

static bool read_number_field(Reader *reader, const Field *field, const Yaml *value,
                              double *number) {
    if (field->word && yaml_is(value, field->word)) {
        *number = field->word_value;
        return true;
    }
    return schema_read_number(reader, field->key, field->unit, field->min, field->max, value,
                              number);
}

static bool read_text(Reader *reader, const Field *field, const Yaml *value, const char **text) {
    if (!want_text(reader, field->key, "a text", value)) {
        return false;
    }
    *text = value->text;
    return true;
}

bool schema_read_field(Reader *reader, const Field *field, const Yaml *value, void *member) {
    switch (field->type) {
    case FIELD_NUMBER:
        return read_number_field(reader, field, value, member);
    case FIELD_COUNT:
        return read_count(reader, field, value, member);
    case FIELD_BOOL:
        return read_bool(reader, field, value, member);
    case FIELD_WORD:
        return read_word(reader, field, value, member);
    case FIELD_NAME:
        return read_name(reader, field, value, member);
    case FIELD_TEXT:
        return read_text(reader, field, value, member);
    case FIELD_VECTOR:
        return schema_read_vector(reader, field->key, field->unit, field->max, value, member, 3);
    case FIELD_POINT:
        return schema_read_vector(reader, field->key, field->unit, field->max, value, member, 2);
    case FIELD_GRID:
        return read_grid(reader, field, value, member);
    case FIELD_GROUP:
        return schema_read(reader, field->group, value, member);
    case FIELD_RAW:
        *(const Yaml **)member = value;
        return true;
    case FIELD_CUSTOM:
        return field->read(reader, field, value, member);
    }
    return false;
}

static bool read_shorthand(Reader *reader, const Schema *schema, const Yaml *value, void *object) {
    bool ok = true;
    for (int i = 0; i < schema->shorthand && ok; i++) {
        const Field *field = &schema->fields[i];
        ok = schema_read_field(reader, field, value, (char *)object + field->offset);
    }
    return ok;
}

/* Is `key` likely to be one of the unknown keys of the map, misspelled? */
static bool is_misspelled(const Schema *schema, const Yaml *map, const char *key) {
    for (const Yaml *value = map->first; value; value = value->next) {
        if (!schema_find(schema, value->key->text) &&
            text_distance(value->key->text, key, 2) <= 2) {
            return true;
        }
    }
    return false;
}

bool schema_read(Reader *reader, const Schema *schema, const Yaml *map, void *object) {
    if (schema->shorthand && (map->kind == YAML_TEXT || yaml_find(map, "value"))) {
        return read_shorthand(reader, schema, map, object);
    }
    if (map->kind != YAML_MAP || map->broken) {
        return schema_error(reader, map, "'%s' wants a mapping of keys, found %s", schema->name,
                            yaml_describe(map, reader->report));
    }
    bool ok = true;
    for (const Yaml *value = map->first; value; value = value->next) {
        if (!schema_find(schema, value->key->text)) {
            complain_key(reader, schema, value->key);
            ok = false;
        }
    }
    for (const Field *field = schema->fields; field->key; field++) {
        const Yaml *value = yaml_find(map, field->key);
        if (value) {
            ok = schema_read_field(reader, field, value, (char *)object + field->offset) && ok;
        } else if (field->required && !is_misspelled(schema, map, field->key)) {
            ok = schema_error(reader, map->key ? map->key : map, "'%s' needs '%s': %s",
                              schema->name, field->key, field->help);
        }
    }
    return ok;
}
