#!/bin/sh
# Every look, as triangles and as surfels, for looking at: FOLDER/LOOK-mesh.png, FOLDER/LOOK-splats.png, and sheets
# FOLDER/sheet-mesh-01.png, ... of six. A look that needs what the run does not hold is named and left out.
# looks_sheet.sh FOLDER [WIDTHxHEIGHT [RUN]]
set -eu
cd "$(dirname "$0")/.."
toile=scripts/toile
folder=${1:?looks_sheet.sh FOLDER [WIDTHxHEIGHT [RUN]]}
size=${2:-1280x720}
run=${3:-tests/golden/table.states}
mkdir -p "$folder"
looks=$($toile looks | awk '/^obstacles/ {exit} /^  / {print $1}')
for surface in mesh splats; do
    rm -f "$folder/sheet-$surface-"*.png
    number=0
    for look in $looks; do
        $toile render "$run" -o "$folder/$look-$surface.png" --size "$size" --look "$look" --surface $surface \
            --title "$look, $surface" --threads 1 --quiet --force || continue
        number=$((number + 1))
        ln -sf "$look-$surface.png" "$folder/$(printf 'list-%s-%02d.png' $surface $number)"
    done
    ffmpeg -nostdin -v error -y -i "$folder/list-$surface-%02d.png" -vf scale=640:-2,tile=2x3 \
        "$folder/sheet-$surface-%02d.png"
    rm -f "$folder/list-$surface-"*.png
done
