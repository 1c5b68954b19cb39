#!/usr/bin/env bash
# All benchmarks of speed, one after the other: some 70 minutes and 40 GB of disk. For figures that mean something nothing
# else should run. Needs root and memory control groups of version 1 (growth) and Debian's pcl-tools (peers).
#
#   tests/bench/all.sh GENERATOR.cpp [FOLDER]     a C++ source of a `gen_scan N PREFIX las|ply|pcd`; where scans are kept
#   tests/bench/all.sh --quick GENERATOR.cpp      a minute or two: today's ratios to PCL beside the recorded ones
set -euo pipefail
cd "$(dirname "$0")/../.."
if [[ ${1:-} == --quick ]]; then
  exec tests/bench/peers.py --quick --generator "${2:?a generator}"
fi
generator=${1:?a generator, or --quick}
folder=${2:-$(mktemp -d)}
[[ -n ${2:-} ]] || trap 'rm -rf "$folder"' EXIT

step() {
  printf '\n== %s\n' "$*"
  "$@"
}

step tests/bench/peers.py --generator "$generator" --turns 5 --keep "$folder"
step tests/bench/growth.py --generator "$generator" --turns 5 --keep "$folder" --memory 1GiB 4GiB
step tests/bench/shapes.py --points 20000000 --turns 5 --keep "$folder"
step tests/bench/roofline.py --generator "$generator" --turns 5 --keep "$folder"
for kind in las ply; do
  scan=$folder/bench-5000000.$kind
  [[ -e $scan ]] || { g++ -O2 -o "$folder/gen_scan" "$generator"; "$folder/gen_scan" 5000000 "${scan%.*}" "$kind"; }
  build/release/cairn build "$scan" -o "$folder/$kind.cairn" --force --progress none
  step build/release/read_back "$folder/$kind.cairn" --turns 5
done
step build/release/normals_against_pcl "$folder/bench-5000000.las" --turns 5
