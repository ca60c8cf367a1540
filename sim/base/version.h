/* version.h: the one version of both programs. */
#ifndef TOILE_BASE_VERSION_H
#define TOILE_BASE_VERSION_H

#define TOILE_VERSION "0.1.0"

#endif
