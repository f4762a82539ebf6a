// SPDX-License-Identifier: GPL-3.0-or-later
// Reading and writing the values of the blocks of this server.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "ndmap/v1/attributes.pb.h"
#include "server/attribute_columns.h"
#include "server/block_host.h"

namespace ndmap::server {

class AttributeRows {
 public:
  using Gone = std::function<bool()>;
  // Takes a part of an answer, of which it may take what is in it; false: nobody wants more.
  using TakePart = std::function<bool(v1::ReadBlocksResponse&)>;

  explicit AttributeRows(BlockHost* host) : host_(host) {}

  // What the names mean, and the job that last brought the attributes up to date. Errors of ResolveColumns();
  // ABORTED while a job does.
  struct Columns {
    std::vector<AskedColumn> columns;
    uint64_t update = 0;
  };
  absl::StatusOr<Columns> Resolve(const std::string& map, unsigned dimension, const Names& names) const;

  // Cells that count here, in parts. ABORTED as RowView::Make(), or when an update came between.
  absl::Status Read(const v1::ReadBlocksRequest& request, const Gone& gone, const TakePart& take) const;
  // A part of a write, on all blocks here that have not seen a later one; ABORTED if some have. Rows of cells
  // that count elsewhere are written, too. An attribute that was dropped is written nowhere.
  absl::Status Apply(const v1::ApplyAttributeRequest& request, v1::ApplyAttributeResponse& response) const;

 private:
  BlockHost* const host_;
};

// INVALID_ARGUMENT: too many, not as many upper words as lower ones, or one that is no id.
absl::Status CheckIds(const v1::CellSelection::Ids& ids);
// INVALID_ARGUMENT: neither ids nor all nor a query, or levels of ids.
absl::Status CheckSelection(const v1::CellSelection& select);
// Whether a cell is of the levels that are asked for.
bool WithinLevels(const v1::CellSelection& select, const CellId& id);

}  // namespace ndmap::server
