// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/values_from_vtu.h"

#include <optional>
#include <string>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/strings/str_cat.h"
#include "client/cli/attribute_text.h"
#include "client/cli/cell_arguments.h"
#include "core/geometry/grid_shape.h"
#include "core/io/file_numbers.h"
#include "core/io/mesh_numbers.h"
#include "core/io/vtu_values.h"
#include "core/map/ids.h"

namespace ndmap::cli {
namespace {

// The value of one row, into the column or, a text, into its builder.
absl::Status AddRow(const VtuValues& read, size_t row, AttributeColumn* column, ColumnBuilder* texts) {
  switch (column->type) {
    case v1::VALUE_TYPE_DOUBLE:
      column->doubles.push_back(read.reals[row]);
      return absl::OkStatus();
    case v1::VALUE_TYPE_VEC3:
      for (size_t c = 0; c < 3; ++c) column->doubles.push_back(read.reals[3 * row + c]);
      return absl::OkStatus();
    case v1::VALUE_TYPE_INT64:
      column->integers.push_back(read.integers[row]);
      return absl::OkStatus();
    default:
      return texts->Add(read.texts[row]);
  }
}

// From numbers in files back to ids, in a map made from a grid or from a mesh.
class Numbers {
 public:
  static absl::StatusOr<Numbers> Of(const v1::Map& map) {
    Numbers numbers;
    if (map.has_mesh()) {
      const v1::MeshSummary& mesh = map.mesh();
      const uint64_t cells = mesh.tetrahedra() + mesh.pyramids() + mesh.prisms() + mesh.hexahedra();
      if (cells == 0) return absl::InvalidArgumentError(absl::StrCat("map '", map.map(), "' has no cells"));
      numbers.mesh_.emplace(cells);
      numbers.of_ = absl::StrCat("a mesh of ", cells, " cells");
      return numbers;
    }
    if (map.grid().cells_size() != 3) {
      return absl::InvalidArgumentError(absl::StrCat("map '", map.map(), "' has neither grid nor mesh"));
    }
    GridShape grid;
    for (int c = 0; c < 3; ++c) grid.cells[static_cast<size_t>(c)] = map.grid().cells(c);
    numbers.grid_.emplace(grid);
    numbers.of_ = absl::StrCat("a grid of ", grid.cells[0], "x", grid.cells[1], "x", grid.cells[2]);
    return numbers;
  }

  std::optional<CellId> Cell(int64_t number, int level) const {
    return mesh_ ? mesh_->Cell(number, level) : grid_->Hexahedron(number, level);
  }
  std::optional<CellId> Vertex(int64_t number) const {
    return mesh_ ? mesh_->Vertex(number) : grid_->Vertex(number);
  }
  // For people.
  const std::string& of() const { return of_; }

 private:
  std::optional<FileNumbers> grid_;
  std::optional<MeshNumbers> mesh_;
  std::string of_;
};

}  // namespace

absl::StatusOr<ValuesByCell> ValuesFromVtu(const std::string& path, const v1::Map& map,
                                           const v1::Attribute& attribute, const std::string& name) {
  const auto wrong = [&](absl::string_view what) {
    return absl::InvalidArgumentError(absl::StrCat(path, ": ", what));
  };
  const bool cells = attribute.dimension() == 3;
  if (!cells && attribute.dimension() != 0) {
    return wrong(absl::StrCat("VTU files have values of vertices and hexahedra, '", attribute.name(),
                              "' is of ", CellWord(attribute.dimension(), true), "; write it from CSV"));
  }
  absl::StatusOr<Numbers> numbers = Numbers::Of(map);
  if (!numbers.ok()) return wrong(numbers.status().message());
  const VtuKind kind = attribute.type() == v1::VALUE_TYPE_INT64      ? VtuKind::kIntegers
                       : attribute.type() == v1::VALUE_TYPE_CATEGORY ? VtuKind::kTexts
                                                                     : VtuKind::kReals;
  absl::StatusOr<VtuValues> read =
      ReadVtuValues(path, cells ? VtuPart::kCells : VtuPart::kPoints, name, kind);
  if (!read.ok()) return read.status();
  ValuesByCell values;
  values.values.type = attribute.type();
  ColumnBuilder texts(attribute.type());
  const unsigned components = attribute.type() == v1::VALUE_TYPE_VEC3 ? 3 : 1;
  if (read->components != components && !read->ids.empty()) {
    return wrong(absl::StrCat("array '", name, "' has ", read->components, " components, '", attribute.name(),
                              "' is of type ", NameOf(attribute.type())));
  }
  absl::flat_hash_set<CellId> seen;
  for (size_t row = 0; row < read->ids.size(); ++row) {
    const int64_t number = read->ids[row];
    // A level beyond an int is none.
    const int level = cells && read->levels[row] >= 0 && read->levels[row] <= CellId::kMaxLevel
                          ? static_cast<int>(read->levels[row])
                          : -1;
    const std::optional<CellId> id = cells ? numbers->Cell(number, level) : numbers->Vertex(number);
    if (!id) {
      return wrong(absl::StrCat("id ", number, cells ? absl::StrCat(" of level ", read->levels[row]) : "",
                                " is no number of a ", CellWord(attribute.dimension(), false), " in ",
                                numbers->of(), ": is the file an export of such a map?"));
    }
    if (!seen.insert(*id).second) continue;
    values.cells.Add(id->hi(), id->lo());
    if (absl::Status s = AddRow(*read, row, &values.values, &texts); !s.ok()) return wrong(s.message());
  }
  if (attribute.type() == v1::VALUE_TYPE_CATEGORY) values.values = texts.Take();
  return values;
}

}  // namespace ndmap::cli
