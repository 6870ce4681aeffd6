#!/bin/bash
# A sweep as an array of Slurm: each task is a shard, and may be killed, requeued or started again at any time.
#
#   sbatch --array=1-8 cluster/slurm.sh PLAN FOLDER
#   sbatch --array=3,5 --export=ALL,SHARDS=8 cluster/slurm.sh PLAN FOLDER    (two of eight once more)
#
# FOLDER is shared by all machines. When all tasks have ended: taxel sweep PLAN --merge FOLDER
#SBATCH --job-name=taxel-sweep
#SBATCH --cpus-per-task=1
#SBATCH --mem-per-cpu=500M
#SBATCH --time=01:00:00
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH --output=sweep-%a.log
set -euo pipefail
plan=${1:?plan}
folder=${2:?folder}
export RAYON_NUM_THREADS=${SLURM_CPUS_PER_TASK:-1}
# `exec`, so that the signals of scancel and of a time limit reach the program itself.
exec "${TAXEL:-taxel}" sweep "$plan" --shards "${SHARDS:-$SLURM_ARRAY_TASK_COUNT}" -o "$folder"
