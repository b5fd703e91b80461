#!/bin/bash
# arm64.sh [OPTION...]: build omentum for arm64 and run its quick tests in an emulator (qemu-user); options are those of
# tools/run_tests.py, as --name '^test_fem'. Without options: all quick tests. --set-up: only fetch the libraries.
#
#   build/arm64/root   libraries of packages.txt for arm64, of the Debian release of this machine: fetched by apt with lists of
#                      its own and unpacked there; neither root nor a foreign architecture of dpkg is needed
#   build/arm64/emulated/omentum   starts the program in the emulator
#
# The processor is emulated with all its extensions: sizes, signs, rounding and the kernels of libraries are those of arm64. The
# order in which threads see memory is that of the machine beneath. A test takes 10 to 40 times as long as on that machine.
# Left out: tests in Python, which need a Python for arm64, those of the installed tree and of tools.
# Exit code 77, and the reason: the emulator, the cross compiler, or Debian's packages are not in reach.
set -euo pipefail
cd "$(dirname "$0")/.."
out=$PWD/build/arm64
mkdir -p "$out"
skip() { echo "skip: arm64.sh: $1"; exit 77; }

[ "$(uname -m)" != aarch64 ] || skip "this machine is arm64: make check does it"
missing=$(sed 's/#.*//' tools/packages_arm64.txt | tr '\n' ' ')
command -v aarch64-linux-gnu-gcc > /dev/null || skip "no aarch64-linux-gnu-gcc; install $missing"
command -v qemu-aarch64-static > /dev/null || skip "no qemu-aarch64-static; install $missing"
command -v apt-get > /dev/null || skip "packages come by apt-get, which is not here"

# The libraries: every package of packages.txt that is a library for development, with all that it needs.
wanted=$(sed 's/#.*//' packages.txt tools/packages_wheel.txt | tr -s ' \t' '\n' | grep -E '^(lib.*|zlib1g|cyclonedds)-dev$' | tr '\n' ' ')
wanted+="libc6-dev gringo"
if [ "$(cat "$out/root.list" 2> /dev/null)" != "$wanted" ]; then
    apt=$out/apt
    rm -rf "$out/root" "$out/root.list"
    mkdir -p "$apt/lists/partial" "$apt/archives/partial" "$out/root"
    : > "$apt/status"
    codename=$(. /etc/os-release && echo "$VERSION_CODENAME")
    echo "deb [arch=arm64 signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] http://deb.debian.org/debian $codename main" > "$apt/list"
    own=(-q -y -o APT::Architecture=arm64 -o APT::Architectures::=arm64 -o "Dir::Etc::sourcelist=$apt/list" -o Dir::Etc::sourceparts=-
         -o "Dir::State::lists=$apt/lists" -o "Dir::State::status=$apt/status" -o "Dir::Cache=$apt" -o APT::Sandbox::User=root
         -o APT::Install-Recommends=0 -o DPkg::Post-Invoke::=true)
    # shellcheck disable=SC2086
    { apt-get "${own[@]}" update && apt-get "${own[@]}" --download-only install $wanted; } > "$out/apt.log" 2>&1 ||
        { tail -n 3 "$out/apt.log" >&2; skip "the packages of arm64 cannot be fetched from deb.debian.org"; }
    mkdir -p "$out/root/usr/lib" "$out/root/usr/bin" "$out/root/usr/sbin"
    ln -s usr/lib usr/bin usr/sbin "$out/root/"
    for package in "$apt"/archives/*.deb; do
        dpkg-deb --fsys-tarfile "$package" | tar -C "$out/root" --keep-directory-symlink -x --exclude='./usr/share/*'
    done
    # What packages choose at their installation; no path in a link leads out of the root.
    lib=$out/root/usr/lib/aarch64-linux-gnu
    ln -sf openblas-pthread/libopenblas.so.0 "$lib/libopenblas.so.0"
    ln -sf openblas-pthread/libopenblas.so "$lib/libopenblas.so"
    (cd "$out/root/usr/include/aarch64-linux-gnu" && ln -sf openblas-pthread/*.h .)
    ln -sf openblas-pthread/libblas.so.3 "$lib/libblas.so.3"
    ln -sf openblas-pthread/liblapack.so.3 "$lib/liblapack.so.3"
    find "$out/root" -type l -lname '/*' -printf '%p %l\n' | while read -r link target; do ln -sfr "$out/root$target" "$link"; done
    rm -rf "$apt"
    echo "$wanted" > "$out/root.list"
fi

[ "${1:-}" != --set-up ] || exit 0

if command -v ccache > /dev/null; then export CMAKE_C_COMPILER_LAUNCHER=${CMAKE_C_COMPILER_LAUNCHER-ccache}; fi
cmake --preset arm64 -G Ninja > "$out/configure.log" 2>&1 || { tail -n 30 "$out/configure.log" >&2; exit 1; }
[ $# -gt 0 ] || set -- --not-label 'slow|python|install' --name '^(?!tools_)'
mapfile -t need < <(python3 -B tools/run_tests.py "$out" --targets "$@")
cmake --build "$out" --target "${need[@]}" > "$out/build.log" 2>&1 || { grep -m 20 -A 5 'error\|FAILED' "$out/build.log" >&2 || tail -n 20 "$out/build.log" >&2; exit 1; }
! grep -A 4 'warning:' "$out/build.log" || exit 1
python3 -B tools/run_tests.py "$out" "$@"
