#!/bin/sh
# The same states bit for bit: release and debug builds, 1, 2 and 3 threads, every sweep that the
# processor knows. Prints one line a run and fails when two hashes differ.
set -eu
cd "$(dirname "$0")/.."
make --no-print-directory config=debug build/debug/toile-sim >/dev/null
make --no-print-directory build/release/toile-sim >/dev/null
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cat >"$folder/scene.yaml" <<'SCENE'
toile: 1
film: {rate: 30, seconds: 0.5}
cloth:
  sheet:
    shape: {rectangle: {width: 40 cm, height: 40 cm}}
    fabric: wool-tropical
    nodes: 41 x 41
    at: [0, 0, 3 cm]
    noise: 0.3 mm
  threads:
    shape: {rectangle: {width: 20 cm, height: 20 cm}}
    fabric: wool-tropical
    model: particles
    nodes: 21 x 19
    at: [-40 cm, 0, 3 cm]
    noise: 0.3 mm
  tube:
    shape: {sleeve: {radius: 5 cm, length: 15 cm, rest: curved}}
    fabric: wool-tropical
    nodes: 27 x 19
    at: [40 cm, 0, 3 cm]
    noise: 0.3 mm
handles:
  - {hold: sheet.top-left}
  - {hold: threads.top-left}
  - {clamp: tube.start}
  - {clamp: tube.end, turn: {axis: z, by: 40 deg, from: 0.1 s, to: 0.5 s}}
obstacles:
  ball: {sphere: {radius: 5 cm}, at: [5 cm, 0, -3 cm], friction: 0.3}
SCENE
first=""
bad=0
run() {
    hash=$(TOILE_VECTORS=${3:-} "build/$1/toile-sim" sim "$folder/scene.yaml" -o "$folder/run" \
        --force --quiet --json --threads "$2" | sed 's/.*"state_hash": "\([0-9a-f]*\)".*/\1/')
    echo "determinism: $1, $2 threads${3:+, $3}: $hash"
    first=${first:-$hash}
    [ "$hash" = "$first" ] || bad=1
}
run release 1
run release 2
run release 3
run release 1 scalar
run release 1 sse2
run debug 1
run debug 2
[ "$bad" -eq 0 ] && echo "determinism: ok" || echo "determinism: states differ" >&2
exit "$bad"
