// SPDX-License-Identifier: GPL-3.0-or-later
// MFEM's own text format, version 1.0, with straight cells.
#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/io/mesh_formats.h"
#include "core/io/text_scanner.h"
#include "core/io/word_scanner.h"

namespace ndmap::internal {
namespace {

struct Geometry {
  absl::string_view plural;
  int vertices;
};
constexpr Geometry kGeometries[] = {{"points", 1},         {"lines", 2},      {"triangles", 3},
                                    {"quadrilaterals", 4}, {"tetrahedra", 4}, {"hexahedra", 8},
                                    {"prisms", 6},         {"pyramids", 5}};
constexpr CellKind kKinds[] = {CellKind::kTetrahedron, CellKind::kHexahedron, CellKind::kPrism,
                               CellKind::kPyramid};
constexpr int64_t kFirstCell = 4;

class MfemReader {
 public:
  explicit MfemReader(absl::string_view bytes) : in_(bytes, '#') {}

  absl::StatusOr<MeshFile> Read() {
    absl::string_view word;
    if (!in_.Word(&word) || word != "MFEM" || !in_.Word(&word) || (word != "mesh" && word != "NC")) {
      return in_.Expected("MFEM mesh v1.0");
    }
    if (word == "NC")
      return in_.Wrong("is an MFEM mesh with hanging nodes; only conforming ones can be read");
    if (!in_.Word(&word) || word != "v1.0") return in_.Expected("v1.0");
    out_.format = "MFEM";
    bool elements = false, vertices = false;
    while (in_.Word(&word)) {
      absl::Status s;
      if (word == "dimension") {
        int64_t dimension = 0;
        if (!in_.Integer(&dimension) || dimension != 3) s = in_.Expected("the dimension 3");
      } else if (word == "elements") {
        if (elements) return in_.Wrong("a second elements");
        elements = true;
        s = Cells("element");
      } else if (word == "boundary") {
        s = Cells("boundary element");
      } else if (word == "vertices") {
        if (vertices) return in_.Wrong("a second vertices");
        vertices = true;
        s = Vertices();
      } else {
        s = in_.Expected("dimension, elements, boundary or vertices");
      }
      if (!s.ok()) return s;
    }
    if (!elements || !vertices) {
      return absl::InvalidArgumentError(
          absl::StrCat("truncated: the file ends without ", elements ? "vertices" : "elements"));
    }
    left_out_.NoteTo(&out_);
    out_.mesh.source.numbering = "elements and vertices counted from 0";
    return std::move(out_);
  }

 private:
  absl::Status Cells(absl::string_view what) {
    int64_t count = 0;
    if (!in_.Integer(&count) || count < 0) return in_.Expected(absl::StrCat("the number of ", what, "s"));
    for (int64_t i = 0; i < count; ++i) {
      int64_t attribute = 0, geometry = 0;
      if (!in_.Integer(&attribute)) return in_.Expected(absl::StrCat("the attribute of ", what, " ", i));
      if (!in_.Integer(&geometry) || geometry < 0 ||
          geometry >= static_cast<int64_t>(std::size(kGeometries))) {
        return in_.Expected(absl::StrCat("the geometry, 0 to 7, of ", what, " ", i));
      }
      std::array<uint32_t, kMostCellCorners> corners{};
      const Geometry& shape = kGeometries[geometry];
      for (int c = 0; c < shape.vertices; ++c) {
        int64_t index = 0;
        if (!in_.Integer(&index) || index < 0 || index > 0xfffffffe) {
          return in_.Expected(absl::StrCat("a vertex of ", what, " ", i));
        }
        corners[c] = static_cast<uint32_t>(index);
      }
      if (geometry < kFirstCell) {
        left_out_.Add(shape.plural, 1);
      } else if (what == "element") {
        out_.mesh.AddCell(kKinds[geometry - kFirstCell], absl::MakeConstSpan(corners).first(shape.vertices));
        out_.mesh.source.cells.push_back(static_cast<uint64_t>(i));
      } else {
        return in_.Wrong(absl::StrCat(what, " ", i, " has three dimensions"));
      }
    }
    return absl::OkStatus();
  }

  absl::Status Vertices() {
    int64_t count = 0;
    if (!in_.Integer(&count) || count < 0) return in_.Expected("the number of vertices");
    absl::string_view word;
    if (!in_.Word(&word)) return in_.Expected("the number of coordinates");
    if (word == "nodes") return in_.Wrong("has curved cells (nodes); only straight ones can be read");
    if (word != "3") return in_.Expected("the number of coordinates, 3,");
    for (int64_t i = 0; i < count; ++i) {
      Point3 place;
      for (double& x : place) {
        if (!in_.Real(&x)) return in_.Expected(absl::StrCat("a coordinate of vertex ", i, " of ", count));
      }
      out_.mesh.points.push_back(place);
    }
    return absl::OkStatus();
  }

  WordScanner in_;
  LeftOut left_out_;
  MeshFile out_;
};

}  // namespace

absl::StatusOr<MeshFile> ReadMfem(absl::string_view bytes) { return MfemReader(bytes).Read(); }

}  // namespace ndmap::internal
