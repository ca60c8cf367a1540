/* memory.h: memory of the heap, for what is no arena's. Where there is none left the program says so and ends;
 * callers need not ask. What is got is given back by free. */
#ifndef TOILE_BASE_MEMORY_H
#define TOILE_BASE_MEMORY_H

#include <stddef.h>

_Noreturn void memory_exhausted(size_t bytes); /* exit code 74 */

/* As malloc, calloc, realloc; never NULL, not even for 0 bytes. */
void *memory_new(size_t bytes);
void *memory_zeroed(size_t count, size_t size);
void *memory_resize(void *old, size_t bytes);

#endif
