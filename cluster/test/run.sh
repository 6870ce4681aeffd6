#!/bin/bash
# Tests `taxel sweep` as a cluster uses it: shards, Slurm, GNU parallel, killed tasks, bad files and a full disk.
#
#   TAXEL=path cluster/test/run.sh    [default: target/release/taxel]
#
# Whatever happens on the way, the points and the table must be those of one process, byte for byte. It needs root and
# Debian's packages slurm-wlm, munge and parallel. Its Slurm is its own, on loopback, in a temporary folder that goes at the end.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
plan=$here/plan64.toml
TAXEL=$(realpath "${TAXEL:-$here/../../target/release/taxel}")
export TAXEL
# A scheduler that started this test is not the one that is tested.
unset ${!SLURM_@} ${!HQ_@} PARALLEL_SEQ RAYON_NUM_THREADS SHARDS

fail() { echo "failed: $*" >&2; exit 1; }
say() { echo "ok: $*"; }
need() { command -v "$1" >/dev/null || fail "$1 is missing: apt-get install slurm-wlm munge parallel"; }
now() { echo "$EPOCHREALTIME"; }
since() { awk -v a="$1" -v b="$EPOCHREALTIME" 'BEGIN { printf "%.1f", b - a }'; }
sweep() { "$TAXEL" sweep "$@" >>"$work/log" 2>&1; }
count() { find "$1/points" -name '*.json' 2>/dev/null | wc -l; }

. "$here/own-slurm.sh"

[ "$(id -u)" = 0 ] || fail "this test starts daemons and mounts a small disk: run it as root"
for program in munged slurmctld slurmd sbatch parallel; do need "$program"; done
[ -x "$TAXEL" ] || fail "$TAXEL is missing: cargo build --release, or set TAXEL"
work=$(mktemp -d "${TMPDIR:-/tmp}/sweep-test.XXXXXX")

clean_up() {
    local status=$?
    set +e
    [ $status = 0 ] || tail -n 20 "$work/log" >&2
    stop_slurm
    wait
    mountpoint -q "$work/full/points" && umount "$work/full/points"
    rm -rf "$work"
    exit $status
}
trap clean_up EXIT
trap 'exit 1' INT TERM HUP

# Says "ok" if the folder has the reference's points and no other file, and all of them merge to the reference's table.
same() {
    diff -rq "$work/reference/points" "$1/points" || fail "$2: points differ"
    sweep "$plan" --merge "$1" -o "$1/merged.csv" || fail "$2: the merge refuses"
    cmp "$work/reference/results.csv" "$1/merged.csv" || fail "$2: tables differ"
    say "$2"
}

one_process() {
    local begun; begun=$(now)
    sweep "$plan" -o "$work/reference" || fail "one process"
    [ "$(count "$work/reference")" = 64 ] || fail "one process: $(count "$work/reference") of 64 points"
    say "one process: 64 points in $(since "$begun") s"
}

# Shards, one after the other. Eight are alone on one core each: their sum is what a perfect division would divide.
shards() {
    local shard begun
    for n in 1 3 8; do
        begun=$(now)
        for shard in $(seq "$n"); do
            if [ "$n" = 8 ]; then export RAYON_NUM_THREADS=1; fi
            sweep "$plan" --shard "$shard/$n" -o "$work/shards$n" || fail "shard $shard/$n"
        done
        alone=$(since "$begun")
        unset RAYON_NUM_THREADS
        same "$work/shards$n" "$n shards one after the other, $alone s"
    done
}

gnu_parallel() {
    local begun makespan; begun=$(now)
    "$here/../parallel.sh" "$plan" "$work/a folder" 8 -j2 >>"$work/log" 2>&1 || fail "cluster/parallel.sh"
    makespan=$(since "$begun")
    same "$work/a folder" "GNU parallel, 8 shards, 2 at a time, $makespan s"
    awk -v makespan="$makespan" -v alone="$alone" -v load="$(cut -d' ' -f1-3 /proc/loadavg)" 'BEGIN {
        printf "ok: time on two cores over half the sum of 8 shards alone: %.1f s / (%.1f s / 2) = %.2f", makespan, alone, 2 * makespan / alone
        printf " (an idle machine: at most 1.15; load average %s)\n", load }'
}

# Whether a shard of the array has kept a point by now.
has_begun() {
    local id
    for id in $("$TAXEL" sweep "$plan" --list --shard "$1/8" | cut -d' ' -f1); do
        [ ! -f "$work/slurm/points/$id.json" ] || return 0
    done
    return 1
}

# Takes a task that runs, lets it keep a point, and ends it in this way: `scancel`, or `kill`, which is kill -9 of its program.
# Sets `stopped` to its index.
stop_a_task() {
    local id pid state
    until_true 30 '[ -n "$(squeue -h -r -j "$job" -t R -o %K)" ]' || fail "no task runs"
    # The youngest, so that it has work left.
    read -r stopped id < <(squeue -h -r -j "$job" -t R -S -S -o "%K %A")
    until_true 30 "has_begun $stopped" || fail "task $stopped keeps no point"
    if [ "$1" = scancel ]; then
        scancel "${job}_$stopped"
    else
        pid=$(scontrol listpids "$id" | awk '$1 ~ /^[0-9]+$/ { print $1; exit }')
        kill -9 "$pid"
    fi
    until_true 30 'state=$(state_of "$stopped"); [[ $state =~ ^(CANCELLED|FAILED)$ ]]' || fail "task $stopped is $state after $1"
}
state_of() { scontrol -o show job "${job}_$1" | grep -o ' JobState=[A-Z]*' | cut -d= -f2; }

