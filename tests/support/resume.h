/* resume.h: runs of the whole program that are stopped and resumed. */
#ifndef TOILE_TESTS_RESUME_H
#define TOILE_TESTS_RESUME_H

/* Writes the scene into the folder of the test (folder.h), simulates `frames` of it by one thread into
 * `whole`, the first `stop` of them by two and the rest by three into `parts`, and asserts that both are
 * the same to the bit. */
void resume_check(const char *scene, int stop, int frames);

#endif
