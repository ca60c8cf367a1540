#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/vec.h"
#include "sim/scene/schema.h"
#include "sim/scene/units.h"

#define KEY_COLUMN 24    /* [character] where the type starts in the reference */
#define TYPE_COLUMN 20   /* width of the type */
#define VALUE_COLUMN 14  /* width of the default */
#define PAGE_WIDTH 130   /* where help texts are wrapped */
#define LONGEST_WORDS 40 /* a longer list of words stands before the help text */

void schema_print_number(FILE *out, double value) {
    char text[32];
    for (int digits = 15; digits <= 17; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, value);
        if (strtod(text, NULL) == value) {
            break;
        }
    }
    fputs(text, out);
}

/* the unit for people: the first alternative, angles in rad */
static void print_unit(FILE *out, const char *unit) {
    for (const char *p = unit; *p && *p != '|';) {
        bool angle = strncmp(p, "angle", 5) == 0;
        fprintf(out, "%.*s", angle ? 3 : 1, angle ? "rad" : p);
        p += angle ? 5 : 1;
    }
}

void schema_print_quantity(FILE *out, double value, const char *unit) {
    schema_print_number(out, value);
    if (unit && unit[0]) {
        fputc(' ', out);
        print_unit(out, unit);
    }
}

void schema_print_text(FILE *out, const char *text) {
    static const char plain[] =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_./-";
    bool letter = (text[0] >= 'a' && text[0] <= 'z') || (text[0] >= 'A' && text[0] <= 'Z');
    if (letter && strspn(text, plain) == strlen(text)) {
        fputs(text, out);
        return;
    }
    fputc('"', out);
    for (const char *p = text; *p; p++) {
        if (*p == '\n' || *p == '\t') {
            fputs(*p == '\n' ? "\\n" : "\\t", out);
        } else {
            fprintf(out, *p == '"' || *p == '\\' ? "\\%c" : "%c", *p);
        }
    }
    fputc('"', out);
}

void schema_print_key(FILE *out, int indent, const char *key) {
    fprintf(out, "%*s", indent, "");
    schema_print_text(out, key);
    fputs(": ", out);
}

static void print_list(FILE *out, const double *numbers, int count, const char *unit) {
    for (int i = 0; i < count; i++) {
        fputs(i ? ", " : "[", out);
        schema_print_quantity(out, numbers[i], unit);
    }
    fputc(']', out);
}

/* Is there something to print? Not a number and NULL stand for "not given". */
static bool is_given(const Field *field, const void *member) {
    switch (field->type) {
    case FIELD_NUMBER:
        return !isnan(*(const double *)member);
    case FIELD_VECTOR:
    case FIELD_POINT:
        return !isnan(((const double *)member)[0]);
    case FIELD_NAME:
    case FIELD_TEXT:
        return *(const char *const *)member != NULL;
    case FIELD_RAW:
        return false;
    default:
        return true;
    }
}

static void print_value(FILE *out, const Field *field, const void *member) {
    const double *numbers = member;
    const int *counts = member;
    switch (field->type) {
    case FIELD_NUMBER:
        if (field->word && *numbers == field->word_value) {
            fputs(field->word, out);
        } else {
            schema_print_quantity(out, *numbers, field->unit);
        }
        break;
    case FIELD_COUNT:
        fprintf(out, "%d", *counts);
        break;
    case FIELD_BOOL: {
        bool flag = *(const bool *)member;
        fputs(field->words ? field->words[flag] : flag ? "true" : "false", out);
        break;
    }
    case FIELD_WORD:
        fputs(field->words[*counts], out);
        break;
    case FIELD_NAME:
    case FIELD_TEXT:
        schema_print_text(out, *(const char *const *)member);
        break;
    case FIELD_VECTOR:
        print_list(out, numbers, 3, field->unit);
        break;
    case FIELD_POINT:
        print_list(out, numbers, 2, field->unit);
        break;
    case FIELD_GRID:
        fprintf(out, "%d x %d", counts[0], counts[1]);
        break;
    default:
        break;
    }
}

