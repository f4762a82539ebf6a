// SPDX-License-Identifier: GPL-3.0-or-later
// Values of points or cells out of VTU files, with the numbers that exports give points and cells.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/io/mesh_reader.h"

namespace ndmap {

struct VtuValues {
  // By point or cell, piece after piece: its "id", of cells also its "level".
  std::vector<int64_t> ids;
  std::vector<int64_t> levels;
  // One or three each, in the vector that was asked for.
  unsigned components = 1;
  std::vector<double> reals;
  std::vector<int64_t> integers;
  std::vector<std::string> texts;
};

enum class VtuPart { kPoints, kCells };
enum class VtuKind { kReals, kIntegers, kTexts };

// The array `name` of a .vtu file of any encoding, or of all files that a .pvtu file names. Numbers of any
// type are taken; as integers only those that are whole; as texts strings and, in decimal, whole numbers.
//
// The error is one sentence that begins with the path: NOT_FOUND if there is no such file, RESOURCE_EXHAUSTED
// above max_bytes in one file, INVALID_ARGUMENT for whatever is wrong in it, arrays that are not there
// included.
absl::StatusOr<VtuValues> ReadVtuValues(const std::string& path, VtuPart part, const std::string& name,
                                        VtuKind kind, uint64_t max_bytes = kMostMeshBytes);

}  // namespace ndmap
