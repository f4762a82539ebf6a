// SPDX-License-Identifier: Apache-2.0
// Columns of numbers on their way up: their bytes, cut into chunks.
#pragma once

#include <bit>
#include <cstddef>

#include "absl/strings/string_view.h"
#include "absl/types/span.h"

namespace ndmap::internal {

static_assert(std::endian::native == std::endian::little, "columns are little-endian on the wire");

inline constexpr size_t kUploadChunkBytes = size_t{1} << 20;

template <class T>
absl::string_view BytesOf(absl::Span<const T> column) {
  return absl::string_view(reinterpret_cast<const char*>(column.data()), column.size() * sizeof(T));
}

// Writes the columns as chunks with the field `data` into a stream of an RPC. False when a write failed: then
// the service has already answered, and Finish() of the stream tells what. `sent` is told how many bytes each
// chunk had.
template <class Chunk, class Stream, class Sent>
bool WriteColumns(absl::Span<const absl::string_view> columns, Stream& stream, Sent sent) {
  Chunk chunk;
  for (absl::string_view column : columns) {
    for (size_t at = 0; at < column.size(); at += kUploadChunkBytes) {
      const absl::string_view part = column.substr(at, kUploadChunkBytes);
      chunk.set_data(part.data(), part.size());
      if (!stream.Write(chunk)) return false;
      sent(part.size());
    }
  }
  return true;
}

}  // namespace ndmap::internal
