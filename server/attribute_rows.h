// SPDX-License-Identifier: GPL-3.0-or-later
// Reading and writing the values of the blocks of this server.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "ndmap/v1/attributes.pb.h"
#include "server/attribute_columns.h"
#include "server/block_answers.h"
#include "server/block_host.h"
#include "server/block_scan.h"

namespace ndmap::server {

class AttributeRows {
 public:
  using Gone = std::function<bool()>;
  // Takes a part of an answer, of which it may take what is in it; false: nobody wants more.
  using TakePart = std::function<bool(v1::ReadBlocksResponse&)>;

  AttributeRows(BlockHost* host, BlockAnswers* answers) : host_(host), answers_(answers) {}

  // What the names mean, and which state of the map answers are of: the job that last brought the attributes
  // up to date; without rows, BlockHost::AtRest(). Errors of ResolveColumns(); ABORTED while a job does, or
  // changes a map whose cells have no rows.
  struct Columns {
    std::vector<AskedColumn> columns;
    // No attribute of the dimension is defined: cells are looked for in the map (block_scan.h).
    bool by_scan = false;
    uint64_t update = 0;

    bool points() const;
  };
  absl::StatusOr<Columns> Resolve(const std::string& map, unsigned dimension, const Names& names) const;

  // ABORTED when the state of the map is not that of the columns any more.
  absl::Status CheckState(const std::string& map, AttributeGates& gates, const Columns& columns) const;
  // One of a few scans here at one time.
  absl::StatusOr<std::unique_ptr<ScanTurns::Turn>> WaitForScan(const Gone& gone) const {
    return scans_.Wait(gone);
  }

  // Cells that count here, in parts; of cells without rows, asked for by id, those that are here. Of all
  // cells without rows first those that no other block has, then, ascending and put together, those that
  // others may have (`found`). ABORTED as RowView::Make(), or when an update came between.
  absl::Status Read(const v1::ReadBlocksRequest& request, const Gone& gone, const TakePart& take) const;
  // A part of a write, on all blocks here that have not seen a later one; ABORTED if some have. Rows of cells
  // that count elsewhere are written, too. An attribute that was dropped is written nowhere.
  absl::Status Apply(const v1::ApplyAttributeRequest& request, v1::ApplyAttributeResponse& response) const;

 private:
  absl::Status ReadAllFound(const v1::ReadBlocksRequest& request, const BlockHost::MapInfo& info,
                            AttributeGates& gates, const Columns& columns, const Gone& gone,
                            const TakePart& take) const;

  BlockHost* const host_;
  BlockAnswers* const answers_;
  mutable ScanTurns scans_;
};

// A list in parts; false: nobody wants more.
bool SendFound(const std::vector<FoundCell>& cells, bool points,
               const std::function<bool(v1::FoundCells&&)>& send);

// INVALID_ARGUMENT: too many, not as many upper words as lower ones, or one that is no id.
absl::Status CheckIds(const v1::CellSelection::Ids& ids);
// INVALID_ARGUMENT: neither ids nor all nor a query, or levels of ids.
absl::Status CheckSelection(const v1::CellSelection& select);
// Whether a cell is of the levels that are asked for.
bool WithinLevels(const v1::CellSelection& select, const CellId& id);

}  // namespace ndmap::server
