#!/usr/bin/env bash
# A cluster on one machine: three hosts, each a network namespace with its own address and host name, joined by a switch
# in a fourth; Open MPI starts ranks on all of them and talks TCP between them. Checks that a run over the cluster has the
# hashes of a run in one process, and that a link which is cut ends it with exit code 3 and a line that names a rank.
#
#   tests/cluster.sh [ATOLL]     ATOLL: the program, built with the feature mpi against Open MPI; built here by default
#
# Needs root, ip (iproute2), unshare (util-linux) and Open MPI, and says so where one is missing (exit code 77).
# Nothing outside the namespaces is touched, and they are removed at the end, however it comes.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

hosts=(one two three)
tag=atoll$$ # of every name in the system, so that two of these can run side by side
net=10.90.0

# What mpirun calls in place of ssh: "agent [options] HOST COMMAND...". Enters the host's namespace and takes its name.
if [[ ${1:-} == agent ]]; then
    shift
    while [[ $1 == -* ]]; do shift; done
    host=$1
    shift
    exec ip netns exec "$CLUSTER_TAG-$host" unshare --uts sh -c "hostname $host && $*"
fi

skip() {
    printf 'skipped: the cluster test needs %s\n' "$1"
    exit 77
}
[[ $(id -u) == 0 ]] || skip root
command -v ip >/dev/null || skip 'ip, of the package iproute2'
command -v unshare >/dev/null || skip 'unshare, of the package util-linux'
mpirun=$(command -v mpirun.openmpi || command -v mpirun) || skip 'Open MPI, of the package openmpi-bin'
[[ $("$mpirun" --version 2>&1) =~ OpenRTE|open-mpi ]] || skip 'an mpirun of Open MPI, of the package openmpi-bin'

work=$(mktemp -d)
remove_hosts() {
    local name pids
    for name in "${hosts[@]/#/$tag-}" "$tag-switch"; do
        pids=$(ip netns pids "$name" 2>/dev/null || true)
        # shellcheck disable=SC2086
        [[ -z $pids ]] || kill -KILL $pids 2>/dev/null || true
        ip netns del "$name" 2>/dev/null || true
    done
}
cleanup() {
    remove_hosts
    rm -rf "$work"
}
trap cleanup EXIT

fail() {
    printf 'FAILED: %s\n' "$1" >&2
    [[ $# -lt 2 ]] || cat "$2" >&2
    exit 1
}

# The hosts and their cables; all ends are named in the switch, so that one can be taken out.
make_hosts() {
    local i host
    ip netns add "$tag-switch" 2>/dev/null || skip 'the right to make network namespaces'
    ip -n "$tag-switch" link add switch type bridge
    ip -n "$tag-switch" link set switch up
    for i in "${!hosts[@]}"; do
        host=${hosts[i]}
        ip netns add "$tag-$host"
        ip -n "$tag-switch" link add "to-$host" type veth peer name eth0 netns "$tag-$host"
        ip -n "$tag-switch" link set "to-$host" master switch up
        ip -n "$tag-$host" addr add "$net.$((i + 1))/24" dev eth0
        ip -n "$tag-$host" link set eth0 up
        ip -n "$tag-$host" link set lo up
        # How often a host sends again what is not acknowledged. By default it goes on for a quarter of an hour, and for so
        # long mpirun waits for a host that is cut off. Now it gives up after 12 seconds at the earliest, when the ranks
        # have long ended; an error of TCP that came first would end the run another way.
        ip netns exec "$tag-$host" sh -c 'echo 5 >/proc/sys/net/ipv4/tcp_retries2' || skip 'a /proc/sys that can be written'
    done
}

atoll=${1:-}
if [[ -z $atoll ]]; then
    cargo build --release --quiet --features mpi
    atoll=${CARGO_TARGET_DIR:-target}/release/atoll
fi
atoll=$(readlink -f "$atoll")

# Starts the program with four ranks on the three hosts, from the first of them.
on_the_cluster() {
    local list
    list=$(printf '%s:2,' "${hosts[@]}")
    CLUSTER_TAG=$tag ip netns exec "$tag-${hosts[0]}" unshare --uts sh -c 'hostname "$0" && exec "$@"' "${hosts[0]}" \
        env OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 "$mpirun" \
        --mca plm_rsh_agent "$(readlink -f "${BASH_SOURCE[0]}") agent" --mca plm_rsh_no_tree_spawn 1 \
        --mca oob_tcp_if_include "$net.0/24" --mca btl_tcp_if_include "$net.0/24" --mca btl tcp,self \
        --mca mpi_yield_when_idle 1 --map-by node --host "${list%,}" -n 4 "$atoll" run "$@" --transport mpi
}

hashes() {
    grep -oE '"(state|contact)_hash": "[0-9a-f]+"' "$1"
}

make_hosts
scene=(configs/quickstart.toml --steps 60 --tiles 5x5 --quiet)
"$atoll" run "${scene[@]}" --ranks 1 --json "$work/alone.json" >/dev/null
for exchange in alltoallv sparse; do
    on_the_cluster "${scene[@]}" --set mpi_exchange="$exchange" --json "$work/cluster.json" >"$work/said" 2>&1 ||
        fail "a run over the cluster ($exchange) ended with exit code $?" "$work/said"
    grep -q '"ranks": 4' "$work/cluster.json" || fail 'not four ranks' "$work/cluster.json"
    [[ $(hashes "$work/alone.json") == $(hashes "$work/cluster.json") ]] ||
        fail "the hashes over the cluster ($exchange) are not those of one process" "$work/cluster.json"
    printf 'ok: three hosts, four ranks, %s: the hashes of one process\n' "$exchange"
done

for exchange in alltoallv sparse; do
    # New hosts each time: one whose cable was put back may still take others for out of reach, which no launcher stands.
    remove_hosts
    make_hosts
    : >"$work/said" # now, and not when the run comes to it: it holds steps of the run before
    on_the_cluster configs/quickstart.toml --steps 4000000000 --tiles 5x5 --peer-timeout 5 --set mpi_exchange="$exchange" \
        >"$work/said" 2>&1 &
    run=$!
    for ((i = 0; i < 600; i++)); do
        grep -q '^step [0-9]' "$work/said" && break
        kill -0 "$run" 2>/dev/null || fail 'ended before its link was cut' "$work/said"
        sleep 0.1
    done
    grep -q '^step [0-9]' "$work/said" || fail 'no step within a minute' "$work/said"
    ip -n "$tag-switch" link set "to-${hosts[1]}" down
    cut=$SECONDS
    # Far longer than the timeout, and what TCP takes to give up.
    for ((i = 0; i < 900; i++)); do
        kill -0 "$run" 2>/dev/null || break
        sleep 0.1
    done
    ! kill -0 "$run" 2>/dev/null || fail "still running $((SECONDS - cut)) s after its link was cut" "$work/said"
    code=0
    wait "$run" || code=$?
    [[ $code == 3 ]] || fail "exit code $code after a link was cut, and not 3" "$work/said"
    line=$(grep -m 1 -E 'rank [0-9]+ was lost after [0-9]+ of 4000000000 steps: ' "$work/said") ||
        fail 'no line that names a lost rank' "$work/said"
    printf 'ok: a link cut (%s): exit code 3 after %d s: %s\n' "$exchange" $((SECONDS - cut)) "$line"
done
printf 'ok: the cluster test passed\n'
