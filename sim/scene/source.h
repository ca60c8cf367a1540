/* source.h: the files of a scene: opening, paths relative to the file that names them, and
 * `include`.
 *
 * `include: other.yaml` in any mapping merges the keys of other.yaml at that place. A key that
 * the including mapping has as well keeps the including value, except that two mappings are
 * merged in turn; but shape, camera, fabric, turn, move, motion and isotropic always replace
 * as a whole, because half a shape of one kind and half of another make no sense.
 */
#ifndef TOILE_SCENE_SOURCE_H
#define TOILE_SCENE_SOURCE_H

#include "sim/scene/yaml.h"

#define SOURCE_LARGEST (16 << 20) /* [byte] of one file */
#define SOURCE_DEEPEST 8          /* files within files */
#define SOURCE_MOST 256           /* files of one scene */

/* The files of one reading. */
typedef struct Sources {
    Arena *arena;
    Report *report;
    int count;
} Sources;

/* Text that is already in memory (copied). NULL and a report when it is too long. */
const Source *source_from_text(Sources *sources, const char *path, const char *text, size_t bytes);

/* Reads a whole file. `named` is where its name was written, for the report (source NULL: the
 * command line). NULL and a report when it is missing, too large, or no file. */
const Source *source_read(Sources *sources, const char *path, Place named);

/* `path` as seen from the directory of `from`. */
const char *source_resolve(Sources *sources, const Source *from, const char *path);

/* The tree of a source with its includes merged; NULL and a report. */
Yaml *source_tree(Sources *sources, const Source *source);

/* $TOILE_ASSETS/NAME, or assets/NAME beside the sources that toile was built from. */
const char *source_asset(Arena *arena, const char *name);

#endif
