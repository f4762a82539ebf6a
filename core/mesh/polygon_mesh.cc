// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/mesh/polygon_mesh.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <tuple>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/mesh/classes.h"
#include "core/mesh/mesh_check.h"

namespace ndmap {
namespace {

using internal::Classes;
using internal::Count;
using internal::HowCounted;
using internal::Refused;

std::string FaceName(const PolygonMesh& mesh, uint64_t face) {
  return absl::StrCat("face ", mesh.source.Cell(face));
}

absl::Status CheckArrays(const PolygonMesh& mesh) {
  constexpr uint64_t kMost = 0xfffffffe;
  if (mesh.points.size() > kMost || mesh.corners.size() > kMost) {
    return Refused(mesh.source, "has more points or corners than 32 bits can count");
  }
  const auto fits = [](const std::vector<uint64_t>& numbers, size_t of) {
    return numbers.empty() || numbers.size() == of;
  };
  if (mesh.begins.empty() || mesh.begins[0] != 0 || mesh.begins.back() != mesh.corners.size() ||
      !std::is_sorted(mesh.begins.begin(), mesh.begins.end()) || !fits(mesh.source.cells, mesh.faces()) ||
      !fits(mesh.source.points, mesh.points.size())) {
    return Refused(mesh.source, "its arrays of faces, corners and numbers do not fit together");
  }
  if (mesh.faces() == 0) return Refused(mesh.source, "has no faces");
  for (uint64_t f = 0; f < mesh.faces(); ++f) {
    for (uint32_t corner : mesh.Corners(f)) {
      if (corner < mesh.points.size()) continue;
      return Refused(mesh.source, absl::StrCat(FaceName(mesh, f), HowCounted(mesh.source),
                                               " has a corner at index ", corner + mesh.source.first_point,
                                               ", out of range; there are ", mesh.points.size(), " points"));
    }
  }
  for (uint32_t p = 0; p < mesh.points.size(); ++p) {
    for (double x : mesh.points[p]) {
      if (std::isfinite(x)) continue;
      return Refused(mesh.source, absl::StrCat("point ", mesh.source.Point(p), HowCounted(mesh.source),
                                               " has a coordinate that is not finite"));
    }
  }
  return absl::OkStatus();
}

// The first few of a set of faces, and how many there are.
class FaceList {
 public:
  void Add(uint64_t face) {
    constexpr size_t kNamed = 5;
    if (first_.size() < kNamed) first_.push_back(face);
    ++count_;
  }
  uint64_t count() const { return count_; }
  std::string Names(const PolygonMesh& mesh) const {
    std::string names;
    for (size_t i = 0; i < first_.size(); ++i) {
      const bool last = i + 1 == first_.size() && count_ == first_.size();
      absl::StrAppend(&names, i == 0 ? "" : last ? " and " : ", ", FaceName(mesh, first_[i]));
    }
    if (count_ > first_.size()) absl::StrAppend(&names, " and ", count_ - first_.size(), " more");
    return absl::StrCat(names, HowCounted(mesh.source));
  }

 private:
  std::vector<uint64_t> first_;
  uint64_t count_ = 0;
};

absl::Status CheckFaces(const PolygonMesh& mesh) {
  FaceList small, repeated;
  std::vector<uint32_t> sorted;
  for (uint64_t f = 0; f < mesh.faces(); ++f) {
    const auto corners = mesh.Corners(f);
    sorted.assign(corners.begin(), corners.end());
    std::sort(sorted.begin(), sorted.end());
    if (sorted.size() < 3) small.Add(f);
    if (std::adjacent_find(sorted.begin(), sorted.end()) != sorted.end()) repeated.Add(f);
  }
  if (small.count() > 0) {
    return Refused(mesh.source, absl::StrCat(Count(small.count(), "face has", "faces have"),
                                             " fewer than three corners: ", small.Names(mesh)));
  }
  if (repeated.count() > 0) {
    return Refused(mesh.source, absl::StrCat(Count(repeated.count(), "face comes", "faces come"),
                                             " to the same point twice: ", repeated.Names(mesh)));
  }
  return absl::OkStatus();
}

// One side of a face.
struct Side {
  uint32_t low, high;  // Its points.
  uint32_t face, side;
  bool up;  // Runs from low to high.
};

std::vector<Side> SortedSides(const PolygonMesh& mesh) {
  std::vector<Side> sides;
  sides.reserve(mesh.corners.size());
  for (uint32_t f = 0; f < mesh.faces(); ++f) {
    const auto corners = mesh.Corners(f);
    for (uint32_t i = 0; i < corners.size(); ++i) {
      const uint32_t from = corners[i], to = corners[(i + 1) % corners.size()];
      sides.push_back({std::min(from, to), std::max(from, to), f, i, from < to});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return std::tie(a.low, a.high, a.face, a.side) < std::tie(b.low, b.high, b.face, b.side);
  });
  return sides;
}

// Edges that cannot be glued: how many, and the faces at the first.
struct EdgeFault {
  uint64_t count = 0;
  uint32_t low = 0, high = 0;
  FaceList faces;

