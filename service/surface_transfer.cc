// SPDX-License-Identifier: GPL-3.0-or-later
#include "service/surface_transfer.h"

#include <xxhash.h>

#include <memory>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/string_view.h"
#include "service/columns.h"

namespace ndmap::service {
namespace {

constexpr uint64_t kPoint = sizeof(Point3);
constexpr uint64_t kTriangle = 3 * sizeof(uint32_t);
static_assert(kPoint == 24 && sizeof(std::array<uint32_t, 3>) == kTriangle, "columns are copied as they lie");

}  // namespace

uint64_t SurfaceBytes(uint64_t points, uint64_t triangles) { return points * kPoint + triangles * kTriangle; }

std::string SurfaceId(const TriangleSurface& surface) {
  std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> state(XXH3_createState(), &XXH3_freeState);
  XXH3_128bits_reset_withSeed(state.get(), surface.points.size());
  XXH3_128bits_update(state.get(), surface.points.data(), surface.points.size() * kPoint);
  XXH3_128bits_update(state.get(), surface.triangles.data(), surface.triangles.size() * kTriangle);
  const XXH128_hash_t hash = XXH3_128bits_digest(state.get());
  return absl::StrFormat("%016x%016x", hash.high64, hash.low64);
}

void SendSurface(const TriangleSurface& surface, const std::string& id, const std::string& name,
                 absl::FunctionRef<bool(const v1::SurfaceChunk&)> write) {
  v1::SurfaceChunk chunk;
  v1::SurfaceHeader& header = *chunk.mutable_header();
  header.set_name(name);
  header.set_points(surface.points.size());
  header.set_triangles(surface.triangles.size());
  header.set_surface_id(id);
  if (!write(chunk)) return;
  const absl::string_view columns[2] = {
      {reinterpret_cast<const char*>(surface.points.data()), surface.points.size() * kPoint},
      {reinterpret_cast<const char*>(surface.triangles.data()), surface.triangles.size() * kTriangle}};
  for (absl::string_view column : columns) {
    for (size_t at = 0; at < column.size(); at += kChunkBytes) {
      chunk.set_data(std::string(column.substr(at, kChunkBytes)));
      if (!write(chunk)) return;
    }
  }
}

absl::Status SurfaceReceiver::Begin(const v1::SurfaceHeader& header) {
  if (header.name().size() > 256) return absl::InvalidArgumentError("a surface's name has at most 256 bytes");
  // Far above what fits in memory, so that products cannot overflow.
  constexpr uint64_t kMost = uint64_t{1} << 40;
  if (header.points() > kMost || header.triangles() > kMost ||
      SurfaceBytes(header.points(), header.triangles()) > max_bytes_) {
    return absl::ResourceExhaustedError(absl::StrCat("a surface of ", header.points(), " points and ",
                                                     header.triangles(), " triangles is over the limit of ",
                                                     max_bytes_, " bytes (--max-surface-bytes)"));
  }
  header_ = header;
  has_header_ = true;
  return absl::OkStatus();
}

absl::Status SurfaceReceiver::Add(const v1::SurfaceChunk& chunk) {
  if (!has_header_) {
    if (!chunk.has_header()) return absl::InvalidArgumentError("a surface begins with its header");
    return Begin(chunk.header());
  }
  if (!chunk.has_data()) return absl::InvalidArgumentError("after a surface's header comes its data");
  const uint64_t point_bytes = header_.points() * kPoint, triangle_bytes = header_.triangles() * kTriangle;
  if (chunk.data().size() > point_bytes + triangle_bytes - received_) {
    return absl::InvalidArgumentError(absl::StrCat("a surface of ", point_bytes + triangle_bytes,
                                                   " bytes by its header has more than that"));
  }
  CopyInto(surface_.points, 0, point_bytes, received_, chunk.data());
  CopyInto(surface_.triangles, point_bytes, triangle_bytes, received_, chunk.data());
  received_ += chunk.data().size();
  return absl::OkStatus();
}

absl::Status SurfaceReceiver::Finish() {
  if (!has_header_) return absl::InvalidArgumentError("a surface without a header");
  const uint64_t expected = SurfaceBytes(header_.points(), header_.triangles());
  if (received_ != expected) {
    return absl::InvalidArgumentError(
        absl::StrCat("a surface of ", expected, " bytes by its header ended after ", received_));
  }
  const std::string id = SurfaceId(surface_);
  if (id != header_.surface_id()) {
    return absl::DataLossError(
        absl::StrCat("the surface's checksum is ", id, ", its header says something else"));
  }
  return ValidateClosedSurface(surface_);
}

}  // namespace ndmap::service
