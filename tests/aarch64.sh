#!/usr/bin/env bash
# Another architecture: the golden results (tests/golden.txt), which every machine must get, computed for aarch64 under
# qemu. Takes two minutes to build on two cores, and half a minute to run.
#
#   tests/aarch64.sh
#
# Needs a cross compiler of C for its linker, qemu, and a Rust that has the standard library of aarch64, and installs what
# is missing where it is root on Debian; elsewhere it says what that is (exit code 77). What it builds is kept in
# target/aarch64. On a machine of this architecture there is nothing to emulate.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

target=aarch64-unknown-linux-gnu
libraries=/usr/aarch64-linux-gnu # of C, to run with
folder=${CARGO_TARGET_DIR:-target}/aarch64
mkdir -p "$folder"
folder=$(realpath "$folder")

skip() {
    printf 'skipped: the golden results on aarch64 need %s\n' "$1"
    exit 77
}

has() {
    command -v "$1" >/dev/null
}

may_install() {
    [[ $(id -u) == 0 ]] && has apt-get
}

# Installs packages, and removes none that are in their way.
install() {
    may_install || return
    printf 'installing %s\n' "$*"
    export DEBIAN_FRONTEND=noninteractive
    apt-get update -qq && apt-get install -y -qq --no-install-recommends --no-remove "$@" >/dev/null
}

# Whether a compiler, called with some options, has the standard library of the target.
has_target() {
    local library
    library=$("$@" --target "$target" --print target-libdir 2>/dev/null) && compgen -G "$library/libstd-*.rlib" >/dev/null
}

provide_linker_and_qemu() {
    local missing=()
    has aarch64-linux-gnu-gcc || missing+=(gcc-aarch64-linux-gnu)
    [[ -e $libraries/lib/crt1.o ]] || missing+=(libc6-dev-arm64-cross)
    has qemu-aarch64-static || has qemu-aarch64 || missing+=(qemu-user-static)
    ((${#missing[@]} == 0)) || install "${missing[@]}" || skip "${missing[*]}"
    qemu=$(command -v qemu-aarch64-static || command -v qemu-aarch64) || skip 'qemu for programs of aarch64'
}

# Debian's compiler, and its library for the target, unpacked where only we look for it: as another architecture is not
# known to this machine, it is asked for with lists of packages of its own.
provide_rust_of_debian() {
    rustc=/usr/bin/rustc
    [[ -x $rustc ]] || install rustc-web || return
    local sysroot=$folder/sysroot package version lists=$folder/lists
    flags="--sysroot $sysroot"
    package=$(dpkg-query --search "$rustc" | cut -d : -f 1) || return
    version=$(dpkg-query --show --showformat '${Version}' "$package") || return
    [[ $(cat "$sysroot/version" 2>/dev/null) == "$version" ]] && has_target "$rustc" --sysroot "$sysroot" && return
    printf 'unpacking the library of %s %s for %s\n' "$package" "$version" "$target"
    rm -rf "$sysroot" "$lists"
    mkdir -p "$sysroot/lib/rustlib" "$lists/partial"
    local asking=(-qq -o APT::Architectures::=amd64 -o APT::Architectures::=arm64 -o "Dir::State::Lists=$lists"
        -o Dir::Cache::pkgcache= -o Dir::Cache::srcpkgcache= -o APT::Sandbox::User=root)
    apt-get "${asking[@]}" update &&
        (cd "$lists" && apt-get "${asking[@]}" download "libstd-${package/rustc/rust}-dev:arm64=$version") &&
        dpkg-deb --extract "$lists"/libstd-*.deb "$lists/unpacked" || return
    mv "$lists/unpacked/usr/lib/rustlib/$target" "$sysroot/lib/rustlib" &&
        ln -s /usr/lib/rustlib/x86_64-unknown-linux-gnu "$sysroot/lib/rustlib" &&
        printf '%s\n' "$version" >"$sysroot/version" &&
        rm -rf "$lists"
}

# Sets `rustc`, and its `flags`.
provide_rust() {
    rustc=${RUSTC:-rustc}
    flags=
    has_target "$rustc" && return
    may_install || skip "the library of $target: rustup target add $target"
    has rustup && rustup target add "$target" && has_target "$rustc" && return
    provide_rust_of_debian && has_target "$rustc" --sysroot "$folder/sysroot" || skip "the library of $target"
    local needed have
    needed=$(sed -n 's/^rust-version = "\(.*\)"/\1/p' Cargo.toml)
    have=$("$rustc" --version | cut -d ' ' -f 2)
    printf '%s\n' "$needed" "$have" | sort --version-sort --check=quiet || skip "Rust $needed; Debian has $have"
}

if [[ $(uname -m) == aarch64 ]]; then
    printf 'ok: this machine is one, and its golden results are those of cargo test\n'
    exit
fi
[[ $(uname -sm) == 'Linux x86_64' ]] || skip 'Linux on x86-64'
provide_linker_and_qemu
provide_rust
printf '%s, %s\n' "$("$rustc" --version)" "$("$qemu" --version | head -n 1)"
# Flags that the environment has are for the machine itself.
env -u RUSTFLAGS -u CARGO_ENCODED_RUSTFLAGS \
    RUSTC="$rustc" CARGO_TARGET_DIR="$folder" \
    CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUSTFLAGS="$flags" \
    CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc \
    CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER="$qemu -L $libraries" \
    cargo test --release --target "$target" -p atoll-tests --test golden
printf 'ok: the golden results on aarch64\n'
