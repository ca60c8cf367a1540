#include "sim/scene/yaml.h"

#include <stdio.h>
#include <string.h>
#include <yaml.h>

/* one pass over the events of libyaml */
typedef struct Pass {
    yaml_parser_t parser;
    const Source *source;
    Report *report;
    Arena *arena;
    int value_count;
} Pass;

Yaml *yaml_find(const Yaml *map, const char *key) {
    Yaml *value = map->kind == YAML_MAP ? map->first : NULL;
    while (value && strcmp(value->key->text, key) != 0) {
        value = value->next;
    }
    return value;
}

bool yaml_is(const Yaml *value, const char *text) {
    return value->kind == YAML_TEXT && strcmp(value->text, text) == 0;
}

void yaml_append(Yaml *parent, const Yaml *key, Yaml *value) {
    Yaml **end = &parent->first;
    while (*end) {
        end = &(*end)->next;
    }
    value->key = key;
    value->next = NULL;
    *end = value;
    parent->count++;
}

const char *yaml_describe(const Yaml *value, Report *report) {
    if (value->kind != YAML_TEXT) {
        static const char *const kinds[2][2] = {{"an empty list", "a list"},
                                                {"an empty mapping", "a mapping"}};
        return kinds[value->kind == YAML_MAP][value->count > 0];
    }
    if (!value->text[0]) {
        return "nothing";
    }
    const char *quote = report_quote(report, value->text);
    size_t size = strlen(quote) + 3;
    char *text = arena_push(report->arena, char, size);
    snprintf(text, size, "'%s'", quote);
    return text;
}

static Place place_of(const Pass *pass, yaml_mark_t mark) {
    return (Place){pass->source, (int)mark.line + 1, (int)mark.column + 1};
}

static bool complain(Pass *pass, yaml_mark_t mark, const char *message) {
    return report_error(pass->report, place_of(pass, mark), EXIT_BAD_INPUT, "%s", message);
}

static bool line_has_tab(const Source *source, size_t line) {
    const char *p = source->text;
    for (size_t i = 0; i < line && p; i++) {
        p = strchr(p, '\n');
        p = p ? p + 1 : NULL;
    }
    return p && memchr(p, '\t', strcspn(p, "\n"));
}

/* What libyaml found wrong, in words that help somebody who does not know its insides. */
static bool complain_syntax(Pass *pass) {
    const yaml_parser_t *parser = &pass->parser;
    const char *problem = parser->problem ? parser->problem : "this is not YAML";
    yaml_mark_t mark = parser->problem_mark;
    if (strstr(problem, "cannot start any token")) {
        problem = line_has_tab(pass->source, mark.line)
                      ? "a tab cannot indent YAML; use spaces"
                      : "a character that YAML reserves (@ ` %) must be quoted";
    }
    if (parser->context && parser->context_mark.line != mark.line) {
        return report_error(pass->report, place_of(pass, mark), EXIT_BAD_INPUT,
                            "%s (%s in line %d)", problem, parser->context,
                            (int)parser->context_mark.line + 1);
    }
    return report_error(pass->report, place_of(pass, mark), EXIT_BAD_INPUT, "%s", problem);
}

static bool next_event(Pass *pass, yaml_event_t *event) {
    return yaml_parser_parse(&pass->parser, event) || complain_syntax(pass);
}

static Yaml *value_create(Pass *pass, YamlKind kind, yaml_mark_t mark) {
    Yaml *value = arena_push(pass->arena, Yaml, 1);
    *value = (Yaml){.kind = kind, .place = place_of(pass, mark), .text = ""};
    pass->value_count++;
    return value;
}

static void refuse_properties(Pass *pass, Yaml *value, yaml_mark_t mark, const yaml_char_t *anchor,
                              const yaml_char_t *tag) {
    if (anchor) {
        value->broken = true;
        complain(pass, mark, "anchors (&name) are not supported; use 'include'");
    }
    if (tag) {
        value->broken = true;
        complain(pass, mark, "tags (!name) are not supported; leave the tag out");
    }
}

