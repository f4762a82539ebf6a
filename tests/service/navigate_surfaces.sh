#!/usr/bin/env bash
# Navigation on the meshes of the surfaces of the main job, against one CGAL map of each:
#   tests/service/navigate_surfaces.sh FOLDER [QUESTIONS]     FOLDER has armadillo.off, elephant.off, ...
# Uses build/release; prints a line for each surface.
set -euo pipefail
folder=${1:?usage: tests/service/navigate_surfaces.sh FOLDER [QUESTIONS]}
root=$(cd "$(dirname "$0")/../.." && pwd)
export NDMAP_NAVIGATE_QUESTIONS=${2:-300}
failed=0
for file in armadillo.off bunny_52000.off elephant.off cow.off turbineblade_199k.off.xz knot2.off cheese.off \
            dragon_871k.off.xz; do
  [ -e "$folder/$file" ] || { echo "$file: not in $folder"; failed=1; continue; }
  if log=$(NDMAP_NAVIGATE_SURFACE="$folder/$file" "$root/build/release/bin/navigate_surfaces_test" 2>&1); then
    echo "$file: $(grep -c '^\[       OK' <<<"$log") tests passed, $NDMAP_NAVIGATE_QUESTIONS questions each, 1, 2 and 8 blocks"
  else
    echo "$file: FAILED"; grep -B1 -A8 Failure <<<"$log" | head -40; failed=1
  fi
done
exit $failed
