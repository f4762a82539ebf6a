// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/named_piece.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/algorithm/refine/frame.h"
#include "core/mesh/cell_darts.h"

namespace ndmap {
namespace {

// How VTK has a kind: its type, and our local corners (core/mesh/cell_darts.h) in its order. The triangles of
// its wedge run the other way round than those of our prism.
struct VtkKind {
  uint8_t type;
  std::array<uint8_t, kMostCellCorners> corners;
};
constexpr std::array<VtkKind, kCellKinds> kVtkKinds = {{
    {kVtkTetra, {0, 1, 2, 3}},
    {kVtkPyramid, {0, 1, 2, 3, 4}},
    {kVtkWedge, {0, 2, 1, 3, 5, 4}},
    {kVtkHexahedron, {0, 1, 3, 2, 4, 5, 7, 6}},
}};

}  // namespace

NamedPiece::NamedPiece(std::shared_ptr<const InitialCells> initial, uint64_t cells, VtuCells as,
                       const ChosenAttributes& attributes)
    : initial_(std::move(initial)),
      numbers_(cells),
      as_(as),
      on_points_(0, attributes),
      on_cells_(3, attributes) {}

absl::StatusOr<bool> NamedPiece::Step(Block3& block, size_t budget, const AttributeStore* attributes) {
  if (!begun_) {
    begun_ = true;
    version_ = block.version();
    names_ = std::make_unique<CellNames<Block3>>(block.map(), *initial_);
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

absl::Status NamedPiece::AddCell(Block3& block, Cell cell) {
  const auto& info = block.map().info_of_attribute<3>(cell);
  if (info.id.level() == 0 && !HasVertices<Block3>(block.map(), info.reference)) {
    return absl::FailedPreconditionError(absl::StrCat("block ", block.id().value, " is being built"));
  }
  const std::optional<int64_t> number = numbers_.OfCell(info.id);
  if (!number) {
    return absl::OutOfRangeError(absl::StrCat("hexahedron ", info.id.ToString(), " is of level ",
                                              info.id.level(), ", file numbers of this mesh reach level ",
                                              numbers_.finest_level()));
  }
  kind_ = info.kind;
  const VtuCell what{static_cast<int32_t>(block.id().value), static_cast<uint8_t>(info.id.level()),
                     static_cast<uint8_t>(info.state == CellState::kClear ? CellState::kUnknown : info.state),
                     *number};
  if (!on_cells_.empty()) on_cells_.Add(info.id);
  const size_t darts = names_->Look(cell);
  return as_ == VtuCells::kPolyhedra ? AddFaces(block, darts, what) : AddCorners(block, darts, what);
}

absl::Status NamedPiece::AddCorners(Block3& block, size_t darts, const VtuCell& what) {
  const unsigned count = DartsOf(kind_).corners;
  std::array<size_t, kMostCellCorners> dart_at;
  dart_at.fill(darts);
  for (size_t i = 0; i < darts; ++i) {
    if (const unsigned corner = names_->Corner(i); corner < count) dart_at[corner] = i;
  }
  const VtkKind& vtk = kVtkKinds[static_cast<size_t>(kind_)];
  std::array<int64_t, kMostCellCorners> points;
  for (unsigned i = 0; i < count; ++i) {
    const size_t dart = dart_at[vtk.corners[i]];
    if (dart == darts) {
      return absl::InternalError(absl::StrCat("block ", block.id().value, ": a cell without its corner ", i));
    }
    absl::StatusOr<int64_t> point = AddPoint(block, dart);
    if (!point.ok()) return point.status();
    points[i] = *point;
  }
  piece_.AddCell(vtk.type, absl::MakeConstSpan(points).first(count), what);
  return absl::OkStatus();
}

absl::Status NamedPiece::AddFaces(Block3& block, size_t darts, const VtuCell& what) {
  auto& map = block.map();
  std::vector<int64_t> sizes, points;
  for (size_t i = 0; i < darts;) {
    const auto first = names_->dart(i);
    const size_t begin = points.size();
    do {
      absl::StatusOr<int64_t> point = AddPoint(block, i);
      if (!point.ok()) return point.status();
      points.push_back(*point);
    } while (map.beta<1>(names_->dart(i++)) != first);
    // Our darts run clockwise seen from outside: backwards is VTK's way.
    std::reverse(points.begin() + static_cast<ptrdiff_t>(begin), points.end());
    sizes.push_back(static_cast<int64_t>(points.size() - begin));
  }
  piece_.AddPolyhedron(sizes, points, what);
  return absl::OkStatus();
}

absl::StatusOr<int64_t> NamedPiece::AddPoint(Block3& block, size_t i) {
  const CellId vertex = names_->Name(i, 0);
  const std::optional<int64_t> number = numbers_.OfVertex(vertex);
  if (!number) {
    return absl::OutOfRangeError(absl::StrCat("vertex ", vertex.ToString(),
                                              " of a neighbour is finer than level ", numbers_.finest_level(),
                                              ", which file numbers of this mesh reach"));
  }
  const auto [it, added] = point_of_id_.try_emplace(*number, 0);
  if (added) {
    it->second = piece_.AddPoint(Frame<Block3>::StartPoint(block.map(), names_->dart(i)), *number);
    if (!on_points_.empty()) on_points_.Add(vertex);
  }
  return it->second;
}

}  // namespace ndmap
