// SPDX-License-Identifier: GPL-3.0-or-later
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "core/io/block_piece.h"
#include "core/io/named_piece.h"
#include "core/io/vtu_writer.h"
#include "server/piece.h"

namespace ndmap::server {
namespace {

// About a millisecond's work.
constexpr size_t kExportedHexahedraAStep = 200;

// NOT_FOUND for a name of no attribute, INVALID_ARGUMENT for one of edges or faces.
absl::Status CheckAttribute(const std::string& name, const AttributeStore& attributes) {
  if (attributes.table(0).Find(name) != nullptr || attributes.table(3).Find(name) != nullptr) {
    return absl::OkStatus();
  }
  const std::string shown = absl::CHexEscape(name.substr(0, 128));
  if (attributes.table(1).Find(name) != nullptr || attributes.table(2).Find(name) != nullptr) {
    return absl::InvalidArgumentError(absl::StrCat(
        "attribute \"", shown, "\" is of edges or faces, pieces have values of vertices and hexahedra"));
  }
  return absl::NotFoundError(absl::StrCat("the map has no attribute \"", shown, "\""));
}

// Of a grid (BlockPiece) or of a mesh (NamedPiece).
template <class Piece>
class VtuPieceBuilder final : public PieceBuilder {
 public:
  template <class... Arguments>
  explicit VtuPieceBuilder(const ChosenAttributes& attributes, Arguments&&... arguments)
      : piece_(std::forward<Arguments>(arguments)..., attributes), attributes_(attributes) {}

  absl::StatusOr<bool> Step(Block3& block, const AttributeStore& attributes) override {
    const bool none = attributes_ && attributes_->empty();
    if (!begun_ && attributes_) {
      for (const std::string& name : *attributes_) {
        if (absl::Status s = CheckAttribute(name, attributes); !s.ok()) return s;
      }
    }
    begun_ = true;
    return piece_.Step(block, kExportedHexahedraAStep, none ? nullptr : &attributes);
  }
  absl::Status Write(const PieceSink& sink) override {
    return WriteVtu(piece_.piece(), [&sink](absl::string_view bytes) {
      return sink(bytes) ? absl::OkStatus() : absl::CancelledError("nobody wants more of the piece");
    });
  }
  absl::btree_map<std::string, int64_t> counts() const override {
    return {{"points", static_cast<int64_t>(piece_.piece().points.size())},
            {"cells", static_cast<int64_t>(piece_.piece().types.size())}};
  }

 private:
  Piece piece_;
  const ChosenAttributes attributes_;
  bool begun_ = false;
};

}  // namespace

absl::StatusOr<std::unique_ptr<PieceBuilder>> MakeVtuPiece(const Parameters& options,
                                                           const PieceOrigin& origin) {
  for (const auto& [name, value] : options.values()) {
    if (name != "cells" && name != "attributes") {
      return absl::InvalidArgumentError(
          absl::StrCat("a piece has no option \"", name, "\", only \"cells\" and \"attributes\""));
    }
  }
  const std::string cells = options.TextOr("cells", "hexahedron");
  if (cells != "hexahedron" && cells != "polyhedron") {
    return absl::InvalidArgumentError(
        absl::StrCat("cells of kind \"", cells, "\"; expected hexahedron or polyhedron"));
  }
  const std::string attributes = options.TextOr("attributes", "all");
  ChosenAttributes chosen;
  if (attributes != "all") chosen.emplace();
  if (attributes != "all" && attributes != "none") *chosen = absl::StrSplit(attributes, ',');
  if (chosen && chosen->size() > AttributeDefinition::kMaxAttributes) {
    return absl::InvalidArgumentError(absl::StrCat(chosen->size(), " names of attributes, expected at most ",
                                                   AttributeDefinition::kMaxAttributes));
  }
  const VtuCells as = cells == "polyhedron" ? VtuCells::kPolyhedra : VtuCells::kHexahedra;
  if (origin.grid) return std::make_unique<VtuPieceBuilder<BlockPiece>>(chosen, *origin.grid, as);
  return std::make_unique<VtuPieceBuilder<NamedPiece>>(chosen, origin.mesh, origin.mesh_cells, as);
}

}  // namespace ndmap::server
