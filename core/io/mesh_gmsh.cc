// SPDX-License-Identifier: GPL-3.0-or-later
// Gmsh's .msh: versions 2.0 to 2.2 and 4.1, text and binary.
#include <algorithm>
#include <array>
#include <optional>
#include <utility>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/io/mesh_formats.h"
#include "core/io/text_scanner.h"
#include "core/io/word_scanner.h"

namespace ndmap::internal {
namespace {

struct ElementType {
  int number;
  uint8_t dimension;
  uint8_t nodes;
  absl::string_view plural;
  std::optional<CellKind> kind = {};
};

constexpr ElementType kElementTypes[] = {
    {1, 1, 2, "lines"},
    {2, 2, 3, "triangles"},
    {3, 2, 4, "quadrilaterals"},
    {4, 3, 4, "tetrahedra", CellKind::kTetrahedron},
    {5, 3, 8, "hexahedra", CellKind::kHexahedron},
    {6, 3, 6, "prisms", CellKind::kPrism},
    {7, 3, 5, "pyramids", CellKind::kPyramid},
    {8, 1, 3, "lines of order 2"},
    {9, 2, 6, "triangles of order 2"},
    {10, 2, 9, "quadrilaterals of order 2"},
    {11, 3, 10, "tetrahedra of order 2"},
    {12, 3, 27, "hexahedra of order 2"},
    {13, 3, 18, "prisms of order 2"},
    {14, 3, 14, "pyramids of order 2"},
    {15, 0, 1, "points"},
    {16, 2, 8, "quadrilaterals of order 2 with 8 nodes"},
    {17, 3, 20, "hexahedra of order 2 with 20 nodes"},
    {18, 3, 15, "prisms of order 2 with 15 nodes"},
    {19, 3, 13, "pyramids of order 2 with 13 nodes"},
    {21, 2, 10, "triangles of order 3"},
    {26, 1, 4, "lines of order 3"},
    {29, 3, 20, "tetrahedra of order 3"},
    {36, 2, 16, "quadrilaterals of order 3"},
    {90, 3, 40, "prisms of order 3"},
    {92, 3, 64, "hexahedra of order 3"},
};

class GmshReader {
 public:
  explicit GmshReader(absl::string_view bytes) : in_(bytes, '\0') {}

  absl::StatusOr<MeshFile> Read() {
    if (absl::Status s = Header(); !s.ok()) return s;
    absl::string_view word;
    bool elements = false;
    while (in_.Word(&word)) {
      absl::Status s;
      if (word == "$Nodes") {
        if (nodes_) return in_.Wrong("a second $Nodes");
        nodes_ = true;
        s = version4_ ? Nodes4() : Nodes2();
      } else if (word == "$Elements") {
        if (elements) return in_.Wrong("a second $Elements");
        if (!nodes_) return in_.Wrong("$Elements stands before $Nodes");
        elements = true;
        s = version4_ ? Elements4() : Elements2();
      } else if (absl::StartsWith(word, "$") && !absl::StartsWith(word, "$End")) {
        const std::string end = absl::StrCat("$End", word.substr(1));
        if (!in_.SkipBehind(end)) s = in_.Expected(Shown(end));
      } else {
        s = in_.Expected("the beginning of a section");
      }
      if (!s.ok()) return s;
    }
    if (!elements) {
      return absl::InvalidArgumentError(
          absl::StrCat("truncated: the file ends without ", nodes_ ? "$Elements" : "$Nodes"));
    }
    out_.mesh.source.points = numbers_.Take();
    out_.mesh.source.numbering = "by the file's element and node numbers";
    left_out_.NoteTo(&out_);
    return std::move(out_);
  }

 private:
  absl::Status Header() {
    absl::string_view word;
    if (!in_.Word(&word) || word != "$MeshFormat") {
      if (word == "$NOD") return in_.Wrong("is a Gmsh 1 file; save it as version 4.1 or 2.2");
      return in_.Expected("$MeshFormat");
    }
    absl::string_view version;
    double number = 0;
    if (!in_.Word(&version) || !absl::SimpleAtod(version, &number))
      return in_.Expected("the format's version");
    version4_ = number == 4.1;
    if (!version4_ && !(number >= 2 && number < 3)) {
      return in_.Wrong(absl::StrCat("is of Gmsh's format ", Shown(version),
                                    "; 2.0 to 2.2 and 4.1 can be read, save it as one of them"));
    }
    int64_t type = 0, size = 0;
    if (!in_.Integer(&type) || type < 0 || type > 1) return in_.Expected("0 for text or 1 for binary");
    if (!in_.Integer(&size) || (type == 1 && size != 8)) return in_.Expected("8, the size of a number,");
    binary_ = type == 1;
    out_.format = absl::StrCat("Gmsh ", version4_ ? "4.1" : "2.2", binary_ ? ", binary" : "");
    if (binary_) {
      int32_t one = 0;
      if (!in_.EndLine()) return in_.Expected("the end of the line");
      if (!in_.Binary(&one)) return in_.Expected("the number 1");
      if (one != 1 && one != 0x01000000) return in_.Wrong("has no 1 to tell the order of bytes by");
      in_.set_swap(one != 1);
    }
    return End("$EndMeshFormat");
  }

