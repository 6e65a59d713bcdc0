#!/usr/bin/env bash
# Measures explicit steps of every kinematics with packs of eight, four and two numbers (AVX-512, AVX2, SSE2), on one core of an otherwise idle
# machine, and writes one Markdown table: ns a point, and the share of the multiply-add peak that the same build reaches. Builds the program and
# its parts once for each of LEVELS (values of PERIKIT_LEVEL, or `native`) in build/widths.
#   widths.sh TABLE [ROUNDS [OPTION...]]    TABLE: the file to write. ROUNDS: 3; the builds take turns, the fastest counts. OPTION: of `perikit bench`
# CMAKE_ARGUMENTS: more options for CMake.
set -euo pipefail
table=$(realpath -m "${1:?widths.sh TABLE [ROUNDS [OPTION...]]}")
rounds=${2:-3}
options=("${@:3}")
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
read -ra levels <<< "${LEVELS:-x86-64-v4 x86-64-v3 x86-64-v2}"
export OMP_WAIT_POLICY=passive

for level in "${levels[@]}"; do
  tree=build/widths/$level
  if [[ $level == native ]]; then processor=(-DPERIKIT_NATIVE=ON); else processor=(-DPERIKIT_LEVEL="$level"); fi
  # shellcheck disable=SC2086
  cmake -S . -B "$tree" -G Ninja -DCMAKE_BUILD_TYPE=Release -DPERIKIT_TESTS=OFF "${processor[@]}" ${CMAKE_ARGUMENTS:-} > /dev/null
  cmake --build "$tree" --target perikit-program parts
  rm -f "$tree"/round_*.json
done
for ((round = 1; round <= rounds; ++round)); do
  for level in "${levels[@]}"; do
    echo "round $round, $level"
    "build/widths/$level/bin/perikit" bench --json "build/widths/$level/round_$round.json" ${options[@]+"${options[@]}"} > /dev/null
  done
done

python3 - "$table" "${levels[@]}" << 'END'
import glob, json, sys

# What is aimed at, in % of the peak; rows that are not named have no aim.
aims = {"lattice": {"bond_based": 35, "ordinary": 35, "conventional": 30, "conventional+silling": 30, "conventional+wan": 30, "baqp": 40, "projection": 50,
                    "bond_augmented": 50, "selective": 50, "bond_associated": 50, "non_spherical": 50},
        "cloud": {"conventional": 25, "baqp": 30, "projection": 30}}
levels = sys.argv[2:]
peak, fastest, operations = {}, {}, {}
for level in levels:
    for file in glob.glob(f"build/widths/{level}/round_*.json"):
        with open(file) as stream:
            found = json.load(stream)
        peak[level] = max(peak.get(level, 0), found["multiply_add_GFLOP_per_s"])
        for row in found["rows"]:
            key = row["kinematics"], row["material"], row["dimension"], row["body"]
            fastest[key, level] = min(fastest.get((key, level), float("inf")), row["step_ns"])
            operations[key] = row["operations"]

several = len({key[1:3] for key in operations}) > 1   # laws or dimensions: named in the rows
with open(sys.argv[1], "w") as out:
    def line(cells):
        out.write("| " + " | ".join(cells) + " |\n")
    out.write("Multiply-add peak of each build: " + ", ".join(f"`{level}` {peak[level]:.1f} GFLOP/s" for level in levels) +
              ".\nOperations are those counted with packs of eight (framework/tools/operations.csv).\n\n")
    line(["kinematics", "body"] + [heading for level in levels for heading in (f"`{level}`: ns a point", "of its peak")] + ["aim"])
    out.write("|" + "---|" * (3 + 2 * len(levels)) + "\n")
    for body in "lattice", "cloud":
        for key, count in sorted((key, count) for key, count in operations.items() if key[3] == body):
            cells = [f"`{key[0]}`" + (f", {key[1]}, {key[2]}D" if several else ""), body]
            for level in levels:
                ns = fastest[key, level]
                cells += [f"{ns:.1f}", f"{100 * count / ns / peak[level]:.0f} %" if count else "-"]
            aim = aims[body].get(key[0]) if key[1:3] == ("saint_venant_kirchhoff", 3) else None
            line(cells + [f"{aim} %" if aim else "-"])
END
cat "$table"
