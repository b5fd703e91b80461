#!/bin/bash
# test_slurm.sh: the jobs of tools/slurm without Slurm: parts cover a set once, arguments reach the program.
set -u
cd "$(dirname "$0")/../../tools/slurm" || exit 1
nfail=0
fail() {
    echo "FAILED: $1"
    nfail=$((nfail + 1))
}

for job in *.sbatch; do
    bash -n "$job" || fail "$job: syntax"
    grep -q '^#SBATCH --time=' "$job" || fail "$job: no time limit"
    bash "$job" > /dev/null 2>&1 && fail "$job: no arguments, and no complaint"
done

# One task of an array; prints "FIRST END FOLDER" of what the program is told, nothing for an empty part.
task() { # NTASK TASK TOTAL
    SLURM_ARRAY_TASK_COUNT=$1 SLURM_ARRAY_TASK_MIN=3 SLURM_ARRAY_TASK_ID=$((3 + $2)) OMENTUM=echo \
        bash banet_data.sbatch out "$3" --seed 7 |
        sed -n 's/^banet generate -o \([^ ]*\) --first \([0-9]*\) --samples \([0-9]*\) .* --seed 7$/\2 \3 \1/p'
}
for case in "1 5000" "7 5000" "20 380" "3 101" "4 50"; do
    read -r ntask total <<< "$case"
    next=0
    for ((k = 0; k < ntask; ++k)); do
        read -r first end folder <<< "$(task "$ntask" "$k" "$total")"
        [ -z "$first" ] && continue
        [ "$first" = "$next" ] || fail "$ntask tasks, $total samples: task $k begins at $first, not $next"
        [ $((first % 50)) = 0 ] || fail "$ntask tasks: task $k begins inside a file"
        [ "$folder" = "out/part_$k" ] || fail "task $k writes $folder"
        next=$end
    done
    [ "$next" = "$total" ] || fail "$ntask tasks make $next of $total samples"
done

# The join names all parts; the training passes options on.
dir=$(mktemp -d)
mkdir "$dir/part_0" "$dir/part_1"
said=$(OMENTUM=echo bash banet_join.sbatch "$dir" 100 --way exact)
[ "$said" = "banet generate -o $dir/set --samples 100 --shard 50 --workers 1 --part $dir/part_0 --part $dir/part_1 --way exact" ] ||
    fail "join: $said"
said=$(SLURM_NTASKS=2 SLURM_JOB_NODELIST=one MPIRUN="echo ranks" OMENTUM=omentum bash banet_train.sbatch data out --epochs 3 | tail -1)
[ "$said" = "ranks omentum banet train --mpi -d data -o out --workers 1 --epochs 3" ] || fail "train: $said"
rm -r "$dir"
echo "$nfail failures"
[ "$nfail" = 0 ]
