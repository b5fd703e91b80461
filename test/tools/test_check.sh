#!/bin/bash
# tools/check.sh on a small tree of its own with a made-up cmake and ctest: it counts every test, goes on after
# a failure, names what failed, and its exit code tells.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
mkdir -p "$tmp/bin" "$tmp/tree/tools" "$tmp/tree/src/base"
cp "$root"/tools/{check.sh,list_c.sh,check_tree.py} "$tmp/tree/tools/"
cp "$root/.clang-format" "$tmp/tree/"
cd "$tmp/tree"
echo 'set(OM_ROOMS base)' > CMakeLists.txt
fake() { printf '#!/bin/bash\n%s\n' "$2" > "$tmp/bin/$1"; chmod +x "$tmp/bin/$1"; }
fail() { echo "test_check: $1"; cat "$tmp/log"; exit 1; }
good() {
    printf 'int a(void) { return 1; }\n' > src/base/base_a.c
    mkdir -p build/release build/dev
    fake cmake 'exit 0'
    fake clang 'exit 0'
    fake mpiexec 'exit 0'
    fake mpicc 'exit 0'
    fake ctest 'while [ "$1" != --output-junit ]; do [ $# -gt 0 ] || exit 0; shift; done
echo "<testsuite tests=\"5\" failures=\"0\" disabled=\"0\" skipped=\"2\">" > "$2"'
}
run() { PATH=$tmp/bin:$PATH tools/check.sh > "$tmp/log" 2>&1; }
last() { tail -n 1 "$tmp/log"; }

good
run || fail "a good tree fails"
[ "$(last)" = "12 passed, 0 failed, 4 skipped" ] || fail "counts of a good tree: $(last)"

good
printf 'int   a( void ){return 1;}\n' > src/base/base_a.c
! run || fail "bad format passes"
grep -q '^failed: format$' "$tmp/log" || fail "bad format is not named"
[ "$(last)" = "11 passed, 1 failed, 4 skipped" ] || fail "counts with bad format: $(last)"

good
printf '#include "omentum/defras.h"\n' > src/base/base_a.c
! run || fail "an arrow that runs up passes"
grep -q '^failed: layers' "$tmp/log" || fail "the arrow is not named"

good
fake cmake 'echo "a.c:1: warning: unused"; exit 0'
! run || fail "a warning passes"
grep -q '^failed: build release$' "$tmp/log" || fail "the build is not named"
[ "$(last)" = "3 passed, 3 failed, 0 skipped" ] || fail "counts with warnings: $(last)"

good
fake cmake 'exit 1'
! run || fail "a broken build passes"

good
fake ctest 'while [ "$1" != --output-junit ]; do [ $# -gt 0 ] || exit 0; shift; done
printf "%s\n" "<testsuite tests=\"5\" failures=\"1\" disabled=\"0\" skipped=\"0\">" "<testcase name=\"test_x\">" \
    "<failure message=\"\"/>" > "$2"; exit 8'
! run || fail "a failing test passes"
grep -q '^failed: tests release: test_x$' "$tmp/log" || fail "the test is not named"
[ "$(last)" = "14 passed, 2 failed, 0 skipped" ] || fail "counts with a failing test: $(last)"

good
fake ctest 'exit 0'
! run || fail "a ctest without results passes"
echo "test_check: passed"
