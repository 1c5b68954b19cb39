#!/usr/bin/env bash
# Proves that the project builds from nothing: makes a bare Debian 12 in a folder, clones this
# repository's HEAD into it, and runs the demonstration and the tests there. Needs root.
#
#   scripts/check_bare.sh            scripts/demo.sh, then scripts/test.sh
#   scripts/check_bare.sh command    this command instead, with bash, in the clone
set -euo pipefail
cd "$(dirname "$0")/.."
[[ $EUID -eq 0 ]] || exec sudo "scripts/$(basename "$0")" "$@"
command -v debootstrap >/dev/null || apt-get -qq install --yes debootstrap >/dev/null

# The mirror that this machine's own package manager uses.
mirror=$(apt-get indextargets --format '$(SITE) $(RELEASE)' 'Created-By: Packages' |
  awk '$2 == "bookworm" { print $1; exit }')

root=$(mktemp --directory --tmpdir cairn-bare.XXXXXX)
chmod 755 "$root"
clean_up() {
  mountpoint --quiet "$root/proc" && umount "$root/proc"
  rm -rf --one-file-system "$root" "$root.log"
}
trap clean_up EXIT

debootstrap --variant=minbase bookworm "$root" "$mirror" >"$root.log" ||
  { tail -n 20 "$root.log" >&2; exit 1; }
rm -f "$root/etc/apt/sources.list"
for part in /etc/apt /usr/share/keyrings /etc/ssl/certs /usr/share/ca-certificates; do
  [[ -d $part ]] && mkdir -p "$root$part" && cp --archive "$part/." "$root$part"
done
cp /etc/resolv.conf /etc/hosts "$root/etc/"
mount -t proc proc "$root/proc"

mkdir -p "$root/build"
git clone --quiet --no-hardlinks . "$root/build/cairn"
[[ ! -d ../shared ]] || cp --archive --dereference ../shared "$root/build/shared"

echo "Bare Debian $(cat "$root/etc/debian_version") in $root"
env --ignore-environment PATH=/usr/sbin:/usr/bin:/sbin:/bin HOME=/root LC_ALL=C.UTF-8 \
  chroot "$root" bash -c "cd /build/cairn && ${1:-scripts/demo.sh && scripts/test.sh}"
