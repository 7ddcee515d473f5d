#!/usr/bin/env bash
# Sweeps on a real Slurm: two nodes on loopback. Two sweeps of an external program; then a sweep of a built-in tracker, during which
# one node is killed. The gathered files must equal those of local runs.
#
# Usage: bash tests/cluster/slurm.sh [path of skiagraph]. Needs root, slurm-wlm and munge (Debian), and installs them if it can; if it
# cannot, it prints SKIPPED and succeeds (with CI=true it fails). Everything runs in one temporary folder and on 127.0.0.1, without systemd,
# cgroups or a database, in at most five minutes.
set -euo pipefail
cd "$(dirname "$0")/../.."
program=$(realpath "${1:-target/debug/skiagraph}")

skip() {
  echo "SKIPPED: tests/cluster/slurm.sh: $1" >&2
  if [ -n "${SKIAGRAPH_SKIPPED:-}" ]; then echo "tests/cluster/slurm.sh: $1" >> "$SKIAGRAPH_SKIPPED"; fi
  if [ "${CI:-}" = true ]; then exit 1; else exit 0; fi
}

[ "$(id -u)" = 0 ] || skip "starting Slurm needs root"
export PATH="$PATH:/usr/sbin:/sbin"
if ! command -v slurmctld >/dev/null || ! command -v munged >/dev/null; then
  command -v apt-get >/dev/null || skip "Slurm is not installed, and there is no apt-get to install it"
  { timeout 240 apt-get update -qq && DEBIAN_FRONTEND=noninteractive timeout 240 apt-get install -y -qq slurm-wlm munge; } >/dev/null 2>&1 ||
    skip "slurm-wlm and munge cannot be installed"
fi
command -v slurmctld >/dev/null && command -v munged >/dev/null || skip "slurm-wlm and munge are not installed"

