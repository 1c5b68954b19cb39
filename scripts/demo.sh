#!/usr/bin/env bash
# Builds the program, turns scans into a dataset, proves it against them, and tells what it holds.
#
#   scripts/demo.sh             four million points of a statue, simulated from seven stations
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
cmake --build --preset release --target cairn
mkdir -p demo

if [[ ${#scans[@]} -eq 0 ]]; then
  say "Simulate a campaign"
  run build/release/cairn simulate configs/scenes/statue.toml -o demo/statue --points 4000000 --force
  sources=(demo/statue/campaign.toml)
  scans=(demo/statue/*.ply)
else
  sources=("${scans[@]}")
fi
dataset=demo/campaign.cairn

say "Build the dataset"
SECONDS=0
run build/release/cairn build "${sources[@]}" -o "$dataset" --force
built_s=$SECONDS

say "Verify it, against the scans"
run build/release/cairn verify "$dataset" --against "${sources[@]}"

say "What it holds"
run build/release/cairn info "$dataset"

megabytes() { du --total --block-size=1M --apparent-size "$@" | tail -n 1 | cut -f 1; }
say "Summary"
echo "scans:   ${#scans[@]} files, $(megabytes "${scans[@]}") MiB"
echo "dataset: $dataset, $(megabytes "$dataset") MiB, built in $built_s s, verified"
