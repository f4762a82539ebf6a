#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Tries the cluster in containers for real: builds the image, starts a coordinator and four block servers, and does
# the main job on them with the command line from outside: create, refine, trim, check, hash, export. The same job by
# `ndmap run` on this machine must give the same hash. Everything that was started is stopped at the end.
#   deploy/compose/try.sh [SURFACE [DEPTH]]     default: elephant (else a sample), depth 5
# Uses the running Docker if there is one. Else (as root) it starts one of its own, in a network namespace of its own,
# with everything in a temporary folder; a base image that cannot be pulled is made with debootstrap.
#   NDMAP=PROGRAM            the command line to use; default build/release/bin/ndmap
#   NDMAP_CCACHE_DIR=FOLDER  a ccache folder that the image is compiled with
#   NDMAP_TRY_DIR=FOLDER     keep the images of a Docker of our own there, for the next time
set -euo pipefail
cd "$(dirname "$0")/../.."

space=ndmap-try-$$ work=$(mktemp -d "${TMPDIR:-/tmp}/ndmap-try.XXXXXX") keep=${NDMAP_TRY_DIR:-} own=() up=
home=$(realpath -m "${keep:-$work/docker}")
compose=(docker-compose -p ndmap-try -f deploy/compose/docker-compose.yml)

containers() { docker ps -aq --filter label=com.docker.compose.project=ndmap-try; }

say() { printf '%4d s  %s\n' "$SECONDS" "$*"; }

start_docker() {  # start_docker FLAG...: our own daemon, for the whole script or until stop_docker
  mkdir -p "$home"
  "${own[@]}" dockerd --data-root "$home/data" --exec-root "$work/exec" -p "$work/pid" -H "unix://$work/sock" "$@" \
    >>"$work/dockerd.log" 2>&1 &
  export DOCKER_HOST=unix://$work/sock
  until docker info >/dev/null 2>&1; do
    kill -0 $! 2>/dev/null || { tail -n 5 "$work/dockerd.log" >&2; exit 1; }
    sleep 0.2
  done
}

stop_docker() {
  [ -e "$work/pid" ] || return 0
  local pid
  pid=$(cat "$work/pid")
  kill "$pid" && tail --pid="$pid" -f /dev/null
}

clean() {
  local code=$?
  [ "$code" -eq 0 ] || { say "FAILED"; [ -z "$up" ] || "${compose[@]}" logs --tail 20 >&2 || true; }
  [ -z "$up" ] || "${compose[@]}" down --timeout 10 >/dev/null 2>&1 || true
  stop_docker || true
  if [ -e "/run/netns/$space" ]; then ip netns del "$space"; fi
  grep -oE " ($work|$home)/[^ ]*" /proc/self/mounts | sort -r | xargs -r umount || true
  rm -rf --one-file-system "$work"
}
trap clean EXIT
trap 'exit 130' INT TERM

base_image() {  # there already, from the registry, or made here
  docker image inspect debian:bookworm-slim >/dev/null 2>&1 && return
  docker pull -q debian:bookworm-slim >/dev/null 2>&1 && return
  say "no image can be pulled: making the base image with debootstrap"
  debootstrap --variant=minbase bookworm "$work/root" >"$work/debootstrap.log"
  tar -C "$work/root" -c . | docker import - debian:bookworm-slim >/dev/null
  rm -rf --one-file-system "$work/root"
}

build_image() {  # from the last commit
  mkdir "$work/context"
  git archive HEAD | tar -x -C "$work/context"
  [ -z "${NDMAP_CCACHE_DIR:-}" ] || cp -r "$NDMAP_CCACHE_DIR" "$work/context/docker/ccache"
  docker build --network=host -f docker/Dockerfile -t ndmap "$work/context" >"$work/build.log" 2>&1 ||
    { tail -n 30 "$work/build.log" >&2; exit 1; }
  rm -r "$work/context"
}

hash_of() { grep -oE '"hash": *"[0-9a-f]{32}"' "$1" | cut -d'"' -f4; }  # of the output of --json

ndmap=$(readlink -f "${NDMAP:-build/release/bin/ndmap}")
[ -x "$ndmap" ] || { echo "try.sh: there is no $ndmap: run ./setup build, or set NDMAP" >&2; exit 1; }
surface=${1:-../shared/meshes/surfaces/elephant.off} depth=${2:-5}
if [ $# -eq 0 ] && [ ! -e "$surface" ]; then
  surface=$work/bumpy-torus.off
  "$ndmap" sample bumpy-torus -o "$surface"
fi

if docker info >/dev/null 2>&1; then
  say "Docker is running: $(docker info --format '{{.ServerVersion}}')"
  base_image
  build_image
else
  start_docker --bridge=none --iptables=false --ip6tables=false --ip-forward=false --ip-masq=false
  base_image
  build_image
  stop_docker
  # Containers need a bridge and its rules: in a namespace of their own, not in this machine's.
  ip netns add "$space"
  ip -n "$space" link set lo up
  own=(nsenter "--net=/run/netns/$space")
  start_docker --userland-proxy=false
fi
say "the image is built: $(docker image inspect ndmap --format '{{.Size}}' | awk '{ printf "%.0f MB", $1 / 1e6 }')"

began=$(date +%s%N) up=yes
"${compose[@]}" up -d --no-build 2>"$work/up.log" || { cat "$work/up.log" >&2; exit 1; }
deadline=$((SECONDS + 60))
until [ "$(containers | xargs docker inspect --format '{{.State.Health.Status}}' | grep -c '^healthy$')" = 5 ]; do
  [ "$SECONDS" -lt "$deadline" ] || { say "not healthy after 60 s"; exit 1; }
  sleep 0.2
done
say "five containers are up and healthy after $((($(date +%s%N) - began) / 1000000)) ms"
export NDMAP_COORDINATOR=127.0.0.1:7100
outside() { "${own[@]}" "$ndmap" "$@" 2>>"$work/progress.log" || { tail -n 5 "$work/progress.log" >&2; exit 1; }; }
outside version | sed 's/^/        /'
outside create try "$surface" --blocks 4 --depth "$depth" >/dev/null
say "create: $(basename "$surface") in 4 blocks"
outside refine try --depth "$depth" | sed 's/^/        /'
say "refine: depth $depth"
outside trim try >/dev/null
say "trim"
outside check try | sed 's/^/        /'
say "check"
outside --json hash try >"$work/hash.json"
say "hash: $(hash_of "$work/hash.json")"
outside export try -o "$work/out" | sed "s|$work/||; s/^/        /"
say "export"
containers | xargs docker stats --no-stream --format '{{.Name}}: {{.MemUsage}}' | sed 's/^/        /'

unset NDMAP_COORDINATOR
"$ndmap" --json run "$surface" --blocks 4 --depth "$depth" >"$work/run.json" 2>>"$work/progress.log"
say "the same by ndmap run: $(hash_of "$work/run.json")"
[ "$(hash_of "$work/hash.json")" = "$(hash_of "$work/run.json")" ] || { say "the hashes differ"; exit 1; }

began=$(date +%s%N)
"${compose[@]}" stop >/dev/null 2>&1
codes=$(containers | xargs docker inspect --format '{{.State.ExitCode}}' | sort | uniq -c | xargs)
"${compose[@]}" down >/dev/null 2>&1
up=
say "stopped in $((($(date +%s%N) - began) / 1000000)) ms; exit codes (count code): $codes"
[ "$codes" = "5 0" ]
say "done: equal hashes"