void schema_print(FILE *out, int indent, const Schema *schema, const void *object) {
    for (const Field *field = schema->fields; field->key; field++) {
        const void *member = (const char *)object + field->offset;
        if (field->print) {
            field->print(out, indent, field, member);
        } else if (field->type == FIELD_GROUP) {
            fprintf(out, "%*s%s:\n", indent, "", field->key);
            schema_print(out, indent + 2, field->group, member);
        } else if (field->type != FIELD_CUSTOM && is_given(field, member)) {
            schema_print_key(out, indent, field->key);
            print_value(out, field, member);
            fputc('\n', out);
        }
    }
}

static bool is_list(const Field *field) {
    return field->type == FIELD_VECTOR || field->type == FIELD_POINT;
}

/* "a, b, c"; the empty word stands for "not given" */
static void print_words(FILE *out, const char *const *words) {
    for (int i = 0; words[i] && words[i][0]; i++) {
        fprintf(out, "%s%s", i ? ", " : "", words[i]);
    }
}

/* does the list of words fit in the column of types? */
static bool words_fit(const Field *field) {
    size_t width = 0;
    for (int i = 0; field->words && field->words[i] && field->words[i][0]; i++) {
        width += strlen(field->words[i]) + (i ? 2 : 0);
    }
    return width < LONGEST_WORDS;
}

static void print_type(FILE *out, const Field *field) {
    static const char *const types[] = {
        "number",    "whole number", "true, false", "", "name", "text",
        "[x, y, z]", "[u, v]",       "n x n",       "", "",     ""};
    char text[64] = "";
    FILE *buffer = fmemopen(text, sizeof text, "w");
    ASSERT(buffer);
    if (field->words) {
        if (words_fit(field)) {
            print_words(buffer, field->words);
        } else {
            fputs("one of these:", buffer);
        }
    } else {
        bool unit = field->unit && field->unit[0];
        bool plain = field->unit && !unit && !is_list(field);
        fputs(plain ? "number" : unit && !is_list(field) ? "" : types[field->type], buffer);
        fputs(unit && is_list(field) ? " " : "", buffer);
        print_unit(buffer, unit ? field->unit : "");
    }
    fclose(buffer);
    fprintf(out, "%-*s ", TYPE_COLUMN - 1, text);
}

static void print_default(FILE *out, const Field *field, const void *object) {
    char text[96] = "";
    FILE *buffer = fmemopen(text, sizeof text, "w");
    ASSERT(buffer);
    const char *member = object ? (const char *)object + field->offset : NULL;
    if (field->required) {
        fputs("required", buffer);
    } else if (member && is_list(field) && is_given(field, member)) {
        print_list(buffer, (const double *)(const void *)member,
                   field->type == FIELD_VECTOR ? 3 : 2, NULL);
    } else if (member && field->type < FIELD_GROUP && is_given(field, member)) {
        print_value(buffer, field, member);
    }
    fclose(buffer);
    fprintf(out, "%-*s ", VALUE_COLUMN - 1, text);
}

/* words of `text`, wrapped; continued under `column` */
static void print_wrapped(FILE *out, int column, const char *text) {
    int x = column;
    while (*text) {
        int word = (int)strcspn(text, " ");
        if (x > column && x + word + 1 > PAGE_WIDTH) {
            fprintf(out, "\n%*s", column, "");
            x = column;
        }
        x += fprintf(out, "%s%.*s", x > column ? " " : "", word, text);
        text += word;
        text += strspn(text, " ");
    }
    fputc('\n', out);
}

static void print_row(FILE *out, int indent, const Field *field, const void *object) {
    fprintf(out, "%*s%-*s ", indent, "", KEY_COLUMN - indent - 1, field->key);
    print_type(out, field);
    print_default(out, field, object);
    char text[256] = "";
    FILE *buffer = fmemopen(text, sizeof text, "w");
    ASSERT(buffer);
    if (field->words && !words_fit(field)) {
        print_words(buffer, field->words);
        fputs("; ", buffer);
    }
    fputs(field->help, buffer);
    fclose(buffer);
    print_wrapped(out, KEY_COLUMN + TYPE_COLUMN + VALUE_COLUMN, text);
}

void schema_print_reference(FILE *out, int indent, const Schema *schema) {
    Arena arena = {0};
    void *object = NULL;
    if (schema->set_default) {
        object = arena_alloc(&arena, schema->size);
        schema->set_default(object);
    }
    for (const Field *field = schema->fields; field->key; field++) {
        print_row(out, indent, field, object);
        if (field->group) {
            schema_print_reference(out, indent + 2, field->group);
        }
    }
    arena_free(&arena);
}
