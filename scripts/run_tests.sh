#!/bin/sh
# Runs test programs one after the other and ends with one line: N passed, N failed.
set -u
passed=0
failed=0
export OPENBLAS_NUM_THREADS=1 OMP_WAIT_POLICY=passive
log=$(mktemp)
for program in "$@"; do
    [ -x "$program" ] || continue
    case $program in *.o | *.d) continue ;; esac
    start=$(date +%s)
    "$program" >"$log" 2>&1
    code=$?
    ok=$(grep -c '^\[       OK \]' "$log")
    bad=$(grep -c '^\[  FAILED  \] [a-z_]*$' "$log")
    # cmocka lists every failed test twice
    bad=$((bad / 2))
    if [ "$code" -ne 0 ] && [ "$bad" -eq 0 ]; then
        bad=1 # crashed
    fi
    passed=$((passed + ok))
    failed=$((failed + bad))
    printf '%-24s %3d passed, %d failed, %d s\n' "$(basename "$program")" "$ok" "$bad" \
        $(($(date +%s) - start))
    grep '^SKIPPED' "$log"
    [ "$bad" -eq 0 ] || cat "$log"
done
rm -f "$log"
[ $((passed + failed)) -gt 0 ] || echo "run_tests: no test program is called $*" >&2
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]
