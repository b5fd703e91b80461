#!/bin/bash
# tools/check.sh on a small tree of its own with a made-up cmake and small tests: it counts every test, continues after
# a failure, names what failed, holds the limit of time, and its exit code tells.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
mkdir -p "$tmp/bin" "$tmp/tree/tools" "$tmp/tree/src/base" "$tmp/tree/test/base"
cp "$root"/tools/{check.sh,list_c.sh,check_tree.py,run_tests.py,ctest_files.py,changed_rooms.py} "$tmp/tree/tools/"
cp "$root/.clang-format" "$tmp/tree/"
cd "$tmp/tree"
unset SINCE
echo 'set(OM_ROOMS base)' > CMakeLists.txt
fake() { printf '#!/bin/bash\n%s\n' "$2" > "$tmp/bin/$1"; chmod +x "$tmp/bin/$1"; }
fail() { echo "test_check: $1"; cat "$tmp/log"; exit 1; }
# add PRESET NAME LABELS COMMAND: a test of a build folder, written as CMake writes it for CTest.
add() {
    printf 'add_test([=[%s]=] "bash" "-c" "%s")\nset_tests_properties([=[%s]=] PROPERTIES  LABELS "%s" SKIP_RETURN_CODE "77")\n' \
        "$2" "$4" "$2" "$3" >> "build/$1/CTestTestfile.cmake"
}
good() {
    printf 'int a(void) { return 1; }\n' > src/base/base_a.c
    rm -rf build
    mkdir -p build/{release,dev,tsan,mpi,nogpl,arm64} build/release/bin
    printf '#!/bin/bash\nmkdir -p build/demo && echo demo > build/demo/report.html\n' > build/release/bin/omentum
    chmod +x build/release/bin/omentum
    printf '# none\n' > tools/slow_quick_tests.txt
    printf '#!/usr/bin/env python3\n' > tools/clang_syntax.py
    fake cmake 'exit 0'
    fake clang 'exit 0'
    fake mpiexec 'exit 0'
    fake mpicc 'exit 0'
    local preset
    for preset in release dev tsan mpi nogpl arm64; do
        add $preset test_base_a 'memory;room_base' 'echo cases=$OM_TEST_CASES'
        add $preset test_fem_b 'memory;room_fem' 'printf \"skip: no PyTorch\\n[  SKIPPED ] other\\n\"; test -z \"$OM_TEST_CASES\" || touch '"$PWD/build/memory"
        add $preset replay_c 'fuzz;parser' 'exit 77'
        add $preset test_nn_d 'room_nn' 'touch '"$PWD/build/nn-"'$PPID'
        add $preset test_slow 'slow;room_fem' "touch $PWD/build/slow"
    done
}
run() { PATH=$tmp/bin:$PATH tools/check.sh "$@" > "$tmp/log" 2>&1; }
last() { tail -n 1 "$tmp/log"; }
holds() { grep -q -- "$1" "$tmp/log" || fail "$2"; }

good
run || fail "a good tree fails"
# format, layers, two set-ups and builds, demo, clang; three tests in release; base whole and the memory of fem in dev
[ "$(last)" = "14 passed, 0 failed, 4 skipped" ] || fail "counts of a good tree: $(last)"
holds '^skipped: tests release: test_fem_b: other: no PyTorch$' "a skipped case is not named"
holds '^skipped: tests dev: replay_c$' "a skipped test is not named"
holds '^sanitizers: no commit that passed is known' "a clean checkout does not say what it leaves out"
holds 's  test_fem_b (memory)$' "the memory of a room is not tested under the sanitizers"
[ -e build/memory ] || fail "the memory cases are not selected"
[ ! -e build/slow ] || fail "a slow test runs"
[ "$(ls build/nn-* | wc -l)" = 1 ] || fail "a room that did not change runs whole under the sanitizers"
holds '^[0-9]* s of processor time in [0-9]* s$' "the processor time is not printed"

# The rooms that changed since a commit run whole, and those directly above them.
good
rm -rf .git
git init -q . && git -c user.name=a -c user.email=a add -A && git -c user.name=a -c user.email=a commit -qm a
mkdir -p src/nn include/omentum && printf '// a\n' > include/omentum/nn.h
touched() { python3 "$root/tools/changed_rooms.py" HEAD "$PWD"; }
[ "$(touched)" = $'touched: nn\nabove:' ] || fail "a new header touches its room: $(touched)"
printf '#include "omentum/nn.h"\n' > src/base/base_a.c
[ "$(touched)" = $'touched: base nn\nabove:' ] || fail "two rooms are touched: $(touched)"
git -c user.name=a -c user.email=a commit -qam b && printf '// b\n' > include/omentum/nn.h
[ "$(touched)" = $'touched: nn\nabove: base' ] || fail "a room that includes a touched one is above it: $(touched)"
rm -r include src/nn && printf 'int a(void) { return 1; }\n' > src/base/base_a.c && mkdir src/nn && printf 'int n(void) { return 1; }\n' > src/nn/nn_a.c
SINCE=HEAD run || true
holds '^sanitizers: since HEAD changed: base nn; directly above: nothing$' "what changed is not said"
[ "$(ls build/nn-* | wc -l)" = 2 ] || fail "a room that changed does not run whole under the sanitizers"
rm -rf src/nn .git

