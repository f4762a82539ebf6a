#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# A mesh that is fine only near a point: a cluster, a map, two refinements with different oracles, a check, an export.
# usage: examples/refine_near_a_point.sh FOLDER   (ndmap must be in PATH)
set -euo pipefail
folder=${1:?usage: refine_near_a_point.sh FOLDER}
mkdir -p "$folder"

ndmap up --processes 2 --json > "$folder/cluster.json" 2> "$folder/cluster.log" &
cluster=$!
trap 'kill -INT $cluster; wait $cluster || true' EXIT
until grep -q '}' "$folder/cluster.json"; do
  kill -0 $cluster 2> /dev/null || { cat "$folder/cluster.log" >&2; exit 1; }
  sleep 0.1
done
NDMAP_COORDINATOR=$(sed -n 's/.*"coordinator": *"\([^"]*\)".*/\1/p' "$folder/cluster.json")
export NDMAP_COORDINATOR

ndmap sample torus --triangles 2000 -o "$folder/torus.off"
ndmap create torus "$folder/torus.off" --grid 12x12x4 --blocks 4
ndmap refine torus --depth 1
ndmap refine torus --depth 4 --oracle sphere --centre 1,0,0 --radius 0.2
ndmap trim torus
ndmap check torus
ndmap export torus -o "$folder/mesh"
