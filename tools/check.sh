#!/bin/bash
# check.sh [--all] [ROOM]: what must hold before a change lands. `make check` runs it after the set-up.
#
#   format, layers         the formatter, tools/check_tree.py
#   build, tests release   every quick test, and the demo. A test over LIMIT seconds of processor time fails, unless
#                          tools/slow_quick_tests.txt names it with a reason
#   build, tests dev       address and undefined sanitizers. Whole: the parsers and their rooms, `base`, the rooms that
#                          changed since the last commit that passed, and those directly above them. Of every other room
#                          the cases of failing allocations. build/checked has that commit (a clean checkout has none),
#                          SINCE=COMMIT names another one
#   clang                  its warnings, where it is installed
#
# With ROOM only the tests of that room, whole in both builds. With --all (`make check-all`, hours) every quick test under the
# sanitizers, the slow tests, the thread sanitizer, every benchmark once, the builds with MPI, without GPL parts and for arm64
# in an emulator, and the mutants.
# It continues after a failure so that one run tells all; what was skipped is listed by name; the last line counts,
# the exit code decides. Times are processor time; doc/check_times.md has those of the tests.
set -uo pipefail
cd "$(dirname "$0")/.."
passed=0 failed=0 skipped=0 failures=() skips=()
start=$SECONDS
all='' room=''
for word in "$@"; do
    case $word in
    --all) all=1 ;;
    *) room=$word ;;
    esac
done
if [ -n "$room" ] && [ ! -d "test/$room" ] && [ ! -d "$room" ]; then
    echo "check: there is no room '$room': test/ has $(cd test && echo */ | tr -d /)" >&2
    exit 2
fi
LIMIT=2
# Two tests run side by side, each with threads of its own: waiting threads must not spin.
export OMP_WAIT_POLICY=passive
# A compiler cache is used where it is installed.
if command -v ccache > /dev/null; then export CMAKE_C_COMPILER_LAUNCHER=${CMAKE_C_COMPILER_LAUNCHER-ccache}; fi

# seconds: processor time of all that this script has run and waited for (in a subshell `times` would begin anew).
seconds() {
    local stat
    read -ra stat < "/proc/$$/stat"
    echo $(((stat[15] + stat[16]) / $(getconf CLK_TCK)))
}

# stage NAME command...: one check, one line with its processor time.
stage() {
    local name=$1 t0 code=0
    t0=$(seconds)
    shift
    "$@" || code=1
    local took="$(($(seconds) - t0)) s"
    if [ $code -eq 0 ]; then
        passed=$((passed + 1))
        echo "ok    $name ($took)"
    else
        failed=$((failed + 1)) failures+=("$name")
        echo "FAIL  $name ($took)"
    fi
    return $code
}

# skip NAME REASON: a stage that cannot run here.
skip() {
    skipped=$((skipped + 1)) skips+=("$1: $2")
    echo "skip  $1: $2"
}

check_format() { tools/list_c.sh | xargs -0 clang-format --dry-run -Werror; }

configure() { mkdir -p build && cmake --preset "$1" -G Ninja > "build/$1.log" 2>&1 || { tail -n 80 "build/$1.log"; return 1; }; }

# build PRESET TARGET...: quiet unless something is wrong.
build() {
    local log=build/$1.log preset=$1
    shift
    cmake --build "build/$preset" --target "$@" >> "$log" 2>&1 || { tail -n 80 "$log"; return 1; }
    if grep -q 'warning:' "$log"; then
        grep -A 4 'warning:' "$log" | head -n 40
        return 1
    fi
}

# run NAME PRESET OPTION...: the tests of a build that the options of run_tests.py select; each counts.
run() {
    local name=$1 preset=$2 results=$PWD/build/$2.results word what rest bad gone
    shift 2
    rm -f "$results"
    python3 -B tools/run_tests.py "build/$preset" --results "$results" "$@"
    [ -s "$results" ] || echo "broken" > "$results"
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
    done < "$results"
}

# tests NAME PRESET OPTION...: build what the selected tests need, and run them.
tests() {
    local name=$1 preset=$2 need
    shift 2
    stage "configure $name" configure "$preset" || return
    mapfile -t need < <(python3 -B tools/run_tests.py "build/$preset" --targets "$@")
    stage "build $name" build "$preset" "${need[@]}" && run "$name" "$preset" "$@"
}

