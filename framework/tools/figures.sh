#!/usr/bin/env bash
# Regenerates the figure of each kinematics' page: its spectrum (configs/studies/spectrum.toml) beside that of the conventional model.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
perikit=${PERIKIT:-build/release/bin/perikit}

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
for folder in plugins/kinematics/*/; do
  name=$(basename "$folder")
  case $name in
    conventional) peer=sub_horizon ;;
    selective) continue ;;   # does nothing to a line of Poisson's ratio 0
    *) peer=conventional ;;
  esac
  sed -e "s|^kinematics.type = .*|kinematics.type = [\"$peer\", \"$name\"]|" -e "s|^scene = .*|scene = \"$PWD/configs/chowdhury/spectrum.toml\"|" \
    configs/studies/spectrum.toml > "$work/$name.toml"
  "$perikit" study "$work/$name.toml" -o "$work/$name" > /dev/null
  cp "$work/$name/plot.png" "$folder/spectrum.png"
done
