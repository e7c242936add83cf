#!/usr/bin/env bash
# Checks everything: formatting, lints, documentation, and all tests in both build profiles. Stops at the first failure.
# Needs Rust and nothing else; where rustfmt or clippy is not installed, its check is left out, and the end says so.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")"

left_out=()

# Says what is done, does it, and says how long that took.
step() {
    local start=$SECONDS
    printf '\n==> %s\n' "$*"
    "$@"
    printf '==> done in %d s\n' "$((SECONDS - start))"
}

# As step, for the part of Rust named first, which may not be installed.
step_with() {
    local part=$1
    shift
    if cargo "$part" --version >/dev/null 2>&1; then
        step "$@"
    else
        printf '\n==> left out, cargo %s is not installed: %s\n' "$part" "$*"
        left_out+=("cargo $part")
    fi
}

step_with fmt cargo fmt --all --check
step_with clippy cargo clippy --workspace --all-targets -- --deny warnings
step env RUSTDOCFLAGS='--deny warnings' cargo doc --workspace --no-deps
# The program first: tests compare it with the one that has assertions.
step cargo build --release
step cargo test --workspace
# Documentation has had its tests; what is compiled for speed is tested again.
step cargo test --release --workspace --lib --bins --tests

printf '\nAll passed in %d s' "$SECONDS"
if ((${#left_out[@]})); then
    printf ', without'
    printf ' %s' "${left_out[@]}"
fi
printf '\n'
