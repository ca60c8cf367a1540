#include <dirent.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "sim/base/text.h"
#include "sim/scene/fabric_schema.h"

#define FABRIC_VERSION 1

const FabricRow fabric_rows[] = {{"weight", offsetof(Fabric, weight), "kg/m2"},
                                 {"thickness", offsetof(Fabric, thickness), "m"},
                                 {"bending.warp", offsetof(Fabric, bend_warp), "N m"},
                                 {"bending.weft", offsetof(Fabric, bend_weft), "N m"},
                                 {"bending.bias", offsetof(Fabric, bend_bias), "N m"},
                                 {"bending.poisson", offsetof(Fabric, bend_poisson), ""},
                                 {"bending.hysteresis", offsetof(Fabric, bend_hysteresis), "N"},
                                 {"bending.onset", offsetof(Fabric, bend_onset), "1/m"},
                                 {"stretch.warp", offsetof(Fabric, stretch_warp), "N/m"},
                                 {"stretch.weft", offsetof(Fabric, stretch_weft), "N/m"},
                                 {"stretch.poisson", offsetof(Fabric, stretch_poisson), ""},
                                 {"stretch.limit", offsetof(Fabric, stretch_limit), ""},
                                 {"shear.stiffness", offsetof(Fabric, shear), "N/m"},
                                 {"shear.hysteresis", offsetof(Fabric, shear_hysteresis), "N/m"},
                                 {"shear.hysteresis_5", offsetof(Fabric, shear_hysteresis5), "N/m"},
                                 {"friction", offsetof(Fabric, friction), ""},
                                 {0}};

static int compare_names(const void *a, const void *b) {
    return strcmp(*(const char *const *)a, *(const char *const *)b);
}

const char *const *fabric_names(Arena *arena) {
    size_t count = 0, capacity = 256; /* more fabrics are not listed */
    const char **names = arena_push(arena, const char *, capacity + 1);
    DIR *folder = opendir(source_asset(arena, "fabrics"));
    for (struct dirent *entry; folder && count < capacity && (entry = readdir(folder));) {
        size_t bytes = strlen(entry->d_name);
        if (bytes > 5 && strcmp(entry->d_name + bytes - 5, ".yaml") == 0) {
            char *name = arena_strdup(arena, entry->d_name);
            name[bytes - 5] = '\0';
            names[count++] = name;
        }
    }
    if (folder) {
        closedir(folder);
    }
    qsort(names, count, sizeof *names, compare_names);
    return names;
}

/* a length to the rigidity that it stands for */
static void length_to_rigidity(const Fabric *fabric, const FabricNumber *length,
                               FabricNumber *rigidity) {
    if (isnan(length->value)) {
        return;
    }
    double unit = fabric->weight.value * 9.80665;
    *rigidity = *length;
    rigidity->value = unit * pow(length->value, 3.0);
    rigidity->low = unit * pow(length->low, 3.0);
    rigidity->high = unit * pow(length->high, 3.0);
}

static void use_isotropic(FabricKeys *keys) {
    Fabric *fabric = &keys->fabric;
    double poisson = keys->iso_poisson.value;
    fabric->isotropic = true;
    fabric->stretch_warp = fabric->stretch_weft = keys->iso_stretch;
    fabric->stretch_poisson = fabric->bend_poisson = keys->iso_poisson;
    fabric->bend_warp = fabric->bend_weft = keys->iso_bending;
    FabricNumber derived = {
        .low = NAN, .high = NAN, .flag = FABRIC_DERIVED, .from = "it is isotropic"};
    fabric->shear = fabric->bend_bias = derived;
    fabric->shear.value = keys->iso_stretch.value / (2.0 * (1.0 + poisson));
    fabric_set_twist(fabric, 0.5 * (1.0 - poisson) * keys->iso_bending.value);
}

static const char *const bending_keys[] = {"bending", "bending_length", "isotropic", NULL};

