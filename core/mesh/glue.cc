// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <new>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/strings/str_cat.h"
#include "core/mesh/mesh_check.h"
#include "core/mesh/volume_mesh.h"

namespace ndmap {
namespace {

using internal::CellList;
using internal::CellName;
using internal::Count;
using internal::FaceName;
using internal::HowCounted;
using internal::Refused;

// The corners of a face in ascending order; a triangle's last is kNoPoint.
using FaceKey = std::array<uint32_t, kMostFaceCorners>;

struct CellFace {
  uint32_t cell;
  uint8_t face;
};

struct KeyedFace {
  FaceKey key;
  CellFace at;
};

FaceKey KeyOf(const VolumeMesh& mesh, const CellFace& at) {
  FaceKey key;
  key.fill(kNoPoint);
  const int size = ShapeOf(mesh.kinds[at.cell]).face_corners[at.face];
  for (int i = 0; i < size; ++i) key[i] = mesh.FacePoint(at.cell, at.face, i);
  std::sort(key.begin(), key.end());  // kNoPoint is larger than any point.
  return key;
}

template <class Visit>
void ForEachFace(const VolumeMesh& mesh, Visit visit) {
  for (uint32_t c = 0; c < mesh.cells(); ++c) {
    const uint8_t faces = ShapeOf(mesh.kinds[c]).faces;
    for (uint8_t f = 0; f < faces; ++f) visit(CellFace{c, f});
  }
}

// All faces, those with the same smallest point together.
struct Buckets {
  std::vector<uint64_t> begins;  // One a point, and one more.
  std::vector<CellFace> faces;
};

Buckets BySmallestPoint(const VolumeMesh& mesh) {
  Buckets out;
  out.begins.assign(mesh.points.size() + 2, 0);
  // Counted two further on, so that after the filling each begin is where it belongs.
  ForEachFace(mesh, [&](const CellFace& at) { ++out.begins[KeyOf(mesh, at)[0] + 2]; });
  for (size_t p = 1; p < out.begins.size(); ++p) out.begins[p] += out.begins[p - 1];
  out.faces.resize(out.begins.back());
  ForEachFace(mesh, [&](const CellFace& at) { out.faces[out.begins[KeyOf(mesh, at)[0] + 1]++] = at; });
  out.begins.pop_back();
  return out;
}

// How the cycles of two faces with the same points lie to each other.
enum class Fit { kOpposite, kAlike, kOtherwise };

Fit FitOf(const VolumeMesh& mesh, const CellFace& a, const CellFace& b, uint8_t* turn) {
  const int size = ShapeOf(mesh.kinds[a.cell]).face_corners[a.face];
  int t = 0;
  while (mesh.FacePoint(b.cell, b.face, t) != mesh.FacePoint(a.cell, a.face, 0)) ++t;
  *turn = static_cast<uint8_t>(t);
  bool opposite = true, alike = true;
  for (int i = 1; i < size; ++i) {
    const uint32_t point = mesh.FacePoint(a.cell, a.face, i);
    opposite &= point == mesh.FacePoint(b.cell, b.face, (t + size - i) % size);
    alike &= point == mesh.FacePoint(b.cell, b.face, (t + i) % size);
  }
  return opposite ? Fit::kOpposite : alike ? Fit::kAlike : Fit::kOtherwise;
}

// Faces that cannot be glued: how many, and the cells at the first of them.
struct FaceFault {
  uint64_t count = 0;
  CellFace face{};
  CellList cells;

  void Add(absl::Span<const KeyedFace> at) {
    if (count++ > 0) return;
    face = at[0].at;
    for (const KeyedFace& f : at) cells.Add(f.at.cell);
  }
  absl::Status Why(const VolumeMesh& mesh, absl::string_view one, absl::string_view many,
                   absl::string_view advice) const {
    return Refused(
        mesh, absl::StrCat(Count(count, one, many), ", ", count == 1 ? "" : "for example ",
                           FaceName(mesh, face.cell, face.face), " of ", cells.Names(mesh), "; ", advice));
  }
};

class Gluer {
 public:
  explicit Gluer(GluedMesh* out) : mesh_(out->mesh), out_(out) {}

  absl::Status Run() {
    out_->links.assign(kMostCellFaces * mesh_.cells(), {});
    const Buckets buckets = BySmallestPoint(mesh_);
    std::vector<KeyedFace> bucket;
    for (size_t p = 0; p + 1 < buckets.begins.size(); ++p) {
      bucket.clear();
      for (uint64_t i = buckets.begins[p]; i < buckets.begins[p + 1]; ++i) {
        bucket.push_back({KeyOf(mesh_, buckets.faces[i]), buckets.faces[i]});
      }
      LinkBucket(&bucket);
    }
    return Faults();
  }

