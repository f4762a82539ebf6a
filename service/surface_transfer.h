// SPDX-License-Identifier: GPL-3.0-or-later
// Surfaces on the wire: a header and columns of bytes, checked on arrival.
#pragma once

#include <cstdint>
#include <string>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "core/geometry/surface.h"
#include "ndmap/v1/common.pb.h"

namespace ndmap::service {

inline constexpr size_t kChunkBytes = 1 << 20;

// Bytes of a surface's columns.
uint64_t SurfaceBytes(uint64_t points, uint64_t triangles);

// The surface's id: 32 hexadecimal digits of its content. O(bytes).
std::string SurfaceId(const TriangleSurface& surface);

// Header and data, a chunk at a time; stops when `write` returns false.
void SendSurface(const TriangleSurface& surface, const std::string& id, const std::string& name,
                 absl::FunctionRef<bool(const v1::SurfaceChunk&)> write);

// Takes the chunks of one surface. Trusts nothing: memory grows with what arrives, not with what a header
// promises.
class SurfaceReceiver {
 public:
  explicit SurfaceReceiver(uint64_t max_bytes) : max_bytes_(max_bytes) {}

  absl::Status Add(const v1::SurfaceChunk& chunk);
  // All is there, has the checksum that the header names, and is a closed surface.
  absl::Status Finish();

  const std::string& id() const { return header_.surface_id(); }
  const std::string& name() const { return header_.name(); }
  // After Finish().
  TriangleSurface&& Take() { return std::move(surface_); }

 private:
  absl::Status Begin(const v1::SurfaceHeader& header);

  const uint64_t max_bytes_;
  bool has_header_ = false;
  v1::SurfaceHeader header_;
  uint64_t received_ = 0;
  TriangleSurface surface_;
};

}  // namespace ndmap::service
