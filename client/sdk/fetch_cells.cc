// SPDX-License-Identifier: Apache-2.0
#include <utility>

#include "client/sdk/connection.h"
#include "client/sdk/map.h"

namespace ndmap {

absl::StatusOr<std::vector<v1::FetchCellsResponse>> MapHandle::FetchCells(
    const v1::FetchCellsRequest& request) const {
  absl::StatusOr<std::string> address = AddressOf(request.dart().block());
  if (!address.ok()) return address.status();
  auto server = connection_->BlockServer(*address);
  if (!server.ok()) return server.status();
  v1::FetchCellsRequest mine = request;
  mine.set_map(name());
  std::vector<v1::FetchCellsResponse> parts;
  absl::Status status = internal::Retry(connection_->options(), [&] {
    parts.clear();
    grpc::ClientContext context;
    internal::SetDeadline(context, connection_->options().call_timeout);
    auto stream = (*server)->FetchCells(&context, mine);
    v1::FetchCellsResponse part;
    while (stream->Read(&part)) parts.push_back(std::move(part));
    return internal::FromGrpc(stream->Finish(), internal::ServerName(*address));
  });
  if (!status.ok()) return status;
  return parts;
}

}  // namespace ndmap
