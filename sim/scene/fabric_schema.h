/* fabric_schema.h: the keys of a fabric, in a file of its own or within a scene.
 *
 * Inside sim/scene only; everybody else uses fabric.h. */
#ifndef TOILE_SCENE_FABRIC_SCHEMA_H
#define TOILE_SCENE_FABRIC_SCHEMA_H

#include "sim/scene/fabric.h"
#include "sim/scene/schema.h"
#include "sim/scene/source.h"

/* What the keys fill before they become a Fabric. Unknown numbers are NAN. */
typedef struct FabricKeys {
    Fabric fabric;                         /* first: the keys that are kept as they are */
    FabricNumber bend_twist;               /* [N m] D66, instead of bend_bias */
    FabricNumber length_warp, length_weft; /* [m] bending lengths, instead of rigidities */
    FabricNumber iso_stretch;              /* [N/m] isotropic material: E times thickness */
    FabricNumber iso_poisson;
    FabricNumber iso_bending; /* [N m] plate rigidity D */
    int version;              /* of the file */
    const Yaml *like;         /* the fabric whose numbers come first */
    const Yaml *drape;
} FabricKeys;

extern const Schema fabric_schema;
extern const char *const fabric_flag_names[]; /* by FabricFlag */

FabricKeys fabric_keys_default(void);

/* The numbers of a fabric, for loops over them. */
typedef struct FabricRow {
    const char *name; /* "bending.warp" */
    size_t offset;    /* of the FabricNumber in Fabric */
    const char *unit; /* SI, as printed */
} FabricRow;
extern const FabricRow fabric_rows[]; /* name NULL ends */

bool fabric_read_drapes(Reader *reader, const Yaml *list, Fabric *fabric);

/* Reads `fabric:` of a cloth: a name, a path, or a mapping of keys. `sources` opens the files. */
bool fabric_read_value(Reader *reader, Sources *sources, const Yaml *value, Fabric *fabric);

/* Finds and reads a fabric by name or path; `named`: where that was written. */
bool fabric_read_named(Reader *reader, Sources *sources, const char *name, Place named,
                       Fabric *fabric);

/* Complains about values that no fabric has; `place`: of the fabric as a whole.
 * Only numbers that were given are looked at. False when one is impossible. */
bool fabric_check(Reader *reader, const Fabric *fabric, Place place);

/* The names of all fabrics in the assets, sorted, NULL-terminated; empty without the folder. */
const char *const *fabric_names(Arena *arena);

/* Prints the fabric as the keys of an inline mapping. */
void fabric_print_keys(FILE *out, int indent, const Fabric *fabric);

#endif
