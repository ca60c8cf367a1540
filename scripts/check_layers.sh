#!/bin/sh
# Proves that includes form the DAG of CONTRIBUTING.md, that each foreign library is known to one
# file, and that files and functions keep their size limits. Prints every violation.
set -eu
cd "$(dirname "$0")/.."
bad=0
complain() { echo "layers: $*" >&2; bad=1; }

# folder -> folders that it may include, besides itself
allowed() {
    case $1 in
    sim/base) echo "" ;;
    sim/geom) echo "sim/base" ;;
    sim/scene) echo "sim/base sim/geom" ;;
    sim/state) echo "sim/base sim/geom" ;;
    sim/solve) echo "sim/base" ;;
    sim/model) echo "sim/base sim/geom sim/scene sim/solve" ;;
    sim/contact) echo "sim/base sim/geom sim/scene sim/solve" ;;
    sim/step) echo "sim/base sim/geom sim/scene sim/solve sim/model sim/contact" ;;
    sim) echo "sim/base sim/geom sim/scene sim/state sim/solve sim/model sim/contact sim/step" ;;
    render) echo "sim/base sim/geom sim/state" ;;
    esac
}

for file in $(git ls-files 'sim/*.c' 'sim/*.h' 'render/*.c' 'render/*.h'); do
    folder=$(dirname "$file")
    for included in $(sed -n 's/^#include "\(.*\)"$/\1/p' "$file"); do
        [ -f "$included" ] || { complain "$file includes $included, which is not there"; continue; }
        from=$(dirname "$included")
        [ "$from" = "$folder" ] && continue
        case " $(allowed "$folder") " in
        *" $from "*) ;;
        *) complain "$file may not include $included" ;;
        esac
    done
done

# each foreign library is known to one file (two for the GL types: the loader and its table)
one_file() {
    pattern=$1; most=$2
    users=$(git grep -lE "^#include <$pattern" -- sim render | sort)
    count=$(printf '%s' "$users" | grep -c . || true)
    [ "$count" -le "$most" ] || complain "<$pattern> is included by $count files:" $users
}
one_file 'cholmod\.h' 1
one_file 'assimp/' 1
one_file 'yaml\.h' 1
one_file 'udunits2\.h' 1
one_file 'libqhull_r/' 1
one_file 'lapacke\.h' 1
one_file 'gmp\.h' 1
one_file 'png\.h' 1
one_file 'OpenEXR/' 1
one_file 'cairo/' 1
one_file 'libav(codec|filter|format|util)/' 1
one_file 'xxhash\.h' 1
one_file 'GL/osmesa\.h' 1
one_file 'EGL/' 1
one_file 'omp\.h' 1

# sizes: .c 600 lines, .h 220, functions 60 (element kernels 150)
for file in $(git ls-files 'sim/*.c' 'sim/*.h' 'render/*.c' 'render/*.h' 'tests/*.c' 'tests/*.h'); do
    lines=$(wc -l <"$file")
    case $file in
    *.c) [ "$lines" -le 600 ] || complain "$file has $lines lines, at most 600" ;;
    *.h) [ "$lines" -le 220 ] || complain "$file has $lines lines, at most 220" ;;
    esac
done
# element kernels that may be longer than 60 lines (at most 150)
kernels="cell_row rest_row"
long=$(mktemp)
for file in $(git ls-files 'sim/*.c' 'render/*.c' 'tests/*.c'); do
    awk -v file="$file" -v kernels="$kernels" '
        /^[a-zA-Z_].*\(/ { head = $0 }
        !start && /\) \{$/ { start = NR; name = head }
        /^}/ && start { n = NR - start + 1; limit = 60
            m = split(kernels, k, " ")
            for (i = 1; i <= m; i++) if (index(name, k[i] "(")) limit = 150
            if (n > limit) printf "layers: %s: %d lines in: %s\n", file, n, name
            start = 0 }
    ' "$file"
done >"$long"
if [ -s "$long" ]; then
    cat "$long" >&2
    bad=1
fi
rm -f "$long"
[ "$bad" -eq 0 ] && echo "layers: ok"
exit "$bad"
