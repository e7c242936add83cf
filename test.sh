#!/usr/bin/env bash
# Checks everything: formatting, lints, documentation, tests in both build profiles (those of programs and files in one), and, as
# it is compiled for speed, the transports whose ranks are processes, for real: iceoryx2, Open MPI, MPICH, and a cluster of network
# namespaces; and results on another architecture, aarch64. Stops at the first failure. Takes about half an hour on two cores.
#
# Needs Rust. What else it needs it installs where it is root on Debian or Ubuntu, and packages of Python in target/python;
# elsewhere it leaves out what it cannot check, and the end says so.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

# Tests interrupt programs. What a shell starts in the background ignores that, and so would all that is started here.
if [[ -z ${ATOLL_SIGNALS:-} ]] && env --default-signal=INT true 2>/dev/null; then
    ATOLL_SIGNALS=heeded exec env --default-signal=HUP,INT,QUIT,TERM "$PWD/test.sh" "$@"
fi

# What runs beside others ends with them, and the last line names what failed.
doing=
ended() {
    local code=$?
    # shellcheck disable=SC2046
    kill $(jobs -p) 2>/dev/null || true
    ((code == 0)) || printf '\n==> failed with exit code %d after %d s: %s\n' "$code" "$SECONDS" "$doing"
}
trap ended EXIT

left_out=()
target="${CARGO_TARGET_DIR:-target}"

# Says what is done, does it, and says how long that took.
step() {
    local start=$SECONDS
    doing="$*"
    printf '\n==> %s\n' "$doing"
    "$@" || return
    printf '==> done in %d s\n' "$((SECONDS - start))"
}

# Notes that something is not checked, and why.
leave_out() {
    printf '\n==> left out: %s\n' "$1"
    left_out+=("$1")
}

# As step, for the part of Rust named first, which may not be installed.
step_with() {
    local part=$1
    shift
    if cargo "$part" --version >/dev/null 2>&1; then
        step "$@"
    else
        leave_out "cargo $part, which is not installed"
    fi
}

# As step, for a script that says by exit code 77 that what is named first cannot be checked here.
step_unless_77() {
    local what=$1 code=0
    shift
    step "$@" || code=$?
    if ((code == 77)); then
        leave_out "$what, as said above"
    elif ((code)); then
        exit "$code"
    fi
}

has() {
    command -v "$1" >/dev/null
}

has_libclang() {
    # Not libclang-cpp, which is another library.
    [[ -n ${LIBCLANG_PATH:-} ]] || compgen -G '/usr/lib/llvm-*/lib/libclang[.-][s0-9]*' >/dev/null ||
        ldconfig -p 2>/dev/null | grep -E 'libclang(-[0-9.]+)?\.so' >/dev/null
}

# A browser without a window, to open pages in. A test looks for the same ones.
has_browser() {
    local name
    for name in ${ATOLL_BROWSER:-chromium-headless-shell chromium chromium-browser google-chrome}; do
        if has "$name"; then
            ATOLL_BROWSER=$name
            export ATOLL_BROWSER
            return
        fi
    done
    return 1
}

