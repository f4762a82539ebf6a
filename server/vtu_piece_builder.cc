// SPDX-License-Identifier: GPL-3.0-or-later
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/io/block_piece.h"
#include "core/io/vtu_writer.h"
#include "server/piece.h"

namespace ndmap::server {
namespace {

// About a millisecond's work.
constexpr size_t kHexahedraAStep = 200;

class VtuPieceBuilder final : public PieceBuilder {
 public:
  VtuPieceBuilder(const GridShape& grid, VtuCells cells, bool fields)
      : piece_(grid, cells), fields_(fields) {}

  absl::StatusOr<bool> Step(Block3& block, const AttributeStore& attributes) override {
    return piece_.Step(block, kHexahedraAStep, fields_ ? &attributes : nullptr);
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
  BlockPiece piece_;
  const bool fields_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<PieceBuilder>> MakeVtuPiece(const Parameters& options, const GridShape& grid) {
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
  if (attributes != "all" && attributes != "none") {
    return absl::InvalidArgumentError(absl::StrCat("attributes \"", attributes, "\"; expected all or none"));
  }
  return std::make_unique<VtuPieceBuilder>(
      grid, cells == "polyhedron" ? VtuCells::kPolyhedra : VtuCells::kHexahedra, attributes == "all");
}

}  // namespace ndmap::server
