// SPDX-License-Identifier: Apache-2.0
// A map of a cluster: its jobs, its numbers, its pieces, walks on its darts, questions about its cells.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "client/sdk/attributes.h"
#include "client/sdk/job.h"
#include "ndmap/v1/block_service.pb.h"
#include "ndmap/v1/coordinator.pb.h"
#include "ndmap/v1/navigate.pb.h"

namespace ndmap {

// Where one walk ended.
struct Walked {
  // The last dart that the word reached.
  v1::DartInfo at;
  // Letters that were applied: all of them unless `free`.
  uint32_t used = 0;
  // The dart is free for the next letter: the boundary of the map.
  bool free = false;
  // How often the walk went on in another block, and how often that block was on another server.
  uint32_t block_crossings = 0;
  uint32_t server_crossings = 0;
};

// A walk with every dart on its way.
struct Traced {
  struct Step {
    v1::DartInfo at;
    bool crossed_block = false;
    bool crossed_server = false;
  };
  v1::DartInfo start;
  // One for each letter that was applied: all of them unless `free`.
  std::vector<Step> steps;
  bool free = false;
};

// Many darts in columns: the same row of `blocks` and `darts` is one dart.
struct DartColumns {
  std::vector<uint32_t> blocks;
  // Indices there.
  std::vector<uint32_t> darts;
  // By block: the version at which its darts were named. Darts of a block that is not here, or has 0, are not
  // checked.
  std::map<uint32_t, uint64_t> versions;

  size_t size() const { return darts.size(); }
};

// Where many walks ended, row by row.
struct WalkedColumns {
  // The last darts that the word reached, with the versions of all blocks that walks were in.
  DartColumns at;
  // Letters that were applied. Fewer than the word has: the dart is free for the next one, the boundary of
  // the map.
  std::vector<uint32_t> used;
};

// A map, with the routing table as it was when the handle was made. Cheap to copy.
class MapHandle {
 public:
  // Takes a piece's bytes in order; an error ends the export.
  using ByteSink = absl::FunctionRef<absl::Status(absl::string_view)>;
  // Takes an answer's parts in order; an error ends the question.
  using PartSink = absl::FunctionRef<absl::Status(const v1::ExploreResponse&)>;

  MapHandle(std::shared_ptr<internal::Connection> connection, v1::Map info)
      : connection_(std::move(connection)), info_(std::make_shared<const v1::Map>(std::move(info))) {}

  const std::string& name() const { return info_->map(); }
  // State, grid, and which block is on which server.
  const v1::Map& info() const { return *info_; }
  // NOT_FOUND naming the block and how many there are.
  absl::StatusOr<std::string> AddressOf(uint32_t block) const;

  // Starts long work: phases one after the other. FAILED_PRECONDITION names the job that is in the way.
  absl::StatusOr<JobHandle> StartJob(const std::string& kind, const std::vector<v1::Phase>& phases) const;

  // What every block holds, by block; asks each server once.
  absl::StatusOr<std::vector<v1::BlockStats>> Stats() const;
  // What the operating system says of each server that holds a block, by address.
  absl::StatusOr<std::vector<v1::ProcessStats>> ServerStats() const;

  // Some dart of a block. NOT_FOUND if the block is empty.
  absl::StatusOr<v1::DartInfo> AnyDart(uint32_t block) const;

  // Applies `word` (letters 0 ... 3, from the first to the last) to many darts, by Proposition 1, as fast as
  // can be: one call for as many darts as a server takes, which follows the walks through the cluster. All of
  // it is of one version of each block. NOT_FOUND for a dart or block that is not there, FAILED_PRECONDITION
  // for a stale one, INVALID_ARGUMENT for another letter, ABORTED while a job changes the map again and
  // again.
  absl::StatusOr<WalkedColumns> Walk(const DartColumns& starts, absl::Span<const uint8_t> word) const;

  // The same for a few darts, with everything that is there and the blocks that the walks went through: where
  // a letter leads to another block, the walk goes on at the dart with the same label there, wherever that
  // block is. One result for each start, in order. A call for each group of walks that are in the same block
  // at the same letter. Fails as a whole: NOT_FOUND for a dart that is not there, FAILED_PRECONDITION for a
  // stale reference, INVALID_ARGUMENT for another letter.
  absl::StatusOr<std::vector<Walked>> Beta(absl::Span<const v1::DartRef> starts,
                                           absl::Span<const uint8_t> word) const;

  // Asks about cells and their neighbourhoods, wherever they are (explore.h makes the questions,
  // navigate.proto tells them); the map's name is filled in. One call to one server, which asks the others:
  // that of the first anchor that is a dart or a block, else each server in turn. The answer is of one
  // version of each block. RESOURCE_EXHAUSTED above the server's limit of darts, NOT_FOUND for a cell that is
  // not there, FAILED_PRECONDITION for a stale dart. Tried again when a server does not answer.
  absl::StatusOr<v1::ExploreResponse> Explore(const v1::ExploreRequest& request) const;
  // The same part by part, for answers that need not be held at once; the first part is taken even if it is
  // empty. Tried again only as long as nothing was taken.
  absl::Status Explore(const v1::ExploreRequest& request, PartSink take) const;
  // The chunk of hexahedra around a dart, with all links, in parts: what a Navigator (navigator.h) keeps. The
  // map's name is filled in. Tried again when a server does not answer.
  absl::StatusOr<std::vector<v1::FetchCellsResponse>> FetchCells(const v1::FetchCellsRequest& request) const;

