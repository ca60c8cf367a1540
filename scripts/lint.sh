#!/bin/sh
# clang-tidy and cppcheck over the sources; any finding fails.
set -eu
cd "$(dirname "$0")/.."
flags="-std=c17 -I. -isystem /usr/include/suitesparse -D_GNU_SOURCE -DTOILE_SOURCE_DIR=\"/tmp\"
    -DVECTOR_VARIANT=scalar"
files=$(git ls-files 'sim/*.c' 'render/*.c')
bad=0
printf '%s\n' $files | xargs -P 2 -n 1 sh -c '
    flags=$1; shift
    clang-tidy --quiet "$@" -- $flags 2>/dev/null' sh "$flags" >/tmp/toile_tidy.$$ || bad=1
if grep -q -E 'warning:|error:' /tmp/toile_tidy.$$; then
    grep -E -A3 'warning:|error:' /tmp/toile_tidy.$$ >&2
    bad=1
fi
rm -f /tmp/toile_tidy.$$
[ "$bad" -eq 0 ] && echo "clang-tidy: ok"
# rows of the sweep start LANE_MARGIN into their buffer: index -1 is theirs
cppcheck --std=c11 --quiet --inline-suppr --error-exitcode=1 --enable=warning,portability \
    --suppress=missingIncludeSystem --suppress=uninitvar -I. -D_GNU_SOURCE \
    --suppress=negativeIndex:sim/model/sweep_kernel.c \
    -DTOILE_SOURCE_DIR='"."' -DVECTOR_VARIANT=scalar $files && echo "cppcheck: ok" || bad=1
exit "$bad"
