#!/bin/bash
# check.sh: everything that must hold before a change lands. `make check` runs it after the set-up.
# Goes on after a failure so that one run tells all; the last line counts, the exit code decides.
set -uo pipefail
cd "$(dirname "$0")/.."
passed=0 failed=0 skipped=0 failures=()
start=$SECONDS
# Two tests run side by side, each with threads of its own: waiting threads must not spin.
export OMP_WAIT_POLICY=passive

# stage NAME command...: one check, one line with its time.
stage() {
    local name=$1 t0=$SECONDS
    shift
    if "$@"; then
        passed=$((passed + 1))
        echo "ok    $name ($((SECONDS - t0)) s)"
    else
        failed=$((failed + 1)) failures+=("$name")
        echo "FAIL  $name ($((SECONDS - t0)) s)"
        return 1
    fi
}

check_format() { tools/list_c.sh | xargs -0 clang-format --dry-run -Werror; }

# build PRESET: configure once, then build; quiet unless something is wrong.
build() {
    local log=build/$1.log
    mkdir -p build
    { [ -f "build/$1/build.ninja" ] || cmake --preset "$1" -G Ninja; } > "$log" 2>&1 &&
        cmake --build "build/$1" >> "$log" 2>&1 || { tail -n 80 "$log"; return 1; }
    if grep -q 'warning:' "$log"; then
        grep -A 4 'warning:' "$log" | head -n 40
        return 1
    fi
}

# tests PRESET: the quick tests of a build; each counts.
tests() {
    local junit=$PWD/build/$1/junit.xml total bad skip names
    rm -f "$junit"
    ctest --test-dir "build/$1" -LE slow -j "$(nproc)" --output-on-failure --no-tests=error \
        --output-junit "$junit" || true
    if [ ! -f "$junit" ]; then
        failed=$((failed + 1)) failures+=("tests $1: ctest wrote no result")
        return
    fi
    count() { grep -m 1 -o "$1=\"[0-9]*\"" "$junit" | tr -dc 0-9; }
    total=$(count tests) bad=$(count failures) skip=$(($(count skipped) + $(count disabled)))
    passed=$((passed + total - bad - skip)) failed=$((failed + bad)) skipped=$((skipped + skip))
    names=$(grep -B 1 '<failure' "$junit" | grep -o 'testcase name="[^"]*"' | cut -d '"' -f 2 | xargs)
    [ "$bad" -eq 0 ] || failures+=("tests $1: $names")
}

stage "format" check_format
stage "layers, sizes, names" python3 tools/check_tree.py
stage "build release" build release && tests release
stage "build with sanitizers" build dev && tests dev
# The second compiler is not in packages.txt (it is large): used where it is there.
if command -v clang > /dev/null; then
    stage "build with clang" build clang
else
    skipped=$((skipped + 1))
    echo "skip  build with clang: it is not installed"
fi
# Nor is Open MPI; its test trains as two ranks.
check_mpi() {
    { [ -f build/mpi/build.ninja ] || cmake --preset mpi -G Ninja; } > build/mpi.log 2>&1 &&
        cmake --build build/mpi --target test_nn_mpi >> build/mpi.log 2>&1 &&
        ctest --test-dir build/mpi -R '^test_nn_mpi' --no-tests=error --output-on-failure >> build/mpi.log 2>&1 ||
        { tail -n 40 build/mpi.log; return 1; }
}
if command -v mpiexec > /dev/null && command -v mpicc > /dev/null; then
    stage "two ranks over MPI" check_mpi
else
    skipped=$((skipped + 1))
    echo "skip  two ranks over MPI: Open MPI is not installed"
fi

echo
for failure in "${failures[@]}"; do echo "failed: $failure"; done
echo "$(((SECONDS - start) / 60)) min $(((SECONDS - start) % 60)) s"
echo "$passed passed, $failed failed, $skipped skipped"
[ $failed -eq 0 ]
