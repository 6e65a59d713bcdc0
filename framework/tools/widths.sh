#!/bin/sh
# framework/tools/widths.sh [FOLDER [WIDTHS [OPTIONS OF perikit bench]]]
#
# The share of the arithmetic peak that explicit steps reach at each SIMD width, as a table: builds the program for x86-64-v4 (AVX-512),
# x86-64-v3 (AVX2) and x86-64-v2 (SSE2 and its kin) below FOLDER (build/widths) and measures all of them in one run, in turns. The peak is that of
# multiply-adds in packs of the same width (without AVX2: of a multiplication and an addition).
# WIDTHS: "v4 v3 v2", as far as this machine can run them.
set -eu
source=$(cd "$(dirname "$0")/../.." && pwd)
folder=${1:-$source/build/widths}
widths=${2:-}
rounds=${PERIKIT_ROUNDS:-3}
if [ -z "$widths" ]; then
  widths="v3 v2"
  grep -q avx512dq /proc/cpuinfo && widths="v4 $widths"
fi
[ $# -gt 2 ] && shift 2 || shift $#

for width in $widths; do
  cmake -S "$source" -B "$folder/$width" -G Ninja -DCMAKE_BUILD_TYPE=Release -DPERIKIT_NATIVE=OFF -DPERIKIT_LEVEL=x86-64-$width \
        ${PERIKIT_LAUNCHER:+-DCMAKE_CXX_COMPILER_LAUNCHER=$PERIKIT_LAUNCHER} > "$folder.$width.log" 2>&1 || { cat "$folder.$width.log" >&2; exit 1; }
  cmake --build "$folder/$width" >> "$folder.$width.log" 2>&1 || { tail -40 "$folder.$width.log" >&2; exit 1; }
done
for round in $(seq "$rounds"); do
  for width in $widths; do
    "$folder/$width/bin/perikit" bench --json "$folder/$width.$round.json" "$@" > "$folder/$width.$round.txt"
  done
done
python3 - "$folder" "$rounds" $widths <<'PYTHON'
import json, sys
folder, rounds, widths = sys.argv[1], int(sys.argv[2]), sys.argv[3:]
best = {}
for width in widths:
    for round in range(1, rounds + 1):
        for row in json.load(open(f"{folder}/{width}.{round}.json"))["rows"]:
            key = row["kinematics"], row["material"], row["dimension"], row["body"]
            share = row.get("of_multiply_add")
            old = best.setdefault(key, {}).get(width)
            if old is None or row["step_ns"] < old[0]:
                best[key][width] = row["step_ns"], share
names = {"v4": "AVX-512", "v3": "AVX2", "v2": "SSE2"}
print("| kinematics | D | body | " + " | ".join(f"{names[w]} [ns] | of peak" for w in widths) + " |")
print("|---" * (3 + 2 * len(widths)) + "|")
for (kinematics, material, dimension, body), found in best.items():
    cells = [f"{found[w][0]:.4g} | " + (f"{100 * found[w][1]:.0f} %" if found[w][1] else "-") for w in widths if w in found]
    print(f"| {kinematics} | {dimension} | {body} | " + " | ".join(cells) + " |")
PYTHON
