// SPDX-License-Identifier: GPL-3.0-or-later
// The XML of a .vtu file, up to the appended data, and the arrays that it tells of.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace ndmap::internal {

// One DataArray as the file declares it.
struct VtuArray {
  std::string name;    // As errors call it: "Points", "connectivity".
  std::string type;    // "Float64"
  std::string format;  // "ascii", "binary", "appended"
  int64_t components = 1;
  uint64_t offset = 0;  // Of appended ones, behind the underscore.
  std::string text;     // What stands between the tags.
  uint64_t line = 0;
};

struct VtuFilePiece {
  uint64_t points = 0, cells = 0;
  std::optional<VtuArray> coordinates, connectivity, offsets, types;
  // Those of them that were asked for.
  std::vector<VtuArray> point_data = {}, cell_data = {};
};

enum class VtuCompressor { kNone, kZlib, kLzma };

struct VtuDocument {
  bool big_endian = false;
  bool wide_header = false;  // UInt64 before binary data, not UInt32.
  VtuCompressor compressor = VtuCompressor::kNone;
  std::vector<VtuFilePiece> pieces;
  // All offsets that any array declares, ascending: in base64 only the next one tells where an array ends.
  std::vector<uint64_t> all_offsets;
  bool appended_base64 = false;
  // An index (.pvtu) was read: the files that it names, as it names them.
  bool is_index = false;
  std::vector<std::string> sources;
  absl::string_view appended;  // What follows the underscore, to the end of the file; part of `bytes`.
};

// What else than the mesh is wanted of a file.
struct VtuWanted {
  std::vector<std::string> data;  // Names of arrays of points and cells.
  bool index = false;             // Indices of pieces are read, too; otherwise refused.
};

// INVALID_ARGUMENT with the line. Document type declarations are refused, so no entity grows.
absl::StatusOr<VtuDocument> ParseVtu(absl::string_view bytes, const VtuWanted& wanted = {});

// The numbers of an array, which must be `count`. INVALID_ARGUMENT with the array's name and line;
// RESOURCE_EXHAUSTED if it takes more than max_bytes. What a header promises is not believed: memory grows
// with what is there.
absl::StatusOr<std::vector<double>> VtuReals(const VtuDocument& document, const VtuArray& array,
                                             uint64_t count, uint64_t max_bytes);
absl::StatusOr<std::vector<int64_t>> VtuIntegers(const VtuDocument& document, const VtuArray& array,
                                                 std::optional<uint64_t> count, uint64_t max_bytes);

// Numbers of any type, not finite ones and integers (rounded) included; and the texts of an array of strings.
absl::StatusOr<std::vector<double>> VtuAnyNumbers(const VtuDocument& document, const VtuArray& array,
                                                  uint64_t count, uint64_t max_bytes);
absl::StatusOr<std::vector<std::string>> VtuTexts(const VtuDocument& document, const VtuArray& array,
                                                  uint64_t max_bytes);

}  // namespace ndmap::internal
