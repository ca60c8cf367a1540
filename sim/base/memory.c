#include "sim/base/memory.h"

#include <stdio.h>
#include <stdlib.h>

#include "sim/base/error.h"

_Noreturn void memory_exhausted(size_t bytes) {
    fprintf(stderr, "toile: out of memory (%zu bytes were asked for)\n", bytes);
    exit(EXIT_IO);
}

void *memory_new(size_t bytes) { return memory_resize(NULL, bytes); }

void *memory_zeroed(size_t count, size_t size) {
    void *memory = calloc(count > 0 ? count : 1, size > 0 ? size : 1);
    if (!memory) {
        memory_exhausted(count * size);
    }
    return memory;
}

void *memory_resize(void *old, size_t bytes) {
    void *memory = realloc(old, bytes > 0 ? bytes : 1);
    if (!memory) {
        memory_exhausted(bytes);
    }
    return memory;
}
