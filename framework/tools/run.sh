#!/usr/bin/env bash
# From a fresh checkout to results: packages, build, the quick start scene into out/quickstart, and a check that what was built computes what it should.
# Options go to setup.sh.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

framework/tools/setup.sh "$@"
cmake --preset release -DPERIKIT_TESTS=OFF -DPERIKIT_NATIVE=OFF   # also in a folder of an earlier version, which was native
cmake --build --preset release
build/release/bin/perikit run configs/quickstart.toml -o out/quickstart
build/release/bin/perikit check --machine