/* at most one way to state the bending */
static bool check_ways(Reader *reader, const Yaml *map) {
    const Yaml *first = NULL;
    for (int i = 0; bending_keys[i]; i++) {
        const Yaml *value = yaml_find(map, bending_keys[i]);
        if (value && first) {
            return schema_error(reader, value->key, "'%s' and '%s' say the same; give one of them",
                                first->key->text, value->key->text);
        }
        first = value ? value : first;
    }
    const Yaml *isotropic = yaml_find(map, "isotropic"), *stretch = yaml_find(map, "stretch");
    stretch = stretch ? stretch : yaml_find(map, "shear");
    return !isotropic || !stretch ||
           schema_error(reader, stretch->key, "'isotropic' and '%s' say the same; give one of them",
                        stretch->key->text);
}

/* the numbers that matter and were left out */
static void warn_left_out(Reader *reader, const Fabric *fabric, Place place) {
    static const size_t offsets[] = {offsetof(Fabric, thickness), offsetof(Fabric, bend_warp),
                                     offsetof(Fabric, stretch_warp), offsetof(Fabric, shear),
                                     offsetof(Fabric, friction)};
    static const char *const names[] = {"thickness", "bending", "stretch", "shear", "friction"};
    char list[80] = "";
    for (int i = 0; i < 5; i++) {
        const FabricNumber *number = (const void *)((const char *)fabric + offsets[i]);
        if (number->flag == FABRIC_FALLBACK) {
            strcat(list, list[0] ? ", " : "");
            strcat(list, names[i]);
        }
    }
    if (list[0] && !fabric->isotropic) {
        report_warning(reader->report, place,
                       "the fabric does not say %s: medians of real fabrics stand in", list);
    }
}

/* from the keys that were given to a whole fabric */
static bool finish(Reader *reader, const Yaml *map, FabricKeys *keys) {
    Fabric *fabric = &keys->fabric;
    if (isnan(fabric->weight.value)) {
        return schema_error(reader, map->key ? map->key : map,
                            "a fabric needs its 'weight', such as 160 g/m2");
    }
    bool had_bending = !isnan(fabric->bend_warp.value) || !isnan(fabric->bend_weft.value);
    length_to_rigidity(fabric, &keys->length_warp, &fabric->bend_warp);
    length_to_rigidity(fabric, &keys->length_weft, &fabric->bend_weft);
    bool from_weight = isnan(fabric->bend_warp.value) && isnan(fabric->bend_weft.value);
    if (yaml_find(map, "isotropic")) {
        use_isotropic(keys);
        from_weight = false;
    }
    if (from_weight && !had_bending) {
        report_warning(reader->report, map->place,
                       "fabric estimated from its weight: real fabrics of %.0f g/m2 bend 0.3 to 3 "
                       "times as stiff; measure a bending length (ruler, 41.5 deg: ASTM D1388)",
                       fabric->weight.value * 1e3);
    }
    fabric_fill(fabric);
    warn_left_out(reader, fabric, map->place);
    if (!isnan(keys->bend_twist.value)) {
        fabric->bend_bias = keys->bend_twist;
        fabric_set_twist(fabric, keys->bend_twist.value);
    }
    return fabric_check(reader, fabric, map->place);
}

static void forget_fallbacks(Fabric *fabric) {
    for (const FabricRow *row = fabric_rows; row->name; row++) {
        FabricNumber *number = (FabricNumber *)((char *)fabric + row->offset);
        if (number->flag == FABRIC_FALLBACK) {
            number->value = NAN;
        }
    }
}

static bool read_map(Reader *reader, Sources *sources, const Yaml *map, Fabric *fabric);

/* the fabric that another one is like */
static bool read_like(Reader *reader, Sources *sources, const Yaml *like, Fabric *fabric) {
    if (like->kind != YAML_TEXT || !like->text[0]) {
        return schema_error(reader, like, "'like' wants the name of a fabric, found %s",
                            yaml_describe(like, reader->report));
    }
    if (!fabric_read_named(reader, sources, like->text, like->place, fabric)) {
        return false;
    }
    forget_fallbacks(fabric);
    return true;
}

