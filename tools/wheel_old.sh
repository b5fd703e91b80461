#!/bin/bash
# wheel_old.sh: make build/old/root, a root of Debian 11 (glibc 2.31) with the libraries of packages.txt, from which tools/wheel.sh --old
# builds the wheel for older systems. Most are that Debian's packages; five go into its /usr/local, with their licences:
#
#   CHOLMOD      without its modules under the GPL, from the source of this machine's Debian (tools/cholmod_ngpl.sh)
#   HDF5         1.10.8 of this machine's Debian: that of Debian 11 has no H5Pset_file_locking; without curl, OpenSSL and szip
#   Cyclone DDS  0.10, which Debian 11 lacks, from the source of Debian 13
#   oneDNN       2.6, which Debian 11 lacks, as its makers put it on PyPI (onednn-cpu-gomp): it takes an hour to compile
#   Embree       3.13.5 of this machine's Debian, for triangles, SSE2, AVX and AVX2 alone: that of Debian 11 has 487 MB, and PyPI takes 100
#
# The sources' SHA-256 are those of Debian's signed index. What is there is not made again.
# Needs root (chroot), debootstrap and PyPI. Exit code 77, and the reason: one is missing.
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
old=$here/build/old
root=$old/root
skip() { tail -n 3 "$old/log" >&2; echo "skip: wheel_old.sh: $1"; exit 77; }
in_root() { chroot "$root" env -i PATH=/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin HOME=/tmp DEBIAN_FRONTEND=noninteractive "$@"; }

mkdir -p "$old"
: > "$old/log"
[ "$(id -u)" -eq 0 ] || skip "a root of another system needs root"
command -v debootstrap > /dev/null || skip "no debootstrap; install debootstrap"
libraries=$(sed 's/#.*//' "$here/packages.txt" "$here/tools/packages_wheel.txt" | tr -s ' \t' '\n' | grep -E '^(lib.*|zlib1g)-dev$' |
    grep -vE '^lib(dnnl|hdf5|cmocka|embree)-dev$' | tr '\n' ' ')
if [ "$(cat "$old/packages" 2> /dev/null)" != "$libraries" ]; then
    [ -e "$root/etc/debian_version" ] || debootstrap --variant=minbase bullseye "$root" http://deb.debian.org/debian > "$old/log" 2>&1 ||
        { rm -rf "$root"; skip "Debian 11 cannot be fetched"; }
    cp /etc/resolv.conf "$root/etc/"
    # shellcheck disable=SC2086
    { in_root apt-get -q update && in_root apt-get install -q -y --no-install-recommends gcc g++ libc6-dev xz-utils make cmake ninja-build pkg-config \
        gringo $libraries; } > "$old/log" 2>&1 || skip "the packages of Debian 11 cannot be fetched"
    # Links of update-alternatives are absolute: from outside they would lead to this machine's libraries.
    in_root find /usr/lib /usr/lib64 /usr/include "(" -name "*.so*" -o -name "*.h" ")" -lname "/*" -exec sh -c 'ln -srf "$(readlink -f "$1")" "$1"' sh {} ";"
    echo "$libraries" > "$old/packages"
fi

# source_of NAME SUITE: its source from Debian in the root's /tmp/NAME.
source_of() {
    local apt=$old/apt_$2 url file sum own
    mkdir -p "$apt/lists/partial" "$apt/archives/partial"
    : > "$apt/status"
    echo "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] http://deb.debian.org/debian $2 main" > "$apt/list"
    own=(-q -o "Dir::Etc::sourcelist=$apt/list" -o Dir::Etc::sourceparts=- -o "Dir::State::lists=$apt/lists"
         -o "Dir::State::status=$apt/status" -o "Dir::Cache=$apt" -o APT::Sandbox::User=root)
    { apt-get "${own[@]}" update && apt-get "${own[@]}" --print-uris source "$1"; } > "$old/log" 2>&1 || skip "no source of $1 in $2"
    read -r url file _ sum < <(grep "^'.*orig\.tar" "$old/log")
    [ -e "$old/$file" ] || curl -sfL -o "$old/$file" "${url//\'/}" || skip "$url cannot be fetched"
    echo "${sum#SHA256:}  $old/$file" | sha256sum --check --quiet || { rm "$old/$file"; skip "$file has another sum"; }
    rm -rf "$root/tmp/$1" && mkdir "$root/tmp/$1"
    tar -C "$root/tmp/$1" --strip-components=1 -xf "$old/$file"
}

