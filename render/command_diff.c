/* diff: whether two results are the same, for people and for CI. */
#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

#include "render/command.h"
#include "render/diff.h"
#include "render/interrupt.h"

static bool go_on(void *context, const DiffRow *row) {
    (void)context;
    (void)row;
    return !interrupt_requested();
}

static bool set_rules(const Options *options, DiffRules *rules, Error *error) {
    const DiffProfile *profile =
        diff_profile_find(options->profile ? options->profile : "golden", error);
    if (!profile) {
        return false;
    }
    *rules = diff_rules_of(profile);
    return !options->thresholds || diff_rules_read(options->thresholds, rules, error);
}

/* ---- --update: b becomes a ---- */

static bool copy_file(const char *from, const char *to, Error *error) {
    PartFile file;
    char buffer[65536];
    size_t size;
    FILE *in = fopen(from, "rb");
    if (!in) {
        return error_set_errno(error, EXIT_IO, "%s", from);
    }
    bool good = file_create_folders(to, error) && file_start(&file, to, error);
    while (good && (size = fread(buffer, 1, sizeof buffer, in)) > 0) {
        fwrite(buffer, 1, size, file.out);
    }
    bool whole = !ferror(in);
    fclose(in);
    if (good && !whole) {
        file_abandon(&file);
        return error_set_errno(error, EXIT_IO, "%s", from);
    }
    return good && file_finish(&file, error);
}

/* Accepts what differs, and says what to commit. */
static bool update(const Diff *diff, Error *error) {
    int accepted = 0, gone = 0;
    for (int i = 0; i < diff->item_count; i++) {
        const DiffItem *item = &diff->items[i];
        struct stat status;
        if (!item->failed && !item->trouble[0]) {
            continue;
        }
        if (item->only_a) {
            gone++;
        } else if (stat(item->b, &status) != 0 || !S_ISREG(status.st_mode)) {
            return error_set(error, EXIT_USAGE,
                             "--update copies files; %s is a sequence: give two "
                             "folders",
                             item->b);
        } else if (!copy_file(item->b, item->a, error)) {
            return false;
        } else {
            printf("%s%s", accepted++ ? " " : "git add ", item->a);
        }
    }
    fputs(accepted ? "\n" : "", stdout);
    for (int i = 0; gone > 0 && i < diff->item_count; i++) {
        if (diff->items[i].only_a) {
            printf("# %s is not made any more: git rm it, if that is right\n", diff->items[i].a);
        }
    }
    if (accepted > 0) {
        printf("# %d accepted; look at them, then commit them alone\n", accepted);
    } else if (gone == 0) {
        printf("# nothing to accept\n");
    }
    return true;
}

static bool compare(const Options *options, Diff *diff, Error *error) {
    if (!set_rules(options, &diff->def.rules, error) || !diff_find_items(diff, error)) {
        return false;
    }
    if (!diff_compare(diff, go_on, NULL, error) ||
        (options->output && !diff_write_reports(diff, options->output, error))) {
        return false;
    }
    if (options->update) {
        return update(diff, error);
    }
    if (options->json) {
        diff_print_json(diff, stdout);
    } else if (!options->quiet || diff_verdict(diff) != EXIT_OK) {
        diff_print_table(diff, stdout);
    }
    return true;
}

ExitCode command_diff(const Options *options, Error *error) {
    Diff diff = {
        .def = {.a = options->arguments[0], .b = options->arguments[1], .resize = options->resize}};
    bool good = compare(options, &diff, error);
    ExitCode code = !good ? error->code : options->update ? EXIT_OK : diff_verdict(&diff);
    diff_free(&diff);
    return code;
}
