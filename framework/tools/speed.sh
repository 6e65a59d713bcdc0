#!/usr/bin/env bash
# Measures the speed of this machine's perikit beside its limits and beside LAMMPS, on one core, and writes framework/docs/speed.md and the tables of
# framework/docs/how_fast.md with it: some minutes on an otherwise idle machine, plus a build of perikit that counts operations.
#   speed.sh BUILD            BUILD: a release build with its benchmarks
#   speed.sh BUILD --small    a few small bodies, no LAMMPS, no build; the page goes to BUILD/speed, the documentation stays as it is
set -euo pipefail
build=$(realpath "$1")
small=${2:-}
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
export OMP_WAIT_POLICY=passive
out=$build/speed
mkdir -p "$out"
bench="$build/bin/perikit bench"
stress="--dimension 2 1 --plane strain stress --kinematics baqp"

if [ -z "$small" ]; then
  cmake --preset counting > /dev/null
  cmake --build --preset counting > /dev/null
  count="build/counting/bin/perikit bench --operations framework/tools/operations.csv"
  plane="--dimension 2 --cells 256"
  line="--dimension 1 --cells 20000"
  $count
  $count --material hencky hypoelastic linear_elastic mooney_rivlin neo_hookean
  $count $plane
  $count $line
  $bench --json "$out/bench.json" | tee "$out/bench.md"
  $bench $plane --json "$out/bench_plane.json" | tee "$out/bench_plane.md"
  $bench $line --json "$out/bench_line.json" | tee "$out/bench_line.md"
  $bench $stress --cells 100 --material hencky hypoelastic linear_elastic mooney_rivlin neo_hookean saint_venant_kirchhoff | tee "$out/bench_stress.md"
  tests/benchmarks/lammps.sh | tee "$out/lammps.txt"
  "$build/bin/materials_benchmark" | tee "$out/materials.md"
  page=framework/docs/speed.md
  summary=framework/docs/how_fast.md
else
  $bench --cells 6 --kinematics conventional baqp conventional+wan --json "$out/bench.json" | tee "$out/bench.md"
  $bench --cells 6 --kinematics conventional --dimension 2 | tee "$out/bench_plane.md"
  $bench --cells 6 --kinematics conventional --dimension 1 | tee "$out/bench_line.md"
  $bench $stress --cells 6 | tee "$out/bench_stress.md"
  printf 'LAMMPS lps 1\nLAMMPS pmb 1\n' > "$out/lammps.txt"
  : > "$out/materials.md"
  page=$out/speed.md
  summary=$out/how_fast.md
  cp framework/docs/how_fast.md "$summary"
fi

# A line a kinematics of what `perikit bench` has in two: lattice and cloud.
kinematics_table() {
  awk -F' *[|] *' '
    BEGIN { print "| kinematics | lattice: ns a point and step | bytes a point | of the arithmetic peak | cloud: ns a point and step | bytes a point | of the arithmetic peak |"
            print "|---|---|---|---|---|---|---|" }
    $4 == 3 { name = $2; sub(/[+]/, "` with `", name); sub(/^selective$/, "selective` over `baqp", name); share = "-"; if (match($10, /[0-9]+ %/)) share = substr($10, RSTART, RLENGTH)
              cell[name, $5] = sprintf("%.0f | %s | %s", $6, $7, share); if ($5 == "lattice") { order[++n] = name; step[n] = $6 } }
    END { for (i = 1; i <= n; ++i) { best = 0; for (k = 1; k <= n; ++k) if (!done[k] && (!best || step[k] + 0 < step[best] + 0)) best = k
            done[best] = 1; printf "| `%s` | %s | %s |\n", order[best], cell[order[best], "lattice"], cell[order[best], "cloud"] } }' "$out/bench.md"
}

# A line a law of what materials_benchmark has in two: 3D and plane strain.
laws_table() {
  awk -F' *[|] *' '
    BEGIN { print "| law | stress, 3D: ns a point | plane strain | tangent, 3D | plane strain | share of the arithmetic peak, stress and tangent in 3D |"
            print "|---|---|---|---|---|---|" }
    $3 == "solid" { stress = $4; tangent = $9; share = $7 ", " $12 }
    $3 == "plane strain" { printf "| `%s` | %s | %s | %s | %s | %s |\n", $2, stress, $4, tangent, $9, share }' "$out/materials.md"
}

# What zero stress across planes and lines costs over zero strain, a line a law and body.
stress_table() {
  awk -F' *[|] *' '
    BEGIN { print "| law | body | plane stress: step [ns] | over plane strain | tangent action [ns] | over plane strain | uniaxial stress: step [ns] | over uniaxial strain | tangent action [ns] | over uniaxial strain |"
            print "|---|---|---|---|---|---|---|---|---|---|" }
    $4 ~ /^[12]$/ { step[$3, $4, $5] = $6; action[$3, $4, $5] = $12 }
    $4 ~ /stress/ { d = substr($4, 1, 1)
                    cell[d] = sprintf("%s | %.2f | %s | %.2f", $6, $6 / step[$3, d, $5], $12, $12 / action[$3, d, $5])
                    if (!(($3, $5) in plane)) plane[$3, $5] = cell[d]
                    else printf "| `%s` | %s | %s | %s |\n", $3, $5, plane[$3, $5], cell[d] }' "$out/bench_stress.md"
}

# The lines between <!-- NAME --> and <!-- end NAME --> of how_fast.md become standard input.
replace() {
  local text
  text=$(cat)
  grep -q "<!-- $1 -->" "$summary" && grep -q "<!-- end $1 -->" "$summary" || { echo "speed.sh: $summary has no place for $1"; exit 1; }
  TEXT=$text awk -v name="$1" '
    $0 == "<!-- " name " -->" { print; print ENVIRON["TEXT"]; skip = 1 }
    $0 == "<!-- end " name " -->" { skip = 0 }
    !skip' "$summary" > "$summary.new"
  mv "$summary.new" "$summary"
}

laws_table | replace "laws table"
lps=$(sed -n 's/^LAMMPS lps //p' "$out/lammps.txt")
pmb=$(sed -n 's/^LAMMPS pmb //p' "$out/lammps.txt")
kinematics_table | replace "kinematics table"
printf 'There: %s.\nOn the same machine, the same 32^3 lattice and one core, Debian'"'"'s LAMMPS takes %s ns a point and step for its linear peridynamic\nsolid and %s ns for its bond-based material.\n' \
  "$(sed -n 's/^machine: \(.*\) (one thread).*/\1 on one core/p' "$out/bench.md")" "$lps" "$pmb" | replace "machine"

{
  printf '# Speed\n\nWritten by `framework/tools/speed.sh BUILD`. One core, an explicit step with everything in it; how to read the columns stands above each table.\n\n'
  printf '## Kinematics, 3D\n\n'
  cat "$out/bench.md"
  printf '\n## Kinematics, 2D\n\n'
  sed 1,2d "$out/bench_plane.md"
  printf '\n## Kinematics, 1D\n\n'
  sed 1,2d "$out/bench_line.md"
  printf '\n## Zero stress across planes and lines\n\n`perikit bench %s --cells 100 --material ...`\n\n' "$stress"
  stress_table
  printf '\n## LAMMPS, the same lattice\n\n`tests/benchmarks/lammps.sh`, right after: linear peridynamic solid (`lps`) %s ns a point and step, bond-based (`pmb`) %s ns.\n' "$lps" "$pmb"
  printf '\n## Laws\n\nBatches of 128 points through the virtual call; operations counted by a scalar that knows what it shares.\n\n'
  cat "$out/materials.md"
} > "$page.new"
mv "$page.new" "$page"
