#!/usr/bin/env bash
# Builds the program, turns scans into a dataset, proves it against them, tells what it holds, and draws it.
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

say "Draw it"
camera=auto
[[ -z ${sources[0]##*statue/campaign.toml} ]] && camera=-3.2,-5.6,3.4/0.1,0.2,2/0,0,1/45
run build/release/cairn render "$dataset" -o demo/campaign.png --size 960x540 --camera="$camera" --force

megabytes() { du --total --block-size=1M --apparent-size "$@" | tail -n 1 | cut -f 1; }
say "Summary"
echo "scans:   ${#scans[@]} files, $(megabytes "${scans[@]}") MiB"
echo "dataset: $dataset, $(megabytes "$dataset") MiB, built in $built_s s, verified"
echo "picture: demo/campaign.png; in a window: build/release/cairn view $dataset --camera=$camera"