slurm_array() {
    local begun job stopped canceled killed again; begun=$(now)
    start_slurm
    cd "$work"
    job=$(sbatch --parsable --array=1-8 "$here/../slurm.sh" "$plan" "$work/slurm")
    stop_a_task scancel; canceled=$stopped
    stop_a_task kill; killed=$stopped
    # Both ways back: the same task again, which would wait two minutes, and an array of the tasks that are wanted again.
    until_true 30 'scontrol requeue "${job}_$canceled" 2>>"$work/log"' || fail "task $canceled is not requeued"
    scontrol update JobId="${job}_$canceled" StartTime=now
    again=$(sbatch --parsable --array="$killed" --export=ALL,SHARDS=8 "$here/../slurm.sh" "$plan" "$work/slurm")
    until_true 120 '[ -z "$(squeue -h -j "$job,$again" -t PD,R,CG,CF -o %A)" ]' || fail "the array does not end"
    for stopped in "$canceled" "$killed"; do
        grep -q ', [1-9] there already' "sweep-$stopped.log" || fail "task $stopped began anew: $(tail -n 3 "sweep-$stopped.log")"
    done
    cd "$here"
    # A killed program may leave its temporary file, which is no result.
    find "$work/slurm/points" -type f ! -name '*.json' -delete
    same "$work/slurm" "Slurm array of 8 shards; task $canceled ended by scancel, $killed by kill -9, both came back; $(since "$begun") s"
}

bad_files() {
    local points=$work/bad/points files status=0
    cp -r "$work/reference" "$work/bad"
    mapfile -t files < <(cd "$points" && ls | head -n 5)
    truncate -s 500 "$points/${files[0]}"
    perl -pi -e 'substr($_, 400, 1) ^= "\x01"' "$points/${files[1]}"
    cp "$points/${files[4]}" "$points/${files[2]}"
    : >"$points/${files[3]}"
    "$TAXEL" sweep "$plan" --merge "$work/bad" -o "$work/bad.csv" >"$work/said" 2>&1 || status=$?
    [ $status = 2 ] || fail "merge of bad files: exit status $status"
    for file in "${files[@]:0:4}"; do grep -q "$file" "$work/said" || fail "the merge does not name $file"; done
    ! grep -q "${files[4]}" "$work/said" || fail "the merge names a good file"
    [ ! -e "$work/bad.csv" ] || fail "the merge wrote a table"
    say "a truncated, a corrupted, a foreign and an empty file are refused by name"
    sweep "$plan" -o "$work/bad" || fail "sweep over bad files"
    same "$work/bad" "the sweep replaces them"
}

changed_plan() {
    local changed=$work/changed.toml
    sed 's/^training.frames = .*/training.frames = 500/' "$plan" >"$changed"
    sweep "$changed" -o "$work/alone" || fail "changed plan"
    cp -r "$work/reference" "$work/both"
    sweep "$changed" -o "$work/both" || fail "changed plan into the same folder"
    [ "$(count "$work/both")" = 128 ] || fail "two plans in a folder: $(count "$work/both") files"
    for each in "$plan reference" "$changed alone"; do
        sweep "${each% *}" --merge "$work/both" -o "$work/both/merged.csv" || fail "merge of a folder of two plans"
        cmp "$work/${each##* }/results.csv" "$work/both/merged.csv" || fail "two plans in a folder: tables differ"
    done
    ! cmp -s "$work/reference/results.csv" "$work/alone/results.csv" || fail "the changed plan gives the same"
    say "a changed plan in the same folder uses none of the old files, and both merge as alone"
}

full_disk() {
    local points=$work/full/points how file status=0
    mkdir -p "$points"
    # Room for 8 files of a page beside 40 that are there.
    if mount -t tmpfs -o size=$((48 * 4))k tmpfs "$points" 2>>"$work/log"; then how=tmpfs; else how="ulimit -f"; fi
    find "$work/reference/points" -name '*.json' | head -n 40 | xargs cp -t "$points"
    ( [ "$how" = tmpfs ] || ulimit -f 0; exec "$TAXEL" sweep "$plan" -o "$work/full" >/dev/null 2>"$work/said" ) || status=$?
    [ $status != 0 ] || fail "full disk: exit status 0"
    [ "$(count "$work/full")" -lt 64 ] || fail "the disk was not full"
    for file in "$points"/*.json; do cmp "$file" "$work/reference/points/${file##*/}" || fail "full disk: $file is not whole"; done
    say "full disk ($how): exit status $status, and all $(count "$work/full") files are whole"
    [ "$how" != tmpfs ] || mount -o remount,size=1m "$points"
    sweep "$plan" -o "$work/full" || fail "sweep after space was made"
    same "$work/full" "after space was made it completes"
}

# Two shards at once in one folder, and both of them twice; the other points are there.
at_once() {
    local shard pids=() id
    cp -r "$work/reference" "$work/together"
    for shard in 1 2; do
        for id in $("$TAXEL" sweep "$plan" --list --shard "$shard/8" | cut -d' ' -f1); do rm "$work/together/points/$id.json"; done
    done
    for shard in 1 2 1 2; do sweep "$plan" --shard "$shard/8" -o "$work/together" & pids+=($!); done
    for id in "${pids[@]}"; do wait "$id" || fail "a shard beside others"; done
    same "$work/together" "two shards at once in one folder, each twice"
}

one_process
shards
gnu_parallel
slurm_array
bad_files
changed_plan
full_disk
at_once
echo "all is well, in $SECONDS s"
