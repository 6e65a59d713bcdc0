#!/usr/bin/env bash
# From a fresh checkout to the test report: packages, build, every test. Options go to setup.sh; the exit status is that of ctest.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."

framework/tools/setup.sh "$@"
cmake --preset release -DPERIKIT_TESTS=ON -DPERIKIT_NATIVE=OFF
cmake --build --preset release
exec ctest --preset release
