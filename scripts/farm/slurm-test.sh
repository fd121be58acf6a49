#!/bin/bash
# Runs scripts/farm/flipfree.slurm on a real slurmctld and slurmd of this machine, kills shares in the middle, and compares the results
# with those of a run without a farm. Wants the system's packages slurmctld, slurmd, slurm-client and munge, and root.
#
#   scripts/farm/slurm-test.sh MODELS [FOLDER]      a folder of models; FOLDER for all that is written (a temporary one)
set -euo pipefail
cd "$(dirname "$0")/../.."
models=$(realpath "${1:?usage: slurm-test.sh MODELS [FOLDER]}")
work=$(realpath -m "${2:-$(mktemp -d)}")
root=$PWD
python=$root/build/venv/bin/python
export PYTHONPATH=$root/build/python FLIPFREE="$python -m flipfree"
shares=4

mkdir -p "$work"
cd "$work"
rm -rf uv whole results ./*.jsonl state spool munge logs
mkdir state spool munge logs
pids=()
trap 'kill "${pids[@]}" 2>/dev/null || true' EXIT

# -- a cluster of one node, with keys and sockets of its own
head -c 1024 /dev/urandom > munge/key
chmod 400 munge/key
chmod 755 "$work" munge
munged -F --force --key-file="$work/munge/key" --socket="$work/munge/socket" --pid-file="$work/munge/pid" \
  --log-file="$work/munge/log" --seed-file="$work/munge/seed" > logs/munged 2>&1 &
pids+=($!)
host=$(hostname -s)
cat > slurm.conf <<EOF
ClusterName=test
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket
CredType=cred/munge
SlurmctldPort=16817
SlurmdPort=16818
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
ProctrackType=proctrack/pgid
TaskPlugin=task/none
SchedulerType=sched/builtin
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
JobCompType=jobcomp/none
MpiDefault=none
ReturnToService=2
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 State=UNKNOWN
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
EOF
export SLURM_CONF=$work/slurm.conf
slurmctld -D > logs/slurmctld 2>&1 &
pids+=($!)
slurmd -D > logs/slurmd 2>&1 &
pids+=($!)
for _ in $(seq 60); do
  [ "$(sinfo -h -o %T 2>/dev/null)" = idle ] && break
  sleep 1
done
sinfo

# -- the batch, without and with a farm
batch=(unwrap "$models" --suffix .obj --timeout 120)
$FLIPFREE "${batch[@]}" --out whole --json whole.jsonl --jobs 2 --quiet
echo "\$ sbatch --array=1-$shares flipfree.slurm $shares results unwrap models --out uv --suffix .obj --timeout 120"
sbatch --array=1-$shares -o "logs/share-%a" "$root/scripts/farm/flipfree.slurm" $shares results "${batch[@]}" --out uv

# Two shares are killed in the middle, with the children that solve; Slurm is told to requeue a third one.
lines() { cat results/*.jsonl 2>/dev/null | wc -l; }
killed=0
for _ in $(seq 1200); do
  if [ "$killed" -lt 2 ] && [ "$(lines)" -gt $((15 * (killed + 1))) ]; then
    victim=$(pgrep -f -- '--json results/' | head -1 || true)
    if [ -n "$victim" ]; then
      echo "\$ kill -9 $victim   # $(lines) models are done"
      kill -9 "$victim"
      killed=$((killed + 1))
      sleep 1
      squeue
    fi
  elif [ "$killed" = 2 ] && [ "$(lines)" -gt 45 ]; then
    running=$(squeue -h -t R -r -o %i | head -1)
    if [ -n "$running" ]; then
      echo "\$ scontrol requeue $running   # $(lines) models are done"
      scontrol requeue "$running"
      killed=3
    fi
  fi
  # What is requeued waits for two minutes, unless told not to.
  for job in $(squeue -h -t PD -r -o %i); do scontrol update jobid="$job" starttime=now 2> /dev/null || true; done
  [ -n "$(squeue -h)" ] || break
  sleep 0.2
done
cat logs/share-* | grep "queued again" || true

"$python" - "$killed" <<'EOF'
import json, pathlib, sys

def steady(paths):
    lines = [json.loads(line) for path in paths for line in path.read_text().splitlines()]
    for line in lines:
        line.pop("seconds"), line.pop("peak_memory", None)
        line["output"] = line["output"].replace("whole/", "uv/")
    return sorted(lines, key=lambda line: line["input"])

whole = steady([pathlib.Path("whole.jsonl")])
shares = steady(sorted(pathlib.Path("results").glob("*.jsonl")))
files = {p.relative_to("uv"): p.read_bytes() for p in pathlib.Path("uv").rglob("*") if p.is_file()}
alone = {p.relative_to("whole"): p.read_bytes() for p in pathlib.Path("whole").rglob("*") if p.is_file()}
same = whole == shares and files == alone
print(f"{len(shares)} results of the farm, {len(whole)} without; {len(files)} maps; the same: {same}; interrupted {sys.argv[1]} times")
sys.exit(0 if same and sys.argv[1] == "3" else 1)
EOF