folder=$(mktemp -d -t skiagraph-slurm.XXXXXX)
chmod 755 "$folder"
pids=()
finish() {
  code=$?
  timeout 10 scancel --user=root >/dev/null 2>&1 && sleep 1 || true
  # only what this script has started, by process id; nodes die with their process namespaces
  for pid in "${pids[@]:-}"; do
    [ -n "$pid" ] && { kill -KILL "$pid"; wait "$pid"; } 2>/dev/null || true
  done
  if [ "$code" != 0 ]; then
    for log in "$folder"/*.log "$folder"/sweep/log/*.txt; do
      [ -s "$log" ] && { echo "== $log"; tail -15 "$log"; } >&2
    done
  fi
  rm -rf "$folder"
  exit "$code"
}
trap finish EXIT

# Munge: a private key and socket
mkdir -p "$folder/munge"
chmod 700 "$folder/munge"
head -c 1024 /dev/urandom > "$folder/munge/key"
chmod 400 "$folder/munge/key"
munged --foreground --force --key-file="$folder/munge/key" --socket="$folder/munge/socket" --pid-file="$folder/munge/pid" \
  --log-file="$folder/munge/munged.log" --seed-file="$folder/munge/seed" > "$folder/munged.log" 2>&1 &
pids+=($!)
for _ in $(seq 50); do [ -S "$folder/munge/socket" ] && break; sleep 0.1; done
[ -S "$folder/munge/socket" ] || { echo "munged did not start" >&2; exit 1; }

port=$((20000 + RANDOM % 20000))
host=$(hostname)
cat > "$folder/slurm.conf" <<CONF
ClusterName=skiagraph
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
AuthType=auth/munge
AuthInfo=socket=$folder/munge/socket,cred_expire=15
CommunicationParameters=NoInAddrAny
SlurmUser=root
SlurmdUser=root
StateSaveLocation=$folder/state
SlurmdSpoolDir=$folder/spool.%n
SlurmctldPidFile=$folder/slurmctld.pid
SlurmdPidFile=$folder/slurmd.%n.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
MpiDefault=none
ReturnToService=2
SlurmdTimeout=10
SlurmctldTimeout=10
SchedulerParameters=sched_interval=2
JobRequeue=1
MaxArraySize=9
NodeName=n1 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 1)) CPUs=1 State=UNKNOWN
NodeName=n2 NodeHostname=$host NodeAddr=127.0.0.1 Port=$((port + 2)) CPUs=1 State=UNKNOWN
PartitionName=all Nodes=n1,n2 Default=YES MaxTime=INFINITE State=UP
CONF
mkdir -p "$folder/state" "$folder/spool.n1" "$folder/spool.n2"
export SLURM_CONF="$folder/slurm.conf"
slurmctld -D -c -f "$SLURM_CONF" > "$folder/slurmctld.log" 2>&1 &
pids+=($!)
# each node runs in its own process namespace, so that killing its first process kills everything on it
unshare --pid --fork --kill-child --mount-proc true 2>/dev/null || skip "unshare cannot make process namespaces here"
unshare --pid --fork --kill-child --mount-proc slurmd -D -N n1 -f "$SLURM_CONF" > "$folder/slurmd.n1.log" 2>&1 &
node1=$!
pids+=("$node1")
unshare --pid --fork --kill-child --mount-proc slurmd -D -N n2 -f "$SLURM_CONF" > "$folder/slurmd.n2.log" 2>&1 &
pids+=($!)
for _ in $(seq 100); do [ "$(sinfo -h -t idle -o %D 2>/dev/null)" = 2 ] && break; sleep 0.3; done
[ "$(sinfo -h -t idle -o %D)" = 2 ] || { echo "the nodes did not come up" >&2; sinfo >&2 || true; exit 1; }
echo "Slurm is up: $(sinfo --version), two nodes"

# waits until the last job of a sweep has gathered the results, and compares them with those of the local run
same_as_local() {
  # the tables are written one after the other
  for _ in $(seq 300); do [ -f "$2/runs.csv" ] && [ -f "$2/runs.jsonl" ] && break; sleep 0.4; done
  [ -f "$2/runs.csv" ] || { echo "the last job of $2 has not gathered the results" >&2; squeue >&2; exit 1; }
  for table in runs.csv runs.jsonl; do cmp "$1/$table" "$2/$table"; done
}

# an external program that stands still, as far away as its setting says
cat > "$folder/moved.sh" <<'PROGRAM'
#!/bin/bash
read -r hello
echo '{"type":"ready","name":"moved"}'
while read -r told; do
  case $told in *'"type":"end"'*) exit ;; esac
  frame=${told#*'"frame":'}
  echo "{\"type\":\"pose\",\"frame\":${frame%%,*},\"markers\":{\"pelvis\":[0,0.$1,0.9],\"thorax\":[0,0.$1,1.4]}}"
done
PROGRAM
chmod +x "$folder/moved.sh"
cat > "$folder/clips.toml" <<'SWEEP'
schema = "skiagraph.sweep/1"
name = "clips"
base = "tiny.toml"
seeds = 2
draws = true
reports = true
[axes]
clip = [{ name = "walk", set = [] }, { name = "run", set = ["motion.clip=embedded:run"] }]
SWEEP

# submits a job array with a task for every part, and a last job that runs what is missing and writes the tables
submit() {
  local sweep=$1 parts=$2 array
  mkdir -p "$sweep/log"
  array=$(sbatch --parsable --array="1-$parts" --requeue --output="$sweep/log/%A_%a.txt" --open-mode=append --wrap "
    '$program' sweep run '$sweep' -j 1 --part \$SLURM_ARRAY_TASK_ID/$parts; code=\$?
    if [ \$code = 75 ]; then scontrol requeue \${SLURM_ARRAY_JOB_ID}_\$SLURM_ARRAY_TASK_ID; fi
    exit \$code")
  sbatch --parsable --dependency="afterany:$array" --output="$sweep/log/last_%j.txt" --wrap "'$program' sweep run '$sweep'" > /dev/null
}

# 24 cells; first the same sweep locally, undisturbed
cat > "$folder/tiny.toml" <<'SCENARIO'
schema = "skiagraph.scenario/1"
name = "tiny"
[motion]
clip = "embedded:walk"
last_frame = 25
[rig.ring]
radius_m = 3.5
size_px = [160, 120]
[tracker.annealed_particle_filter]
SCENARIO
define=(sweep plan "$folder/tiny.toml" particles=20,40,60 rig.ring.count=1,2 --seeds 4)
"$program" "${define[@]}" --out "$folder/local"
"$program" sweep run "$folder/local" -j 2 --quiet > /dev/null
"$program" "${define[@]}" --out "$folder/sweep"

# two sweeps of a program, on both nodes
exec=(--exec "$folder/moved.sh {far}")
program_sweep=(sweep plan "$folder/tiny.toml" "${exec[@]}" far=1,2,3 --seeds 4 --draws)
program_clips=(sweep plan "$folder/clips.toml" "${exec[@]}" far=2)
for kind in program_sweep program_clips; do
  declare -n define_kind=$kind
  "$program" "${define_kind[@]}" --out "$folder/$kind.local"
  "$program" sweep run "$folder/$kind.local" -j 2 --quiet > /dev/null
  "$program" "${define_kind[@]}" --out "$folder/$kind"
  submit "$folder/$kind" 4
done
for kind in program_sweep program_clips; do same_as_local "$folder/$kind.local" "$folder/$kind"; done
grep -qE ',(ok|diverged),' "$folder/program_sweep/runs.csv" || { head -3 "$folder/program_sweep/runs.csv" >&2; exit 1; }
for kind in program_clips program_clips.local; do "$program" report "$folder/$kind" > /dev/null; done
# the pages name their own folders, and the time that their cells took
plain() { sed 's/program_clips\.local/program_clips/g; /<dt>processor time</d' "$folder/$1/report.html"; }
cmp <(plain program_clips.local) <(plain program_clips)
echo "two sweeps of an external program: runs.csv, runs.jsonl and report.html equal those of the local runs (${SECONDS} s)"

submit "$folder/sweep" 8

# once some cells have results, kill node n1 with all its tasks
for _ in $(seq 300); do
  [ "$(find "$folder/sweep/results" -name '*.json' 2>/dev/null | wc -l)" -ge 4 ] && break
  sleep 0.2
done
on_node=""
for _ in $(seq 200); do
  on_node=$(squeue -h -t running --nodelist=n1 -o %i | tr "\n" " ")
  [ -n "$on_node" ] && break
  sleep 0.1
done
[ -n "$on_node" ] || { echo "nothing runs on node n1, so nothing is tested" >&2; exit 1; }
done_before=$(find "$folder/sweep/results" -name '[0-9a-f]*.json' | wc -l)
kill -KILL "$node1"
echo "killed node n1 with all its tasks after $done_before of 24 cells; on it: $on_node"

for _ in $(seq 600); do [ -f "$folder/sweep/runs.csv" ] && break; sleep 0.4; done
[ -f "$folder/sweep/runs.csv" ] || { echo "the last job has not written the tables" >&2; squeue >&2; sinfo >&2; exit 1; }
for table in runs.csv runs.jsonl; do cmp "$folder/local/$table" "$folder/sweep/$table"; done
[ "$done_before" -lt 24 ] || { echo "all cells were done before the node was killed, so nothing was tested" >&2; exit 1; }
echo "24 cells on two nodes, one of them killed: runs.csv and runs.jsonl equal those of the local run (${SECONDS} s)"
