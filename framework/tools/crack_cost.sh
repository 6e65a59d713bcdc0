#!/usr/bin/env bash
# What a crack costs by critical_energy, bonds that break at once and bonds that weaken, by the energy that they hold and the one that they
# set free: the double cantilever beam under eight kinematics. A Markdown table is printed: that of framework/docs/fracture.md, "What a crack
# costs". About an hour on one core; part of `ninja fracture`.
#   crack_cost.sh PERIKIT OUT
# Runs that are done are kept.
set -euo pipefail
perikit=$(realpath "$1")
out=$(realpath -m "$2")
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
mkdir -p "$out"

# Folder, name in the table, setting, opening of each end [m] by energies set free and held: cracks that cost more are opened farther.
# Of pair laws both energies are the same.
all=(
  bond_based '`bond_based`' bond_based 1.8e-3 ''
  ordinary '`ordinary`' ordinary 1.8e-3 ''
  baqp '`baqp`' baqp 1.8e-3 1.8e-3
  projection '`projection`' projection 1.8e-3 1.8e-3
  bond_augmented '`bond_augmented`' bond_augmented 1.8e-3 1.8e-3
  bond_associated '`bond_associated`' bond_associated 1.8e-3 3e-3
  silling '`conventional` with `silling`, 1' '{type="conventional",stabilization={type="silling",coefficient=1.0}}' 2e-3 4e-3
  wan '`conventional` with `wan`' '{type="conventional",stabilization="wan"}' 2e-3 4e-3
)

# One cell: energy per area, G, load over LEFM's.   cell FOLDER KINEMATICS OPENING SOFTENING ENERGY
cell() {
  local folder=$out/$1_$4_$5
  [ -s "$folder.txt" ] || { rm -rf "$folder"; framework/tools/double_cantilever.sh "$perikit" "$folder" --set kinematics="$2" --set constants.w="$3" \
    --set damage.softening="$4" --set interface.0.damage.softening="$4" --set damage.energy="$5" --set interface.0.damage.energy="$5" > "$folder.part"
    mv "$folder.part" "$folder.txt"; }
  awk 'NF == 6 && $1 + 0 > 0 { printf " %.2f, %.2f, %.2f |", $1, $2, $4; next } { printf " %s |", $0 }' "$folder.txt"
}

printf '| kinematics | at once | softening 4 | held, at once | held, softening 4 |\n|---|---|---|---|---|\n'
for ((k = 0; k < ${#all[@]}; k += 5)); do
  printf '| %s |' "${all[k + 1]}"
  for energy in released held; do
    opening=${all[k + 3]}
    [ "$energy" = held ] && opening=${all[k + 4]}
    for softening in 1 4; do
      if [ -n "$opening" ]; then cell "${all[k]}" "${all[k + 2]}" "$opening" "$softening" "$energy"; else printf ' the same |'; fi
    done
  done
  printf '\n'
done
