/* schema.h: tables that say what may stand in a mapping, and what reads and prints by them.
 *
 * Each parameter struct has one Schema: a table with a row per key (type, unit, limits, help).
 * The reader, the reference (`toile help scene`), the effective scene and did-you-mean all loop
 * over it; the defaults are those of the struct's default function. A row of type FIELD_CUSTOM
 * brings its own reading function for what does not fit in a row.
 */
#ifndef TOILE_SCENE_SCHEMA_H
#define TOILE_SCENE_SCHEMA_H

#include <stddef.h>
#include <stdio.h>

#include "sim/scene/yaml.h"

typedef struct Reader Reader;
typedef struct Schema Schema;
typedef struct Field Field;

typedef enum FieldType {
    FIELD_NUMBER, /* double, a quantity with a unit */
    FIELD_COUNT,  /* int, a whole number without unit */
    FIELD_BOOL,   /* bool: true, false; or words[0] = false, words[1] = true */
    FIELD_WORD,   /* int: index into `words` */
    FIELD_NAME,   /* const char *: one of Reader.names[(int)min]; any word when that is NULL */
    FIELD_TEXT,   /* const char * */
    FIELD_VECTOR, /* Vec3: [x, y, z], each a quantity */
    FIELD_POINT,  /* double[2]: [u, v], each a quantity */
    FIELD_GRID,   /* int[2]: 60 x 40 */
    FIELD_GROUP,  /* a struct of its own: `group` */
    FIELD_RAW,    /* const Yaml *: kept for the caller */
    FIELD_CUSTOM  /* `read` and `print` */
} FieldType;

typedef bool FieldRead(Reader *reader, const Field *field, const Yaml *value, void *member);
/* Prints whole lines, the key included; nothing when it was never given. */
typedef void FieldPrint(FILE *out, int indent, const Field *field, const void *member);

struct Field {
    const char *key; /* NULL ends a table */
    FieldType type;
    size_t offset;            /* of the member in the struct */
    const char *unit;         /* SI unit as in units.h; NULL for none */
    double min, max;          /* allowed values, SI, ends included; FIELD_NAME: which names */
    const char *word;         /* FIELD_NUMBER: a word that may stand for a number, "auto" */
    double word_value;        /* and its value */
    const char *const *words; /* NULL-terminated */
    const Schema *group;      /* what is inside, also of raw and custom fields (for help) */
    FieldRead *read;
    FieldPrint *print;
    bool required;
    const char *help;
};

struct Schema {
    const char *name; /* for messages: "film" */
    const char *help;
    const Field *fields;
    size_t size;                 /* of the struct */
    void (*set_default)(void *); /* fills the struct; NULL: zeros mean "not given" */
    int shorthand;               /* a plain text fills the first so many fields; 0 = none */
};

#define SCHEMA_NAME_LISTS 3 /* models, steppers, looks */

struct Reader {
    Arena *arena;
    Report *report;
    double frame_seconds;                        /* [s] what the unit `frame` means */
    const char *const *names[SCHEMA_NAME_LISTS]; /* NULL: any word */
    const Schema *root;                          /* of the language, for did-you-mean */
    void *context;                               /* of custom fields */
};

/* Fills `object` (already holding its defaults) from a mapping. False when something was
 * wrong; it is then in the report and `object` keeps what it had. Fields are read in the
 * order of the table, not of the file. */
bool schema_read(Reader *reader, const Schema *schema, const Yaml *map, void *object);

/* One value by one row; `member` points to the member. */
bool schema_read_field(Reader *reader, const Field *field, const Yaml *value, void *member);

/* The same for single values that no table describes; `name` is for messages. */
bool schema_read_number(Reader *reader, const char *name, const char *unit, double min, double max,
                        const Yaml *value, double *number);
bool schema_read_vector(Reader *reader, const char *name, const char *unit, double limit,
                        const Yaml *value, double *numbers, int count);

/* Reports at a value; false, always; silent when the value was complained about before. */
bool schema_error(Reader *reader, const Yaml *value, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* "; did you mean 'x'?", or "; one of a, b, c", or "". */
const char *schema_suggest(Reader *reader, const char *word, const char *const *words);

const Field *schema_find(const Schema *schema, const char *key);

/* Prints every field of `object` as YAML lines that read back to the same bits. */
void schema_print(FILE *out, int indent, const Schema *schema, const void *object);
void schema_print_number(FILE *out, double value); /* shortest text with the same bits */
void schema_print_quantity(FILE *out, double value, const char *unit);
void schema_print_text(FILE *out, const char *text); /* quoted when YAML needs it */
void schema_print_key(FILE *out, int indent, const char *key);

/* Prints every key with unit, default and help, and the groups inside. */
void schema_print_reference(FILE *out, int indent, const Schema *schema);

#endif
