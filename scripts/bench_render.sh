#!/bin/sh
# What a drawn frame costs: CSV rows like those of `make bench`, on stdout. On an idle machine.
# bench_render.sh [RUN]: with a run of 60 frames or more also the gain of two processes
# in frames a second: fewer frames would measure how long two processes take to start.
set -eu
cd "$(dirname "$0")/.."
toile=scripts/toile
states=tests/golden/table.states
python=${PYTHON:-/usr/bin/python3}
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

first=1
for options in "--size 1280x720" "--size 1920x1080" "--size 1280x720 --quality draft" \
    "--size 1280x720 --surface splats" "--size 1920x1080 --surface splats" \
    "--size 1280x720 --triangles 200000" "--size 1280x720 --triangles 200000 --surface splats"; do
    # shellcheck disable=SC2086 # options are words
    $toile bench $states $options >"$folder/rows"
    if [ $first -eq 1 ]; then cat "$folder/rows"; else tail -n +2 "$folder/rows"; fi
    first=0
    grep ',frame_ms,' "$folder/rows" | tail -n 1 | cut -d, -f8 >>"$folder/frames"
done
# 100,000 surfels against as many vertices of a mesh
tail -n 2 "$folder/frames" | tr '\n' ' ' |
    awk '{printf "render,standard,splats,,192200,,splats_over_mesh,%.3f,1.3,%.3f,,1280x720\n", $2 / $1, $2 / $1 / 1.3 - 1}'

# most memory of a picture in 4K
$python - "$toile" "$states" "$folder/4k.png" <<'PY'
import resource, subprocess, sys
toile, states, picture = sys.argv[1:]
subprocess.run([toile, "render", states, "-o", picture, "--size", "3840x2160", "--quiet"], check=True)
mebibytes = resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss / 1024
print(f"render,standard,mesh,,,,peak_memory_mib,{mebibytes:.0f},2048,{mebibytes / 2048 - 1:.3f},,3840x2160")
PY

run=${1:-}
[ -n "$run" ] || exit 0
for jobs in 1 2; do
    begin=$(date +%s%N)
    $toile render "$run" -o "$folder/jobs.mp4" --frames 0-59 --size 1280x720 --jobs $jobs --threads 1 --force --quiet
    end=$(date +%s%N)
    eval "wall$jobs=$(((end - begin) / 1000))"
done
echo "$wall1 $wall2" | awk '{printf "render,standard,mesh,,,,gain_of_two_processes,%.3f,1.8,%.3f,%.6f,1280x720\n", $1 / $2, $1 / $2 / 1.8 - 1, $1 / 1e6}'