# changed: sets `whole`, the labels of the tests that run whole under the sanitizers.
changed() {
    local since=${SINCE:-$(cat build/checked 2> /dev/null)} touched above name
    whole='parser|room_(base|math|image|shape|report|robot|scan)'
    if [ -z "$since" ]; then
        echo "sanitizers: no commit that passed is known; SINCE=COMMIT adds the rooms that changed"
        return
    fi
    { read -r _ touched; read -r _ above; } < <(python3 -B tools/changed_rooms.py "$since")
    echo "sanitizers: since ${since:0:10} changed: ${touched:-nothing}; directly above: ${above:-nothing}"
    [ "$touched" = all ] && whole='.*'
    for name in $touched $above; do whole+="|room_$name|$name"; done
}

# The first thing a user runs.
check_demo() { build/release/bin/omentum demo -q -o build/demo > build/demo.log 2>&1 && [ -s build/demo/report.html ] || { tail -n 20 build/demo.log; return 1; }; }

# One benchmark after the other, each row once: they run to their end.
check_bench() {
    { build release omentum_bench && build/release/bin/omentum_bench --quick --runs 1 && tools/python_run.sh python/bench.py 20; } > build/bench.log 2>&1 ||
        { tail -n 20 build/bench.log; return 1; }
}

# Open MPI is not in packages.txt (tools/packages_ci.txt); the release build tests two ranks where it is there.
has_mpi() { command -v mpiexec > /dev/null && command -v mpicc > /dev/null; }

stage "format" check_format
stage "layers, sizes, names" python3 tools/check_tree.py
if [ -n "$room" ]; then
    only=(--not-label slow --name "^(test|cli|replay_fuzz|python|sample|tools)_$room(_|\$)")
    tests release release "${only[@]}"
    tests dev dev "${only[@]}"
else
    tests release release --not-label slow --limit $LIMIT --allowed tools/slow_quick_tests.txt --times build/times_release.json
    stage "benchmarks compile" build release omentum_bench
    stage "demo" check_demo
    changed
    [ -n "$all" ] && whole='.*'
    tests dev dev --not-label slow --whole "$whole" --times build/times_dev.json
    # The second compiler is not in packages.txt (it is large): used where it is there.
    if command -v clang > /dev/null; then
        stage "warnings of clang" python3 tools/clang_syntax.py
    else
        skip "warnings of clang" "it is not installed"
    fi
    has_mpi || skip "two ranks over MPI" "Open MPI is not installed"
fi

if [ -n "$all" ]; then
    run slow release --label slow
    tests tsan tsan --not-label 'slow|cli|sample'
    stage "every benchmark" check_bench
    if has_mpi; then
        tests mpi mpi --not-label slow --name '^test_nn|^test_umesh_net'
    else
        skip "build with MPI" "Open MPI is not installed"
    fi
    if [ -e /usr/include/superlu/slu_ddefs.h ]; then  # factors alone differ: these rooms use them
        tests nogpl nogpl --not-label slow --name '^test_(solve|fem|tissue|contact|scene|calibrate|match)_'
    else
        skip "build without GPL parts" "libsuperlu-dev is not installed"
    fi
    if reason=$(tools/arm64.sh --set-up); then
        tests arm64 arm64 --not-label 'slow|python|install' --name '^(?!tools_)'
    elif [[ $reason == *skip:* ]]; then
        skip "build for arm64 in an emulator" "${reason##*skip: arm64.sh: }"
    else
        stage "set-up of arm64" false
    fi
    stage "mutants" make mutants
fi

echo
for skip in "${skips[@]}"; do echo "skipped: $skip"; done
for failure in "${failures[@]}"; do echo "failed: $failure"; done
if [ $failed -eq 0 ] && [ -z "$room" ] && [ -z "$(git status --porcelain 2>&1)" ]; then
    git rev-parse HEAD > build/checked 2> /dev/null || rm -f build/checked
fi
echo "$(seconds) s of processor time in $((SECONDS - start)) s"
echo "$passed passed, $failed failed, $skipped skipped"
[ $failed -eq 0 ]
