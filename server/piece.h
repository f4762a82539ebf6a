// SPDX-License-Identifier: GPL-3.0-or-later
// How a block becomes a file: the hook between queries and core/io.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "absl/container/btree_map.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/algorithm/parameters.h"
#include "core/attributes/table.h"
#include "core/geometry/grid_shape.h"
#include "core/map/block.h"
#include "core/names/initial_cells.h"

namespace ndmap::server {

// Where a piece's bytes go: a stream to the client, or a file. False: nobody wants more.
using PieceSink = std::function<bool(absl::string_view bytes)>;

// Makes one piece. Step() looks at the block, a millisecond's work at a time, between the steps of a job;
// Write() does not touch the block, and runs on another thread when Step() has returned true.
class PieceBuilder {
 public:
  virtual ~PieceBuilder() = default;
  // True: all that is needed of the block has been read. ABORTED when the block was changed in between, or
  // its attributes are being brought up to date.
  virtual absl::StatusOr<bool> Step(Block3& block, const AttributeStore& attributes) = 0;
  virtual absl::Status Write(const PieceSink& sink) = 0;
  // What is in the piece, by name: "points", "cells".
  virtual absl::btree_map<std::string, int64_t> counts() const = 0;
};

// By which a piece numbers its points and cells: the grid that the map was made from, or what the block knows
// of the mesh, and how many initial cells the whole map has.
struct PieceOrigin {
  std::optional<GridShape> grid;
  std::shared_ptr<const InitialCells> mesh;
  uint64_t mesh_cells = 0;
};

// INVALID_ARGUMENT names the option that is wrong.
using PieceSource = std::function<absl::StatusOr<std::unique_ptr<PieceBuilder>>(const Parameters& options,
                                                                                const PieceOrigin& origin)>;

// VTU pieces (core/io). Options: cells, "hexahedron" (the default) or "polyhedron"; attributes, "all" (the
// default), "none", or names separated by commas.
absl::StatusOr<std::unique_ptr<PieceBuilder>> MakeVtuPiece(const Parameters& options,
                                                           const PieceOrigin& origin);

}  // namespace ndmap::server
