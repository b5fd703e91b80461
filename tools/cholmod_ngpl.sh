#!/bin/bash
# cholmod_ngpl.sh OUT: CHOLMOD without its modules under the GPL (Supernodal, MatrixOps, Modify), from Debian's source, as
# OUT/libcholmod.so.3 (indices are int alone) with a link OUT/libcholmod.so, for binaries that are conveyed (OM_WITH_GPL=OFF, tools/wheel.sh). Core, Cholesky,
# Partition and Check are under the LGPL 2.1 or later; AMD, COLAMD, CAMD, CCOLAMD and METIS stay libraries of the system.
# The source lies beside the library: whoever conveys the library conveys or offers it, too; one that is there is used.
# Exit code 77: it cannot be fetched.
set -euo pipefail
mkdir -p "$1"
out=$(cd "$1" && pwd)
[ -e "$out/libcholmod.so" ] && exit 0
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
fetch() {  # by lists of its own: those of the machine need not have source packages
    codename=$(. /etc/os-release && echo "$VERSION_CODENAME")
    echo "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] http://deb.debian.org/debian $codename main" > "$tmp/list"
    mkdir -p "$tmp/lists/partial" "$tmp/cache/archives/partial"
    own=(-o "Dir::Etc::sourcelist=$tmp/list" -o Dir::Etc::sourceparts=- -o "Dir::State::lists=$tmp/lists" -o "Dir::Cache=$tmp/cache"
         -o APT::Sandbox::User=root)
    (cd "$tmp" && apt-get -q "${own[@]}" update && apt-get -q "${own[@]}" source --download-only --tar-only suitesparse) > "$tmp/log" 2>&1 ||
        { tail -n 3 "$tmp/log" >&2; echo "skip: cholmod_ngpl.sh: the source package suitesparse cannot be fetched"; exit 77; }
    cp "$tmp"/suitesparse_*.orig.tar.* "$out/"
}
compgen -G "$out/suitesparse_*.orig.tar.*" > /dev/null || fetch
tar -C "$tmp" -xf "$out"/suitesparse_*.orig.tar.*
src=$(echo "$tmp"/SuiteSparse-*/CHOLMOD)
rm -rf "$src"/{Supernodal,MatrixOps,Modify,GPU,Demo,Tcov,MATLAB,Valgrind}
flags=(-O3 -fPIC -DNGPL -DNDEBUG -DNPRINT -w -I"$src/Include" -I/usr/include/suitesparse)
for file in "$src"/{Core,Cholesky,Partition,Check}/cholmod_*.c; do
    name=$(basename "$file" .c)
    "${CC:-cc}" "${flags[@]}" -c "$file" -o "$tmp/$name.o"
done
"${CC:-cc}" -shared -Wl,-soname,libcholmod.so.3 -Wl,--as-needed -o "$out/libcholmod.so.3" "$tmp"/*.o \
    -lcamd -lccolamd -lcolamd -lamd -lsuitesparseconfig -lmetis -lm
ln -sf libcholmod.so.3 "$out/libcholmod.so"
echo "$out/libcholmod.so.3: $(stat -c %s "$out/libcholmod.so.3") bytes"