# The packages of what is missing, installed if that can be done.
provide() {
    local missing=()
    has_libclang || missing+=(libclang-dev)
    has mpicc.openmpi || missing+=(libopenmpi-dev openmpi-bin)
    has mpicc.mpich || missing+=(libmpich-dev mpich)
    has ip || missing+=(iproute2)
    has_browser || missing+=(chromium-headless-shell)
    python3 -c 'import ensurepip' 2>/dev/null || missing+=(python3 python3-venv)
    ((${#missing[@]})) && [[ $(id -u) == 0 ]] && has apt-get || return 0
    export DEBIAN_FRONTEND=noninteractive
    step apt-get update -qq &&
        step apt-get install -y -qq --no-install-recommends "${missing[@]}" ||
        printf '==> %s cannot be installed\n' "${missing[*]}"
}

# A Python with what the examples in docs/recordings.md need, in an environment of its own, which is kept.
provide_python() {
    local folder="$target/python" requirements=tests/python-requirements.txt
    if ! cmp -s "$requirements" "$folder/python-requirements.txt" || ! "$folder/bin/python" -c 'import duckdb'; then
        python3 -m venv --clear "$folder" &&
            "$folder/bin/python" -m pip install --quiet --disable-pip-version-check --requirement "$requirements" &&
            cp "$requirements" "$folder" || return
    fi
}

await_python() {
    wait "$python_job"
}

# Started once others are compiled: many of their tests mostly wait, and it takes what they leave.
begin_aarch64() {
    nice tests/aarch64.sh >"$target/aarch64.log" 2>&1 &
    aarch64_job=$!
}

await_aarch64() {
    local code=0
    wait "$aarch64_job" || code=$?
    cat "$target/aarch64.log"
    return "$code"
}

# Where nobody will look into the programs, nothing is compiled into them for that: an eighth of the time.
if [[ -n ${CI:-} ]]; then
    export CARGO_PROFILE_DEV_DEBUG=none CARGO_PROFILE_RELEASE_DEBUG=none CARGO_INCREMENTAL=0
fi

provide
has_browser || leave_out 'the pages of atoll report and atoll view in a browser: no chromium-headless-shell'
# They come over the network, while others use the processors.
if [[ -z ${ATOLL_PYTHON:-} ]]; then
    provide_python &
    python_job=$!
fi
features=()
if has_libclang; then
    features+=(--features atoll-tests/iceoryx2)
    # By its own name, in case another MPI has the common one.
    if has mpicc.openmpi; then
        export MPICC=mpicc.openmpi
    fi
    if has "${MPICC:-mpicc}"; then
        features+=(--features atoll-tests/mpi)
    else
        leave_out 'transport mpi: no mpicc (libopenmpi-dev, openmpi-bin)'
    fi
else
    leave_out 'transports iceoryx2 and mpi: no libclang (libclang-dev)'
fi

step_with fmt cargo fmt --all --check
# Benchmarks have features of the same names.
step_with clippy cargo clippy --workspace --all-targets ${features[@]+"${features[@]}" "${features[@]/tests/benches}"} -- --deny warnings
if ((${#features[@]})); then
    step_with clippy cargo clippy --workspace -- --deny warnings
fi
step env RUSTDOCFLAGS='--deny warnings' cargo doc --workspace --no-deps ${features[@]+"${features[@]}"}
if [[ -n ${python_job:-} ]]; then
    if step await_python; then
        ATOLL_PYTHON=$(realpath "$target/python")/bin/python
        export ATOLL_PYTHON
    else
        leave_out 'the examples in Python: their packages cannot be had'
    fi
fi
# As it is compiled for speed, everything, with every transport; of the runner what its program does, and of the core what worlds do,
# as the next says: to compile its kernels once more, for its own tests, would take minutes.
optimized=(cargo test --release --workspace --exclude atoll --exclude atoll-core ${features[@]+"${features[@]}"})
for_speed=("${optimized[@]}" --lib --bins --tests)
step "${for_speed[@]}" --no-run
begin_aarch64
step "${for_speed[@]}"
# With assertions, and as Rust alone compiles it: each crate by itself, its documentation, and what calculates, with every choice
# that there is for that (golden). What programs do around that is the same in both profiles.
calculates=(borders collisions configs driven fast golden hostile library physics reported scenes shapes sleep snapshots strategies surfaces)
step cargo test --workspace --lib "${calculates[@]/#/--test=}"
step cargo test --workspace --doc

# What threads and processes share, in every order in which they may meet (tests/loom).
step env RUSTFLAGS='--cfg loom' CARGO_TARGET_DIR="$target/loom" cargo test --release -p atoll-loom

if [[ ${features[*]} == *mpi* ]]; then
    if has mpicc.mpich; then
        # The same again over MPICH, in a folder of its own, as two MPIs cannot share what is built upon them; the rest is copied.
        mpich="$target/mpich"
        if [[ ! -d $mpich ]]; then
            mkdir "$mpich" && cp -a "$target/release" "$mpich"
            # By this file tests know where they were compiled (https://bford.info/cachedir/).
            printf 'Signature: 8a477f597d28d172789f06886806bc55\n' >"$mpich/CACHEDIR.TAG"
            # It would not notice that it is for another library.
            cargo clean --quiet --release --package mpi-sys --target-dir "$mpich"
        fi
        # With the features of before, or more than what is upon MPI would be compiled anew.
        step env MPICC=mpicc.mpich CARGO_TARGET_DIR="$mpich" ATOLL_WAYS=mpi \
            "${optimized[@]}" --test mpi_conformance --test transports --test loss -- --skip iceoryx2
    else
        leave_out 'MPICH: no mpicc.mpich (libmpich-dev, mpich)'
    fi
fi
step_unless_77 aarch64 await_aarch64
if [[ ${features[*]} == *mpi* ]]; then
    # Alone, as it counts on an answer within seconds.
    step_unless_77 'the cluster' tests/cluster.sh "$target/release/atoll"
fi

printf '\nAll passed in %d s\n' "$SECONDS"
if ((${#left_out[@]})); then
    printf 'left out: %s\n' "${left_out[@]}"
fi
