// SPDX-License-Identifier: Apache-2.0
// Surfaces on their way up: a header, then the bytes of the columns in chunks.
#include <algorithm>
#include <bit>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "absl/strings/str_format.h"
#include "client/sdk/client.h"
#include "client/sdk/connection.h"

namespace ndmap {
namespace {

static_assert(std::endian::native == std::endian::little, "columns are little-endian on the wire");

constexpr size_t kChunkBytes = size_t{1} << 20;

template <class T>
absl::string_view BytesOf(absl::Span<const T> column) {
  return absl::string_view(reinterpret_cast<const char*>(column.data()), column.size() * sizeof(T));
}

}  // namespace

std::string SurfaceId(const SurfaceView& surface) {
  XXH3_state_t state;
  XXH3_INITSTATE(&state);
  XXH3_128bits_reset_withSeed(&state, surface.points.size());
  for (absl::string_view column : {BytesOf(surface.points), BytesOf(surface.triangles)}) {
    if (!column.empty()) XXH3_128bits_update(&state, column.data(), column.size());
  }
  const XXH128_hash_t hash = XXH3_128bits_digest(&state);
  return absl::StrFormat("%016x%016x", hash.high64, hash.low64);
}

absl::StatusOr<std::string> Client::UploadSurface(
    const SurfaceView& surface, const std::function<void(uint64_t, uint64_t)>& progress) const {
  const absl::string_view columns[] = {BytesOf(surface.points), BytesOf(surface.triangles)};
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
    // A write that fails means that the coordinator has already answered: Finish() tells what.
    bool open = stream->Write(header);
    uint64_t sent = 0;
    v1::SurfaceChunk chunk;
    for (absl::string_view column : columns) {
      for (size_t at = 0; open && at < column.size(); at += kChunkBytes) {
        const absl::string_view part = column.substr(at, kChunkBytes);
        chunk.set_data(part.data(), part.size());
        open = stream->Write(chunk);
        sent += part.size();
        if (open && progress) progress(sent, total);
      }
    }
    stream->WritesDone();
    return internal::FromGrpc(stream->Finish(), connection_->coordinator_name());
  });
  if (!status.ok()) return status;
  return response.surface_id();
}

}  // namespace ndmap
