#!/usr/bin/env bash
# Builds the release and runs its tests.
#
#   scripts/test.sh            all short tests
#   scripts/test.sh --long     the long ones
#   scripts/test.sh --all      short and long ones, after the sanitizers' builds, tests and fuzzing
set -euo pipefail
cd "$(dirname "$0")/.."

case "${1:-}" in
  "") label='^short$' ;;
  --long) label='^long$' ;;
  --all) label='.' ;;
  *) grep '^#   ' "scripts/$(basename "$0")" >&2; exit 2 ;;
esac

scripts/setup.sh
[[ "${1:-}" != --all ]] || scripts/sanitize.sh asan tsan fuzz
cmake --preset release
cmake --build --preset release
ctest --preset release --parallel "$(nproc)" --label-regex "$label"
