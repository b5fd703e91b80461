#!/bin/bash
# test_install.sh BUILD_DIR CC: install into a folder made for it, then use what is there as a user would.
set -euo pipefail
here=$(cd "$(dirname "$0")" && pwd)
build=$1 cc=$2
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
fail() { echo "test_install: $1" >&2; exit 1; }

cmake --install "$build" --prefix "$tmp/first" > "$tmp/install.log" || fail "$(cat "$tmp/install.log")"
mv "$tmp/first" "$tmp/prefix"  # an installed tree can be moved
lib=$(dirname "$(find "$tmp/prefix" -name libomentum.so)")
[ -d "$lib" ] || fail "no libomentum.so"
! grep -rqF "$build" "$tmp/prefix" || fail "the build folder is named in $(grep -rlF "$build" "$tmp/prefix")"

# The library has a versioned name, and only om_ names leave it.
version=$(sed -n 's/^#define OM_VERSION "\(.*\)"/\1/p' "$tmp/prefix/include/omentum/base.h")
soname=libomentum.so.${version%.*}
readelf -d "$lib/libomentum.so" | grep -qF "SONAME" || fail "no SONAME"
readelf -d "$lib/libomentum.so" | grep -qF "[$soname]" || fail "the SONAME is not $soname"
[ "$(readlink -f "$lib/libomentum.so")" = "$lib/libomentum.so.$version" ] || fail "no libomentum.so.$version"
foreign=$(nm -D --defined-only "$lib/libomentum.so" | awk '{print $3}' | grep -v '^om_' || true)
[ -z "$foreign" ] || fail "exported besides om_*: $foreign"
private=$(nm -D --defined-only "$lib/libomentum.so" | awk '{print $3}' | grep '^om__' || true)
[ -z "$private" ] || fail "private names exported: $private"

# Every installed header compiles alone as C17, and all of them as C++, without any other include path.
for header in "$tmp"/prefix/include/omentum/*.h; do
    echo "#include \"omentum/$(basename "$header")\"" > "$tmp/alone.h"
    cat "$tmp/alone.h" >> "$tmp/all.h"
    $cc -x c -std=c17 -Wall -Werror -fsyntax-only -I "$tmp/prefix/include" "$tmp/alone.h" || fail "$(basename "$header") alone as C"
done
$cc -x c++ -std=c++17 -Wall -Werror -fsyntax-only -I "$tmp/prefix/include" "$tmp/all.h" || fail "the headers as C++"

# Man page and completion of shells.
grep -q '^\.SS omentum umesh predict$' "$tmp/prefix/share/man/man1/omentum.1" || fail "no man page"
for page in bash-completion/completions/omentum zsh/site-functions/_omentum fish/vendor_completions.d/omentum.fish; do
    grep -q -- '--tolerance\|-l tolerance' "$tmp/prefix/share/$page" || fail "no share/$page"
done

# By pkg-config.
export PKG_CONFIG_PATH=$lib/pkgconfig
mkdir "$tmp/one" "$tmp/two"
# shellcheck disable=SC2046
$cc -std=c17 -Wall -Werror "$here/consumer/consumer.c" -o "$tmp/one/consumer" \
    $(pkg-config --cflags --libs omentum) "-Wl,-rpath,$lib"
(cd "$tmp/one" && ./consumer && grep -q '^mean 0\.' mean.txt) || fail "the program built by pkg-config"

# Samples are what users copy: each links by pkg-config, one also with --static, and no library is named besides.
mkdir "$tmp/samples"
link() {
    # shellcheck disable=SC2046,SC2086
    $cc "$here/../../samples/$1.c" -o "$tmp/samples/$1" $(pkg-config $2 --cflags --libs omentum) "-Wl,-rpath,$lib" ||
        fail "samples/$1.c by pkg-config $2"
}
for sample in "$here"/../../samples/*.c; do
    link "$(basename "$sample" .c)" ""
done
link 01_hang_a_box --static
(cd "$tmp/samples" && ./01_hang_a_box > 01.log) || fail "samples/01_hang_a_box.c does not run"

# By CMake, a sample too.
cmake -S "$here/consumer" -B "$tmp/two/build" -DCMAKE_PREFIX_PATH="$tmp/prefix" -DCMAKE_C_COMPILER="$cc" \
    -DSAMPLES="$here/../../samples" \
    > "$tmp/cmake.log" 2>&1 && cmake --build "$tmp/two/build" >> "$tmp/cmake.log" 2>&1 ||
    fail "$(cat "$tmp/cmake.log")"
(cd "$tmp/two" && build/consumer && build/01_hang_a_box > 01.log) || fail "the program built by CMake"

# The program, from its new place, with nothing of the checkout in reach.
cli=$tmp/prefix/bin/omentum
if [ -x "$build/bin/omentum" ]; then
    cd "$tmp"
    env -i PATH=/usr/bin:/bin "$cli" --version | grep -xF "omentum $version" > /dev/null || fail "omentum --version"
    [ "$(PKG_CONFIG_PATH=$lib/pkgconfig pkg-config --modversion omentum)" = "$version" ] || fail "version of the pkg-config file"
    env -i PATH=/usr/bin:/bin "$cli" --help | grep -q retract || fail "omentum --help"
    ! env -i PATH=/usr/bin:/bin "$cli" nonsense 2> "$tmp/err" || fail "an unknown verb succeeded"
    [ -s "$tmp/err" ] || fail "an unknown verb without a word"
fi
echo "test_install: passed"
