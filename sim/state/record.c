#include "sim/state/record.h"

#include <string.h>

#include "sim/base/hash.h"

static const char kind_letters[][5] = {"HEAD", "LAYO", "FRAM", "DONE"};

size_t record_type_bytes(StateType type) {
    switch (type) {
    case STATE_U8:
        return 1;
    case STATE_I32:
        return 4;
    case STATE_I64:
    case STATE_F64:
        return 8;
    }
    return 0;
}

static size_t padded(size_t bytes) { return (bytes + 7) / 8 * 8; }

static size_t array_data_bytes(const StateArray *array) {
    return record_type_bytes(array->type) * (size_t)array->components * (size_t)array->count;
}

size_t record_bytes(const Record *record) {
    size_t bytes = RECORD_HEAD;
    for (int i = 0; i < record->array_count; i++) {
        bytes += RECORD_ARRAY_HEAD + padded(array_data_bytes(&record->arrays[i]));
    }
    return bytes;
}

static unsigned char *put(unsigned char *out, const void *data, size_t bytes) {
    if (bytes > 0) {
        memcpy(out, data, bytes);
    }
    return out + bytes;
}

static unsigned char *put_array(unsigned char *out, const StateArray *array) {
    uint32_t numbers[2] = {(uint32_t)array->type, (uint32_t)array->components};
    uint64_t count = (uint64_t)array->count;
    size_t bytes = array_data_bytes(array);
    out = put(out, array->name, STATE_NAME_SIZE);
    out = put(out, numbers, sizeof numbers);
    out = put(out, &count, sizeof count);
    out = put(out, array->data, bytes);
    memset(out, 0, padded(bytes) - bytes);
    return out + padded(bytes) - bytes;
}

void record_encode(const Record *record, unsigned char *out) {
    unsigned char *payload = out + RECORD_HEAD, *end = payload;
    for (int i = 0; i < record->array_count; i++) {
        end = put_array(end, &record->arrays[i]);
    }
    uint32_t array_count = (uint32_t)record->array_count;
    uint64_t bytes = (uint64_t)(end - payload);
    uint64_t checksum = hash_bytes(payload, bytes);
    out = put(out, kind_letters[record->kind], 4);
    out = put(out, &array_count, sizeof array_count);
    out = put(out, &bytes, sizeof bytes);
    put(out, &checksum, sizeof checksum);
}

bool record_decode_head(const unsigned char *bytes, RecordHead *head, const char **why) {
    int kind = 0;
    while (kind < 4 && memcmp(bytes, kind_letters[kind], 4) != 0) {
        kind++;
    }
    if (kind == 4) {
        *why = "no record starts here";
        return false;
    }
    head->kind = (StateKind)kind;
    memcpy(&head->array_count, bytes + 4, 4);
    memcpy(&head->payload_bytes, bytes + 8, 8);
    memcpy(&head->checksum, bytes + 16, 8);
    if (head->array_count > RECORD_MAX_ARRAYS || head->payload_bytes > RECORD_MAX_BYTES ||
        head->payload_bytes % 8 != 0) {
        *why = "the record's size is impossible";
        return false;
    }
    return true;
}

static bool decode_array(const unsigned char **cursor, const unsigned char *end,
                         StateArray *array) {
    if (end - *cursor < RECORD_ARRAY_HEAD) {
        return false;
    }
    uint32_t numbers[2];
    uint64_t count;
    memcpy(array->name, *cursor, STATE_NAME_SIZE);
    memcpy(numbers, *cursor + STATE_NAME_SIZE, sizeof numbers);
    memcpy(&count, *cursor + STATE_NAME_SIZE + sizeof numbers, sizeof count);
    *cursor += RECORD_ARRAY_HEAD;
    array->name[STATE_NAME_SIZE - 1] = 0;
    array->type = (StateType)numbers[0];
    if (numbers[0] < STATE_U8 || numbers[0] > STATE_F64 || numbers[1] < 1 || numbers[1] > 1024 ||
        count > RECORD_MAX_BYTES) {
        return false;
    }
    array->components = (int)numbers[1];
    array->count = (int64_t)count;
    uint64_t item = record_type_bytes(array->type) * numbers[1];
    uint64_t left = (uint64_t)(end - *cursor);
    if (count > left / item || padded(count * item) > left) {
        return false;
    }
    array->data = *cursor;
    *cursor += padded(count * item);
    return true;
}

bool record_decode_arrays(const RecordHead *head, const unsigned char *payload, StateArray *arrays,
                          const char **why) {
    const unsigned char *cursor = payload, *end = payload + head->payload_bytes;
    for (uint32_t i = 0; i < head->array_count; i++) {
        if (!decode_array(&cursor, end, &arrays[i])) {
            *why = "an array does not fit into its record";
            return false;
        }
    }
    if (cursor != end) {
        *why = "the arrays do not fill their record";
        return false;
    }
    return true;
}

const StateArray *record_find(const StateArray *arrays, int array_count, const char *name,
                              StateType type, int components) {
    for (int i = 0; i < array_count; i++) {
        const StateArray *array = &arrays[i];
        if (strcmp(array->name, name) == 0 && array->type == type &&
            array->components == components) {
            return array;
        }
    }
    return NULL;
}
