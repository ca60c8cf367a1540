#!/bin/sh
# fuzz.sh SECONDS [scene|state|picture|thresholds|obj|ply|stl|gltf|glb|fbx]: fuzzes the readers of scenes,
# states, pictures and thresholds, and the import of meshes, each for so long, with AddressSanitizer and
# UBSan. Anything found fails and leaves its input in build/fuzz/.
set -eu
cd "$(dirname "$0")/.."
seconds=${1:-60}
only=${2:-scene state picture thresholds obj ply stl gltf glb fbx}
out=build/fuzz
command -v clang >/dev/null || { echo "fuzz: clang is missing: apt-get install clang" >&2; exit 66; }
mkdir -p "$out"

build() {
    name=$1 libs=$2; shift 2
    echo "fuzz: building fuzz_$name"
    clang -std=gnu17 -g -O1 -ffp-contract=off -fsanitize=fuzzer,address,undefined \
        -fno-sanitize-recover=undefined -fno-omit-frame-pointer -I. -D_GNU_SOURCE \
        -isystem /usr/include/suitesparse -DTOILE_SOURCE_DIR="\"$PWD\"" \
        "tests/fuzz/fuzz_$name.c" "$@" $libs -lgomp -o "$out/fuzz_$name"
}

# small states files: a lattice with an obstacle and a scattered disc, a few frames each
state_corpus() {
    [ -x build/release/toile-sim ] || make -s all
    for shape in 'rectangle: {width: 8 cm, height: 4 cm}|nodes: 5 x 3' \
        'disc: {radius: 5 cm}|spacing: 3 cm'; do
        name=${shape%%:*}
        cat >"$out/$name.yaml" <<TEXT
toile: 1
film: {rate: 30, seconds: 0.1}
cloth:
  sheet: {shape: {${shape%|*}}, fabric: wool-tropical, ${shape#*|}}
obstacles:
  ball: {sphere: {radius: 3 cm}, at: [0, 0, -10 cm]}
TEXT
        build/release/toile-sim sim "$out/$name.yaml" -o "$out/$name.run" --force --quiet
        cp "$out/$name.run/run.states" "$1/$name.states"
    done
    cp tests/golden/disc.states "$1/"
}

run() {
    name=$1 longest=$2 patience=${3:-10}
    echo "fuzz: fuzz_$name for $seconds s"
    ASAN_OPTIONS=detect_leaks=1 UBSAN_OPTIONS=print_stacktrace=1 "$out/fuzz_$name" \
        -max_total_time="$seconds" -max_len="$longest" -timeout="$patience" -rss_limit_mb=4096 \
        -artifact_prefix="$out/$name-" -print_final_stats=1 "$out/corpus_$name" \
        >"$out/$name.log" 2>&1 || {
        tail -40 "$out/$name.log" >&2
        echo "fuzz: fuzz_$name found something: $out/$name.log" >&2
        return 1
    }
    grep -E 'number_of_executed_units|^Done|cov:' "$out/$name.log" | tail -2
}

bad=0
for target in $only; do
    mkdir -p "$out/corpus_$target"
    case $target in
    scene)
        build scene "-lyaml -ludunits2 -lxxhash -lm" sim/base/*.c sim/geom/solid.c \
            sim/geom/points.c $(ls sim/scene/*.c | grep -v -e mesh_import -e mesh_assimp)
        for file in assets/scenes/*.yaml assets/fabrics/*.yaml tests/bad/*; do
            [ "$(wc -c <"$file")" -gt 16384 ] || cp "$file" "$out/corpus_scene/"
        done
        run scene 16384 || bad=1
        ;;
    state)
        build state "-lxxhash -lm" sim/base/*.c sim/state/*.c
        state_corpus "$out/corpus_state"
        run state 65536 || bad=1
        ;;
    picture)
        build picture "-lOpenEXRCore-3_1 -lavfilter -lavformat -lavcodec -lswscale -lavutil -lpng -lxxhash -lm" \
            sim/base/*.c render/video.c $(ls render/image*.c) render/diff_gate.c render/file.c
        # small pictures of each kind; the first byte says which
        size=32x24
        ffmpeg -nostdin -v error -y -f lavfi -i testsrc2=size=$size:rate=2:duration=1 "$out/small.mp4"
        n=0
        for kind in png jpg tif exr bmp; do
            pixels=""
            [ "$kind" != exr ] || pixels="-pix_fmt gbrpf32le"
            ffmpeg -nostdin -v error -y -f lavfi -i testsrc2=size=$size -frames:v 1 $pixels \
                "$out/small.$kind"
            { printf "\\$(printf %o $n)"; cat "$out/small.$kind"; } >"$out/corpus_picture/$kind"
            n=$((n + 1))
        done
        { printf '\5'; cat "$out/small.mp4"; } >"$out/corpus_picture/mp4"
        # few bytes may be many pixels, which are read more than once, by the clock of a busy machine
        run picture 65536 300 || bad=1
        ;;
    thresholds)
        build thresholds "-lxxhash -lm" sim/base/*.c render/diff_gate.c
        printf '# limits\nprofile: golden\npsnr: 45 dB\nstep: 3\n[hero*.png]\nshare: 1 %%\nflip: off\n' \
            >"$out/corpus_thresholds/sections"
        printf 'moved: 2 mm\nrelative: 0.001\n\n[*.states]\nmoved: 0.002 m\nnodes: 0\n' \
            >"$out/corpus_thresholds/states"
        run thresholds 4096 || bad=1
        ;;
    obj | ply | stl | gltf | glb | fbx)
        build mesh "-lassimp -lxxhash -lm" "-DMESH_ENDING=\"$target\"" sim/base/*.c \
            sim/scene/mesh*.c
        mv "$out/fuzz_mesh" "$out/fuzz_$target"
        mkdir -p "$out/meshes"
        clang -I. tests/fuzz/make_meshes.c tests/support/meshes.c -o "$out/make_meshes"
        "$out/make_meshes" "$out/meshes"
        for file in "$out/meshes"/*."$target" assets/meshes/*."$target"; do
            [ ! -f "$file" ] || cp "$file" "$out/corpus_$target/"
        done
        run "$target" 65536 || bad=1
        ;;
    *) echo "fuzz: no target $target" >&2; exit 2 ;;
    esac
done
[ "$bad" -eq 0 ] && echo "fuzz: nothing found"
exit "$bad"