/* C0 and C1 control characters but tab and newline; they come from "\x07" in quotes */
static bool has_control(const yaml_char_t *text, size_t bytes) {
    for (size_t i = 0; i < bytes; i++) {
        bool c0 = text[i] < 32 && text[i] != '\n' && text[i] != '\t';
        bool c1 = text[i] == 0xC2 && i + 1 < bytes && text[i + 1] < 0xA0;
        if (c0 || c1 || text[i] == 127) {
            return true;
        }
    }
    return false;
}

static Yaml *read_text(Pass *pass, const yaml_event_t *event) {
    Yaml *value = value_create(pass, YAML_TEXT, event->start_mark);
    size_t bytes = event->data.scalar.length;
    if (has_control(event->data.scalar.value, bytes)) {
        value->broken = true;
        complain(pass, event->start_mark, "there is a control character in this text");
        return value;
    }
    char *text = arena_push(pass->arena, char, bytes + 1);
    memcpy(text, event->data.scalar.value, bytes);
    value->text = text;
    value->quoted = event->data.scalar.style != YAML_PLAIN_SCALAR_STYLE;
    refuse_properties(pass, value, event->start_mark, event->data.scalar.anchor,
                      event->data.scalar.tag);
    return value;
}

static bool read_value(Pass *pass, const yaml_event_t *event, int depth, Yaml **value);

/* Ends a mapping or a list when the event says so; else reads the next value. */
static bool read_next(Pass *pass, yaml_event_type_t end, int depth, Yaml **value) {
    yaml_event_t event;
    if (!next_event(pass, &event)) {
        return false;
    }
    bool ok = true;
    *value = NULL;
    if (event.type != end) {
        ok = read_value(pass, &event, depth, value);
    }
    yaml_event_delete(&event);
    return ok;
}

static bool check_key(Pass *pass, const Yaml *map, const Yaml *key) {
    if (key->kind != YAML_TEXT) {
        return report_error(pass->report, key->place, EXIT_BAD_INPUT,
                            "a key must be a word, found %s", yaml_describe(key, pass->report));
    }
    if (strcmp(key->text, "<<") == 0 && !key->quoted) {
        return report_error(pass->report, key->place, EXIT_BAD_INPUT,
                            "merge keys (<<) are not supported; use 'include'");
    }
    const Yaml *twin = key->broken ? NULL : yaml_find(map, key->text);
    if (twin) {
        return report_error(pass->report, key->place, EXIT_BAD_INPUT,
                            "'%s' is here twice; the first one is in line %d",
                            report_quote(pass->report, key->text), twin->key->place.line);
    }
    return !key->broken;
}

static bool read_map(Pass *pass, int depth, Yaml *map) {
    Yaml **end = &map->first;
    for (;;) {
        Yaml *key, *value;
        if (!read_next(pass, YAML_MAPPING_END_EVENT, depth, &key)) {
            return false;
        }
        if (!key) {
            return true;
        }
        if (map->count == YAML_MOST_KEYS) {
            return report_error(pass->report, key->place, EXIT_BAD_INPUT,
                                "a mapping with more than %d keys", YAML_MOST_KEYS);
        }
        if (!read_next(pass, YAML_NO_EVENT, depth, &value)) {
            return false;
        }
        ASSERT(value);
        if (check_key(pass, map, key)) {
            value->key = key;
            *end = value;
            end = &value->next;
            map->count++;
        }
    }
}

static bool read_list(Pass *pass, int depth, Yaml *list) {
    Yaml **end = &list->first;
    for (;;) {
        Yaml *item;
        if (!read_next(pass, YAML_SEQUENCE_END_EVENT, depth, &item)) {
            return false;
        }
        if (!item) {
            return true;
        }
        *end = item;
        end = &item->next;
        list->count++;
    }
}

