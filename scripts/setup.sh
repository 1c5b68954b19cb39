#!/usr/bin/env bash
# Installs what the build and its tests need on Debian 12, if it is missing; does nothing when all is there.
#
#   scripts/setup.sh            compiler, CMake and libraries
#   scripts/setup.sh checks     these, Clang with its sanitizers, clang-format and clang-tidy, and matplotlib
#   scripts/setup.sh packages   compiler, CMake and libraries, and what scripts/package.sh needs
set -euo pipefail

packages=(
  g++ cmake ninja-build ccache pkg-config git ca-certificates python3
  libtbb-dev libfmt-dev libcli11-dev libtomlplusplus-dev nlohmann-json3-dev
  liblzo2-dev libzstd-dev libxxhash-dev libpugixml-dev libcurl4-openssl-dev libgtest-dev libgmock-dev
  libbenchmark-dev
  libembree-dev libflann-dev liblz4-dev libpcl-dev
  python3-dev python3-numpy pybind11-dev
  libglm-dev libpng-dev libglfw3-dev libepoxy-dev libegl-dev libimgui-dev libgl1-mesa-dri
  libmeshoptimizer-dev
  xvfb xdotool  # windows without a screen, for tests
  nginx-light   # a server, for tests of streaming
  chromium  # web pages without a screen, for tests
  man-db groff-base mandoc zsh fish  # readers of what the program generates, for tests
)
if [[ "${1:-}" == checks ]]; then
  packages+=(clang clang-format clang-tidy lld libclang-rt-14-dev llvm-14 dpkg-dev
    python3-matplotlib)
elif [[ "${1:-}" == packages ]]; then
  packages+=(dpkg-dev file lintian debootstrap)
elif [[ $# -gt 0 ]]; then
  grep '^#   ' "$0" >&2
  exit 2
fi
# Node.js may come from elsewhere, with an npm of its own.
command -v node >/dev/null || packages+=(nodejs)
command -v npm >/dev/null || packages+=(npm)

missing=()
for package in "${packages[@]}"; do
  [[ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>/dev/null)" == installed ]] ||
    missing+=("$package")
done
[[ ${#missing[@]} -eq 0 ]] && exit 0

as_root=()
[[ $EUID -eq 0 ]] || as_root=(sudo)
apt=("${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get -qq -o DPkg::Lock::Timeout=300)

echo "Installing: ${missing[*]}"
"${apt[@]}" update
"${apt[@]}" install --yes --no-install-recommends "${missing[@]}" >/dev/null
