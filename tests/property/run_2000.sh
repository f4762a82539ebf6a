#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# 2,000 random cases of the central property on both storages, in the simulator; prints one summary line a storage.
# usage: tests/property/run_2000.sh [BUILD_FOLDER]   (default build/release; about a minute)
set -euo pipefail
cd "$(dirname "$0")/../.."
build=${1:-build/release}
cmake --build "$build" --target ndmap_property >/dev/null
for storage in flat cgal; do
  "$build/bin/ndmap_property" --from 0 --to 2000 --storage "$storage"
done
