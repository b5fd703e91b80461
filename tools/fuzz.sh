#!/bin/bash
# fuzz.sh SECONDS [TARGET...]: run each fuzz target (all by default) for so long from its corpus, then report
# the share of the parser's lines that its corpus and what was found cover. A crash stops with its input kept.
set -euo pipefail
cd "$(dirname "$0")/.."
seconds=$1
shift
mkdir -p build
cmake --preset fuzz -G Ninja > build/fuzz.log
cmake --build build/fuzz
found=build/fuzz/found
failed=0
export ASAN_OPTIONS=allocator_may_return_null=1 OMP_NUM_THREADS=1

while read -r name corpus covers; do
    if [ $# -gt 0 ] && ! grep -qw -- "$name" <<< "$*"; then continue; fi
    mkdir -p "$found/$name" "$found/crash"
    log=$found/$name.log
    if LLVM_PROFILE_FILE=/dev/null "build/fuzz/bin/$name" -max_total_time="$seconds" -max_len=16384 \
        -timeout=10 -rss_limit_mb=2048 -artifact_prefix="$found/crash/$name-" -print_final_stats=1 \
        "$found/$name" "$corpus" > "$log" 2>&1; then
        runs=$(grep -o 'number_of_executed_units: [0-9]*' "$log" | tr -dc 0-9)
    else
        tail -n 40 "$log"
        echo "$name: FAILED, the input is kept in $found/crash"
        failed=1
        continue
    fi
    LLVM_PROFILE_FILE=$found/$name.profraw "build/fuzz/bin/$name" -runs=0 "$found/$name" "$corpus" \
        > "$log.cover" 2>&1
    llvm-profdata merge -sparse "$found/$name.profraw" -o "$found/$name.profdata"
    # shellcheck disable=SC2086
    lines=$(llvm-cov export -summary-only -instr-profile "$found/$name.profdata" "build/fuzz/bin/$name" $covers |
        python3 -c 'import json, sys
for f in json.load(sys.stdin)["data"][0]["files"]:
    s = f["summary"]["lines"]
    print("%s %.1f %% of %d lines" % (f["filename"].split("/")[-1], s["percent"], s["count"]), end="; ")')
    echo "$name: $seconds s, $runs inputs, no failure; $lines"
done < build/fuzz/fuzz_targets.txt
exit $failed
