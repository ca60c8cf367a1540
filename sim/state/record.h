/* record.h: encoding and decoding of one record of a states file (see state.h). */
#ifndef TOILE_STATE_RECORD_H
#define TOILE_STATE_RECORD_H

#include "sim/state/state.h"

#define RECORD_MAGIC "TOILEST\n"
#define RECORD_FILE_HEAD 16                  /* [byte] magic, version, zero */
#define RECORD_HEAD 24                       /* [byte] kind, array count, payload bytes, checksum */
#define RECORD_ARRAY_HEAD 40                 /* [byte] name, type, components, count */
#define RECORD_MAX_BYTES ((uint64_t)1 << 34) /* a larger record is damage, not data */
#define RECORD_MAX_ARRAYS 256

typedef struct Record {
    StateKind kind;
    int array_count;
    const StateArray *arrays;
} Record;

typedef struct RecordHead {
    StateKind kind;
    uint32_t array_count;
    uint64_t payload_bytes;
    uint64_t checksum;
} RecordHead;

size_t record_type_bytes(StateType type);

/* Bytes of the whole encoded record, and the encoding itself into `out`. */
size_t record_bytes(const Record *record);
void record_encode(const Record *record, unsigned char *out);

/* False when the bytes are no record head; `why` says so in a few words. */
bool record_decode_head(const unsigned char *bytes, RecordHead *head, const char **why);

/* Splits a payload whose checksum was verified into arrays that point into it. False when the
 * arrays do not fill it exactly. `arrays` holds head->array_count entries. */
bool record_decode_arrays(const RecordHead *head, const unsigned char *payload, StateArray *arrays,
                          const char **why);

/* The array of that name, type and number of components, or NULL. */
const StateArray *record_find(const StateArray *arrays, int array_count, const char *name,
                              StateType type, int components);

#endif
