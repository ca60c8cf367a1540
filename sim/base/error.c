#include "sim/base/error.h"

#include <errno.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

bool error_set(Error *error, ExitCode code, const char *format, ...) {
    if (!error || error->code != EXIT_OK) {
        return false;
    }
    error->code = code;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(error->text, sizeof error->text, format, arguments);
    va_end(arguments);
    return false;
}

bool error_set_errno(Error *error, ExitCode code, const char *format, ...) {
    int number = errno;
    if (!error || error->code != EXIT_OK) {
        return false;
    }
    error->code = code;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(error->text, sizeof error->text, format, arguments);
    va_end(arguments);
    size_t used = strlen(error->text);
    snprintf(error->text + used, sizeof error->text - used, ": %s", strerror(number));
    return false;
}

bool error_place(Error *error, const char *where) {
    if (error && where) {
        char text[sizeof error->text];
        snprintf(text, sizeof text, "%s: error: ", where);
        size_t used = strlen(text);
        snprintf(text + used, sizeof text - used, "%s", error->text);
        memcpy(error->text, text, sizeof text);
    }
    return false;
}

_Noreturn void error_assert_failed(const char *expression, const char *file, int line) {
    fprintf(stderr, "toile: a bug in toile: '%s' does not hold at %s:%d\n", expression, file, line);
    fflush(NULL);
    _exit(EXIT_OUR_BUG);
}
