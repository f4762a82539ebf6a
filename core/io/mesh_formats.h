// SPDX-License-Identifier: GPL-3.0-or-later
// The readers behind mesh_reader.h, one for each format, and what they share.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/io/mesh_reader.h"

namespace ndmap::internal {

// Each reads what it knows to be of its format, as far as indices go: none is beyond 32 bits.
// INVALID_ARGUMENT without a file's name.
absl::StatusOr<MeshFile> ReadGmsh(absl::string_view bytes);
absl::StatusOr<MeshFile> ReadMedit(absl::string_view bytes);
absl::StatusOr<MeshFile> ReadMeditBinary(absl::string_view bytes);
absl::StatusOr<MeshFile> ReadMfem(absl::string_view bytes);
// RESOURCE_EXHAUSTED if an array takes more than max_bytes.
absl::StatusOr<MeshFile> ReadVtu(absl::string_view bytes, uint64_t max_bytes);

// Cells of fewer dimensions, by name.
class LeftOut {
 public:
  void Add(absl::string_view plural, uint64_t count) {
    if (count > 0) counts_[std::string(plural)] += count;
  }
  // A note, if any were left out.
  void NoteTo(MeshFile* file) const;

 private:
  std::map<std::string, uint64_t> counts_;
};

// From the numbers by which a file calls its points to their indices.
class PointNumbers {
 public:
  // False if the number is there already.
  bool Add(uint64_t number);
  std::optional<uint32_t> Find(uint64_t number) const;
  uint64_t size() const { return numbers_.size(); }
  uint64_t number(uint64_t index) const { return numbers_[index]; }
  std::vector<uint64_t> Take() { return std::move(numbers_); }

 private:
  bool consecutive_ = true;  // As long as they are, no table is needed.
  std::vector<uint64_t> numbers_;
  absl::flat_hash_map<uint64_t, uint32_t> indices_;
};

}  // namespace ndmap::internal
