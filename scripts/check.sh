#!/usr/bin/env bash
# Checks the form of the code: include directions, clang-format, clang-tidy.
#
#   scripts/check.sh [base]       clang-tidy on the sources that changed since base (default HEAD~)
#   scripts/check.sh --all        clang-tidy on every source
#   scripts/check.sh --no-tidy    no clang-tidy
set -euo pipefail
cd "$(dirname "$0")/.."

mapfile -t files < <(git ls-files --cached --others --exclude-standard '*.h' '*.cpp')
case "${1:-}" in
  --no-tidy) sources=() ;;
  --all) mapfile -t sources < <(printf '%s\n' "${files[@]}" | grep '\.cpp$') ;;
  -*) grep '^#   ' "scripts/$(basename "$0")" >&2; exit 2 ;;
  *)
    # In a variable first: inside <( ) a base that git does not know would pass for no changes.
    changed=$(git diff --name-only --diff-filter=d "${1:-HEAD~}" -- '*.cpp')
    mapfile -t sources <<<"$changed"
    [[ -n $changed ]] || sources=()
    ;;
esac
scripts/setup.sh checks

failed=()
scripts/check_includes.py || failed+=("include directions")
clang-format --dry-run --Werror "${files[@]}" || failed+=(clang-format)
if [[ ${#sources[@]} -gt 0 ]]; then
  # With the compile commands of GCC; Clang may not know every warning in them.
  cmake --preset release >/dev/null
  printf '%s\0' "${sources[@]}" |
    xargs -0 --max-args 1 --max-procs "$(nproc)" \
      clang-tidy -p build/release --quiet --extra-arg=-Wno-unknown-warning-option ||
    failed+=(clang-tidy)
fi

echo "Checked ${#files[@]} files, ${#sources[@]} of them with clang-tidy: ${failed[*]:-nothing} failed"
[[ ${#failed[@]} -eq 0 ]]