  // One walk from a dart, a label or any dart of a block, step by step; at most 4096 letters. The darts
  // within a block are of one version of it, so it may be asked while a job changes the map. ABORTED when the
  // map changed while the walk went from one block to another: ask again. Otherwise errors as of Beta.
  absl::StatusOr<Traced> Trace(uint32_t block, const v1::BetaStart& start,
                               absl::Span<const uint8_t> word) const;

  // Attributes of cells (attributes.h; docs/attributes.md tells the rules). All of these may be called from
  // any thread.
  //
  // Start jobs; every cell has the fill value, and the values are gone, when they are done. ALREADY_EXISTS,
  // NOT_FOUND, INVALID_ARGUMENT, FAILED_PRECONDITION naming the job that is in the way. Not tried again.
  absl::StatusOr<JobHandle> DefineAttribute(const NewAttribute& attribute) const;
  absl::StatusOr<JobHandle> DropAttribute(const std::string& name) const;
  // Those that are defined now; info() has those of when the handle was made.
  absl::StatusOr<std::vector<v1::Attribute>> ListAttributes() const;

  // Values of cells of one dimension, by names of attributes or of what the map knows itself ("@point",
  // "@level",
  // "@volume": attributes.proto). Ids come in the order in which they are asked for, cells of a question
  // ascending, all cells in any order. Asks when the range is begun. Tried again when a server does not
  // answer or attributes are being brought up to date, as long as nothing of a question or of all cells was
  // handed over; reading ids goes on where it was.
  AttributeReader ReadAttributes(uint32_t dimension, std::vector<std::string> names,
                                 v1::CellSelection select) const;

  // Writes one value a cell, at the server of block 0. Ids that the map has not now are told in the answer,
  // the others are written. On an error some may have been written. Tried again as above, for writing the
  // same twice is harmless; somebody else's write in between is then written over. INVALID_ARGUMENT when
  // there are not as many values as cells.
  absl::StatusOr<v1::WriteAttributeResponse> WriteAttribute(const std::string& name, const CellIds& cells,
                                                            const AttributeColumn& values) const;
  // Writes one value to all cells of a selection.
  absl::StatusOr<v1::WriteAttributeResponse> SetAttribute(const std::string& name,
                                                          const v1::CellSelection& select,
                                                          const AttributeColumn& value) const;

  // Counts, exact sums, extremes, histograms, integrals (attributes.proto); the map's name is filled in.
  // Tried again as above.
  absl::StatusOr<std::vector<v1::Aggregate>> Aggregate(const v1::AggregateRequest& question) const;

  // Streams one block's piece, as written by the block's own server, and compares its checksum. `options` go
  // to the piece's writer ("cells": "polyhedron"). Not tried again: the sink may hold half a piece.
  absl::StatusOr<v1::ExportSummary> ExportPiece(
      uint32_t block, const std::vector<std::pair<std::string, std::string>>& options, ByteSink sink) const;
  // The same into a file, which appears at `path` when it is complete; on an error nothing is left behind.
  absl::StatusOr<v1::ExportSummary> ExportPieceToFile(
      uint32_t block, const std::vector<std::pair<std::string, std::string>>& options,
      const std::string& path) const;

 private:
  struct Walker;
  // One call: walks in one block, as far as that block can follow them.
  absl::StatusOr<v1::BetaResponse> BetaInBlock(const v1::BetaRequest& request) const;
  // Lets walkers in one block, at one letter, go as far as they can there, and over to the next block.
  absl::Status Go(absl::Span<Walker* const> walkers, absl::Span<const uint8_t> word) const;
  // Moves a walker that stands at a crossing to the block that holds the label.
  absl::Status Cross(Walker& walker, const v1::BetaResult& at) const;
  absl::StatusOr<bool> HasLabel(uint32_t block, const v1::Label& label) const;
  absl::Status WalkOnce(const std::map<std::string, std::vector<uint32_t>>& by_server,
                        const DartColumns& starts, absl::Span<const uint8_t> word,
                        WalkedColumns& walked) const;
  // One call of Walk: those rows of `starts`, whose blocks are on one server, into the same rows of `walked`.
  absl::Status WalkRows(const std::string& address, absl::Span<const uint32_t> rows,
                        const DartColumns& starts, absl::Span<const uint8_t> word,
                        WalkedColumns& walked) const;
  absl::Status ExploreOnce(const v1::ExploreRequest& request, PartSink take) const;
  // Tries a write until it is done or its error is final.
  absl::StatusOr<v1::WriteAttributeResponse> Write(
      absl::Span<const v1::WriteAttributeRequest> messages) const;

  std::shared_ptr<internal::Connection> connection_;
  std::shared_ptr<const v1::Map> info_;
};

}  // namespace ndmap