 private:
  void LinkBucket(std::vector<KeyedFace>* bucket) {
    std::stable_sort(bucket->begin(), bucket->end(),
                     [](const KeyedFace& a, const KeyedFace& b) { return a.key < b.key; });
    for (size_t i = 0, end; i < bucket->size(); i = end) {
      end = i + 1;
      while (end < bucket->size() && (*bucket)[end].key == (*bucket)[i].key) ++end;
      LinkSame(absl::MakeConstSpan(*bucket).subspan(i, end - i));
    }
  }

  // All the faces with some set of points.
  void LinkSame(absl::Span<const KeyedFace> same) {
    if (same.size() == 1) {
      ++out_->boundary_faces;
      return;
    }
    if (same.size() > 2) return crowded_.Add(same);
    const CellFace &a = same[0].at, &b = same[1].at;
    uint8_t turn = 0;
    const Fit fit = FitOf(mesh_, a, b, &turn);
    if (fit == Fit::kAlike) return alike_.Add(same);
    if (fit == Fit::kOtherwise) return twisted_.Add(same);
    // Where a's first corner stands at b's corner `turn`, b's first stands at a's corner `turn`.
    out_->links[size_t{kMostCellFaces} * a.cell + a.face] = {b.cell, b.face, turn};
    out_->links[size_t{kMostCellFaces} * b.cell + b.face] = {a.cell, a.face, turn};
  }

  absl::Status Faults() const {
    if (crowded_.count > 0) {
      return crowded_.Why(mesh_, "face has more than two cells", "faces have more than two cells",
                          "a volume mesh has at most one cell on either side of a face");
    }
    if (twisted_.count > 0) {
      return twisted_.Why(mesh_, "quadrilateral is listed with its corners in two different orders",
                          "quadrilaterals are listed with their corners in two different orders",
                          "one of the two cells is twisted");
    }
    if (alike_.count == 0) return absl::OkStatus();
    return alike_.Why(mesh_, "face has both its cells on the same side",
                      "faces have both their cells on the same side",
                      "they overlap, or the corners of one are listed inside out");
  }

  const VolumeMesh& mesh_;
  GluedMesh* out_;
  FaceFault crowded_, twisted_, alike_;
};

// Quadrilaterals at the boundary that two triangles at the boundary fill, or one covers in part: the mesh is
// torn there, though the eye sees no gap.
void WarnOfTears(GluedMesh* out) {
  const VolumeMesh& mesh = out->mesh;
  absl::flat_hash_set<FaceKey> triangles;
  bool quadrilaterals = false;
  ForEachFace(mesh, [&](const CellFace& at) {
    if (!out->Link(at.cell, at.face).boundary()) return;
    const FaceKey key = KeyOf(mesh, at);
    if (key[3] == kNoPoint) {
      triangles.insert(key);
    } else {
      quadrilaterals = true;
    }
  });
  if (!quadrilaterals || triangles.empty()) return;
  CellList torn;
  ForEachFace(mesh, [&](const CellFace& at) {
    if (!out->Link(at.cell, at.face).boundary()) return;
    const FaceKey key = KeyOf(mesh, at);
    if (key[3] == kNoPoint) return;
    for (int without = 0; without < kMostFaceCorners; ++without) {
      FaceKey part = key;
      std::rotate(part.begin() + without, part.begin() + without + 1, part.end());
      part[3] = kNoPoint;
      if (triangles.contains(part)) return torn.Add(at.cell);
    }
  });
  if (torn.count() == 0) return;
  out->warnings.push_back(absl::StrCat(Count(torn.count(), "quadrilateral meets", "quadrilaterals meet"),
                                       " triangles of other cells and cannot be glued to them: of ",
                                       torn.Names(mesh)));
}

absl::StatusOr<GluedMesh> GlueOrThrow(VolumeMesh mesh, const GlueOptions& options) {
  GluedMesh out;
  out.mesh = std::move(mesh);
  if (absl::Status s = internal::CheckArrays(out.mesh); !s.ok()) return s;
  internal::TidyPoints({&out.mesh.points, &out.mesh.corners, &out.mesh.source, "cell"},
                       options.merge_equal_points, &out.notes, &out.warnings);
  if (absl::Status s = internal::CheckCorners(out.mesh); !s.ok()) return s;
  if (absl::Status s = internal::CheckSoundness(out.mesh, options, &out.warnings); !s.ok()) return s;
  if (absl::Status s = Gluer(&out).Run(); !s.ok()) return s;
  WarnOfTears(&out);
  return out;
}

}  // namespace

void VolumeMesh::AddCell(CellKind kind, absl::Span<const uint32_t> cell_points) {
  kinds.push_back(kind);
  corners.insert(corners.end(), cell_points.begin(), cell_points.end());
  begins.push_back(corners.size());
}

absl::StatusOr<GluedMesh> Glue(VolumeMesh mesh, const GlueOptions& options) {
  const uint64_t cells = mesh.cells();
  try {
    return GlueOrThrow(std::move(mesh), options);
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError(
        absl::StrCat("too large for this machine's memory: ", cells, " cells"));
  }
}

}  // namespace ndmap
