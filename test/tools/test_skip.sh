#!/bin/bash
# test_common.h by a small program of its own: exit codes of skipped cases, missing data, and the limit on
# processor time.
set -euo pipefail
probe=$(realpath "$1")
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
mkdir -p "$tmp/tree" "$tmp/data/a"
cd "$tmp/tree"
unset OM_DATA
fail() { echo "test_skip: $1"; cat "$tmp/log"; exit 1; }

# probe EXPECTED ARGUMENT: run, keep the output, hold the exit code.
probe() {
    local code=0
    "$probe" "$2" > "$tmp/log" 2>&1 || code=$?
    [ "$code" -eq "$1" ] || fail "$2: exit code $code, $1 is expected"
}
says() { grep -q -- "$1" "$tmp/log" || fail "\"$1\" is not said"; }

probe 0 none
! grep -q 'skip:' "$tmp/log" || fail "a skip that was none"
probe 0 some
says '^skip: no first here$'
says '^\[  SKIPPED \] first$'
probe 77 all
says '^skip: no reason is given$'
probe 1 'skip and fail'

# No data anywhere: skipped. A folder beside the checkout without data, or without the file: failed.
probe 77 data
says '^skip: no data folder .* with a/b.txt$'
mkdir "$tmp/shared"
probe 1 data
says '\.\./shared is there, but not'
export OM_DATA=$tmp/nowhere
probe 1 data
says 'OM_DATA names'
export OM_DATA=$tmp/data
touch "$tmp/data/c.txt"
probe 1 data
says 'a/b.txt is not in the data folder'
touch "$tmp/data/a/b.txt"
probe 0 data

# Processor time ends a test that never ends; without a limit it would go on.
OM_TEST_CPU_S=1 probe 1 spin
says 'more processor time than OM_TEST_CPU_S allows'
echo "test_skip: passed"
