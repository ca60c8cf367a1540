#!/bin/sh
# Makes the pictures and films of assets/gallery from the shipped scenes: gallery.sh [FOLDER OF RUNS]
set -eu
cd "$(dirname "$0")/.."
toile=scripts/toile
runs=${1:-build/gallery}
out=assets/gallery
mkdir -p "$runs" "$out"

run() { # SCENE: simulates it once
    [ -s "$runs/$1/run.states" ] || $toile sim "assets/scenes/$1.yaml" -o "$runs/$1" --quiet
}
still() { # SCENE NAME FRAME OPTIONS...
    scene=$1 name=$2 frame=$3
    shift 3
    $toile render "$runs/$scene" -o "$out/$name.png" --frames "$frame" --size 800x450 \
        --quality quality --force --quiet "$@"
}
film() { # SCENE NAME OPTIONS...
    scene=$1 name=$2
    shift 2
    $toile render "$runs/$scene" -o "$out/$name.mp4" --size 640x360 --force --quiet "$@"
}

for scene in sleeve chiffon tablecloth flag cape skirt breen-cotton breen-polycotton; do run "$scene"; done
still sleeve sleeve 130 --camera near --size 960x540
still chiffon chiffon 70
still chiffon strain 80 --camera top --look strain-warp --show-scale --title "Silk on a ball" --show-time
still chiffon tartan-splats 60 --camera flight --look tartan --surface splats
still tablecloth gingham 33 --look gingham
still flag breton 54 --look breton
still cape suiting 60 --look suiting
still cape curvature 60 --look curvature
still skirt skirt 209 --look suiting
still breen-cotton breen 239 --look cotton
still breen-cotton breen-side 239 --camera side --look linen
still breen-polycotton breen-polycotton 239
still breen-polycotton breen-polycotton-side 239 --camera side
film chiffon chiffon
film tablecloth tablecloth --look tartan
film flag flag --look breton --blur 0.5
film cape cape --look double-face
film skirt skirt --look suiting