static bool read_value(Pass *pass, const yaml_event_t *event, int depth, Yaml **value) {
    if (depth > YAML_DEEPEST) {
        return complain(pass, event->start_mark, "nested deeper than 32 levels");
    }
    if (pass->value_count >= YAML_LARGEST) {
        return complain(pass, event->start_mark, "more than 400000 values in one file");
    }
    switch (event->type) {
    case YAML_SCALAR_EVENT:
        *value = read_text(pass, event);
        return true;
    case YAML_ALIAS_EVENT:
        *value = value_create(pass, YAML_TEXT, event->start_mark);
        (*value)->broken = true;
        complain(pass, event->start_mark, "aliases (*name) are not supported; use 'include'");
        return true;
    case YAML_SEQUENCE_START_EVENT:
        *value = value_create(pass, YAML_LIST, event->start_mark);
        refuse_properties(pass, *value, event->start_mark, event->data.sequence_start.anchor,
                          event->data.sequence_start.tag);
        return read_list(pass, depth + 1, *value);
    case YAML_MAPPING_START_EVENT:
        *value = value_create(pass, YAML_MAP, event->start_mark);
        refuse_properties(pass, *value, event->start_mark, event->data.mapping_start.anchor,
                          event->data.mapping_start.tag);
        return read_map(pass, depth + 1, *value);
    default:
        return complain(pass, event->start_mark, "this is not a value");
    }
}

/* stream start, document start, the value, document end, stream end */
static bool read_stream(Pass *pass, Yaml **root) {
    for (;;) {
        yaml_event_t event;
        if (!next_event(pass, &event)) {
            return false;
        }
        bool ok = true, done = event.type == YAML_STREAM_END_EVENT;
        if (event.type == YAML_DOCUMENT_START_EVENT && *root) {
            ok = complain(pass, event.start_mark, "a second document; a file holds one");
        } else if (event.type != YAML_STREAM_START_EVENT && !done &&
                   event.type != YAML_DOCUMENT_START_EVENT &&
                   event.type != YAML_DOCUMENT_END_EVENT) {
            ok = read_value(pass, &event, 0, root);
        }
        yaml_event_delete(&event);
        if (!ok || done) {
            return ok;
        }
    }
}

/* bytes of the UTF-8 character at p, 0 when it is none (or a control character) */
static size_t character_bytes(const unsigned char *p, size_t left) {
    if (p[0] < 0x80) {
        return p[0] >= 32 ? p[0] != 127 : p[0] == '\t' || p[0] == '\n' || p[0] == '\r';
    }
    size_t bytes = p[0] < 0xC2 ? 0 : p[0] < 0xE0 ? 2 : p[0] < 0xF0 ? 3 : p[0] < 0xF5 ? 4 : 0;
    if (bytes > left) {
        return 0;
    }
    for (size_t i = 1; i < bytes; i++) {
        if ((p[i] & 0xC0) != 0x80) {
            return 0;
        }
    }
    bool overlong = (p[0] == 0xE0 && p[1] < 0xA0) || (p[0] == 0xF0 && p[1] < 0x90);
    bool outside = (p[0] == 0xED && p[1] > 0x9F) || (p[0] == 0xF4 && p[1] > 0x8F);
    return overlong || outside ? 0 : bytes;
}

static bool check_text(const Source *source, Report *report) {
    const unsigned char *text = (const unsigned char *)source->text;
    Place place = {source, 1, 1};
    for (size_t i = 0; i < source->bytes;) {
        size_t bytes = character_bytes(text + i, source->bytes - i);
        if (bytes == 0) {
            return report_error(report, place, EXIT_BAD_INPUT,
                                "byte 0x%02X is not UTF-8 text; is this a binary file?", text[i]);
        }
        place.column = text[i] == '\n' ? 1 : place.column + 1;
        place.line += text[i] == '\n';
        i += bytes;
    }
    return true;
}

Yaml *yaml_tree(const Source *source, Report *report, Arena *arena) {
    Pass pass = {.source = source, .report = report, .arena = arena};
    if (!check_text(source, report)) {
        return NULL;
    }
    ASSERT(yaml_parser_initialize(&pass.parser));
    yaml_parser_set_encoding(&pass.parser, YAML_UTF8_ENCODING);
    yaml_parser_set_input_string(&pass.parser, (const unsigned char *)source->text, source->bytes);
    Yaml *root = NULL;
    bool ok = read_stream(&pass, &root);
    yaml_parser_delete(&pass.parser);
    if (ok && !root) {
        report_error(report, (Place){source, 0, 0}, EXIT_BAD_INPUT, "the file is empty");
    }
    return ok ? root : NULL;
}
