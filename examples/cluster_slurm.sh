#!/bin/bash
# A parameter study on a cluster under SLURM: a job array whose first task runs the scheduler of Dask and the command,
# and whose other tasks run one worker for each core. Submit it from a folder that all nodes see: sbatch cluster_slurm.sh
# Partition, memory and numbers are chosen.
#SBATCH --array=0-8
#SBATCH --cpus-per-task=4
#SBATCH --mem-per-cpu=1G
#SBATCH --time=01:00:00
rm_scheduler_file() { rm -f scheduler.json; }
if [ "$SLURM_ARRAY_TASK_ID" = 0 ]; then
    dask scheduler --scheduler-file scheduler.json --no-dashboard &
    trap 'kill $!; rm_scheduler_file' EXIT
    airmuscle study study.toml --out study --cluster scheduler.json
else
    until [ -s scheduler.json ]; do sleep 1; done
    dask worker --scheduler-file scheduler.json --nworkers "$SLURM_CPUS_PER_TASK" --nthreads 1 --no-dashboard --death-timeout 60
fi
