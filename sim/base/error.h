/* error.h: the three kinds of failure.
 *
 * Our bug:            ASSERT, on in release builds too; prints and aborts with exit code 70.
 * The world's fault:  a function returns false and fills an Error; only main prints it.
 * Mathematics:        an enum that the caller handles (see factor.h, newton.h).
 */
#ifndef TOILE_BASE_ERROR_H
#define TOILE_BASE_ERROR_H

#include <stdbool.h>
#include <stdio.h>

/* Exit codes of every toile program. */
typedef enum ExitCode {
    EXIT_OK = 0,
    EXIT_DIFFERS = 1,        /* diff: the inputs differ; sim: not converged */
    EXIT_USAGE = 2,          /* wrong command line */
    EXIT_BAD_INPUT = 65,     /* a file that was read is wrong */
    EXIT_MISSING_INPUT = 66, /* a file that should be read is not there */
    EXIT_OUR_BUG = 70,       /* an ASSERT failed */
    EXIT_IO = 74,            /* reading or writing failed */
    EXIT_INTERRUPTED = 130   /* Ctrl-C or SIGTERM; the run can be resumed */
} ExitCode;

#define ERROR_TEXT_SIZE 4096

/* One failure, ready to print. A zeroed Error means "nothing happened". */
typedef struct Error {
    ExitCode code;
    char text[ERROR_TEXT_SIZE]; /* one or more whole lines without a final newline */
} Error;

/* Fills `error` (the first failure wins) and returns false, so that a caller can
 * write `return error_set(error, EXIT_IO, "...")`. `error` may be NULL. */
bool error_set(Error *error, ExitCode code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Same, and appends ": " and the text of errno. */
bool error_set_errno(Error *error, ExitCode code, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Puts the place before the text: "WHERE: error: ..."; `where` may be NULL. Returns false. */
bool error_place(Error *error, const char *where);

_Noreturn void error_assert_failed(const char *expression, const char *file, int line);

#define ASSERT(expression)                                                                         \
    ((expression) ? (void)0 : error_assert_failed(#expression, __FILE__, __LINE__))

#endif
