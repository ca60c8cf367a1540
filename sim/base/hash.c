#include "sim/base/hash.h"

#include <xxhash.h>

uint64_t hash_bytes(const void *data, size_t bytes) { return XXH3_64bits(data, bytes); }

double hash_random(uint64_t seed, uint64_t index) {
    uint64_t key[2] = {seed, index};
    uint64_t bits = XXH3_64bits(key, sizeof key) >> 11; /* 53 bits */
    return (double)bits * (2.0 / 9007199254740992.0) - 1.0;
}
