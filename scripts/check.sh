#!/usr/bin/env bash
# Checks the form of the code: include directions, clang-format, clang-tidy.
#
#   scripts/check.sh [base]       clang-tidy on the sources that changed since base (default HEAD~)
#   scripts/check.sh --all        clang-tidy on every source
#   scripts/check.sh --no-tidy    no clang-tidy
set -euo pipefail
cd "$(dirname "$0")/.."
scripts/setup.sh checks

scripts/check_includes.py

mapfile -t files < <(git ls-files --cached --others --exclude-standard '*.h' '*.cpp')
clang-format --dry-run --Werror "${files[@]}"
echo "${#files[@]} files formatted"

case "${1:-}" in
  --no-tidy) exit 0 ;;
  --all) mapfile -t sources < <(printf '%s\n' "${files[@]}" | grep '\.cpp$') ;;
  -*) grep '^#   ' "$0" >&2; exit 2 ;;
  *) mapfile -t sources < <(git diff --name-only --diff-filter=d "${1:-HEAD~}" -- '*.cpp') ;;
esac

# The compile commands of GCC's build hold no flag that Clang does not know.
cmake --preset release >/dev/null
printf '%s\n' "${sources[@]}" |
  xargs --no-run-if-empty --max-args 1 --max-procs "$(nproc)" clang-tidy -p build/release --quiet
echo "${#sources[@]} sources tidy"
