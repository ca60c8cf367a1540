#!/bin/sh
# coverage.sh BUILD: line coverage of the tests, folder by folder, from the gcov data in BUILD.
# What runs in children that end in _exit (much of render) or are killed is not counted.
set -eu
cd "$(dirname "$0")/.."
build=${1:-build/coverage}
[ -n "$(find "$build" -name '*.gcda' 2>/dev/null | head -1)" ] || {
    echo "coverage: no data in $build: run 'make coverage'" >&2
    exit 66
}
# gcov reports a file once for every object that it is in: the scalar and the vector twins of the
# sweep, inline functions of headers. The best covered of these counts.
find "$build/sim" "$build/render" -name '*.gcda' -exec gcov -n {} + 2>/dev/null | awk '
    /^File / { file = substr($2, 2, length($2) - 2) }
    /^Lines executed:/ && file ~ /^(sim|render)\// {
        split($2, part, ":"); percent = part[2] + 0; lines = $NF
        covered = percent * lines / 100
        if (!(file in total) || covered > best[file]) { best[file] = covered; total[file] = lines }
        file = ""
    }
    /^Lines executed:/ { file = "" }
    END {
        for (f in total) {
            folder = f; sub(/\/[^\/]*$/, "", folder)
            hit[folder] += best[f]; all[folder] += total[f]
            hits += best[f]; alls += total[f]
        }
        for (folder in all)
            printf "%-16s %6.1f %%  of %5d lines\n", folder, 100 * hit[folder] / all[folder],
                all[folder] | "sort"
        close("sort")
        printf "%-16s %6.1f %%  of %5d lines\n", "total", 100 * hits / alls, alls
    }'
