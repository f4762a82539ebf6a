// SPDX-License-Identifier: GPL-3.0-or-later
// VTK's .vtu: the cells of its pieces.
#include <algorithm>
#include <array>
#include <iterator>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/io/mesh_formats.h"
#include "core/io/text_scanner.h"
#include "core/io/vtu_document.h"

namespace ndmap::internal {
namespace {

struct FlatType {
  int64_t type;
  absl::string_view plural;
};
constexpr FlatType kFlatTypes[] = {
    {0, "empty cells"},
    {1, "vertices"},
    {2, "sets of vertices"},
    {3, "lines"},
    {4, "polylines"},
    {5, "triangles"},
    {6, "triangle strips"},
    {7, "polygons"},
    {8, "pixels"},
    {9, "quadrilaterals"},
    {21, "quadratic edges"},
    {22, "quadratic triangles"},
    {23, "quadratic quadrilaterals"},
    {28, "biquadratic quadrilaterals"},
    {34, "biquadratic triangles"},
};
constexpr FlatType kRefusedTypes[] = {
    {11, "voxels"},
    {15, "pentagonal prisms"},
    {16, "hexagonal prisms"},
    {24, "quadratic tetrahedra"},
    {25, "quadratic hexahedra"},
    {26, "quadratic wedges"},
    {27, "quadratic pyramids"},
    {29, "triquadratic hexahedra"},
    {42, "polyhedra"},
    {71, "Lagrange tetrahedra"},
    {72, "Lagrange hexahedra"},
    {73, "Lagrange wedges"},
    {74, "Lagrange pyramids"},
};

template <size_t n>
absl::string_view Find(const FlatType (&types)[n], int64_t type) {
  const auto found =
      std::find_if(std::begin(types), std::end(types), [&](const FlatType& t) { return t.type == type; });
  return found == std::end(types) ? "" : found->plural;
}

std::optional<CellKind> KindOf(int64_t type) {
  switch (type) {
    case 10:
      return CellKind::kTetrahedron;
    case 12:
      return CellKind::kHexahedron;
    case 13:
      return CellKind::kPrism;
    case 14:
      return CellKind::kPyramid;
    default:
      return std::nullopt;
  }
}

class VtuCells {
 public:
  VtuCells(const VtuDocument& document, uint64_t max_bytes) : document_(document), max_bytes_(max_bytes) {}

  absl::StatusOr<MeshFile> Read() {
    out_.format = "VTU";
    uint64_t pieces = 0;
    for (const VtuFilePiece& piece : document_.pieces) {
      pieces += piece.cells > 0;
      if (absl::Status s = ReadPiece(piece); !s.ok()) return s;
    }
    left_out_.NoteTo(&out_);
    if (pieces > 1) {
      out_.notes.push_back(
          absl::StrCat("has ", pieces,
                       " pieces, each with points of its own: cells of two pieces are glued only "
                       "when equal points are merged"));
    }
    out_.mesh.source.numbering = "cells and points counted from 0";
    return std::move(out_);
  }

 private:
  absl::Status ReadPiece(const VtuFilePiece& piece) {
    const std::pair<const std::optional<VtuArray>*, absl::string_view> wanted[] = {
        {&piece.coordinates, "Points"},
        {&piece.connectivity, "connectivity"},
        {&piece.offsets, "offsets"},
        {&piece.types, "types"}};
    for (const auto& [array, name] : wanted) {
      if (array->has_value()) continue;
      if (piece.points == 0 && piece.cells == 0) return absl::OkStatus();
      return Invalid(absl::StrCat("truncated or damaged: a piece has no array '", name, "'"));
    }
    if (absl::Status s = ReadPoints(piece); !s.ok()) return s;
    auto types = VtuIntegers(document_, *piece.types, piece.cells, max_bytes_);
    if (!types.ok()) return types.status();
    auto offsets = VtuIntegers(document_, *piece.offsets, piece.cells, max_bytes_);
    if (!offsets.ok()) return offsets.status();
    auto connectivity = VtuIntegers(document_, *piece.connectivity, std::nullopt, max_bytes_);
    if (!connectivity.ok()) return connectivity.status();
    return AddCells(piece.points, *types, *offsets, *connectivity);
  }

