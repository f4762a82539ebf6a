// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/block_piece.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "core/algorithm/refine/hexahedron.h"

namespace ndmap {
namespace {

// Corners in VTK's order, by our numbers.
constexpr std::array<unsigned, 8> kVtkCorners = {0, 1, 3, 2, 4, 5, 7, 6};

// Whether an initial hexahedron has all its vertices: while the algorithm build runs it may have only those
// that it shares with others. The face of d and the faces around it touch all eight corners. O(their darts).
bool HasCorners(Block3::Lcc& map, Block3::Dart d) {
  Block3::Dart e = d;
  do {
    Block3::Dart f = map.beta<2>(e);
    const Block3::Dart begin = f;
    do {
      if (map.attribute<0>(f) == Block3::Lcc::null_handle) return false;
      f = map.beta<1>(f);
    } while (f != begin);
    e = map.beta<1>(e);
  } while (e != d);
  return true;
}

}  // namespace

BlockPiece::BlockPiece(const GridShape& grid, VtuCells cells, const ChosenAttributes& attributes)
    : numbers_(grid), cells_(cells), on_points_(0, attributes), on_cells_(3, attributes) {}

absl::StatusOr<bool> BlockPiece::Step(Block3& block, size_t budget, const AttributeStore* attributes) {
  if (!begun_) {
    begun_ = true;
    version_ = block.version();
    auto& cells = block.map().attributes<3>();
    for (auto it = cells.begin(); it != cells.end(); ++it) todo_.push_back(it);
    std::reverse(todo_.begin(), todo_.end());
  } else if (block.version() != version_) {
    return absl::AbortedError(absl::StrCat("block ", block.id().value, " changed while it was exported"));
  }
  if (attributes != nullptr) {
    for (PieceFields* fields : {&on_points_, &on_cells_}) {
      if (absl::Status s = fields->Look(*attributes); !s.ok()) return s;
    }
  }
  for (size_t i = 0; i < budget && !todo_.empty(); ++i) {
    if (absl::Status s = AddCell(block, todo_.back()); !s.ok()) return s;
    todo_.pop_back();
  }
  for (PieceFields* fields : {&on_points_, &on_cells_}) {
    if (absl::Status s = fields->Check(); !s.ok()) return s;
  }
  if (!todo_.empty()) return false;
  piece_.point_fields = on_points_.Take();
  piece_.cell_fields = on_cells_.Take();
  return true;
}

absl::Status BlockPiece::AddCell(Block3& block, Cell cell) {
  const auto& info = block.map().info_of_attribute<3>(cell);
  if (!HasCorners(block.map(), info.reference)) {
    return absl::FailedPreconditionError(absl::StrCat("block ", block.id().value, " is being built"));
  }
  const int level = info.id.level();
  if (level > numbers_.finest_level()) {
    return absl::OutOfRangeError(absl::StrCat("hexahedron ", info.id.ToString(), " is of level ", level,
                                              ", file numbers of this grid reach level ",
                                              numbers_.finest_level()));
  }
  const Lattice at = numbers_.LowCorner(info.id);
  const int64_t side = int64_t{1} << (numbers_.finest_level() - level);
  const VtuCell what{static_cast<int32_t>(block.id().value), static_cast<uint8_t>(level),
                     static_cast<uint8_t>(info.state == CellState::kClear ? CellState::kUnknown : info.state),
                     numbers_.OfHexahedron(info.id)};
  if (!on_cells_.empty()) on_cells_.Add(info.id);
  const auto frame = Frame<Block3>::Of(block.map(), cell);
  const std::array<Point3, 8> corners = frame.Corners(block.map());
  std::array<Lattice, 8> lattice;
  for (unsigned corner = 0; corner < 8; ++corner) {
    for (int c = 0; c < 3; ++c) lattice[corner][c] = at[c] + (corner >> c & 1) * side;
  }
  if (cells_ == VtuCells::kPolyhedra) return AddFaces(block, frame, lattice, what);
  std::array<int64_t, 8> points;
  for (unsigned i = 0; i < 8; ++i) points[i] = AddPoint(corners[kVtkCorners[i]], lattice[kVtkCorners[i]]);
  piece_.AddHexahedron(points, what);
  return absl::OkStatus();
}

absl::Status BlockPiece::AddFaces(Block3& block, const Frame<Block3>& frame,
                                  const std::array<Lattice, 8>& corners, const VtuCell& what) {
  Faces faces;
  for (unsigned f = 0; f < hexahedron::kFaces; ++f) {
    std::array<Lattice, 4> at;
    for (unsigned k = 0; k < 4; ++k) at[k] = corners[hexahedron::kFaceCorners[f][k]];
    const Dart d = frame.first[hexahedron::Role(f, 0)];
    if (absl::Status s = AddFace(block.map(), d, frame.level, at, faces); !s.ok()) return s;
  }
  piece_.AddPolyhedron(faces.sizes, faces.points, what);
  return absl::OkStatus();
}

absl::Status BlockPiece::AddFace(Lcc& map, Dart d, int level, const std::array<Lattice, 4>& corners,
                                 Faces& faces) {
  if (!Frame<Block3>::FaceIsWhole(map, d, level)) {
    std::array<Lattice, 4> middles;
    for (unsigned k = 0; k < 4; ++k) {
      if (absl::Status s = Between(corners[k], corners[(k + 1) % 4], middles[k]); !s.ok()) return s;
    }
    Lattice centre;
    if (absl::Status s = Between(corners[0], corners[2], centre); !s.ok()) return s;
    for (unsigned k = 0; k < 4; ++k) {
      const std::array<Lattice, 4> part = {corners[k], middles[k], centre, middles[(k + 3) % 4]};
      // On to the dart that leaves the next corner, found before anything else is.
      const Dart next = map.beta<1>(Frame<Block3>::EdgeEnd(map, d, level));
      if (absl::Status s = AddFace(map, d, level + 1, part, faces); !s.ok()) return s;
      d = next;
    }
    return absl::OkStatus();
  }
  std::vector<int64_t> points;
  std::vector<Dart> hanging;
  for (unsigned k = 0; k < 4; ++k) {
    points.push_back(AddPoint(Frame<Block3>::StartPoint(map, d), corners[k]));
    hanging.clear();
    for (d = map.beta<1>(d); Frame<Block3>::StartLevel(map, d) > level; d = map.beta<1>(d)) {
      hanging.push_back(d);
    }
    if (absl::Status s = AddHanging(map, corners[k], corners[(k + 1) % 4], hanging, points); !s.ok()) {
      return s;
    }
  }
  // Our darts run clockwise seen from outside: backwards is VTK's way.
  faces.sizes.push_back(static_cast<int64_t>(points.size()));
  faces.points.insert(faces.points.end(), points.rbegin(), points.rend());
  return absl::OkStatus();
}

absl::Status BlockPiece::AddHanging(Lcc& map, const Lattice& from, const Lattice& to,
                                    absl::Span<const Dart> darts, std::vector<int64_t>& points) {
  if (darts.empty()) return absl::OkStatus();
  // Of the vertices between two ends the one that was made first is in the middle.
  const auto first = std::min_element(darts.begin(), darts.end(), [&map](Dart a, Dart b) {
    return Frame<Block3>::StartLevel(map, a) < Frame<Block3>::StartLevel(map, b);
  });
  const size_t before = static_cast<size_t>(first - darts.begin());
  Lattice middle;
  if (absl::Status s = Between(from, to, middle); !s.ok()) return s;
  if (absl::Status s = AddHanging(map, from, middle, darts.first(before), points); !s.ok()) return s;
  points.push_back(AddPoint(Frame<Block3>::StartPoint(map, *first), middle));
  return AddHanging(map, middle, to, darts.subspan(before + 1), points);
}

absl::Status BlockPiece::Between(const Lattice& a, const Lattice& b, Lattice& middle) const {
  for (int c = 0; c < 3; ++c) {
    if ((a[c] + b[c]) % 2 != 0) {
      return absl::OutOfRangeError(absl::StrCat("a neighbour's hexahedron is finer than level ",
                                                numbers_.finest_level(),
                                                ", which file numbers of this grid reach"));
    }
    middle[c] = (a[c] + b[c]) / 2;
  }
  return absl::OkStatus();
}

int64_t BlockPiece::AddPoint(const Point3& point, const Lattice& at) {
  const int64_t id = numbers_.OfPoint(at);
  const auto [it, added] = point_of_id_.try_emplace(id, 0);
  if (added) {
    it->second = piece_.AddPoint(point, id);
    if (!on_points_.empty()) on_points_.Add(numbers_.VertexAt(at));
  }
  return it->second;
}

}  // namespace ndmap
