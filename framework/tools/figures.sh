#!/usr/bin/env bash
# Regenerates the figures of the parts' pages. Kinematics and stabilisations: the spectrum (configs/studies/spectrum.toml) beside that of
# the conventional model; selective: Cook's membrane with and without it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
perikit=${PERIKIT:-build/release/bin/perikit}

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
# spectrum FOLDER KEY VALUES: one line for each value of the key
spectrum() {
  local folder=$1 key=$2 values=$3
  sed -e "s|^kinematics.type = .*|$key = $values|" -e "s|^series = .*|series = \"$key\"|" \
    -e "s|^scene = .*|scene = \"$PWD/configs/chowdhury/spectrum.toml\"|" configs/studies/spectrum.toml > "$work/study.toml"
  rm -rf "$work/out"
  "$perikit" study "$work/study.toml" -o "$work/out" > /dev/null
  cp "$work/out/plot.png" "$folder/spectrum.png"
}

for folder in plugins/kinematics/*/; do
  name=$(basename "$folder")
  case $name in
    conventional) peer=sub_horizon ;;
    selective) continue ;;   # does nothing to a line of Poisson's ratio 0
    *) peer=conventional ;;
  esac
  spectrum "$folder" kinematics.type "[\"$peer\", \"$name\"]"
done
for folder in plugins/stabilization/*/; do
  name=$(basename "$folder")
  spectrum "$folder" kinematics "[{ type = \"conventional\" }, { type = \"conventional\", stabilization = { type = \"$name\" } }]"
done

for kinematics in bond_associated selective; do
  table="{ type = \"$kinematics\" }"
  [ $kinematics = selective ] && table='{ type = "selective", base = { type = "bond_associated" } }'
  "$perikit" run configs/scabbia/cook.toml --set "kinematics=$table" -o "$work/$kinematics" --quiet > /dev/null
  "$perikit" plot "$work/$kinematics" --field displacement --component y --deformed 1 --range 0 7 \
    -o plugins/kinematics/selective/cook_$kinematics.png > /dev/null
done
