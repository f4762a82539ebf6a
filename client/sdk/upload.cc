// SPDX-License-Identifier: Apache-2.0
// Surfaces on their way up: a header, then the bytes of the columns in chunks.
#define XXH_INLINE_ALL
#include <xxhash.h>

#include "absl/strings/str_format.h"
#include "client/sdk/client.h"
#include "client/sdk/connection.h"
#include "client/sdk/upload_columns.h"

namespace ndmap {

std::string SurfaceId(const SurfaceView& surface) {
  XXH3_state_t state;
  XXH3_INITSTATE(&state);
  XXH3_128bits_reset_withSeed(&state, surface.points.size());
  for (absl::string_view column : {internal::BytesOf(surface.points), internal::BytesOf(surface.triangles)}) {
    if (!column.empty()) XXH3_128bits_update(&state, column.data(), column.size());
  }
  const XXH128_hash_t hash = XXH3_128bits_digest(&state);
  return absl::StrFormat("%016x%016x", hash.high64, hash.low64);
}

absl::StatusOr<std::string> Client::UploadSurface(
    const SurfaceView& surface, const std::function<void(uint64_t, uint64_t)>& progress) const {
  const absl::string_view columns[] = {internal::BytesOf(surface.points),
                                       internal::BytesOf(surface.triangles)};
  const uint64_t total = columns[0].size() + columns[1].size();
  v1::SurfaceChunk header;
  header.mutable_header()->set_name(std::string(surface.name.substr(0, 256)));
  header.mutable_header()->set_points(surface.points.size());
  header.mutable_header()->set_triangles(surface.triangles.size());
  header.mutable_header()->set_surface_id(SurfaceId(surface));

  v1::UploadSurfaceResponse response;
  absl::Status status = internal::Retry(connection_->options(), [&] {
    grpc::ClientContext context;
    internal::SetDeadline(context, connection_->options().transfer_timeout);
    response.Clear();
    auto stream = connection_->coordinator().UploadSurface(&context, &response);
    uint64_t sent = 0;
    if (stream->Write(header)) {
      internal::WriteColumns<v1::SurfaceChunk>(columns, *stream, [&](size_t bytes) {
        sent += bytes;
        if (progress) progress(sent, total);
      });
    }
    stream->WritesDone();
    return internal::FromGrpc(stream->Finish(), connection_->coordinator_name());
  });
  if (!status.ok()) return status;
  return response.surface_id();
}

}  // namespace ndmap
