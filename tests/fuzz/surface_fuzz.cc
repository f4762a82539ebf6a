// SPDX-License-Identifier: GPL-3.0-or-later
// Feeds the surface reader whatever libFuzzer thinks of: the first byte chooses the format. What is accepted must be
// valid, and must read back as itself.
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "absl/strings/string_view.h"
#include "core/io/file_bytes.h"
#include "core/io/surface_reader.h"

namespace {

void Require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "broken: %s\n", what);
  std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  const absl::string_view bytes(reinterpret_cast<const char*>(data) + 1, size - 1);
  if (data[0] % 5 == 4) {
    ndmap::internal::DecompressXz(bytes, 1 << 20).IgnoreError();
    return 0;
  }
  const auto format = static_cast<ndmap::SurfaceFormat>(data[0] % 5);
  const auto file = ndmap::ReadSurfaceFromBytes(bytes, format);
  if (!file.ok()) {
    Require(!file.status().message().empty(), "an error says what it is");
    Require(file.status().message().find('\n') == absl::string_view::npos, "an error is one line");
    return 0;
  }
  Require(ndmap::ValidateClosedSurface(file->surface).ok(), "an accepted surface is closed");
  const auto again = ndmap::ReadSurfaceFromBytes(ndmap::OffText(file->surface), ndmap::SurfaceFormat::kOff);
  Require(again.ok(), "an accepted surface reads back");
  Require(again->surface.points == file->surface.points, "points read back");
  Require(again->surface.triangles.size() == file->surface.triangles.size(), "triangles read back");
  return 0;
}