# build NAME SUITE LICENCE OPTION...: by CMake, into the root's /usr/local.
build() {
    [ ! -e "$root/usr/local/licences/$1.txt" ] || return 0
    source_of "$1" "$2"
    # HDF5's check of long double (for Fortran) leaves this file elsewhere with newer CMake, and stops.
    mkdir "$root/tmp/$1/made" && echo "21;0;" > "$root/tmp/$1/made/pac_Cconftest.out"
    touch "$root/tmp/$1/readme.pdf"  # Embree installs it, and Debian's source lacks it
    in_root bash -ec 'cd "/tmp/$1" && cmake -S . -B made -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX=/usr/local \
        -DCMAKE_INSTALL_LIBDIR=lib -DBUILD_SHARED_LIBS=ON -DBUILD_TESTING=OFF "${@:2}" && cmake --build made -j '"${JOBS:-$(nproc)}"' && cmake --install made' \
        build "$1" "${@:4}" > "$old/log" 2>&1 || { tail -n 20 "$old/log" >&2; exit 1; }
    cp "$root/tmp/$1/$3" "$root/usr/local/licences/$1.txt"
    rm -rf "$root/tmp/$1"
}

mkdir -p "$root/usr/local/licences"
build hdf5 bookworm COPYING -DONLY_SHARED_LIBS=ON -DHDF5_BUILD_CPP_LIB=OFF -DHDF5_BUILD_HL_LIB=OFF -DHDF5_BUILD_TOOLS=OFF -DHDF5_BUILD_EXAMPLES=OFF \
    -DHDF5_ENABLE_Z_LIB_SUPPORT=ON -DHDF5_ENABLE_SZIP_SUPPORT=OFF
build cyclonedds trixie LICENSE -DENABLE_SHM=OFF -DENABLE_SSL=OFF -DENABLE_SECURITY=OFF -DBUILD_IDLC=OFF -DBUILD_DDSPERF=OFF -DBUILD_EXAMPLES=OFF
# Tasks of its own instead of TBB, and no ISPC. Packets of rays stay. AVX2 alone does not link: its trees of width eight are of AVX.
build embree bookworm LICENSE.txt -DEMBREE_MAX_ISA=NONE -DEMBREE_ISA_{SSE2,AVX,AVX2}=ON -DEMBREE_ISA_{SSE42,AVX512}=OFF \
    -DEMBREE_GEOMETRY_{QUAD,CURVE,SUBDIVISION,USER,INSTANCE,GRID,POINT}=OFF -DEMBREE_TASKING_SYSTEM=INTERNAL -DEMBREE_ISPC_SUPPORT=OFF -DEMBREE_TUTORIALS=OFF
if [ ! -e "$root/usr/local/licences/libcholmod3.txt" ]; then
    "$here/tools/cholmod_ngpl.sh" "$here/build/cholmod_ngpl" || exit $?  # fetches the source
    mkdir -p "$root/tmp/cholmod"
    cp "$here"/build/cholmod_ngpl/*.orig.tar.* "$here/tools/cholmod_ngpl.sh" "$root/tmp/cholmod/"
    in_root bash /tmp/cholmod/cholmod_ngpl.sh /tmp/cholmod > "$old/log" 2>&1 || { tail -n 20 "$old/log" >&2; exit 1; }
    cp -a "$root"/tmp/cholmod/libcholmod.so* "$root/usr/local/lib/"
    cp "$root/usr/share/doc/libcholmod3/copyright" "$root/usr/local/licences/libcholmod3.txt"
fi
if [ ! -e "$root/usr/local/licences/libdnnl2.txt" ]; then
    python3 -m pip download -q --disable-pip-version-check --no-deps -d "$old" onednn-cpu-gomp==2022.2.1 onednn-devel-cpu-gomp==2022.2.1 \
        > "$old/log" 2>&1 || skip "PyPI cannot be reached"
    for wheel in "$old"/onednn_*.whl; do python3 -m zipfile -e "$wheel" "$old/onednn"; done
    cp -r "$old"/onednn/*.data/data/include "$root/usr/local/"
    cp "$old"/onednn/onednn_cpu_gomp*.data/data/lib/libdnnl.so.2 "$root/usr/local/lib/"
    ln -sf libdnnl.so.2 "$root/usr/local/lib/libdnnl.so"
    cp "$old"/onednn/onednn_cpu_gomp*.data/data/share/doc/onednn/LICENSE "$root/usr/local/licences/libdnnl2.txt"
fi
# This machine's gcc would take its own libgomp.so, which calls glibc 2.34 (old_root.cmake).
ln -sf ../../lib/x86_64-linux-gnu/libgomp.so.1 "$root/usr/local/lib/libgomp.so"
in_root ldconfig