# One room.
good
run base || fail "one room fails"
[ "$(last)" = "8 passed, 0 failed, 0 skipped" ] || fail "counts of one room: $(last)"
! run nonsense || fail "a room that is not there passes"

# Whatever is bad is named, and does not end the check. Without Open MPI: a skip with a name. (PATH holds only what is needed.)
good
printf '#include "omentum/retract.h"\nint   a( void ){return 1;}\n' > src/base/base_a.c
fake cmake 'case "$*" in *--build*dev*) echo "a.c:1: warning: unused";; esac; exit 0'
add release test_x room_nn 'exit 1'
rm "$tmp/bin/mpiexec" "$tmp/bin/mpicc"
mkdir -p "$tmp/only"
for tool in bash env dirname git find xargs clang-format grep tail head mkdir rm cp cat nproc cut sort tr sed touch getconf; do
    ln -sf "$(command -v $tool)" "$tmp/only/$tool"
done
ln -sf "$(python3 -c 'import sys; print(sys.executable)')" "$tmp/only/python3"
! PATH=$tmp/bin:$tmp/only tools/check.sh > "$tmp/log" 2>&1 || fail "a bad tree passes"
[ "$(last)" = "9 passed, 4 failed, 3 skipped" ] || fail "counts of a bad tree: $(last)"
for name in format layers 'build dev' 'tests release: test_x: exit code 1'; do
    holds "^failed: $name" "bad is not named: $name"
done
holds '^skipped: two ranks over MPI: Open MPI is not installed$' "the skip of MPI is not named"

# A build that breaks, and a runner that says nothing.
good
fake cmake 'case "$*" in *--build*release*) exit 1;; esac; exit 0'
printf 'import sys\nsys.exit(0)\n' > tools/run_tests.py
printf '#!/bin/bash\nexit 0\n' > build/release/bin/omentum
! run || fail "a broken build passes"
holds '^failed: build release$' "the build is not named"
holds '^failed: demo$' "a demo without a report passes"
holds '^failed: tests dev: the results cannot be read$' "a runner without results passes"
cp "$root/tools/run_tests.py" tools/

# All of it: every quick test under the sanitizers, the slow tests, the thread sanitizer, benchmarks, MPI and mutants.
good
mkdir -p build/release/bin
printf '#!/bin/bash\nexit ${BENCH:-0}\n' > build/release/bin/omentum_bench
printf '#!/bin/bash\nexit ${PYTHON_BENCH:-0}\n' > tools/python_run.sh
chmod +x build/release/bin/omentum_bench tools/python_run.sh
printf 'mutants:\n\t@test "$(MUTANTS)" != live\n' > Makefile
printf '#!/bin/bash\nexit 0\n' > tools/arm64.sh
chmod +x tools/arm64.sh
run --all || fail "a good tree fails with --all"
[ -e build/slow ] || fail "the slow tests are left out"
[ "$(ls build/nn-* | wc -l)" = 5 ] || fail "a room is left out: $(ls build/nn-* | wc -l)"
for name in 'build tsan' 'every benchmark' 'build mpi' 'build arm64' mutants; do
    holds "^ok    $name" "$name is not checked"
done
printf 'mutants:\n\t@false\n' > Makefile
printf '#!/bin/bash\necho "skip: arm64.sh: no emulator"\nexit 77\n' > tools/arm64.sh
! BENCH=1 run --all || fail "a broken benchmark passes"
holds '^failed: every benchmark$' "the benchmark is not named"
holds '^failed: mutants$' "mutants that live pass"
holds '^skipped: build for arm64 in an emulator: no emulator$' "arm64 is left out without its reason"
printf '#!/bin/bash\nexit 1\n' > tools/arm64.sh
! run --all || fail "a broken set-up of arm64 passes"
holds '^failed: set-up of arm64$' "the set-up of arm64 is not named"
grep -q '^LIMIT=2$' tools/check.sh && grep -q -- '--limit $LIMIT --allowed tools/slow_quick_tests.txt' tools/check.sh || fail "quick tests have no limit of time"

# What a person types is what this script does.
grep -q 'tools/check.sh --all' "$root/Makefile" || fail "make check-all is not the whole check"
tail -n 1 "$root/.ci/run" | grep -qx 'make check' || fail ".ci/run does not end with make check"
echo "test_check: passed"
