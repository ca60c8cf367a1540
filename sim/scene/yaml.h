/* yaml.h: YAML text as a tree of values that know where they were written.
 *
 * The subset that scenes need, strictly: one document, UTF-8, mappings with text keys, lists,
 * text. Refused, each with a sentence: anchors, aliases, tags, merge keys (use `include`),
 * duplicate keys, nesting deeper than YAML_DEEPEST, more than YAML_LARGEST values. JSON is a
 * subset of YAML and is accepted. Values stay text: the schema gives them a meaning.
 */
#ifndef TOILE_SCENE_YAML_H
#define TOILE_SCENE_YAML_H

#include <stdbool.h>

#include "sim/base/arena.h"
#include "sim/scene/report.h"

#define YAML_DEEPEST 32     /* levels; the readers recurse */
#define YAML_LARGEST 400000 /* values in one file; an outline of 100,000 points fits */
#define YAML_MOST_KEYS 4096 /* of one mapping; they are compared pair by pair */

typedef enum YamlKind { YAML_TEXT, YAML_MAP, YAML_LIST } YamlKind;

typedef struct Yaml Yaml;
struct Yaml {
    YamlKind kind;
    Place place;
    const char *text; /* YAML_TEXT: zero-terminated, without control characters */
    bool quoted;      /* written in quotes or as a block: never a number or true, false */
    bool broken;      /* already complained about: readers say nothing more */
    int count;        /* items of a list, pairs of a map */
    Yaml *first;      /* items; the values of a map, each with its key */
    Yaml *next;       /* sibling */
    const Yaml *key;  /* of a value in a map; else NULL */
};

/* NULL when the text is not YAML at all; other complaints only show in the report. */
Yaml *yaml_tree(const Source *source, Report *report, Arena *arena);

/* The value of a key; NULL when it is not there. */
Yaml *yaml_find(const Yaml *map, const char *key);

bool yaml_is(const Yaml *value, const char *text); /* is it this word? */

/* Appends a value to a map or list; key NULL for a list. */
void yaml_append(Yaml *parent, const Yaml *key, Yaml *value);

/* "a mapping", "a list" or the text in quotes, for "found ..." */
const char *yaml_describe(const Yaml *value, Report *report);

#endif
