#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Shows that ./setup works on a bare Debian 12: makes one with debootstrap in a temporary folder, clones this
# checkout (its last commit) into it and runs there what a new user types. Needs root and debootstrap; leaves
# nothing behind. The exit code is that of ./setup.
#   deploy/bare-debian.sh run            ./setup run
#   deploy/bare-debian.sh test           ./setup test
# Environment:
#   NDMAP_BARE_OUT=FOLDER      keep ./setup's log and, of `run`, the out/ folder there
#   NDMAP_CCACHE_DIR=FOLDER    a ccache folder to compile with; without it everything is compiled
#   NDMAP_MIRROR=URL           where debootstrap takes packages from, instead of its default
#   TMPDIR                     where the root is made (5 GB); default /tmp
set -euo pipefail

usage() { sed -n '3,12p' "$0" | sed 's/^# \{0,1\}//' >&2; exit 2; }

# Runs in namespaces of its own: its mounts and its processes end with it, however it ends.
inside() {
  local root=$1 command=$2 variables=(HOME=/root "PATH=/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin")
  local name
  for name in http_proxy https_proxy no_proxy CI; do [ -z "${!name:-}" ] || variables+=("$name=${!name}"); done
  debootstrap --variant=minbase bookworm "$root" ${NDMAP_MIRROR:+"$NDMAP_MIRROR"} >"$root.log"
  echo "bare root: $(du -shx "$root" | cut -f1), $(chroot "$root" dpkg-query -f '.\n' -W | wc -l) packages, after $SECONDS s"
  cp --dereference /etc/resolv.conf "$root/etc/resolv.conf"
  mount -t proc proc "$root/proc"
  mount -t sysfs -o ro sysfs "$root/sys"
  mount --rbind /dev "$root/dev"
  git clone --quiet --no-hardlinks . "$root/root/ndmap"
  if [ -n "${NDMAP_CCACHE_DIR:-}" ]; then
    mkdir -p "$NDMAP_CCACHE_DIR" "$root/root/.cache/ccache"
    mount --bind "$NDMAP_CCACHE_DIR" "$root/root/.cache/ccache"
    variables+=(CCACHE_DIR=/root/.cache/ccache CCACHE_BASEDIR=/root CCACHE_NOHASHDIR=1
      "CCACHE_SLOPPINESS=include_file_ctime,include_file_mtime")
  fi
  local began=$SECONDS code=0
  chroot "$root" /usr/bin/env -i "${variables[@]}" /bin/bash -c "cd /root/ndmap && ./setup $command" || code=$?
  echo "./setup $command: exit code $code after $((SECONDS - began)) s; the root is now $(du -shx "$root" | cut -f1)"
  return "$code"
}

[ $# -ge 1 ] || usage
if [ "$1" = --inside ]; then
  inside "$2" "$3"
  exit
fi
case $1 in run | test) ;; *) usage ;; esac
cd "$(dirname "$0")/.."
[ "$(id -u)" -eq 0 ] || { echo "bare-debian.sh: must be run as root (chroot, mount)" >&2; exit 1; }
for program in debootstrap unshare git; do
  command -v "$program" >/dev/null || { echo "bare-debian.sh: $program is missing: apt-get install debootstrap util-linux git" >&2; exit 1; }
done

root=$(mktemp -d "${TMPDIR:-/tmp}/ndmap-bare.XXXXXX")
trap 'rm -rf --one-file-system "$root" "$root.log" "$root.out"' EXIT
trap 'exit 130' INT TERM
code=0
unshare --mount --pid --fork --kill-child --propagation private "$0" --inside "$root" "$1" >"$root.out" 2>&1 || code=$?
if [ -n "${NDMAP_BARE_OUT:-}" ]; then
  mkdir -p "$NDMAP_BARE_OUT"
  cp "$root.out" "$NDMAP_BARE_OUT/setup-$1.log"
  [ ! -d "$root/root/ndmap/out" ] || cp -r "$root/root/ndmap/out" "$NDMAP_BARE_OUT/"
fi
head -n 1 "$root.out"
echo ...
tail -n 40 "$root.out"
exit "$code"
