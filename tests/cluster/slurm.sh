#!/usr/bin/env bash
# A sweep on a real Slurm: two nodes on loopback, one of which is killed in the middle; the gathered bytes must be those of a local run.
# By hand: bash tests/cluster/slurm.sh [path of skiagraph]. Needs root, slurm-wlm and munge (Debian), which it installs where it can; where
# it cannot, it says SKIPPED and succeeds (with CI=true it fails). Everything runs in one temporary folder and on 127.0.0.1, without systemd,
# cgroups or a database; at most five minutes.
set -euo pipefail
cd "$(dirname "$0")/../.."
program=$(realpath "${1:-target/debug/skiagraph}")

skip() {
  echo "SKIPPED: tests/cluster/slurm.sh: $1" >&2
  if [ -n "${SKIAGRAPH_SKIPPED:-}" ]; then echo "tests/cluster/slurm.sh: $1" >> "$SKIAGRAPH_SKIPPED"; fi
  if [ "${CI:-}" = true ]; then exit 1; else exit 0; fi
}

[ "$(id -u)" = 0 ] || skip "starting a Slurm needs root"
export PATH="$PATH:/usr/sbin:/sbin"
if ! command -v slurmctld >/dev/null || ! command -v munged >/dev/null; then
  command -v apt-get >/dev/null || skip "no Slurm here, and no apt-get to install it"
  { timeout 240 apt-get update -qq && DEBIAN_FRONTEND=noninteractive timeout 240 apt-get install -y -qq slurm-wlm munge; } >/dev/null 2>&1 ||
    skip "slurm-wlm and munge cannot be installed"
fi
command -v slurmctld >/dev/null && command -v munged >/dev/null || skip "slurm-wlm and munge are not here"

room=$(mktemp -d -t skiagraph-slurm.XXXXXX)
chmod 755 "$room"
pids=()
finish() {
  code=$?
  timeout 10 scancel --user=root >/dev/null 2>&1 && sleep 1 || true
  # only what this script has started, by its number; nodes die with their process namespaces
  for pid in "${pids[@]:-}"; do
    [ -n "$pid" ] && { kill -KILL "$pid"; wait "$pid"; } 2>/dev/null || true
  done
  if [ "$code" != 0 ]; then
    for log in "$room"/*.log "$room"/sweep/log/*.txt; do
      [ -s "$log" ] && { echo "== $log"; tail -15 "$log"; } >&2
    done
  fi
  rm -rf "$room"
  exit "$code"
}
trap finish EXIT

# Munge: a key and a socket of our own
mkdir -p "$room/munge"
chmod 700 "$room/munge"
head -c 1024 /dev/urandom > "$room/munge/key"
chmod 400 "$room/munge/key"
munged --foreground --force --key-file="$room/munge/key" --socket="$room/munge/socket" --pid-file="$room/munge/pid" \
  --log-file="$room/munge/munged.log" --seed-file="$room/munge/seed" > "$room/munged.log" 2>&1 &
pids+=($!)
for _ in $(seq 50); do [ -S "$room/munge/socket" ] && break; sleep 0.1; done
[ -S "$room/munge/socket" ] || { echo "munged does not start" >&2; exit 1; }

port=$((20000 + RANDOM % 20000))
host=$(hostname)
cat > "$room/slurm.conf" <<CONF
ClusterName=skiagraph
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=$port
AuthType=auth/munge
AuthInfo=socket=$room/munge/socket,cred_expire=15
CommunicationParameters=NoInAddrAny
SlurmUser=root
SlurmdUser=root
StateSaveLocation=$room/state
SlurmdSpoolDir=$room/spool.%n
SlurmctldPidFile=$room/slurmctld.pid
SlurmdPidFile=$room/slurmd.%n.pid
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
mkdir -p "$room/state" "$room/spool.n1" "$room/spool.n2"
export SLURM_CONF="$room/slurm.conf"
slurmctld -D -c -f "$SLURM_CONF" > "$room/slurmctld.log" 2>&1 &
pids+=($!)
# a node that can be killed: in a process namespace of its own, all of which dies with its first process
unshare --pid --fork --kill-child --mount-proc true 2>/dev/null || skip "no process namespaces here (unshare)"
unshare --pid --fork --kill-child --mount-proc slurmd -D -N n1 -f "$SLURM_CONF" > "$room/slurmd.n1.log" 2>&1 &
node1=$!
pids+=("$node1")
unshare --pid --fork --kill-child --mount-proc slurmd -D -N n2 -f "$SLURM_CONF" > "$room/slurmd.n2.log" 2>&1 &
pids+=($!)
for _ in $(seq 100); do [ "$(sinfo -h -t idle -o %D 2>/dev/null)" = 2 ] && break; sleep 0.3; done
[ "$(sinfo -h -t idle -o %D)" = 2 ] || { echo "the nodes do not come up" >&2; sinfo >&2 || true; exit 1; }
echo "Slurm is up: $(sinfo --version), two nodes"

# 24 cells; the same sweep on this machine, undisturbed
cat > "$room/tiny.toml" <<'SCENARIO'
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
define=(sweep plan "$room/tiny.toml" particles=20,40,60 rig.ring.count=1,2 --seeds 4)
"$program" "${define[@]}" --out "$room/local"
"$program" sweep run "$room/local" -j 2 --quiet > /dev/null
"$program" "${define[@]}" --out "$room/sweep"

# a submission of nothing first, and one that Slurm refuses: its words are passed on
"$program" sweep submit "$room/sweep" --dry-run --shards 12 | grep -q 'SLURM_ARRAY_TASK_ID'
if "$program" sweep submit "$room/sweep" --shards 12 -- --partition=none 2> "$room/refused.txt"; then exit 1; fi
grep -q 'nvalid partition' "$room/refused.txt" || { cat "$room/refused.txt" >&2; exit 1; }

# twelve shards, more than one array of this cluster takes
"$program" sweep submit "$room/sweep" --shards 12
code=0
"$program" sweep submit "$room/sweep" --shards 12 2> "$room/twice.txt" || code=$?
[ "$code" = 75 ] && grep -q 'still queued or running' "$room/twice.txt" || { cat "$room/twice.txt" >&2; exit 1; }

# once some cells have results, node n1 dies with all that runs on it
for _ in $(seq 300); do
  [ "$(find "$room/sweep/results" -name '*.json' 2>/dev/null | wc -l)" -ge 4 ] && break
  sleep 0.2
done
on_node=""
for _ in $(seq 200); do
  on_node=$(squeue -h -t running --nodelist=n1 -o %i | tr "\n" " ")
  [ -n "$on_node" ] && break
  sleep 0.1
done
[ -n "$on_node" ] || { echo "nothing runs on node n1: nothing is tested" >&2; exit 1; }
done_before=$(find "$room/sweep/results" -name '[0-9a-f]*.json' | wc -l)
kill -KILL "$node1"
echo "killed node n1 with all its tasks after $done_before of 24 cells; on it: $on_node"

for _ in $(seq 600); do [ -f "$room/sweep/runs.csv" ] && break; sleep 0.4; done
[ -f "$room/sweep/runs.csv" ] || { echo "the closer has not gathered" >&2; squeue >&2; sinfo >&2; exit 1; }
for table in runs.csv runs.jsonl; do cmp "$room/local/$table" "$room/sweep/$table"; done
[ "$done_before" -lt 24 ] || { echo "all cells were done before the node died: nothing was tested" >&2; exit 1; }
echo "24 cells on two nodes, one of them killed: runs.csv and runs.jsonl are those of the local run (${SECONDS} s)"
