// SPDX-License-Identifier: GPL-3.0-or-later
// Medit's .mesh (text) and .meshb (binary, versions 1 to 4).
#include <algorithm>
#include <array>
#include <iterator>
#include <optional>
#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "core/io/mesh_formats.h"
#include "core/io/text_scanner.h"
#include "core/io/word_scanner.h"

namespace ndmap::internal {
namespace {

struct Keyword {
  absl::string_view name;
  int code;  // In .meshb.
  int corners;
  absl::string_view plural;
  std::optional<CellKind> kind = {};
};

constexpr Keyword kCells[] = {
    {"Edges", 5, 2, "lines"},
    {"Triangles", 6, 3, "triangles"},
    {"Quadrilaterals", 7, 4, "quadrilaterals"},
    {"Tetrahedra", 8, 4, "tetrahedra", CellKind::kTetrahedron},
    {"Prisms", 9, 6, "prisms", CellKind::kPrism},
    {"Hexahedra", 10, 8, "hexahedra", CellKind::kHexahedron},
    {"Pyramids", 49, 5, "pyramids", CellKind::kPyramid},
};

// Cells of order 2 and more: P2 to P4 and Q2 to Q4.
constexpr absl::string_view kVolumes[] = {"Tetrahedra", "Prisms", "Hexahedra", "Pyramids"};
constexpr int kCurvedCodes[] = {30, 33, 86, 87, 96, 97, 98, 99, 100, 101, 102, 103};
constexpr int kDimensionCode = 3, kVerticesCode = 4, kEndCode = 54;

// What text and binary have in common. `kBinary` decides how a number is read.
template <bool kBinary>
class MeditReader {
 public:
  explicit MeditReader(absl::string_view bytes) : in_(bytes, kBinary ? '\0' : '#') {}

  absl::StatusOr<MeshFile> Read() {
    if (absl::Status s = kBinary ? BinaryHeader() : TextHeader(); !s.ok()) return s;
    bool more = true;
    while (more) {
      if (absl::Status s = kBinary ? BinarySection(&more) : TextSection(&more); !s.ok()) return s;
    }
    if (!vertices_) return absl::InvalidArgumentError("truncated: the file ends without Vertices");
    left_out_.NoteTo(&out_);
    out_.mesh.source.numbering = "cells of each kind and vertices counted from 1";
    out_.mesh.source.first_point = 1;
    return std::move(out_);
  }

 private:
  absl::Status TextHeader() {
    absl::string_view word;
    int64_t version = 0;
    if (!in_.Word(&word) || !absl::StartsWith(word, "MeshVersion"))
      return in_.Expected("MeshVersionFormatted");
    if (!in_.Integer(&version) || version < 1 || version > 4) return in_.Expected("a version from 1 to 4");
    out_.format = "Medit";
    return absl::OkStatus();
  }

  absl::Status BinaryHeader() {
    int32_t one = 0;
    if (!in_.Binary(&one)) return in_.Expected("the number 1");
    in_.set_swap(one != 1);
    if (!in_.Binary(&version_)) return in_.Expected("the version");
    if (version_ < 1 || version_ > 4) {
      return in_.Wrong(absl::StrCat("is of Medit's version ", version_, "; 1 to 4 can be read"));
    }
    out_.format = "Medit, binary";
    return absl::OkStatus();
  }

  absl::Status TextSection(bool* more) {
    absl::string_view word;
    if (!in_.Word(&word)) {
      out_.notes.push_back("has no End at its end: it may have been cut off");
      *more = false;
      return absl::OkStatus();
    }
    if (word == "End") {
      *more = false;
      return absl::OkStatus();
    }
    if (word == "Dimension") return Dimension();
    if (word == "Vertices") return Vertices();
    for (const Keyword& cells : kCells) {
      if (word == cells.name) return Cells(cells);
    }
    for (const absl::string_view volume : kVolumes) {
      if (absl::StartsWith(word, volume) && (absl::StrContains(word, "P") || absl::StrContains(word, "Q")) &&
          !absl::StrContains(word, "Ordering") && word.size() == volume.size() + 2) {
        return in_.Wrong(absl::StrCat("has ", word, "; only cells of order 1 can be read"));
      }
    }
    if (!absl::ascii_isalpha(word[0])) return in_.Expected("a keyword");
    in_.SkipNumbers();
    return absl::OkStatus();
  }

