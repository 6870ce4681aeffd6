#!/bin/bash
# A sweep by GNU parallel, here or on other machines over ssh: as many shards as are asked for, one a core.
#
#   cluster/parallel.sh PLAN FOLDER SHARDS [more options of parallel]
#   cluster/parallel.sh plan.toml /shared/out 64 --sshloginfile machines.txt --workdir .
#
# FOLDER is shared by all machines; without one, give --basefile PLAN --return FOLDER, or copy with rsync. A shard that fails
# is tried twice more. Then: taxel sweep PLAN --merge FOLDER
set -euo pipefail
plan=${1:?plan}
folder=${2:?folder}
shards=${3:?number of shards}
shift 3
# --quote, so that names with spaces reach the program as they are.
seq "$shards" | parallel --quote --retries 3 --halt soon,fail=1 "$@" \
    env RAYON_NUM_THREADS=1 "${TAXEL:-taxel}" sweep "$plan" --shard "{}/$shards" -o "$folder"
