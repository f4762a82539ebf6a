// SPDX-License-Identifier: GPL-3.0-or-later
// Writing values: at the server of block 0, which brings all writes to a map into one order.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "server/attribute_gates.h"
#include "server/attribute_rows.h"
#include "server/explorer.h"
#include "server/peer_calls.h"

namespace ndmap::server {

class AttributeWrites {
 public:
  using ReadPart = std::function<bool(v1::WriteAttributeRequest&)>;

  AttributeWrites(BlockHost* host, PeerStubs* peers, Explorer* explorer, const AttributeRows* rows)
      : host_(host), peers_(peers), explorer_(explorer), rows_(rows) {}

  // Reads parts from a client and does one after the other, each as a whole also when the client goes. A part
  // that is wrong is not done. UNAVAILABLE: a server did not answer; the part is brought to it before
  // anything else happens to the attributes. Blocking.
  absl::Status Write(const ReadPart& read, const Caller& caller, v1::WriteAttributeResponse& response) const;

 private:
  // What is written to.
  struct Target {
    std::string map;
    BlockHost::MapInfo info;
    AttributeDefinition definition;
    std::shared_ptr<AttributeGates> gates;
  };
  absl::StatusOr<Target> Find(const std::string& map, const std::string& name) const;
  absl::Status WriteSelected(const Target& target, const v1::WriteAttributeRequest& request,
                             const Caller& caller, v1::WriteAttributeResponse& response) const;
  absl::Status WriteIds(const Target& target, v1::CellSelection::Ids ids, v1::Values values,
                        v1::WriteAttributeResponse& response) const;
  // One part; what was found is added up.
  absl::Status Do(const Target& target, std::shared_ptr<v1::ApplyAttributeRequest> part,
                  std::vector<v1::ApplyAttributeResponse>& answers) const;
  // On all blocks of all servers.
  absl::Status ToAll(const Target& target, v1::ApplyAttributeRequest& part,
                     std::vector<v1::ApplyAttributeResponse>& answers) const;
  // RESOURCE_EXHAUSTED: the part's categories are too many for the column. As all blocks have the same, it is
  // enough to ask one. NOT_FOUND: the attribute was dropped.
  absl::Status CheckRoom(const Target& target, const v1::Values& values) const;

  BlockHost* const host_;
  PeerStubs* const peers_;
  Explorer* const explorer_;
  const AttributeRows* const rows_;
};

}  // namespace ndmap::server
