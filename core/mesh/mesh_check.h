// SPDX-License-Identifier: GPL-3.0-or-later
// What is asked of a mesh before its cells are glued, and the sentences that name cells as the file does.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/types/span.h"
#include "core/mesh/volume_mesh.h"

namespace ndmap::internal {

// The first few of a set of cells, and how many there are.
class CellList {
 public:
  void Add(uint64_t cell) {
    if (first_.size() < kNamed) first_.push_back(cell);
    ++count_;
  }
  uint64_t count() const { return count_; }
  // "tetrahedron 7", "prism 8 and tetrahedron 7", "..., and 20 more", with how the numbers count.
  std::string Names(const VolumeMesh& mesh) const;

 private:
  static constexpr size_t kNamed = 5;
  std::vector<uint64_t> first_;
  uint64_t count_ = 0;
};

// "prism 7": by the number in the file.
std::string CellName(const VolumeMesh& mesh, uint64_t cell);
// "the face of points 1, 2 and 3".
std::string FaceName(const VolumeMesh& mesh, uint64_t cell, int face);
// " (counted from 0)", or nothing.
std::string HowCounted(const MeshSource& source);
inline std::string HowCounted(const VolumeMesh& mesh) { return HowCounted(mesh.source); }
// "1 cell", "7 cells".
std::string Count(uint64_t n, absl::string_view one, absl::string_view many);

// INVALID_ARGUMENT that begins with the file's name, if it is known.
absl::Status Refused(const MeshSource& source, absl::string_view what);
inline absl::Status Refused(const VolumeMesh& mesh, absl::string_view what) {
  return Refused(mesh.source, what);
}

// Arrays that fit together, cells there, indices in range, coordinates finite. O(size).
absl::Status CheckArrays(const VolumeMesh& mesh);
// No corner twice in a cell, no two cells with the same corners. O(n log n).
absl::Status CheckCorners(const VolumeMesh& mesh);
// No inverted and no flat cells; concave ones are refused or warned about. O(cells).
absl::Status CheckSoundness(const VolumeMesh& mesh, const GlueOptions& options,
                            std::vector<std::string>* warnings);

// The points of a mesh and the corners that stand for them.
struct PointTable {
  std::vector<Point3>* points;
  std::vector<uint32_t>* corners;
  MeshSource* source;
  absl::string_view of;  // "cell" or "face".
};

// Merges points of equal coordinates, or warns of them; drops points that nothing uses, with a note. All
// corners must be in range. Expected O(points + corners).
void TidyPoints(const PointTable& table, bool merge_equal, std::vector<std::string>* notes,
                std::vector<std::string>* warnings);

}  // namespace ndmap::internal
