#include "sim/scene/source.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static const char *const replaced_keys[] = {"shape", "camera", "fabric",    "turn",
                                            "move",  "motion", "isotropic", NULL};

static const Source *source_create(Sources *sources, const char *path, char *text, size_t bytes,
                                   const Source *parent) {
    size_t mark = bytes >= 3 && memcmp(text, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0;
    Source *source = arena_push(sources->arena, Source, 1);
    source->path = arena_strdup(sources->arena, path);
    source->text = text + mark;
    source->bytes = bytes - mark;
    source->order = sources->count++;
    source->parent = parent;
    return source;
}

static bool too_large(Sources *sources, const char *path, Place named) {
    return report_error(sources->report, named, EXIT_BAD_INPUT,
                        "'%s' is larger than 16 MiB; is it a scene?",
                        report_quote(sources->report, path));
}

const Source *source_from_text(Sources *sources, const char *path, const char *text, size_t bytes) {
    if (bytes > SOURCE_LARGEST) {
        too_large(sources, path, (Place){0});
        return NULL;
    }
    char *copy = arena_push(sources->arena, char, bytes + 1);
    memcpy(copy, text, bytes);
    return source_create(sources, path, copy, bytes, NULL);
}

/* reads until the end of the stream or just over the limit */
static char *read_all(Sources *sources, FILE *in, size_t *bytes) {
    size_t capacity = 1 << 16;
    char *buffer = malloc(capacity);
    *bytes = 0;
    while (buffer) {
        size_t got = fread(buffer + *bytes, 1, capacity - *bytes, in);
        *bytes += got;
        if (got == 0 || *bytes > SOURCE_LARGEST) {
            break;
        }
        if (*bytes == capacity) {
            char *larger = realloc(buffer, capacity *= 2);
            if (!larger) {
                free(buffer);
            }
            buffer = larger;
        }
    }
    ASSERT(buffer);
    char *text = NULL;
    if (*bytes <= SOURCE_LARGEST) {
        text = arena_push(sources->arena, char, *bytes + 1);
        memcpy(text, buffer, *bytes);
    }
    free(buffer);
    return text;
}

/* "a.yaml -> b.yaml -> a.yaml" */
static const char *describe_chain(Sources *sources, const Source *source, const char *path) {
    char chain[256];
    snprintf(chain, sizeof chain, "%s", report_quote(sources->report, path));
    for (; source; source = source->parent) {
        char longer[256];
        snprintf(longer, sizeof longer, "%.120s -> %.120s", source->path, chain);
        memcpy(chain, longer, sizeof chain);
    }
    return arena_strdup(sources->arena, chain);
}

static bool check_chain(Sources *sources, const char *path, Place named) {
    int depth = 1;
    for (const Source *s = named.source; s; s = s->parent, depth++) {
        if (strcmp(s->path, path) == 0) {
            return report_error(sources->report, named, EXIT_BAD_INPUT, "a file needs itself: %s",
                                describe_chain(sources, named.source, path));
        }
    }
    return depth <= SOURCE_DEEPEST + 1 ||
           report_error(sources->report, named, EXIT_BAD_INPUT,
                        "files within files nested deeper than %d", SOURCE_DEEPEST);
}

/* May it be opened? A named pipe or a device only as the first file: it would block or never end. */
static bool check_file(Sources *sources, const char *path, Place named) {
    struct stat status;
    const char *quote = report_quote(sources->report, path);
    if (stat(path, &status) != 0) {
        bool missing = errno == ENOENT || errno == ENOTDIR;
        return report_error(sources->report, named, missing ? EXIT_MISSING_INPUT : EXIT_IO,
                            missing ? "there is no file '%s'" : "cannot open '%s'", quote);
    }
    if (S_ISDIR(status.st_mode)) {
        return report_error(sources->report, named, EXIT_IO, "'%s' is a directory", quote);
    }
    if (S_ISREG(status.st_mode) && status.st_size > SOURCE_LARGEST) {
        return too_large(sources, path, named);
    }
    if (!S_ISREG(status.st_mode) && named.source) {
        return report_error(sources->report, named, EXIT_IO, "'%s' is not a plain file", quote);
    }
    if (sources->count >= SOURCE_MOST) {
        return report_error(sources->report, named, EXIT_BAD_INPUT, "a scene of more than %d files",
                            SOURCE_MOST);
    }
    return true;
}

const Source *source_read(Sources *sources, const char *path, Place named) {
    if (!check_chain(sources, path, named) || !check_file(sources, path, named)) {
        return NULL;
    }
    const char *quote = report_quote(sources->report, path);
    FILE *in = fopen(path, "rb");
    if (!in) {
        report_error(sources->report, named, EXIT_IO, "cannot open '%s': %s", quote,
                     strerror(errno));
        return NULL;
    }
    size_t bytes;
    char *text = read_all(sources, in, &bytes);
    bool failed = ferror(in);
    fclose(in);
    if (failed) {
        report_error(sources->report, named, EXIT_IO, "cannot read '%s'", quote);
    } else if (!text) {
        too_large(sources, path, named);
    }
    return failed || !text ? NULL : source_create(sources, path, text, bytes, named.source);
}

const char *source_resolve(Sources *sources, const Source *from, const char *path) {
    const char *slash = from ? strrchr(from->path, '/') : NULL;
    path += 2 * (strncmp(path, "./", 2) == 0);
    if (path[0] == '/' || !slash) {
        return path;
    }
    size_t folder = (size_t)(slash - from->path) + 1;
    size_t bytes = folder + strlen(path) + 1;
    char *joined = arena_push(sources->arena, char, bytes);
    snprintf(joined, bytes, "%.*s%s", (int)folder, from->path, path);
    return joined;
}

const char *source_asset(Arena *arena, const char *name) {
    const char *folder = getenv("TOILE_ASSETS");
    folder = folder && folder[0] ? folder : TOILE_SOURCE_DIR "/assets";
    size_t bytes = strlen(folder) + strlen(name) + 2;
    char *path = arena_push(arena, char, bytes);
    snprintf(path, bytes, "%s/%s", folder, name);
    return path;
}

static bool is_replaced(const char *key) {
    int i = 0;
    while (replaced_keys[i] && strcmp(replaced_keys[i], key) != 0) {
        i++;
    }
    return replaced_keys[i] != NULL;
}

/* adds what `map` does not say itself */
static void merge(Yaml *map, Yaml *included) {
    for (Yaml *value = included->first; value;) {
        Yaml *next = value->next, *own = yaml_find(map, value->key->text);
        if (!own) {
            yaml_append(map, value->key, value);
        } else if (own->kind == YAML_MAP && value->kind == YAML_MAP &&
                   !is_replaced(value->key->text)) {
            merge(own, value);
        }
        value = next;
    }
}

static void unlink_value(Yaml *map, const Yaml *value) {
    Yaml **link = &map->first;
    while (*link != value) {
        ASSERT(*link);
        link = &(*link)->next;
    }
    *link = value->next;
    map->count--;
}

static bool expand_includes(Sources *sources, Yaml *value);

static bool include_into(Sources *sources, Yaml *map, Yaml *include) {
    unlink_value(map, include);
    if (include->kind != YAML_TEXT || !include->text[0]) {
        return report_error(sources->report, include->place, EXIT_BAD_INPUT,
                            "'include' wants the name of a file, found %s",
                            yaml_describe(include, sources->report));
    }
    const char *path = source_resolve(sources, include->place.source, include->text);
    const Source *source = source_read(sources, path, include->place);
    Yaml *tree = source ? source_tree(sources, source) : NULL;
    if (!tree) {
        return false;
    }
    if (tree->kind != YAML_MAP) {
        return report_error(sources->report, tree->place, EXIT_BAD_INPUT,
                            "an included file must be a mapping of keys, found %s",
                            yaml_describe(tree, sources->report));
    }
    merge(map, tree);
    return true;
}

static bool expand_includes(Sources *sources, Yaml *value) {
    bool ok = true;
    for (Yaml *child = value->first; child; child = child->next) {
        ok = expand_includes(sources, child) && ok;
    }
    Yaml *include = yaml_find(value, "include");
    return (!include || include_into(sources, value, include)) && ok;
}

Yaml *source_tree(Sources *sources, const Source *source) {
    Yaml *tree = yaml_tree(source, sources->report, sources->arena);
    return tree && expand_includes(sources, tree) ? tree : NULL;
}