  absl::Status End(absl::string_view end) {
    absl::string_view word;
    return in_.Word(&word) && word == end ? absl::OkStatus() : in_.Expected(end);
  }

  bool Int(int64_t* value) {
    if (!binary_) return in_.Integer(value);
    int32_t raw = 0;
    const bool ok = in_.Binary(&raw);
    *value = raw;
    return ok;
  }
  // Sizes and numbers of nodes and elements in version 4.
  bool Size(uint64_t* value) {
    if (binary_) return in_.Binary(value);
    int64_t text = -1;
    if (!in_.Integer(&text) || text < 0) return false;
    *value = static_cast<uint64_t>(text);
    return true;
  }
  // Binary numbers that are not finite are found when the mesh is checked.
  bool Real(double* value) { return binary_ ? in_.Binary(value) : in_.Real(value); }

  absl::Status Place(uint64_t node, Point3* place) {
    for (double& x : *place) {
      if (!Real(&x)) return in_.Expected(absl::StrCat("a coordinate of node ", node));
    }
    return absl::OkStatus();
  }

  absl::Status AddNode(uint64_t node) {
    if (numbers_.size() >= 0xfffffffe) return in_.Wrong("has more nodes than 32 bits can count");
    return numbers_.Add(node) ? absl::OkStatus() : in_.Wrong(absl::StrCat("node ", node, " is there twice"));
  }

  absl::Status Nodes2() {
    int64_t count = 0;
    if (!in_.Integer(&count) || count < 0) return in_.Expected("the number of nodes");
    if (binary_ && !in_.EndLine()) return in_.Expected("the end of the line");
    for (int64_t i = 0; i < count; ++i) {
      int64_t node = 0;
      if (!Int(&node) || node < 0)
        return in_.Expected(absl::StrCat("the number of node ", i + 1, " of ", count));
      Point3 place;
      if (absl::Status s = Place(static_cast<uint64_t>(node), &place); !s.ok()) return s;
      if (absl::Status s = AddNode(static_cast<uint64_t>(node)); !s.ok()) return s;
      out_.mesh.points.push_back(place);
    }
    return End("$EndNodes");
  }

  absl::Status Nodes4() {
    if (binary_ && !in_.EndLine()) return in_.Expected("the end of the line");
    std::array<uint64_t, 4> head;  // Blocks, nodes, smallest and largest number.
    for (uint64_t& h : head) {
      if (!Size(&h)) return in_.Expected("the numbers of blocks and of nodes");
    }
    for (uint64_t b = 0; b < head[0]; ++b) {
      int64_t dimension = 0, entity = 0, parametric = 0;
      uint64_t count = 0;
      if (!Int(&dimension) || !Int(&entity) || !Int(&parametric) || !Size(&count)) {
        return in_.Expected(absl::StrCat("the beginning of block ", b + 1, " of ", head[0], " of nodes"));
      }
      if (dimension < 0 || dimension > 3) {
        return in_.Wrong(absl::StrCat("a block of nodes has ", dimension, " dimensions"));
      }
      const uint64_t first = numbers_.size();
      for (uint64_t i = 0; i < count; ++i) {
        uint64_t node = 0;
        if (!Size(&node))
          return in_.Expected(absl::StrCat("the number of node ", first + i + 1, " of ", head[1]));
        if (absl::Status s = AddNode(node); !s.ok()) return s;
      }
      for (uint64_t i = 0; i < count; ++i) {
        Point3 place;
        if (absl::Status s = Place(numbers_.number(first + i), &place); !s.ok()) return s;
        out_.mesh.points.push_back(place);
        for (int64_t u = 0; u < (parametric != 0 ? dimension : 0); ++u) {
          double ignored = 0;
          if (!Real(&ignored)) return in_.Expected("a parameter of a node");
        }
      }
    }
    if (numbers_.size() != head[1]) {
      return in_.Wrong(absl::StrCat(head[1], " nodes are promised, the blocks have ", numbers_.size()));
    }
    return End("$EndNodes");
  }

  absl::Status Type(int64_t number, const ElementType** type) {
    const auto found = std::find_if(std::begin(kElementTypes), std::end(kElementTypes),
                                    [&](const ElementType& t) { return t.number == number; });
    if (found == std::end(kElementTypes)) {
      return in_.Wrong(absl::StrCat(
          "has elements of Gmsh's type ", number,
          "; tetrahedra (4), hexahedra (5), prisms (6) and pyramids (7) can be read, others of three "
          "dimensions not"));
    }
    if (found->dimension == 3 && !found->kind) {
      return in_.Wrong(absl::StrCat("has ", found->plural, "; only cells of order 1 can be read"));
    }
    *type = &*found;
    return absl::OkStatus();
  }

