#!/bin/bash
# tools/check.sh on a small tree of its own with a made-up cmake and ctest: it counts every test, goes on after
# a failure, names what failed, and its exit code tells.
set -euo pipefail
root=$(cd "$(dirname "$0")/../.." && pwd)
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
mkdir -p "$tmp/bin" "$tmp/tree/tools" "$tmp/tree/src/base"
cp "$root"/tools/{check.sh,list_c.sh,check_tree.py,test_results.py} "$tmp/tree/tools/"
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
    results 0 "$(ran a "")" "$(ran b "$partly")" "$(ran c "")" "$gone"
}
# Results of ctest as it writes them: a test that ran with its output, one skipped as a whole, one that failed, one
# without its program.
ran() { echo "<testcase name=\"test_$1\" status=\"run\"><system-out>$2</system-out></testcase>"; }
partly='[ RUN      ] other
skip: PyTorch is not importable
[  SKIPPED ] other
[  SKIPPED ] 1 test(s), listed below:
[  SKIPPED ] other'
gone='<testcase name="test_gone" status="notrun"><skipped message="SKIP_RETURN_CODE=77"/><system-out/></testcase>'
bad='<testcase name="test_x" status="fail"><failure message=""/></testcase>'
lost='<testcase name="test_lost" status="notrun"><skipped message="Unable to find executable"/></testcase>'
# results CODE TESTCASE...: a ctest that writes these and ends with the code.
results() {
    local code=$1
    shift
    { echo "<testsuite>"; printf '%s\n' "$@"; echo "</testsuite>"; } > "$tmp/results.xml"
    fake ctest 'while [ "$1" != --output-junit ]; do [ $# -gt 0 ] || exit 0; shift; done
cp '"$tmp/results.xml"' "$2"; exit '"$code"
}
run() { PATH=$tmp/bin:$PATH tools/check.sh "$@" > "$tmp/log" 2>&1; }
last() { tail -n 1 "$tmp/log"; }

good
run || fail "a good tree fails"
[ "$(last)" = "11 passed, 0 failed, 4 skipped" ] || fail "counts of a good tree: $(last)"
grep -q '^skipped: tests release: test_b: other: PyTorch is not importable$' "$tmp/log" || fail "a skipped case is not named"
grep -q '^skipped: tests dev: test_gone$' "$tmp/log" || fail "a skipped test is not named"

good
printf 'int   a( void ){return 1;}\n' > src/base/base_a.c
! run || fail "bad format passes"
grep -q '^failed: format$' "$tmp/log" || fail "bad format is not named"
[ "$(last)" = "10 passed, 1 failed, 4 skipped" ] || fail "counts with bad format: $(last)"

good
printf '#include "omentum/defras.h"\n' > src/base/base_a.c
! run || fail "an arrow that runs up passes"
grep -q '^failed: layers' "$tmp/log" || fail "the arrow is not named"

good
fake cmake 'echo "a.c:1: warning: unused"; exit 0'
! run || fail "a warning passes"
grep -q '^failed: build release$' "$tmp/log" || fail "the build is not named"
[ "$(last)" = "2 passed, 3 failed, 0 skipped" ] || fail "counts with warnings: $(last)"

good
fake cmake 'exit 1'
! run || fail "a broken build passes"

good
results 8 "$(ran a "")" "$bad"
! run || fail "a failing test passes"
grep -q '^failed: tests release: test_x: failed$' "$tmp/log" || fail "the test is not named"
[ "$(last)" = "7 passed, 2 failed, 0 skipped" ] || fail "counts with a failing test: $(last)"

# A test that cannot be started is no skipped test.
good
results 8 "$(ran a "")" "$lost"
! run || fail "a test without its program passes"
grep -q '^failed: tests release: test_lost: Unable to find executable$' "$tmp/log" || fail "the lost test is not named"
[ "$(last)" = "7 passed, 2 failed, 0 skipped" ] || fail "counts with a lost test: $(last)"

# Whatever else ctest complains of, its exit code counts.
good
results 1 "$(ran a "")"
! run || fail "the exit code of ctest is dropped"
grep -q '^failed: tests dev: ctest: exit code 1, and no test failed$' "$tmp/log" || fail "the exit code is not named"

good
results 0
! run || fail "no test at all passes"

good
fake ctest 'exit 0'
! run || fail "a ctest without results passes"

# Without Open MPI: a skip with a name. (PATH holds only what the check needs.)
good
rm "$tmp/bin/mpiexec" "$tmp/bin/mpicc"
mkdir -p "$tmp/only"
for tool in bash env dirname git find xargs clang-format grep tail head mkdir rm cp cat nproc cut sort tr sed; do
    ln -sf "$(command -v $tool)" "$tmp/only/$tool"
done
ln -sf "$(python3 -c 'import sys; print(sys.executable)')" "$tmp/only/python3"
PATH=$tmp/bin:$tmp/only tools/check.sh > "$tmp/log" 2>&1 || fail "without Open MPI the check fails"
grep -q '^skipped: two ranks over MPI: Open MPI is not installed$' "$tmp/log" || fail "the skip of MPI is not named"

# All of it: the slow tests, the thread sanitizer, the benchmarks, MPI and the mutants as well.
good
mkdir -p build/tsan build/mpi build/release/bin
printf '#!/bin/bash\nexit ${BENCH:-0}\n' > build/release/bin/omentum_bench
printf '#!/bin/bash\nexit ${PYTHON_BENCH:-0}\n' > tools/python_run.sh
chmod +x build/release/bin/omentum_bench tools/python_run.sh
printf 'mutants:\n\t@test "$(MUTANTS)" != live\n' > Makefile
run --all || fail "a good tree fails with --all"
[ "$(last)" = "24 passed, 0 failed, 10 skipped" ] || fail "counts of all checks: $(last)"
for name in 'build with the thread sanitizer' 'every benchmark' 'build with MPI' mutants; do
    grep -q "^ok    $name" "$tmp/log" || fail "$name is not checked"
done
! BENCH=1 run --all || fail "a broken benchmark passes"
grep -q '^failed: every benchmark$' "$tmp/log" || fail "the benchmark is not named"
! PYTHON_BENCH=1 run --all || fail "a broken benchmark in Python passes"
! MUTANTS=live run --all || fail "mutants that live pass"

# What a person types is what this script does.
grep -q 'tools/check.sh --all' "$root/Makefile" || fail "make check-all is not the whole check"
tail -n 1 "$root/.ci/run" | grep -qx 'make check' || fail ".ci/run does not end with make check"
echo "test_check: passed"
