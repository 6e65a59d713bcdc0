#!/usr/bin/env bash
# From a fresh checkout to results: packages, build, and the quick start scene into out/quickstart. Options go to setup.sh.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

framework/tools/setup.sh "$@"
cmake --preset release -DPERIKIT_TESTS=OFF
cmake --build --preset release
build/release/bin/perikit run configs/quickstart.toml -o out/quickstart
