/* What is compared with what: two files, or all files of two folders by their names. */
#include <dirent.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "render/diff.h"
#include "render/image_source.h"
#include "render/run.h"

#define MOST_DEPTH 16 /* of folders: deeper ones are a loop of links */
#define MOST_ITEMS 100000

typedef struct Names {
    char **names; /* (count) below the folder */
    int count, room;
} Names;

static bool is_folder(const char *path) {
    struct stat status;
    return stat(path, &status) == 0 && S_ISDIR(status.st_mode);
}

static bool exists(const char *path) {
    struct stat status;
    return stat(path, &status) == 0;
}

static bool add_name(Diff *diff, Names *names, const char *name, Error *error) {
    if (names->count == MOST_ITEMS) {
        return error_set(error, EXIT_BAD_INPUT, "more than %d files", MOST_ITEMS);
    }
    if (names->count == names->room) {
        int room = names->room ? 2 * names->room : 64;
        names->names = arena_grow(&diff->arena, char *, names->names, names->count, room);
        names->room = room;
    }
    names->names[names->count++] = arena_strdup(&diff->arena, name);
    return true;
}

/* All regular files below folder/inside, hidden ones and unfinished parts left out. */
static bool list_folder(Diff *diff, const char *folder, const char *inside, int depth, Names *names,
                        Error *error) {
    char path[FILE_PATH_SIZE];
    snprintf(path, sizeof path, "%s%s%s", folder, *inside ? "/" : "", inside);
    DIR *open = opendir(path);
    if (!open) {
        return error_set_errno(error, errno == ENOENT ? EXIT_MISSING_INPUT : EXIT_IO, "%s", path);
    }
    bool good = true;
    for (struct dirent *entry; good && (entry = readdir(open)) != NULL;) {
        char name[FILE_PATH_SIZE], full[FILE_PATH_SIZE];
        struct stat status;
        const char *ending = file_ending(entry->d_name);
        if (entry->d_name[0] == '.' || strcmp(ending, "part") == 0) {
            continue;
        }
        int length =
            snprintf(name, sizeof name, "%s%s%s", inside, *inside ? "/" : "", entry->d_name);
        int whole = snprintf(full, sizeof full, "%s/%s", folder, name);
        if (length >= (int)sizeof name || whole >= (int)sizeof full || stat(full, &status) != 0) {
            good = error_set_errno(error, EXIT_IO, "%s/%s", path, entry->d_name);
        } else if (S_ISDIR(status.st_mode)) {
            good = depth < MOST_DEPTH
                       ? list_folder(diff, folder, name, depth + 1, names, error)
                       : error_set(error, EXIT_BAD_INPUT, "%s: folders are nested too deep", full);
        } else if (S_ISREG(status.st_mode)) {
            good = add_name(diff, names, name, error);
        }
    }
    closedir(open);
    return good;
}

static int compare_names(const void *a, const void *b) {
    return strcmp(*(char *const *)a, *(char *const *)b);
}

static DiffItemKind kind_of(const char *name) {
    if (strcmp(file_ending(name), "states") == 0) {
        return DIFF_STATES;
    }
    return image_is_picture(name) || image_is_video(name) ? DIFF_PICTURES : DIFF_BYTES;
}

static void set_item(const Diff *diff, DiffItem *item, const char *name, bool in_a, bool in_b) {
    item->kind = kind_of(name);
    item->only_a = !in_b;
    item->only_b = !in_a;
    item->worst = -1;
    snprintf(item->name, sizeof item->name, "%s", name);
    snprintf(item->a, sizeof item->a, "%s/%s", diff->def.a, name);
    snprintf(item->b, sizeof item->b, "%s/%s", diff->def.b, name);
}

/* The union of the names in both folders. */
static bool pair_folders(Diff *diff, Error *error) {
    Names a = {0}, b = {0};
    if (!list_folder(diff, diff->def.a, "", 0, &a, error) ||
        !list_folder(diff, diff->def.b, "", 0, &b, error)) {
        return false;
    }
    if (a.count > 0) {
        qsort(a.names, (size_t)a.count, sizeof *a.names, compare_names);
    }
    if (b.count > 0) {
        qsort(b.names, (size_t)b.count, sizeof *b.names, compare_names);
    }
    diff->items = arena_push(&diff->arena, DiffItem, a.count + b.count);
    for (int i = 0, j = 0; i < a.count || j < b.count;) {
        int order = i == a.count ? 1 : j == b.count ? -1 : strcmp(a.names[i], b.names[j]);
        set_item(diff, &diff->items[diff->item_count++], order <= 0 ? a.names[i] : b.names[j],
                 order <= 0, order >= 0);
        i += order <= 0;
        j += order >= 0;
    }
    return diff->item_count > 0 ||
           error_set(error, EXIT_MISSING_INPUT, "both folders are empty: %s, %s", diff->def.a,
                     diff->def.b);
}

/* The path of the states of a run; false: it is none. */
static bool find_states(const char *path, char states[FILE_PATH_SIZE]) {
    bool folder = is_folder(path);
    snprintf(states, FILE_PATH_SIZE, "%s%s", path, folder ? "/" RUN_FILE : "");
    return folder ? exists(states) : strcmp(file_ending(path), "states") == 0;
}

static bool set_pair(Diff *diff, Error *error) {
    const char *slash = strrchr(diff->def.b, '/');
    DiffItem *item = diff->items = arena_push(&diff->arena, DiffItem, 1);
    diff->item_count = 1;
    item->worst = -1;
    snprintf(item->name, sizeof item->name, "%s", slash && slash[1] ? slash + 1 : diff->def.b);
    snprintf(item->a, sizeof item->a, "%s", diff->def.a);
    snprintf(item->b, sizeof item->b, "%s", diff->def.b);
    char states[2][FILE_PATH_SIZE];
    bool runs[2] = {find_states(diff->def.a, states[0]), find_states(diff->def.b, states[1])};
    if (runs[0] != runs[1]) {
        return error_set(error, EXIT_USAGE, "%s is %s, %s is %s", diff->def.a,
                         runs[0] ? "a run" : "pictures", diff->def.b,
                         runs[1] ? "a run" : "pictures");
    }
    item->kind = runs[0] ? DIFF_STATES : DIFF_PICTURES;
    if (runs[0]) {
        snprintf(item->a, sizeof item->a, "%s", states[0]);
        snprintf(item->b, sizeof item->b, "%s", states[1]);
    }
    return true;
}

bool diff_find_items(Diff *diff, Error *error) {
    diff->worst_item = -1;
    const char *paths[2] = {diff->def.a, diff->def.b};
    for (int i = 0; i < 2; i++) {
        if (strlen(paths[i]) >= FILE_PATH_SIZE / 2) {
            return error_set(error, EXIT_USAGE, "the path is too long: %.60s...", paths[i]);
        }
        if (!exists(paths[i]) && !strchr(paths[i], '%')) {
            return error_set_errno(error, EXIT_MISSING_INPUT, "%s", paths[i]);
        }
    }
    char states[FILE_PATH_SIZE];
    bool folders = is_folder(diff->def.a) && is_folder(diff->def.b);
    return folders && !find_states(diff->def.a, states) && !find_states(diff->def.b, states)
               ? pair_folders(diff, error)
               : set_pair(diff, error);
}
