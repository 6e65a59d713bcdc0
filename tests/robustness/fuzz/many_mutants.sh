#!/usr/bin/env bash
# Mutated inputs by the million, the short form of fuzzing with one random seed after another: many_mutants.sh BIN SEEDS MADE_SEEDS WORK TARGET...
# All targets in turn, a batch each, until PERIKIT_MUTANTS (ten million) inputs are through. Batches that are done stand in WORK/done.csv and are
# not done again. A batch that ends badly ends all; its input is kept in WORK/<target>/fuzz_failure.
set -euo pipefail
bin=$1 seeds=$2 made=$3 work=$4
shift 4
wanted=${PERIKIT_MUTANTS:-10000000}
batch=${PERIKIT_MUTANTS_BATCH:-20000}
mkdir -p "$work"
done=$work/done.csv
[ -f "$done" ] || echo "target,seed,inputs,seconds" > "$done"
"$bin/perikit_fuzz_seeds" "$made"

total() { awk -F, 'NR > 1 { n += $3 } END { print n + 0 }' "$done"; }

# The first seeds are those of the test command.
for ((seed = 2; $(total) < wanted; ++seed)); do
  for target in "$@"; do
    [ "$(total)" -lt "$wanted" ] || break
    if grep -q "^$target,$seed,$batch," "$done"; then continue; fi
    files=("$seeds/$target"/*)
    [ -e "${files[0]}" ] || files=("$made/$target"/*)
    mkdir -p "$work/$target"
    start=$(date +%s.%N)
    if ! (cd "$work/$target" && "$bin/perikit_fuzz_$target" "$batch" "$seed" "${files[@]}"); then
      echo "$target: a finding with seed $seed, kept in $work/$target/fuzz_failure" >&2
      exit 1
    fi
    echo "$target,$seed,$batch,$(echo "$start $(date +%s.%N)" | awk '{ printf "%.1f", $2 - $1 }')" >> "$done"
  done
  echo "$(total) inputs, seeds up to $seed"
done
awk -F, 'NR > 1 { n[$1] += $3; s[$1] += $4 } END { for (t in n) printf "%s: %d inputs, %.0f s\n", t, n[t], s[t] }' "$done" | sort
