#!/bin/bash
# check.sh [--all]: what must hold before a change lands: format, layers, the quick tests in release and under the
# sanitizers, a second compiler. `make check` runs it after the set-up. With --all (`make check-all`, hours) also
# the slow tests, the thread sanitizer, every benchmark once, the build with MPI and the mutants.
# It continues after a failure so that one run tells all; what was skipped is listed by name; the last line counts,
# the exit code decides.
set -uo pipefail
cd "$(dirname "$0")/.."
passed=0 failed=0 skipped=0 failures=() skips=()
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

# build PRESET [TARGET...]: configure, then build; quiet unless something is wrong.
build() {
    local log=build/$1.log preset=$1
    shift
    mkdir -p build
    cmake --preset "$preset" -G Ninja > "$log" 2>&1 &&
        cmake --build "build/$preset" ${1:+--target "$@"} >> "$log" 2>&1 || { tail -n 80 "$log"; return 1; }
    if grep -q 'warning:' "$log"; then
        grep -A 4 'warning:' "$log" | head -n 40
        return 1
    fi
}

# tests NAME PRESET OPTION...: the tests of a build that the options of ctest select; each counts.
tests() {
    local name=$1 junit=$PWD/build/$2/junit.xml preset=$2 code=0 word what rest bad gone
    shift 2
    rm -f "$junit"
    ctest --test-dir "build/$preset" "$@" -j "$(nproc)" --output-on-failure --no-tests=error \
        --test-output-size-passed 1000000 --output-junit "$junit" || code=$?
    while read -r word what rest; do
        case $word in
        fail) failures+=("tests $name: $what${rest:+ $rest}") ;;
        skip) skips+=("tests $name: $what${rest:+ $rest}") ;;
        count)
            read -r bad gone <<< "$rest"
            passed=$((passed + what)) failed=$((failed + bad)) skipped=$((skipped + gone))
            ;;
        *) failed=$((failed + 1)) failures+=("tests $name: the results cannot be read") ;;
        esac
    done < <(python3 tools/test_results.py "$junit" "$code" || echo "broken")
}

# skip NAME REASON: a stage that cannot run here.
skip() {
    skipped=$((skipped + 1)) skips+=("$1: $2")
    echo "skip  $1: $2"
}

stage "format" check_format
stage "layers, sizes, names" python3 tools/check_tree.py
stage "build release" build release all tests && tests release release -LE slow
stage "build with sanitizers" build dev all tests && tests dev dev -LE slow
# The second compiler is not in packages.txt (it is large): used where it is there.
if command -v clang > /dev/null; then
    stage "build with clang" build clang
else
    skip "build with clang" "it is not installed"
fi
# Nor is Open MPI (tools/packages_ci.txt); the release build tests two ranks where it is there.
has_mpi() { command -v mpiexec > /dev/null && command -v mpicc > /dev/null; }
has_mpi || skip "two ranks over MPI" "Open MPI is not installed"

# One benchmark after the other, each row once: they run to their end.
check_bench() {
    cmake --build build/release --target omentum_bench > build/bench.log 2>&1 &&
        build/release/bin/omentum_bench --quick --runs 1 >> build/bench.log 2>&1 && tools/python_run.sh python/bench.py 20 >> build/bench.log 2>&1 ||
        { tail -n 20 build/bench.log; return 1; }
}
if [ "${1:-}" = --all ]; then
    tests slow release -L slow
    stage "build with the thread sanitizer" build tsan tests && tests tsan tsan -LE "slow|cli|sample"
    stage "every benchmark" check_bench
    if has_mpi; then
        stage "build with MPI" build mpi tests && tests mpi mpi -R '^test_nn|^test_umesh_net'
    else
        skip "build with MPI" "Open MPI is not installed"
    fi
    if grep -q '^mutants:' Makefile; then
        stage "mutants" make mutants
    fi
fi

echo
for skip in "${skips[@]}"; do echo "skipped: $skip"; done
for failure in "${failures[@]}"; do echo "failed: $failure"; done
echo "$(((SECONDS - start) / 60)) min $(((SECONDS - start) % 60)) s"
echo "$passed passed, $failed failed, $skipped skipped"
[ $failed -eq 0 ]
