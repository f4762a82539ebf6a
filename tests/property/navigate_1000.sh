#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# 1,000 random cases of navigation for n = 2, 3 and 4, against a single CGAL map; prints one summary line for each n.
# usage: tests/property/navigate_1000.sh [BUILD_FOLDER]   (default build/release)
set -euo pipefail
cd "$(dirname "$0")/../.."
build=${1:-build/release}
cmake --build "$build" --target ndmap_navigate_cases >/dev/null
for n in 2 3 4; do
  "$build/bin/ndmap_navigate_cases" --n "$n" --from 0 --to 1000
done
