// SPDX-License-Identifier: GPL-3.0-or-later
// Values of cells of the whole map, for a client: by the server that is asked.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/attribute_rows.h"
#include "server/explorer.h"
#include "server/part_stream.h"
#include "server/peer_calls.h"

namespace ndmap::server {

class AttributeReads {
 public:
  using Write = std::function<bool(const v1::ReadAttributesResponse&)>;

  AttributeReads(BlockHost* host, PeerStubs* peers, Explorer* explorer, const AttributeRows* rows)
      : host_(host), peers_(peers), explorer_(explorer), rows_(rows) {}

  // Writes the answer in parts, one in memory at a time. Begins again some times when it is ABORTED before
  // the first part. Blocking.
  absl::Status Read(const v1::ReadAttributesRequest& request, const Caller& caller, const Write& write) const;

 private:
  struct Question;
  absl::Status Once(Question& question) const;
  absl::Status ReadAll(Question& question) const;
  // Cells of another server up to those that others may have, too, which become a source.
  absl::Status ReadParts(Question& question, PartStream<v1::ReadBlocksResponse>& stream,
                         std::vector<std::unique_ptr<FoundSource>>& sources) const;
  absl::Status ReadIds(Question& question, const v1::CellSelection::Ids& ids, bool all_there) const;
  absl::Status ReadChunk(Question& question, const v1::ReadBlocksRequest& request, bool all_there) const;

  BlockHost* const host_;
  PeerStubs* const peers_;
  Explorer* const explorer_;
  const AttributeRows* const rows_;
};

// The ids of the cells that a query gives; its map, dimension and form are filled in. Errors of Explore().
absl::StatusOr<v1::CellSelection::Ids> IdsOfQuery(Explorer& explorer, v1::ExploreRequest query,
                                                  const std::string& map, unsigned dimension,
                                                  const Caller& caller);

// A pause before something that was ABORTED is tried again for the k-th time; false when that was the last.
bool TryAgain(int k, const Caller& caller);

}  // namespace ndmap::server
