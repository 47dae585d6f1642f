#!/usr/bin/env bash
#SBATCH --job-name=motorfit
#SBATCH --output=%x-%A-%a.log
#SBATCH --cpus-per-task=8
#SBATCH --time=04:00:00
#SBATCH --requeue
##SBATCH --gres=gpu:1
#
# Submits a study as an array job of SLURM, one shard per task, and a job that merges the results when all tasks have ended:
#
#   examples/slurm.sh STUDY.toml DIR SHARDS
#
# DIR and the recordings must be on a file system that every node sees. A task that is killed, preempted or out of time
# resumes when it is requeued; running the same command again submits the unfinished runs. For studies with device = "gpu"
# remove one # from the line with gres. MOTORFIT names the program if it is not on the path.
set -euo pipefail
motorfit=${MOTORFIT:-motorfit}

if [ -n "${SLURM_ARRAY_TASK_ID:-}" ]; then
    exec "$motorfit" sweep run "$MOTORFIT_SWEEP" --shard "$SLURM_ARRAY_TASK_ID/$MOTORFIT_SHARDS" \
        --threads "${SLURM_CPUS_PER_TASK:-1}" --no-progress
fi

if [ $# -ne 3 ]; then
    echo "usage: $0 STUDY.toml DIR SHARDS" >&2
    exit 2
fi
"$motorfit" sweep plan "$1" --out "$2"
MOTORFIT_SWEEP=$(realpath "$2")
MOTORFIT_SHARDS=$3
export MOTORFIT_SWEEP MOTORFIT_SHARDS
array=$(sbatch --parsable --export=ALL --array="1-$3" "$0")
merge=$(sbatch --parsable --export=ALL --job-name=motorfit-merge --output=%x-%j.log --dependency="afterany:${array%%;*}" \
    --wrap "$(printf '%q sweep merge %q --out %q' "$motorfit" "$MOTORFIT_SWEEP" "$MOTORFIT_SWEEP-report")")
echo "submitted: array job ${array%%;*} of $3 shards, then ${merge%%;*} merges into $2/results.jsonl and $2-report/report.html"
