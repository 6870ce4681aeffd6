# Slurm of one node on loopback, without systemd, for run.sh: all that it has is in the folder $work.

# Waits at most so many seconds until a command is true.
until_true() {
    local end=$((SECONDS + $1))
    until eval "$2"; do [ $SECONDS -lt $end ] || return 1; sleep 0.1; done
}

start_slurm() {
    local host port; host=$(hostname -s); port=$((20000 + RANDOM % 10000))
    mkdir -p "$work"/{state,spool}
    (umask 077; head -c 1024 /dev/urandom >"$work/key")
    cat >"$work/slurm.conf" <<CONF
ClusterName=sweep
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket=$work/munge.socket
SlurmctldPort=$port
SlurmdPort=$((port + 1))
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=sched_interval=1,batch_sched_delay=0,sched_min_interval=50000
SlurmdParameters=config_overrides
ReturnToService=2
MinJobAge=300
KillWait=5
NodeName=$host NodeAddr=127.0.0.1 CPUs=2 RealMemory=2000
PartitionName=all Nodes=ALL Default=YES State=UP
CONF
    export SLURM_CONF=$work/slurm.conf
    # --force: its socket lies below a folder that others may write, as /tmp is.
    munged --force --key-file="$work/key" --socket="$work/munge.socket" --pid-file="$work/munged.pid" \
        --log-file="$work/munged.log" --seed-file="$work/seed" >>"$work/log" 2>&1 || fail "munged does not start"
    slurmctld >>"$work/log" 2>&1 || fail "slurmctld does not start"
    slurmd -N "$host" >>"$work/log" 2>&1 || fail "slurmd does not start"
    until_true 30 "sinfo -h -o %t 2>/dev/null | grep -qx idle" || fail "Slurm's node is not idle: $(tail -n 3 "$work/slurmd.log")"
}

# Ends what start_slurm has started, as far as it came: tasks first, or they would outlive their daemons.
stop_slurm() {
    local name pid
    [ -f "$work/slurm.conf" ] || return 0
    if timeout 5 scancel --quiet --user root 2>/dev/null; then
        until_true 10 '[ -z "$(timeout 5 squeue -h -t R,CG)" ]'
    fi
    for name in slurmd slurmctld munged; do
        pid=$(cat "$work/$name.pid" 2>/dev/null) || continue
        kill "$pid" 2>/dev/null
        timeout 10 tail --pid="$pid" -f /dev/null || kill -9 "$pid"
    done
}
