#!/usr/bin/env bash
# Builds the program, turns scans into a dataset, proves it against them, and tells what it holds.
#
#   scripts/demo.sh             a generated campaign of five million points in four files
#   scripts/demo.sh scan...     your own scans
#
# The dataset is left in demo/, for use with the program build/release/cairn.
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
scans=()
for scan in "$@"; do scans+=("$(realpath "$scan")"); done
cd "$here"

say() { printf '\n== %s\n' "$*"; }
run() { printf '$ %s\n' "$*"; "$@"; }

say "Set up and build"
scripts/setup.sh
cmake --preset release >/dev/null
cmake --build --preset release --target cairn make_scan
mkdir -p demo

if [[ ${#scans[@]} -eq 0 ]]; then
  say "Generate a campaign"
  # make <points> <shape> <seed> <file>, unless it is there from an earlier run
  make() {
    if [[ ! -e demo/$4 ]]; then  # under its name only when it is whole
      run build/release/make_scan --points "$1" --shape "$2" --seed "$3" -o "demo/half_$4"
      mv "demo/half_$4" "demo/$4"
    fi
    scans+=("demo/$4")
  }
  make 1500000 statue 1 statue_east.las
  make 1000000 statue 2 statue_west.ply
  make 1500000 terrain 3 terrain.las
  make 1000000 facade 4 facade.ply
fi
dataset=demo/campaign.cairn

say "Build the dataset"
SECONDS=0
run build/release/cairn build "${scans[@]}" -o "$dataset" --force
built_s=$SECONDS

say "Verify it, against the scans"
run build/release/cairn verify "$dataset" --against "${scans[@]}"

say "What it holds"
run build/release/cairn info "$dataset"

megabytes() { du --total --block-size=1M --apparent-size "$@" | tail -n 1 | cut -f 1; }
say "Summary"
echo "scans:   ${#scans[@]} files, $(megabytes "${scans[@]}") MiB"
echo "dataset: $dataset, $(megabytes "$dataset") MiB, built in $built_s s, verified"
