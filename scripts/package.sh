#!/usr/bin/env bash
# Makes the Debian packages of the program, of the reader library and of the Python package, in build/package/.
#
#   scripts/package.sh            builds, packs, and asks lintian
#   scripts/package.sh --check    also installs them in a bare Debian 12 and does the main job there. Needs root.
set -euo pipefail
cd "$(dirname "$0")/.."
case "${1:-}" in
  "" | --check) ;;
  *) grep '^#   ' "scripts/$(basename "$0")" >&2; exit 2 ;;
esac

scripts/setup.sh packages
place=$PWD/build/package
# The same commit gives the same dates.
SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH:-$(git log -1 --format=%ct 2>/dev/null || stat -c %Y CHANGELOG.md)}
export SOURCE_DATE_EPOCH
cmake --preset release -B "$place" -DCMAKE_INSTALL_PREFIX=/usr -DCAIRN_TESTS=OFF \
  -DCAIRN_ZSH_FOLDER=share/zsh/vendor-completions -DCAIRN_PYTHON_FOLDER=lib/python3/dist-packages >/dev/null
cmake --build "$place" | tail -n 1
rm -f "$place"/*.deb
(cd "$place" && cpack >cpack.log) || { cat "$place/cpack.log" >&2; exit 1; }
ls -l "$place"/*.deb
lintian --allow-root --fail-on error,warning --suppress-tags-from-file scripts/debian/lintian-suppressed "$place"/*.deb
[[ "${1:-}" == --check ]] || exit 0

# --- In a bare Debian -----------------------------------------------------------------------------
[[ $EUID -eq 0 ]] || { echo "scripts/package.sh: --check needs root" >&2; exit 4; }
bare=$place/bare root=$place/root
in_root() {
  env --ignore-environment PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 DEBIAN_FRONTEND=noninteractive \
    chroot "$root" "$@"
}
clean_up() {
  ! mountpoint --quiet "$root/proc" || umount "$root/proc"
  rm -rf --one-file-system "$root"
}
trap clean_up EXIT
clean_up

# Made once; what packages need is downloaded once, too.
if [[ ! -e $bare.made ]]; then
  mirror=$(apt-get indextargets --format '$(SITE) $(RELEASE)' 'Created-By: Packages' |
    awk '$2 == "bookworm" { print $1; exit }')
  rm -rf --one-file-system "$bare"
  debootstrap --variant=minbase bookworm "$bare" "$mirror" >"$place/bare.log" ||
    { tail -n 20 "$place/bare.log" >&2; exit 1; }
  rm -f "$bare/etc/apt/sources.list"
  for part in /etc/apt /usr/share/keyrings /etc/ssl/certs /usr/share/ca-certificates; do
    [[ -d $part ]] && mkdir -p "$bare$part" && cp --archive "$part/." "$bare$part"
  done
  # Debian's own packages alone, as a stranger's machine has them.
  for list in "$bare"/etc/apt/sources.list.d/*; do
    grep --quiet --fixed-strings "$mirror" "$list" || rm -f "$list"
  done
  cp /etc/resolv.conf /etc/hosts "$bare/etc/"
  # The manual page is looked for below: minimal roots leave out documents.
  rm -f "$bare"/etc/dpkg/dpkg.cfg.d/*
  chroot "$bare" apt-get -qq update
  touch "$bare.made"
fi
cp --archive --reflink=auto "$bare" "$root"
mount -t proc proc "$root/proc"
mkdir -p "$place/archives" "$root/srv"
cp "$place"/archives/*.deb "$root/var/cache/apt/archives/" 2>/dev/null || true
cp "$place"/cairn_*.deb "$root/srv/cairn.deb"
cp "$place"/libcairn-dev_*.deb "$root/srv/libcairn-dev.deb"
cp "$place"/python3-cairn_*.deb "$root/srv/python3-cairn.deb"
laz=(../shared/data/laz/*.laz)
[[ ! -f ${laz[0]} ]] || cp "${laz[0]}" "$root/srv/scan.laz"

install_there() {
  in_root apt-get -qq -o Dpkg::Use-Pty=0 -o APT::Keep-Downloaded-Packages=true \
    install --yes --no-install-recommends "$@" >"$place/apt.log" 2>&1 || { tail -n 20 "$place/apt.log" >&2; exit 1; }
  cp --update "$root"/var/cache/apt/archives/*.deb "$place/archives/" 2>/dev/null || true
}
fail() { printf 'scripts/package.sh: %s\n' "$*" >&2; exit 1; }

echo "== A bare Debian $(cat "$root/etc/debian_version"): the program without what it recommends"
install_there /srv/cairn.deb
in_root cairn --version
in_root bash -euc '
  cd /srv
  cairn simulate /usr/share/doc/cairn/examples/scenes/statue.toml -o statue --format las --points 200000 --progress none
  cairn build statue/campaign.toml -o statue.cairn --progress none >/dev/null
  cairn verify statue.cairn --against statue/campaign.toml --progress none
  cairn info statue.cairn --json | grep --quiet "\"points\":"
  cairn render statue.cairn -o statue.png >/dev/null
  cairn export statue.cairn --format 3dtiles -o tiles --progress none >/dev/null
  test -s tiles/page.js
  gzip -cd /usr/share/man/man1/cairn.1.gz | grep --quiet "^\.TH CAIRN 1"
  zcat /usr/share/doc/cairn/changelog.Debian.gz | head -n 1
  test -s /usr/share/doc/cairn/copyright
  source /usr/share/bash-completion/completions/cairn
  COMP_WORDS=(cairn build --codec zs) COMP_CWORD=3
  _cairn cairn zs --codec
  test "${COMPREPLY[*]}" = zstd'
if [[ -e $root/srv/scan.laz ]]; then
  ! in_root cairn build /srv/scan.laz -o /srv/scan.cairn --progress none 2>"$place/refused" ||
    fail "LAZ was read without Node.js"
  grep --quiet "is the package nodejs installed?" "$place/refused" || fail "$(cat "$place/refused")"
  echo "== With Node.js: LAZ"
  install_there nodejs
  in_root cairn build /srv/scan.laz -o /srv/scan.cairn --progress none >/dev/null
  in_root cairn verify /srv/scan.cairn --against /srv/scan.laz --progress none
fi

echo "== The library, for a program of others"
install_there /srv/libcairn-dev.deb g++ cmake make
cp --archive tests/consumer "$root/srv/consumer"
in_root bash -euc '
  cd /srv
  cmake -S consumer -B built >/dev/null
  cmake --build built >/dev/null
  built/consumer statue.cairn'

echo "== The Python package"
install_there /srv/python3-cairn.deb
in_root python3 -c '
import cairn
with cairn.open("/srv/statue.cairn") as site:
    points = site.root.read()
    assert points.xyz.shape == (site.root.point_count, 3) and points.weight.sum() == site.point_count
    print(f"{cairn.__version__}: {points} of {site.point_count:,}")'

echo "== What is left when it is removed"
in_root apt-get -qq -o Dpkg::Use-Pty=0 purge --yes cairn libcairn-dev python3-cairn >"$place/apt.log" 2>&1
! in_root bash -c 'compgen -G "/usr/*/cairn*" || compgen -G "/usr/share/*/cairn*" || command -v cairn ||
  compgen -G "/usr/lib/python3*/*/cairn*"' || fail "files are left"
echo "Checked."
