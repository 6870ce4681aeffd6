#!/usr/bin/env bash
# Installs what is missing to build, test and emulate everything here, on a Debian machine with rustup.
set -euo pipefail
cd "$(dirname "$0")/.."
export PATH="${CARGO_HOME:-$HOME/.cargo}/bin:$PATH"

# The firmware's target, and the cores that `cargo xtask cores` builds for as well.
targets=(thumbv7em-none-eabihf thumbv6m-none-eabi thumbv7m-none-eabi thumbv8m.main-none-eabihf
    riscv32imac-unknown-none-elf wasm32-unknown-unknown)
debian_toolchain=(rustc-web cargo-web rust-web-src rust-web-clippy)

apt_install() {
    local as_root=()
    if [ "$(id -u)" -ne 0 ]; then as_root=(sudo -n); fi
    "${as_root[@]}" apt-get -qq update >/dev/null
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive \
        apt-get -qq install -y --no-install-recommends "$@" >/dev/null
}

command -v cc >/dev/null || apt_install gcc libc6-dev
rustc --version || rustup toolchain install stable --profile minimal --no-self-update
cargo fmt --version >/dev/null 2>&1 || rustup component add rustfmt
cargo clippy --version >/dev/null 2>&1 || rustup component add clippy
command -v qemu-system-arm >/dev/null || apt_install qemu-system-arm
# Compilers that `cargo xtask c` tries exported models with. The one for Cortex-M needs no C library here.
command -v g++ >/dev/null || apt_install g++
command -v clang >/dev/null || apt_install clang
command -v arm-none-eabi-gcc >/dev/null || apt_install gcc-arm-none-eabi

# The targets: whatever is there already, then rustup's, then Debian's packages.
missing=()
for target in "${targets[@]}"; do
    [ -d "$(rustc --print target-libdir --target "$target")" ] || missing+=("$target")
done
if [ "${#missing[@]}" -gt 0 ] &&
    ! dpkg --status "${debian_toolchain[@]}" >/dev/null 2>&1 &&
    ! timeout 300 rustup --quiet target add "${missing[@]}"; then
    apt_install "${debian_toolchain[@]}"
fi

# The oldest Rust that a device's crates promise, which `cargo xtask publish` tries if it is there.
oldest=$(sed -n 's/^rust-version = "\(.*\)"/\1/p' model-core/Cargo.toml)
rustup run "$oldest" rustc --version >/dev/null 2>&1 ||
    timeout 120 rustup --quiet toolchain install "$oldest" --profile minimal --no-self-update || true

# The emulated board: Python with Unicorn, in a folder of its own.
emulator=proof/board-emulator
command -v python3 >/dev/null && python3 -m venv --help >/dev/null 2>&1 && python3 -c 'import ensurepip' 2>/dev/null ||
    apt_install python3 python3-venv
[ -x "$emulator/.venv/bin/python" ] || python3 -m venv "$emulator/.venv"
"$emulator/.venv/bin/python" -m pip --quiet --disable-pip-version-check install --requirement "$emulator/requirements.txt"