  absl::Status BinarySection(bool* more) {
    int32_t code = 0;
    if (!in_.Binary(&code)) return in_.Expected("a keyword");
    int64_t next = 0;
    if (version_ < 3) {
      int32_t small = 0;
      if (!in_.Binary(&small)) return in_.Expected("the place of the next keyword");
      next = small;
    } else if (!in_.Binary(&next)) {
      return in_.Expected("the place of the next keyword");
    }
    if (code == kEndCode) {
      *more = false;
      return absl::OkStatus();
    }
    if (code == kDimensionCode) return Dimension();
    if (code == kVerticesCode) return Vertices();
    for (const Keyword& cells : kCells) {
      if (code == cells.code) return Cells(cells);
    }
    if (std::find(std::begin(kCurvedCodes), std::end(kCurvedCodes), code) != std::end(kCurvedCodes)) {
      return in_.Wrong(absl::StrCat("has cells of a higher order (keyword ", code,
                                    "); only cells of order 1 can be read"));
    }
    if (next < static_cast<int64_t>(in_.position())) {
      return in_.Wrong(absl::StrCat("keyword ", code, " says that the next begins at byte ", next));
    }
    return in_.Take(static_cast<uint64_t>(next) - in_.position()) ? absl::OkStatus()
                                                                  : in_.Expected("the next keyword");
  }

  bool Integer(int64_t* value) {
    if constexpr (kBinary) {
      if (version_ >= 4) return in_.Binary(value);
      int32_t small = 0;
      const bool ok = in_.Binary(&small);
      *value = small;
      return ok;
    } else {
      return in_.Integer(value);
    }
  }

  // Binary numbers that are not finite are found when the mesh is checked.
  bool Real(double* value) {
    if constexpr (kBinary) {
      if (version_ >= 2) return in_.Binary(value);
      float small = 0;
      const bool ok = in_.Binary(&small);
      *value = small;
      return ok;
    } else {
      return in_.Real(value);
    }
  }

  absl::Status Dimension() {
    int64_t dimension = 0;
    int32_t binary = 0;
    const bool ok = kBinary ? in_.Binary(&binary) : in_.Integer(&dimension);
    if (kBinary) dimension = binary;
    if (!ok) return in_.Expected("the dimension");
    return dimension == 3 ? absl::OkStatus()
                          : in_.Wrong(absl::StrCat("has ", dimension, " dimensions; 3 expected"));
  }

  absl::Status Vertices() {
    if (vertices_) return in_.Wrong("a second Vertices");
    vertices_ = true;
    int64_t count = 0;
    if (!Integer(&count) || count < 0) return in_.Expected("the number of vertices");
    for (int64_t i = 1; i <= count; ++i) {
      Point3 place;
      for (double& x : place) {
        if (!Real(&x)) return in_.Expected(absl::StrCat("a coordinate of vertex ", i, " of ", count));
      }
      if (absl::Status s = Reference("vertex", i); !s.ok()) return s;
      out_.mesh.points.push_back(place);
    }
    return absl::OkStatus();
  }

  absl::Status Cells(const Keyword& cells) {
    int64_t count = 0;
    if (!Integer(&count) || count < 0) return in_.Expected(absl::StrCat("the number of ", cells.plural));
    uint64_t& numbered = numbered_[static_cast<size_t>(cells.code)];
    for (int64_t i = 1; i <= count; ++i) {
      std::array<uint32_t, kMostCellCorners> corners{};
      for (int c = 0; c < cells.corners; ++c) {
        int64_t index = 0;
        const bool there = Integer(&index);
        if (there && (index < 1 || index > 0xffffffff ||
                      (vertices_ && index > static_cast<int64_t>(out_.mesh.points.size())))) {
          return in_.Wrong(absl::StrCat("number ", i, " of ", count, " ", cells.plural, " has vertex ", index,
                                        ", out of range; vertices are counted from 1",
                                        vertices_ ? absl::StrCat(" to ", out_.mesh.points.size()) : ""));
        }
        if (!there)
          return in_.Expected(absl::StrCat("a vertex of number ", i, " of ", count, " ", cells.plural));
        corners[c] = static_cast<uint32_t>(index - 1);
      }
      if (absl::Status s = Reference(cells.plural, i); !s.ok()) return s;
      if (!cells.kind) continue;
      out_.mesh.AddCell(*cells.kind, absl::MakeConstSpan(corners).first(cells.corners));
      out_.mesh.source.cells.push_back(++numbered);
    }
    if (!cells.kind) left_out_.Add(cells.plural, static_cast<uint64_t>(count));
    return absl::OkStatus();
  }

  // The number behind each vertex and cell, of which nothing is made.
  absl::Status Reference(absl::string_view of, int64_t i) {
    int64_t reference = 0;
    if constexpr (kBinary) {
      if (Integer(&reference)) return absl::OkStatus();
    } else {
      double real = 0;
      if (in_.Real(&real)) return absl::OkStatus();
    }
    return in_.Expected(absl::StrCat("the reference of number ", i, " of the ", of));
  }

  WordScanner in_;
  int32_t version_ = 0;
  bool vertices_ = false;
  std::array<uint64_t, 64> numbered_{};  // By keyword: how many cells came.
  LeftOut left_out_;
  MeshFile out_;
};

}  // namespace

absl::StatusOr<MeshFile> ReadMedit(absl::string_view bytes) { return MeditReader<false>(bytes).Read(); }

absl::StatusOr<MeshFile> ReadMeditBinary(absl::string_view bytes) { return MeditReader<true>(bytes).Read(); }

}  // namespace ndmap::internal
