#!/bin/bash
# A sweep on HyperQueue's workers: each task is a shard of one core.
#
#   cluster/hyperqueue.sh PLAN FOLDER SHARDS
#
# FOLDER is shared by all workers, and so is the program: give TAXEL its whole path. A task whose worker was lost starts
# again by itself. One that failed does not: start all again, what is there is not computed twice. Then:
# taxel sweep PLAN --merge FOLDER
set -euo pipefail
plan=${1:?plan}
folder=${2:?folder}
shards=${3:?number of shards}
mkdir -p "$folder"
# What follows `--` is the program's: it has options of its own.
hq submit --wait --array "1-$shards" --cpus 1 --env RAYON_NUM_THREADS=1 --stdout none --stderr "$folder/%{TASK_ID}.log" -- \
    "${TAXEL:-taxel}" sweep "$plan" --shards "$shards" -o "$folder"