  absl::Status ReadPoints(const VtuFilePiece& piece) {
    if (piece.coordinates->components != 3) {
      return Invalid(absl::StrCat("array 'Points' of line ", piece.coordinates->line, ": has ",
                                  piece.coordinates->components, " components; 3 expected"));
    }
    first_point_ = out_.mesh.points.size();
    if (piece.points > 0xfffffffe - first_point_) return Invalid("has more points than 32 bits can count");
    const auto reals = VtuReals(document_, *piece.coordinates, 3 * piece.points, max_bytes_);
    if (!reals.ok()) return reals.status();
    for (size_t i = 0; i < reals->size(); i += 3) {
      out_.mesh.points.push_back({(*reals)[i], (*reals)[i + 1], (*reals)[i + 2]});
    }
    return absl::OkStatus();
  }

  absl::Status AddCells(uint64_t points, const std::vector<int64_t>& types,
                        const std::vector<int64_t>& offsets, const std::vector<int64_t>& connectivity) {
    int64_t begin = 0;
    for (size_t c = 0; c < types.size(); ++c, ++cell_) {
      const int64_t end = offsets[c];
      if (end < begin || end > static_cast<int64_t>(connectivity.size())) {
        return Invalid(absl::StrCat("cell ", cell_, ", counted from 0, has offset ", end,
                                    ", out of range; it begins at ", begin, " and connectivity has ",
                                    connectivity.size(), " entries"));
      }
      absl::Status s =
          AddCell(types[c], points, absl::MakeConstSpan(connectivity).subspan(begin, end - begin));
      if (!s.ok()) return s;
      begin = end;
    }
    if (begin == static_cast<int64_t>(connectivity.size())) return absl::OkStatus();
    return Invalid(
        absl::StrCat("its cells use ", begin, " of ", connectivity.size(), " entries of connectivity"));
  }

  absl::Status AddCell(int64_t type, uint64_t points, absl::Span<const int64_t> given) {
    const auto kind = KindOf(type);
    if (!kind) {
      const absl::string_view flat = Find(kFlatTypes, type), refused = Find(kRefusedTypes, type);
      if (flat.empty()) {
        return Invalid(
            absl::StrCat("cell ", cell_, ", counted from 0, is of VTK's type ", type,
                         refused.empty() ? "" : absl::StrCat(" (", refused, ")"),
                         "; tetrahedra (10), hexahedra (12), wedges (13) and pyramids (14) can be read"));
      }
      left_out_.Add(flat, 1);
      return absl::OkStatus();
    }
    const CellShape& shape = ShapeOf(*kind);
    if (given.size() != shape.corners) {
      return Invalid(absl::StrCat("cell ", cell_, ", counted from 0, is a ", shape.name, " with ",
                                  given.size(), " corners; ", shape.corners, " expected"));
    }
    // VTK's wedge has its triangles the other way round.
    constexpr std::array<uint8_t, 6> kWedge = {0, 2, 1, 3, 5, 4};
    std::array<uint32_t, kMostCellCorners> corners{};
    for (size_t i = 0; i < given.size(); ++i) {
      const int64_t index = given[*kind == CellKind::kPrism ? kWedge[i] : i];
      if (index < 0 || index >= static_cast<int64_t>(points)) {
        return Invalid(absl::StrCat("cell ", cell_, ", counted from 0, has point ", index,
                                    ", out of range; there are ", points, ", counted from 0"));
      }
      corners[i] = static_cast<uint32_t>(first_point_ + static_cast<uint64_t>(index));
    }
    out_.mesh.AddCell(*kind, absl::MakeConstSpan(corners).first(given.size()));
    out_.mesh.source.cells.push_back(cell_);
    return absl::OkStatus();
  }

  const VtuDocument& document_;
  uint64_t max_bytes_;
  uint64_t cell_ = 0;  // Of the file, all pieces together.
  uint64_t first_point_ = 0;
  LeftOut left_out_;
  MeshFile out_;
};

}  // namespace

absl::StatusOr<MeshFile> ReadVtu(absl::string_view bytes, uint64_t max_bytes) {
  const auto document = ParseVtu(bytes);
  if (!document.ok()) return document.status();
  return VtuCells(*document, max_bytes).Read();
}

}  // namespace ndmap::internal
