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
  VtuPieceBuilder(const GridShape& grid, VtuCells cells) : piece_(grid, cells) {}

  absl::StatusOr<bool> Step(Block3& block) override { return piece_.Step(block, kHexahedraAStep); }
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
};

}  // namespace

absl::StatusOr<std::unique_ptr<PieceBuilder>> MakeVtuPiece(const Parameters& options, const GridShape& grid) {
  for (const auto& [name, value] : options.values()) {
    if (name != "cells") {
      return absl::InvalidArgumentError(absl::StrCat("a piece has no option \"", name, "\", only \"cells\""));
    }
  }
  const std::string cells = options.TextOr("cells", "hexahedron");
  if (cells != "hexahedron" && cells != "polyhedron") {
    return absl::InvalidArgumentError(
        absl::StrCat("cells of kind \"", cells, "\"; expected hexahedron or polyhedron"));
  }
  return std::make_unique<VtuPieceBuilder>(
      grid, cells == "polyhedron" ? VtuCells::kPolyhedra : VtuCells::kHexahedra);
}

}  // namespace ndmap::server
