#!/bin/sh
# Tests slurm_array.sh against a real slurmctld and slurmd on the loopback, started here and stopped again.
# Without Slurm, munge, ffmpeg or root it says so and succeeds.
set -eu
here=$(cd "$(dirname "$(readlink -f "$0")")" && pwd)
skip() { echo "SKIPPED slurm: $*"; exit 0; }
for program in slurmctld slurmd sbatch munged mungekey ffmpeg; do
    command -v "$program" >/dev/null || PATH=$PATH:/usr/sbin command -v "$program" >/dev/null ||
        skip "$program is not installed (slurmctld slurmd slurm-client munge)"
done
PATH=$PATH:/usr/sbin:/sbin
[ "$(id -u)" -eq 0 ] || skip "slurmd needs root"

dir=$(mktemp -d /tmp/toile-slurm-XXXXXX)
pids=""
clean() {
    for pid in $pids; do kill "$pid" 2>/dev/null || true; done
    for pid in $pids; do wait "$pid" 2>/dev/null || true; done
    rm -rf "$dir"
}
trap clean EXIT INT TERM

# munge on a socket of its own
mkdir "$dir/munge"
chmod 755 "$dir"
mungekey -c -k "$dir/munge/key" >/dev/null
munged --foreground --force --key-file="$dir/munge/key" --socket="$dir/munge/socket" \
    --pid-file="$dir/munge/pid" --log-file="$dir/munge/log" --seed-file="$dir/munge/seed" 2>/dev/null &
pids="$pids $!"

host=$(hostname -s)
mkdir "$dir/state" "$dir/spool"
cat >"$dir/slurm.conf" <<CONF
ClusterName=toile
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=26817
SlurmdPort=26818
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$dir/munge/socket
CredType=cred/munge
StateSaveLocation=$dir/state
SlurmdSpoolDir=$dir/spool
SlurmctldPidFile=$dir/slurmctld.pid
SlurmdPidFile=$dir/slurmd.pid
SlurmctldLogFile=$dir/slurmctld.log
SlurmdLogFile=$dir/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=1,batch_sched_delay=0
MpiDefault=none
ReturnToService=2
NodeName=$host NodeAddr=127.0.0.1 CPUs=$(nproc) State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP
CONF
export SLURM_CONF=$dir/slurm.conf
slurmctld -D >/dev/null 2>&1 &
pids="$pids $!"
slurmd -D >/dev/null 2>&1 &
pids="$pids $!"
tries=0
until sinfo -h -o %T 2>/dev/null | grep -q -E 'idle|mixed'; do
    tries=$((tries + 1))
    if [ $tries -gt 60 ]; then
        tail -3 "$dir"/*.log >&2
        skip "slurmctld and slurmd did not come up on this machine"
    fi
    sleep 0.5
done

cd "$dir"
cat >scene.yaml <<'SCENE'
toile: 1
film: {rate: 30, seconds: 0.3, size: 160x90, camera: {eye: [0.4, -0.9, 0.3]}, floor: -30 cm}
cloth: {sheet: {shape: {rectangle: {width: 30 cm, height: 30 cm}}, fabric: denim, nodes: 9 x 9}}
handles: [{hold: sheet.left}]
SCENE
"$here/toile" sim scene.yaml -o run --quiet
"$here/toile" render run -o whole.mkv --quiet --quality draft
"$here/slurm_array.sh" render run -o joined.mkv --parts 4 --quality draft
"$here/toile" diff whole.mkv joined.mkv --profile exact >/dev/null ||
    { echo "slurm: the joined film is not the whole one" >&2; exit 1; }
"$here/slurm_array.sh" render run -o joined.mp4 --parts 3 --quality draft
frames=$(ffprobe -v error -count_frames -show_entries stream=nb_read_frames -of csv=p=0 joined.mp4)
[ "$frames" -eq "$("$here/toile" frames run)" ] || { echo "slurm: $frames frames in the mp4" >&2; exit 1; }
"$here/toile" render run -o whole/ --quiet --quality draft
"$here/slurm_array.sh" render run -o parts/ --parts 12 --quality draft
"$here/toile" diff whole parts --profile exact >/dev/null ||
    { echo "slurm: the pictures of the parts differ" >&2; exit 1; }
sed 's/denim/canvas/' scene.yaml >stiff.yaml
"$here/slurm_array.sh" film scene.yaml stiff.yaml -o films --quality draft
[ -s films/scene.mp4 ] && [ -s films/stiff.mp4 ] || { echo "slurm: films are missing" >&2; exit 1; }
if "${PYTHON:-/usr/bin/python3}" -c 'import numpy, matplotlib' 2>/dev/null; then
    "$here/toile" study scene.yaml -o studied --nodes 0.5,1 --slurm >study.txt
    grep -q 'the reference' studied/study.csv && [ "$(grep -c ^study studied/study.csv)" -eq 2 ] ||
        { echo "slurm: the study is not whole" >&2; exit 1; }
fi
if "$here/slurm_array.sh" render run -o bad.mkv --parts 2 --look no-such-look 2>/dev/null || [ -e bad.mkv ]; then
    echo "slurm: a failed task went unnoticed" >&2
    exit 1
fi
echo "slurm: ok"
