#!/usr/bin/env bash
# What a crack costs by critical_energy, bonds that break at once and bonds that weaken, by the energy that they hold and the one that they
# set free: the double cantilever beam under eight kinematics, three more at twice the spacing; and by a stretch and a strength, at two spacings. Three Markdown tables are
# printed: those of framework/docs/fracture.md, "What a crack costs". About an hour and a half on one core; part of `ninja fracture`.
#   crack_cost.sh PERIKIT OUT
. "$(dirname "${BASH_SOURCE[0]}")/table_cells.sh"

# Folder, name in the table, setting, opening of each end [m] by energies set free and held: cracks that cost more are opened farther.
# Of pair laws both energies are the same.
all=(
  bond_based '`bond_based`' '{type="bond_based",surface_correction="none"}' 1.8e-3 ''
  ordinary '`ordinary`' '{type="ordinary",surface_correction="none"}' 1.8e-3 ''
  baqp '`baqp`' baqp 1.8e-3 1.8e-3
  projection '`projection`' projection 1.8e-3 1.8e-3
  bond_augmented '`bond_augmented`' bond_augmented 1.8e-3 1.8e-3
  bond_associated '`bond_associated`' bond_associated 1.8e-3 3e-3
  silling '`conventional` with `silling`, 1' "$silling" 2e-3 4e-3
  wan '`conventional` with `wan`' "$wan" 2e-3 4e-3
)
# At twice the spacing, and plane strain for the selective map, which needs it.
coarse=(
  baqp '`baqp`' baqp stress
  baqp_strain '`baqp`, plane strain' baqp strain
  selective '`selective` over `baqp`, plane strain' '{type="selective",base="baqp"}' strain
  bond_associated '`bond_associated`' bond_associated stress
  non_spherical '`non_spherical`' non_spherical stress
  sub_horizon '`sub_horizon`' sub_horizon stress
)
# By other criteria, with the settings that they need.
others=(
  bond_based '`bond_based`' '{type="bond_based",surface_correction="none"}' false
  baqp '`baqp`' baqp true
  wan '`conventional` with `wan`' "$wan" true
  bond_associated '`bond_associated`' bond_associated true
)

# One cell: energy per area, G, load over LEFM's.   cell FOLDER SETTING...
cell() {
  [ -s "$out/$1.txt" ] || rm -rf "${out:?}/$1"
  run_cell "$1" double_cantilever.sh '' "${@:2}"
  awk 'NF == 6 && $1 + 0 > 0 { printf " %.2f, %.2f, %.2f |", $1, $2, $4; next } { printf " %s |", $0 }' "$out/$1.txt"
}
# by_energy FOLDER KINEMATICS OPENING SOFTENING ENERGY
by_energy() {
  cell "$1_$4_$5" kinematics="$2" constants.w="$3" damage.softening="$4" interface.0.damage.softening="$4" damage.energy="$5" interface.0.damage.energy="$5" "${@:6}"
}
# by_other FOLDER KINEMATICS CRITERION LIMIT OF_ARMS OF_INTERFACE MORE SPACING
by_other() {
  cell "$1_$3_$8" kinematics="$2" damage="{type=\"$3\",$4=$5$7}" interface.0.damage="{type=\"$3\",$4=$6$7}" body.lattice.spacing="$8" constants.dx="$8" \
    integrator.steps=40 constants.w=2.5e-3
}

printf '| kinematics | at once | softening 4 | held, at once | held, softening 4 |\n|---|---|---|---|---|\n'
for ((k = 0; k < ${#all[@]}; k += 5)); do
  printf '| %s |' "${all[k + 1]}"
  for energy in released held; do
    opening=${all[k + 3]}
    [ "$energy" = held ] && opening=${all[k + 4]}
    for softening in 1 4; do
      if [ -n "$opening" ]; then by_energy "${all[k]}" "${all[k + 2]}" "$opening" "$softening" "$energy"; else printf ' the same |'; fi
    done
  done
  printf '\n'
done

printf '\n| kinematics | at once | softening 4 | held, at once | held, softening 4 |\n|---|---|---|---|---|\n'
for ((k = 0; k < ${#coarse[@]}; k += 4)); do
  printf '| %s |' "${coarse[k + 1]}"
  for energy in released held; do
    for softening in 1 4; do
      by_energy "coarse_${coarse[k]}" "${coarse[k + 2]}" 2.5e-3 $softening $energy body.lattice.spacing=2e-3 constants.dx=2e-3 integrator.steps=40 body.plane="${coarse[k + 3]}"
    done
  done
  printf '\n'
done
printf '\n| kinematics | `critical_stretch`, 2 mm | 1 mm | `max_stress`, 2 mm | 1 mm |\n|---|---|---|---|---|\n'
for ((k = 0; k < ${#others[@]}; k += 4)); do
  printf '| %s |' "${others[k + 1]}"
  for spacing in 2e-3 1e-3; do
    by_other "${others[k]}" "${others[k + 2]}" critical_stretch energy_release_rate 1e9 500.0 ",consistent=${others[k + 3]}" $spacing
  done
  for spacing in 2e-3 1e-3; do
    if [ "${others[k]}" = bond_based ]; then printf ' has no stress |'; else by_other "${others[k]}" "${others[k + 2]}" max_stress strength 1e12 1.2e7 '' $spacing; fi
  done
  printf '\n'
done
