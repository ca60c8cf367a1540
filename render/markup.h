/* markup.h: text inside HTML and XML. */
#ifndef TOILE_RENDER_MARKUP_H
#define TOILE_RENDER_MARKUP_H

#include <stdbool.h>
#include <stdio.h>

/* Text or a quoted attribute. ascii: everything else becomes a question mark, for readers that
 * refuse control characters and broken UTF-8. */
static inline void markup_put(FILE *out, const char *text, bool ascii) {
    for (; *text; text++) {
        unsigned char c = (unsigned char)*text;
        const char *name = c == '<'   ? "&lt;"
                           : c == '>' ? "&gt;"
                           : c == '&' ? "&amp;"
                           : c == '"' ? "&quot;"
                                      : NULL;
        if (name) {
            fputs(name, out);
        } else {
            fputc(ascii && (c < ' ' || c > 126) ? '?' : c, out);
        }
    }
}

#endif
