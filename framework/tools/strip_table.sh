#!/usr/bin/env bash
# The strip of configs/fracture/strip.toml over sizes of the step, kinematics, what the crack is given, and bonds that weaken. Three Markdown tables are printed: that of
# framework/docs/fracture.md, "Size of the step", and those of the strip in "What a crack costs". Minutes; part of `ninja fracture`.
#   strip_table.sh PERIKIT OUT
. "$(dirname "${BASH_SOURCE[0]}")/table_cells.sh"

# Folder, name in the tables, setting.
all=(
  bond_based '`bond_based`' '{type="bond_based",surface_correction="none"}'
  ordinary '`ordinary`' '{type="ordinary",surface_correction="none"}'
  baqp '`baqp`' baqp
  projection '`projection`' projection
  bond_associated '`bond_associated`' bond_associated
  silling '`conventional` with `silling`, 1' "$silling"
  wan '`conventional` with `wan`' "$wan"
)
stretch='damage={type="critical_stretch",energy_release_rate="Gc",consistent=true,no_fail=["grips","end"]}'

# One cell: energy per area, speed and, where asked for, the balance.   cell FOLDER COLUMNS SETTING...
cell() {
  run_cell "$1" strip.sh --force "${@:3}"
  awk -v columns="$2" 'NF == 3 && $1 + 0 > 0 { printf " %.2f, %.0f m/s", $1, $2; if (columns == 3) { sub("%", " %", $3); printf ", %s", $3 }; printf " |"; next }
    { sub("the crack did not pass the gates", "not through"); printf " %s |", $0 }' "$out/$1.txt"
}
by_step() {  # FOLDER NAME SETTING...
  printf '| %s |' "$2"
  for safety in 0.9 0.7 0.5 0.25; do cell "step_$1_$safety" 3 integrator.safety=$safety "${@:3}"; done
  printf '\n'
}

printf '| kinematics, criterion, G/Gc | 0.9 | 0.7 | 0.5 (default) | 0.25 |\n|---|---|---|---|---|\n'
for ((k = 0; k < ${#all[@]}; k += 3)); do by_step "${all[k]}" "${all[k + 1]}, \`critical_energy\`, 1.5" kinematics="${all[k + 2]}"; done
by_step stretch '`baqp`, `critical_stretch` (`consistent`), 2' kinematics=baqp constants.ratio=2 "$stretch"

printf '\n| kinematics | G/Gc = 1.1 | G/Gc = 1.5 | G/Gc = 2 |\n|---|---|---|---|\n'
for ((k = 0; k < ${#all[@]}; k += 3)); do
  printf '| %s |' "${all[k + 1]}"
  for ratio in 1.1 1.5 2; do cell "given_${all[k]}_$ratio" 2 kinematics="${all[k + 2]}" constants.ratio=$ratio; done
  printf '\n'
done
printf '\n| kinematics | softening 4, G/Gc = 1.5 | held, 1.5 | held, 2 |\n|---|---|---|---|\n'
for ((k = 0; k < ${#all[@]}; k += 3)); do
  printf '| %s |' "${all[k + 1]}"
  cell "soft_${all[k]}" 2 kinematics="${all[k + 2]}" damage.softening=4 integrator.end_time=1.6e-4   # slower cracks
  for ratio in 1.5 2; do cell "held_${all[k]}_$ratio" 2 kinematics="${all[k + 2]}" damage.energy=held constants.ratio=$ratio; done
  printf '\n'
done
