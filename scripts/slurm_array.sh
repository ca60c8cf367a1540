#!/bin/sh
# Work of toile as a Slurm job array.
#
#   slurm_array.sh render RUN -o FILE [--parts N] [render options]   frames of one run, in N tasks
#   slurm_array.sh film SCENE... -o FOLDER [film options]            one scene a task: a sweep
#   slurm_array.sh study FOLDER                                      the runs of `toile study --slurm`
#
# Parts of a video are joined without encoding again; pictures of a sequence need no joining. Tasks and
# this script must see the same files. Waits for the end; exit code 0 when every task succeeded.
# SBATCH_OPTIONS: more options of sbatch, such as --partition or --time.
set -eu

here=$(cd "$(dirname "$(readlink -f "$0")")" && pwd)
toile=$here/toile
fail() { echo "slurm_array: $*" >&2; exit 2; }

# Frames of part k of n of the range first..last, as A-B; nothing when there are more parts than frames.
part_range() {
    first=$1 last=$2 parts=$3 k=$4
    count=$((last - first + 1))
    begin=$((first + count * k / parts)) end=$((first + count * (k + 1) / parts - 1))
    [ "$begin" -gt "$end" ] || echo "$begin-$end"
}

# ---- inside a task ----

# task_render FOLDER: the k-th part; its arguments stand in FOLDER/arguments, one a line
task_render() {
    folder=$1 k=$SLURM_ARRAY_TASK_ID
    . "$folder/settings"
    range=$(part_range "$first" "$last" "$parts" "$k")
    [ -n "$range" ] || exit 0
    if [ "$ending" = sequence ]; then out=$file; else
        out=$folder/$(printf 'part-%05d' "$k").$ending; fi
    set --
    while IFS= read -r word; do set -- "$@" "$word"; done <"$folder/arguments"
    exec "$toile" render "$run" -o "$out" --frames "$range" --force --quiet --threads 1 "$@"
}

task_film() {
    folder=$1
    scene=$(sed -n "$((SLURM_ARRAY_TASK_ID + 1))p" "$folder/scenes")
    name=$(basename "$scene")
    set --
    while IFS= read -r word; do set -- "$@" "$word"; done <"$folder/arguments"
    exec "$toile" film "$scene" -o "$folder/${name%.*}.mp4" --quiet --threads 1 "$@"
}

task_study() {
    name=$(sed -n "$((SLURM_ARRAY_TASK_ID + 1))p" "$1/runs")
    exec "${PYTHON:-/usr/bin/python3}" "$here/study.py" --run "$1" "$name"
}

# ---- outside ----

# submit LAST COMMAND...: an array 0..LAST of this script with that command; waits for it
submit() {
    last_task=$1
    shift
    # shellcheck disable=SC2086 # options are words
    sbatch --wait --parsable --array="0-$last_task" --output="$log/%a.log" --job-name=toile \
        ${SBATCH_OPTIONS:-} --wrap "exec '$here/slurm_array.sh' $*" >"$log/id" ||
        { cat "$log"/*.log >&2 2>/dev/null; echo "slurm_array: a task failed; see $log" >&2; exit 1; }
}

join_parts() {
    for part in "$folder"/part-*."$ending"; do echo "file '$part'"; done >"$folder/list"
    ffmpeg -v error -y -f concat -safe 0 -i "$folder/list" -map 0:v -c copy \
        -map_metadata 0 -movflags +faststart "$folder/joined.$ending"
    mv "$folder/joined.$ending" "$file"
}

render() {
    run=${1:-}; shift || fail "render: RUN is missing"
    file="" parts=8 range="" words=""
    arguments=$(mktemp)
    while [ $# -gt 0 ]; do
        case $1 in
        -o | --output) file=$2; shift ;;
        --parts) parts=$2; shift ;;
        --frames) range=$2; shift ;;
        *) printf '%s\n' "$1" >>"$arguments" ;;
        esac
        shift
    done
    [ -n "$file" ] || fail "render: -o FILE is missing"
    count=$("$toile" frames "$run") || exit $?
    first=${range%%-*} last=${range#*-}
    first=${first:-0} last=${last:-$((count - 1))}
    [ "$last" -lt "$count" ] || fail "--frames: the last one is $((count - 1))"
    ending=${file##*.}
    case $file in *.png | */) ending=sequence ;; esac
    case $(basename "$file") in *.*) ;; *) ending=sequence ;; esac
    case $file in *.hevc.mp4) ending=hevc.mp4 ;; *.av1.webm) ending=av1.webm ;; *.prores.mov) ending=prores.mov ;; esac
    case $ending in gif | apng) fail "parts of a .$ending cannot be joined; use a sequence or .mkv" ;; esac
    run=$(readlink -f "$run")
    mkdir -p "$(dirname "$file")"
    case $file in /*) ;; *) file=$PWD/$file ;; esac
    folder=$(mktemp -d "$(dirname "$file")/toile-parts-XXXXXX") # tasks on other machines see it too
    log=$folder
    mv "$arguments" "$folder/arguments"
    chmod 644 "$folder/arguments"
    printf "run='%s' file='%s' first=%s last=%s parts=%s ending=%s\n" "$run" "$file" "$first" "$last" \
        "$parts" "$ending" >"$folder/settings"
    submit $((parts - 1)) task_render "'$folder'"
    [ "$ending" = sequence ] || join_parts
    rm -r "$folder"
}

film() {
    out="" log=""
    list=$(mktemp) arguments=$(mktemp)
    while [ $# -gt 0 ]; do
        case $1 in
        -o | --output) out=$2; shift ;;
        -*) printf '%s\n' "$1" >>"$arguments" ;;
        *.yaml | *.json) readlink -f "$1" >>"$list" ;;
        *) printf '%s\n' "$1" >>"$arguments" ;;
        esac
        shift
    done
    [ -n "$out" ] && [ -s "$list" ] || fail "film: SCENE... -o FOLDER"
    mkdir -p "$out"
    log=$(readlink -f "$out")
    mv "$list" "$log/scenes"
    mv "$arguments" "$log/arguments"
    submit $(($(wc -l <"$log/scenes") - 1)) task_film "'$log'"
}

study() {
    [ -s "${1:-}/runs" ] || fail "study: a folder with the list 'runs' is missing"
    log=$(readlink -f "$1")/tasks
    mkdir -p "$log"
    submit $(($(wc -l <"$log/../runs") - 1)) task_study "'$(readlink -f "$1")'"
}

verb=${1:-}
[ $# -gt 0 ] && shift
case $verb in
task_render | task_film | task_study) "$verb" "$@" ;;
render | film | study)
    command -v sbatch >/dev/null || { echo "slurm_array: there is no Slurm here (sbatch)" >&2; exit 66; }
    "$verb" "$@" ;;
*) sed -n '2,12s/^# \{0,1\}//p' "$0" >&2; exit 2 ;;
esac