static bool read_map(Reader *reader, Sources *sources, const Yaml *map, Fabric *fabric) {
    FabricKeys keys = fabric_keys_default();
    const Yaml *like = yaml_find(map, "like");
    if (like && !read_like(reader, sources, like, &keys.fabric)) {
        return false;
    }
    if (!schema_read(reader, &fabric_schema, map, &keys) || !check_ways(reader, map)) {
        return false;
    }
    if (yaml_find(map, "bending") || yaml_find(map, "bending_length") ||
        yaml_find(map, "stretch") || yaml_find(map, "shear")) {
        keys.fabric.isotropic = false; /* whatever the fabric was that it is like */
    }
    if (keys.drape && !fabric_read_drapes(reader, keys.drape, &keys.fabric)) {
        return false;
    }
    if (!finish(reader, map, &keys)) {
        return false;
    }
    *fabric = keys.fabric;
    return true;
}

/* "assets/fabrics/denim.yaml" -> "denim" */
static const char *stem(Arena *arena, const char *path) {
    const char *slash = strrchr(path, '/');
    char *name = arena_strdup(arena, slash ? slash + 1 : path);
    char *dot = strrchr(name, '.');
    if (dot && dot != name) {
        *dot = '\0';
    }
    return name;
}

static bool read_file(Reader *reader, Sources *sources, const char *path, Place named,
                      Fabric *fabric) {
    const Source *source = source_read(sources, path, named);
    const Yaml *tree = source ? source_tree(sources, source) : NULL;
    if (!tree) {
        return false;
    }
    const Yaml *version = yaml_find(tree, "toile-fabric");
    if (!version) {
        return schema_error(reader, tree, "a fabric file starts with 'toile-fabric: 1'");
    }
    if (!yaml_is(version, "1")) {
        return schema_error(reader, version, "written for toile-fabric %s, this is toile-fabric %d",
                            yaml_describe(version, reader->report), FABRIC_VERSION);
    }
    if (!read_map(reader, sources, tree, fabric)) {
        return false;
    }
    fabric->name = fabric->name ? fabric->name : stem(reader->arena, path);
    return true;
}

bool fabric_read_named(Reader *reader, Sources *sources, const char *name, Place named,
                       Fabric *fabric) {
    size_t bytes = strlen(name);
    if (strchr(name, '/') || (bytes > 5 && strcmp(name + bytes - 5, ".yaml") == 0)) {
        return read_file(reader, sources, source_resolve(sources, named.source, name), named,
                         fabric);
    }
    const char *const *names = fabric_names(reader->arena);
    for (int i = 0; names[i]; i++) {
        if (strcmp(names[i], name) == 0) {
            char *file = arena_push(reader->arena, char, bytes + sizeof "fabrics/.yaml");
            sprintf(file, "fabrics/%s.yaml", name);
            return read_file(reader, sources, source_asset(reader->arena, file), named, fabric);
        }
    }
    return report_error(reader->report, named, EXIT_MISSING_INPUT, "no fabric is called '%s'%s",
                        report_quote(reader->report, name), schema_suggest(reader, name, names));
}

bool fabric_read_value(Reader *reader, Sources *sources, const Yaml *value, Fabric *fabric) {
    if (value->kind == YAML_MAP && !value->broken) {
        if (!read_map(reader, sources, value, fabric)) {
            return false;
        }
        fabric->name = fabric->name ? fabric->name : "inline";
        return true;
    }
    if (value->kind == YAML_LIST || value->broken || !value->text[0]) {
        return schema_error(reader, value,
                            "'fabric' wants a name, a path or a mapping of keys, found %s",
                            yaml_describe(value, reader->report));
    }
    return fabric_read_named(reader, sources, value->text, value->place, fabric);
}

bool fabric_read(const char *name_or_path, Arena *arena, Fabric *fabric, Error *error) {
    Report report = {.arena = arena};
    Sources sources = {.arena = arena, .report = &report};
    Reader reader = {.arena = arena, .report = &report, .root = &fabric_schema};
    fabric_read_named(&reader, &sources, name_or_path, (Place){0}, fabric);
    if (!report_finish(&report, error)) {
        return false;
    }
    fabric->warning_count = report.warning_count;
    fabric->warnings = report_warnings(&report);
    return true;
}