  // The nodes of an element, by any reader of their numbers.
  template <class ReadNumber>
  absl::Status Element(const ElementType& type, uint64_t number, ReadNumber read) {
    std::array<uint32_t, kMostCellCorners> corners{};
    for (int i = 0; i < type.nodes; ++i) {
      uint64_t node = 0;
      if (!read(&node)) return in_.Expected(absl::StrCat("a node of element ", number));
      if (!type.kind) continue;
      const auto index = numbers_.Find(node);
      if (!index)
        return in_.Wrong(absl::StrCat("element ", number, " has node ", node, ", which is not in $Nodes"));
      corners[i] = *index;
    }
    if (!type.kind) {
      left_out_.Add(type.plural, 1);
      return absl::OkStatus();
    }
    out_.mesh.AddCell(*type.kind, absl::MakeConstSpan(corners).first(type.nodes));
    out_.mesh.source.cells.push_back(number);
    return absl::OkStatus();
  }

  bool Number2(uint64_t* number) {
    int64_t value = -1;
    if (!Int(&value) || value < 0) return false;
    *number = static_cast<uint64_t>(value);
    return true;
  }

  absl::Status Elements2() {
    int64_t count = 0;
    if (!in_.Integer(&count) || count < 0) return in_.Expected("the number of elements");
    if (binary_ && !in_.EndLine()) return in_.Expected("the end of the line");
    for (int64_t done = 0; done < count;) {
      // In text, each element tells its type; in binary, several follow each telling.
      int64_t number = 0, type_number = 0, following = 1, tags = 0;
      const std::string what = absl::StrCat("the beginning of element ", done + 1, " of ", count);
      if (!binary_ && (!in_.Integer(&number) || number < 0)) return in_.Expected(what);
      if (!Int(&type_number)) return in_.Expected(what);
      if (binary_ && !Int(&following)) return in_.Expected(what);
      if (!Int(&tags)) return in_.Expected(what);
      const ElementType* type = nullptr;
      if (absl::Status s = Type(type_number, &type); !s.ok()) return s;
      if (following < 1 || following > count - done || tags < 0) {
        return in_.Wrong(absl::StrCat("element ", done + 1, " of ", count, " begins a block of ", following,
                                      " with ", tags, " tags each, which cannot be"));
      }
      for (int64_t i = 0; i < following; ++i, ++done) {
        if (binary_ && (!Int(&number) || number < 0)) return in_.Expected(what);
        int64_t ignored = 0;
        for (int64_t t = 0; t < tags; ++t) {
          if (!Int(&ignored)) return in_.Expected(absl::StrCat("a tag of element ", number));
        }
        absl::Status s =
            Element(*type, static_cast<uint64_t>(number), [this](uint64_t* node) { return Number2(node); });
        if (!s.ok()) return s;
      }
    }
    return End("$EndElements");
  }

  absl::Status Elements4() {
    if (binary_ && !in_.EndLine()) return in_.Expected("the end of the line");
    std::array<uint64_t, 4> head;
    for (uint64_t& h : head) {
      if (!Size(&h)) return in_.Expected("the numbers of blocks and of elements");
    }
    uint64_t done = 0;
    for (uint64_t b = 0; b < head[0]; ++b) {
      int64_t dimension = 0, entity = 0, type_number = 0;
      uint64_t count = 0;
      if (!Int(&dimension) || !Int(&entity) || !Int(&type_number) || !Size(&count)) {
        return in_.Expected(absl::StrCat("the beginning of block ", b + 1, " of ", head[0], " of elements"));
      }
      const ElementType* type = nullptr;
      if (absl::Status s = Type(type_number, &type); !s.ok()) return s;
      for (uint64_t i = 0; i < count; ++i, ++done) {
        uint64_t number = 0;
        if (!Size(&number))
          return in_.Expected(absl::StrCat("the number of element ", done + 1, " of ", head[1]));
        absl::Status s = Element(*type, number, [this](uint64_t* node) { return Size(node); });
        if (!s.ok()) return s;
      }
    }
    if (done != head[1])
      return in_.Wrong(absl::StrCat(head[1], " elements are promised, the blocks have ", done));
    return End("$EndElements");
  }

  WordScanner in_;
  bool version4_ = false, binary_ = false, nodes_ = false;
  PointNumbers numbers_;
  LeftOut left_out_;
  MeshFile out_;
};

}  // namespace

absl::StatusOr<MeshFile> ReadGmsh(absl::string_view bytes) { return GmshReader(bytes).Read(); }

}  // namespace ndmap::internal
