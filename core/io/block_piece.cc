// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/block_piece.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "core/algorithm/refine/frame.h"
#include "core/algorithm/refine/hexahedron.h"

namespace ndmap {
namespace {

// Corners in VTK's order, by our numbers.
constexpr std::array<unsigned, 8> kVtkCorners = {0, 1, 3, 2, 4, 5, 7, 6};

int FinestLevel(const GridShape& grid) {
  int level = 0;
  for (; level < CellId::kMaxLevel; ++level) {
    double points = 1;
    for (uint32_t n : grid.cells) points *= std::ldexp(static_cast<double>(n), level + 1) + 1;
    if (points >= std::ldexp(1.0, 62)) break;
  }
  return level;
}

}  // namespace

BlockPiece::BlockPiece(const GridShape& grid, VtuCells cells)
    : grid_(grid), cells_(cells), finest_(FinestLevel(grid)) {}

absl::StatusOr<bool> BlockPiece::Step(Block3& block, size_t budget) {
  if (!begun_) {
    begun_ = true;
    version_ = block.version();
    auto& cells = block.map().attributes<3>();
    for (auto it = cells.begin(); it != cells.end(); ++it) todo_.push_back(it);
    std::reverse(todo_.begin(), todo_.end());
  } else if (block.version() != version_) {
    return absl::AbortedError(absl::StrCat("block ", block.id().value, " changed while it was exported"));
  }
  for (size_t i = 0; i < budget && !todo_.empty(); ++i) {
    if (absl::Status s = AddCell(block, todo_.back()); !s.ok()) return s;
    todo_.pop_back();
  }
  return todo_.empty();
}

absl::Status BlockPiece::AddCell(Block3& block, Cell cell) {
  const auto& info = block.map().info_of_attribute<3>(cell);
  if (block.map().attribute<0>(info.reference) == Block3::Lcc::null_handle) {
    return absl::FailedPreconditionError(absl::StrCat("block ", block.id().value, " is being built"));
  }
  const int level = info.id.level();
  if (level > finest_) {
    return absl::OutOfRangeError(absl::StrCat("hexahedron ", info.id.ToString(), " is of level ", level,
                                              ", file numbers of this grid reach level ", finest_));
  }
  const uint64_t number = info.id.initial();
  Lattice at = {static_cast<int64_t>(number % grid_.cells[0]),
                static_cast<int64_t>(number / grid_.cells[0] % grid_.cells[1]),
                static_cast<int64_t>(number / grid_.cells[0] / grid_.cells[1])};
  int64_t id = static_cast<int64_t>(number);
  for (int i = 1; i <= level; ++i) {
    const unsigned digit = info.id.digit(i);
    for (int c = 0; c < 3; ++c) at[c] = 2 * at[c] + (digit >> c & 1);
    id = 8 * id + digit;
  }
  const VtuCell what{static_cast<int32_t>(block.id().value), static_cast<uint8_t>(level),
                     static_cast<uint8_t>(info.state == CellState::kClear ? CellState::kUnknown : info.state),
                     id << 3 * (finest_ - level)};
  const auto frame = Frame<Block3>::Of(block.map(), cell);
  const std::array<Point3, 8> corners = frame.Corners(block.map());
  std::array<int64_t, 8> points;
  for (unsigned i = 0; i < 8; ++i) {
    const unsigned corner = kVtkCorners[i];
    Lattice x;
    for (int c = 0; c < 3; ++c) x[c] = (at[c] + (corner >> c & 1)) << (finest_ - level);
    points[i] = AddPoint(corners[corner], x);
  }
  if (cells_ == VtuCells::kPolyhedra) return AddFaces(block, cell, what);
  piece_.AddHexahedron(points, what);
  return absl::OkStatus();
}

absl::Status BlockPiece::AddFaces(Block3& block, Cell cell, const VtuCell& what) {
  auto& map = block.map();
  std::vector<int64_t> sizes, face_points;
  std::vector<Dart> faces = {map.info_of_attribute<3>(cell).reference};
  const auto mark = map.get_new_mark();
  std::vector<Dart> marked;
  absl::Status status;
  for (size_t i = 0; i < faces.size(); ++i) {
    if (map.is_marked(faces[i], mark)) continue;
    // Our darts run clockwise seen from outside: backwards is VTK's way.
    Dart d = faces[i];
    sizes.push_back(0);
    do {
      map.mark(d, mark);
      marked.push_back(d);
      faces.push_back(map.beta<2>(d));
      const Point3 point = Frame<Block3>::StartPoint(map, d);
      const absl::StatusOr<Lattice> at = LatticeAt(point);
      if (at.ok()) {
        face_points.push_back(AddPoint(point, *at));
      } else {
        status = at.status();
      }
      ++sizes.back();
      d = map.beta<0>(d);
    } while (d != faces[i]);
  }
  for (Dart d : marked) map.unmark(d, mark);
  map.free_mark(mark);
  if (!status.ok()) return status;
  piece_.AddPolyhedron(sizes, face_points, what);
  return absl::OkStatus();
}

int64_t BlockPiece::AddPoint(const Point3& point, const Lattice& at) {
  const int64_t nx = (int64_t{grid_.cells[0]} << finest_) + 1;
  const int64_t ny = (int64_t{grid_.cells[1]} << finest_) + 1;
  const int64_t id = at[0] + nx * (at[1] + ny * at[2]);
  const auto [it, added] = point_of_id_.try_emplace(id, 0);
  if (added) it->second = piece_.AddPoint(point, id);
  return it->second;
}

absl::StatusOr<BlockPiece::Lattice> BlockPiece::LatticeAt(const Point3& point) const {
  // A map's vertices lie on dyadic lattices up to rounding: the coarsest lattice that has the point is the
  // one it was made on.
  Lattice at{};
  for (int c = 0; c < 3; ++c) {
    const double side = grid_.hi[c] - grid_.lo[c];
    const double x = (point[c] - grid_.lo[c]) / side * grid_.cells[c];
    const double largest = std::max({std::abs(grid_.lo[c]), std::abs(grid_.hi[c]), side});
    const double rounding = 64 * std::numeric_limits<double>::epsilon() * largest / side * grid_.cells[c];
    bool found = false;
    for (int level = 0; level <= finest_ && !found; ++level) {
      const double scaled = std::ldexp(x, level);
      const double nearest = std::nearbyint(scaled);
      const double tolerance = std::ldexp(rounding, level);
      found = tolerance < 0.25 && std::abs(scaled - nearest) <= tolerance;
      if (found) at[c] = static_cast<int64_t>(nearest) << (finest_ - level);
    }
    if (!found) {
      return absl::OutOfRangeError(absl::StrCat("point ", point[0], ",", point[1], ",", point[2],
                                                " is not a corner of the grid at any level"));
    }
  }
  return at;
}

}  // namespace ndmap