  void Add(absl::Span<const Side> sides) {
    if (count++ > 0) return;
    low = sides[0].low;
    high = sides[0].high;
    for (const Side& s : sides) faces.Add(s.face);
  }
  absl::Status Why(const PolygonMesh& mesh, absl::string_view one, absl::string_view many,
                   absl::string_view advice) const {
    return Refused(mesh.source,
                   absl::StrCat(Count(count, one, many), ", ", count == 1 ? "that" : "for example that",
                                " of points ", mesh.source.Point(low), " and ", mesh.source.Point(high),
                                " of ", faces.Names(mesh), "; ", advice));
  }
};

absl::Status LinkSides(GluedPolygons* out) {
  const PolygonMesh& mesh = out->mesh;
  out->links.assign(mesh.corners.size(), {});
  const std::vector<Side> sides = SortedSides(mesh);
  EdgeFault crowded, alike;
  for (size_t i = 0, end; i < sides.size(); i = end) {
    end = i + 1;
    while (end < sides.size() && sides[end].low == sides[i].low && sides[end].high == sides[i].high) ++end;
    const auto same = absl::MakeConstSpan(sides).subspan(i, end - i);
    if (same.size() > 2) {
      crowded.Add(same);
    } else if (same.size() == 1) {
      ++out->boundary_edges;
    } else if (same[0].up == same[1].up) {
      alike.Add(same);
    } else {
      out->links[mesh.begins[same[0].face] + same[0].side] = {same[1].face, same[1].side};
      out->links[mesh.begins[same[1].face] + same[1].side] = {same[0].face, same[0].side};
    }
  }
  if (crowded.count > 0) {
    return crowded.Why(mesh, "edge has more than two faces", "edges have more than two faces",
                       "a surface has at most one face on either side of an edge");
  }
  if (alike.count == 0) return absl::OkStatus();
  return alike.Why(mesh, "edge is run in the same direction by its two faces",
                   "edges are run in the same direction by their two faces",
                   "turn one of them: all faces must be listed counter-clockwise as seen from the same side");
}

// Twice the area of a face as fans about its first corner make it.
double TwiceArea(const PolygonMesh& mesh, uint64_t face) {
  const auto corners = mesh.Corners(face);
  const Point3& o = mesh.points[corners[0]];
  Point3 sum{};
  for (size_t i = 2; i < corners.size(); ++i) {
    const Point3 &a = mesh.points[corners[i - 1]], &b = mesh.points[corners[i]];
    for (int x = 0; x < 3; ++x) {
      const int y = (x + 1) % 3, z = (x + 2) % 3;
      sum[x] += (a[y] - o[y]) * (b[z] - o[z]) - (a[z] - o[z]) * (b[y] - o[y]);
    }
  }
  return std::hypot(sum[0], sum[1], sum[2]);
}

void WarnOfFlatFaces(GluedPolygons* out) {
  FaceList flat;
  for (uint64_t f = 0; f < out->mesh.faces(); ++f) {
    if (!(TwiceArea(out->mesh, f) > 0)) flat.Add(f);
  }
  if (flat.count() == 0) return;
  out->warnings.push_back(
      absl::StrCat(Count(flat.count(), "face has", "faces have"), " no area: ", flat.Names(out->mesh)));
}

absl::StatusOr<GluedPolygons> GlueOrThrow(PolygonMesh mesh, const GlueOptions& options) {
  GluedPolygons out;
  out.mesh = std::move(mesh);
  if (absl::Status s = CheckArrays(out.mesh); !s.ok()) return s;
  internal::TidyPoints({&out.mesh.points, &out.mesh.corners, &out.mesh.source, "face"},
                       options.merge_equal_points, &out.notes, &out.warnings);
  if (absl::Status s = CheckFaces(out.mesh); !s.ok()) return s;
  if (absl::Status s = LinkSides(&out); !s.ok()) return s;
  WarnOfFlatFaces(&out);
  return out;
}

// Cycles of boundary sides: after a side comes, around its end within the fan of glued faces, the next.
uint64_t CountBoundaryCycles(const GluedPolygons& glued) {
  const PolygonMesh& mesh = glued.mesh;
  const auto next_in_face = [&](SideLink at) {
    const uint64_t size = mesh.Corners(at.face).size();
    return SideLink{at.face, static_cast<uint32_t>((at.side + 1) % size)};
  };
  std::vector<bool> seen(mesh.corners.size(), false);
  uint64_t cycles = 0;
  for (uint32_t f = 0; f < mesh.faces(); ++f) {
    for (uint32_t i = 0; i < mesh.Corners(f).size(); ++i) {
      SideLink at{f, i};
      if (!glued.Link(f, i).boundary() || seen[mesh.begins[f] + i]) continue;
      ++cycles;
      while (!seen[mesh.begins[at.face] + at.side]) {
        seen[mesh.begins[at.face] + at.side] = true;
        at = next_in_face(at);
        while (!glued.Link(at.face, at.side).boundary()) at = next_in_face(glued.Link(at.face, at.side));
      }
    }
  }
  return cycles;
}

}  // namespace

void PolygonMesh::AddFace(absl::Span<const uint32_t> face_points) {
  corners.insert(corners.end(), face_points.begin(), face_points.end());
  begins.push_back(corners.size());
}

absl::StatusOr<GluedPolygons> GluePolygons(PolygonMesh mesh, const GlueOptions& options) {
  const size_t corners = mesh.corners.size();
  try {
    return GlueOrThrow(std::move(mesh), options);
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError(
        absl::StrCat("too large for this machine's memory: faces with ", corners, " corners"));
  }
}

PolygonFacts Describe(const GluedPolygons& glued) {
  const PolygonMesh& mesh = glued.mesh;
  PolygonFacts facts;
  facts.box = {mesh.points.at(0), mesh.points.at(0)};
  for (const Point3& p : mesh.points) {
    for (int x = 0; x < 3; ++x) {
      facts.box.lo[x] = std::min(facts.box.lo[x], p[x]);
      facts.box.hi[x] = std::max(facts.box.hi[x], p[x]);
    }
  }
  Classes faces(mesh.faces()), vertices(mesh.corners.size());
  for (uint64_t f = 0; f < mesh.faces(); ++f) {
    const uint64_t size = mesh.Corners(f).size();
    ++facts.faces[std::min<uint64_t>(size, 5) - 3];
    facts.area += TwiceArea(mesh, f) / 2;
    for (uint64_t i = 0; i < size; ++i) {
      const SideLink& link = glued.Link(f, i);
      if (link.boundary()) continue;
      const uint64_t other = mesh.Corners(link.face).size();
      faces.Join(f, link.face);
      // Our side's beginning is the other's end.
      vertices.Join(mesh.begins[f] + i, mesh.begins[link.face] + (link.side + 1) % other);
    }
  }
  facts.points = mesh.points.size();
  facts.boundary_edges = glued.boundary_edges;
  facts.boundary_cycles = CountBoundaryCycles(glued);
  facts.edges = (mesh.corners.size() + glued.boundary_edges) / 2;
  facts.components = faces.Count();
  facts.euler = static_cast<int64_t>(facts.points) - static_cast<int64_t>(facts.edges) +
                static_cast<int64_t>(mesh.faces());
  facts.split_points = vertices.Count() - facts.points;
  return facts;
}

}  // namespace ndmap
