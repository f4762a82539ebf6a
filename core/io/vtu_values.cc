// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/vtu_values.h"

#include <algorithm>
#include <cmath>
#include <new>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/io/file_bytes.h"
#include "core/io/vtu_document.h"

namespace ndmap {
namespace {

using internal::VtuArray;
using internal::VtuDocument;

// So many files an index may name; ours have one a block.
constexpr size_t kMostPieces = 65536;

class Values {
 public:
  Values(VtuPart part, const std::string& name, VtuKind kind, uint64_t max_bytes)
      : part_(part), name_(name), kind_(kind), max_bytes_(max_bytes) {}

  // Adds what a file has; errors do not name it. `sources`: of an index, the files that it names.
  absl::Status AddFile(const std::string& path, bool index, std::vector<std::string>* sources) {
    const auto bytes = internal::ReadFileBytes(path, max_bytes_);
    if (!bytes.ok()) return bytes.status();
    const internal::VtuWanted wanted{{"id", "level", name_}, index};
    const auto document = internal::ParseVtu(*bytes, wanted);
    if (!document.ok()) return Named(path, document.status());
    if (document->is_index) {
      *sources = document->sources;
      if (sources->size() > kMostPieces)
        return absl::InvalidArgumentError(absl::StrCat(path, ": names ", sources->size(), " pieces"));
      return absl::OkStatus();
    }
    absl::Status status;
    for (const internal::VtuFilePiece& piece : document->pieces) {
      if (status.ok()) status = AddPiece(*document, piece);
    }
    return Named(path, status);
  }
  VtuValues Take() { return std::move(values_); }

 private:
  static absl::Status Named(const std::string& path, const absl::Status& status) {
    return status.ok() ? status : absl::Status(status.code(), absl::StrCat(path, ": ", status.message()));
  }

  absl::Status AddPiece(const VtuDocument& document, const internal::VtuFilePiece& piece) {
    const bool cells = part_ == VtuPart::kCells;
    const std::vector<VtuArray>& data = cells ? piece.cell_data : piece.point_data;
    const uint64_t count = cells ? piece.cells : piece.points;
    // Pieces without points or cells need not have arrays.
    if (count == 0) return absl::OkStatus();
    if (absl::Status s = AddIntegers(document, data, "id", count, &values_.ids); !s.ok()) return s;
    if (cells) {
      if (absl::Status s = AddIntegers(document, data, "level", count, &values_.levels); !s.ok()) return s;
    }
    const auto found = Find(data, name_);
    if (!found.ok()) return found.status();
    const VtuArray& array = **found;
    if (array.components != 1 && array.components != 3) {
      return absl::InvalidArgumentError(
          absl::StrCat("array '", name_, "' has ", array.components, " components, expected 1 or 3"));
    }
    const auto components = static_cast<unsigned>(array.components);
    if (values_.ids.size() > count && components != values_.components)
      return absl::InvalidArgumentError(
          absl::StrCat("array '", name_, "' has not as many components as before"));
    values_.components = components;
    return AddValues(document, array, count * components);
  }

  absl::StatusOr<const VtuArray*> Find(const std::vector<VtuArray>& data, absl::string_view name) const {
    for (const VtuArray& array : data) {
      if (array.name == name) return &array;
    }
    return absl::InvalidArgumentError(
        absl::StrCat("its ", part_ == VtuPart::kCells ? "cells" : "points", " have no array '", name, "'"));
  }

  absl::Status AddIntegers(const VtuDocument& document, const std::vector<VtuArray>& data,
                           absl::string_view name, uint64_t count, std::vector<int64_t>* all) {
    const auto array = Find(data, name);
    if (!array.ok()) return array.status();
    const auto numbers = internal::VtuIntegers(document, **array, count, max_bytes_);
    if (!numbers.ok()) return numbers.status();
    all->insert(all->end(), numbers->begin(), numbers->end());
    return absl::OkStatus();
  }

  absl::Status AddValues(const VtuDocument& document, const VtuArray& array, uint64_t count) {
    if (array.type == "String" && kind_ != VtuKind::kTexts)
      return absl::InvalidArgumentError(absl::StrCat("array '", name_, "' has texts, expected numbers"));
    const bool floats = array.type == "Float32" || array.type == "Float64";
    if (kind_ == VtuKind::kReals) {
      return Append(internal::VtuAnyNumbers(document, array, count, max_bytes_), &values_.reals);
    }
    if (kind_ == VtuKind::kTexts && array.type == "String") {
      auto texts = internal::VtuTexts(document, array, max_bytes_);
      if (texts.ok() && texts->size() != count) {
        return absl::InvalidArgumentError(
            absl::StrCat("array '", name_, "' has ", texts->size(), " texts; ", count, " expected"));
      }
      return Append(std::move(texts), &values_.texts);
    }
    auto numbers = floats ? Whole(internal::VtuAnyNumbers(document, array, count, max_bytes_))
                          : internal::VtuIntegers(document, array, count, max_bytes_);
    if (kind_ == VtuKind::kIntegers || !numbers.ok()) return Append(std::move(numbers), &values_.integers);
    for (int64_t number : *numbers) values_.texts.push_back(absl::StrCat(number));
    return absl::OkStatus();
  }

  template <class T>
  static absl::Status Append(absl::StatusOr<std::vector<T>> more, std::vector<T>* all) {
    if (more.ok()) all->insert(all->end(), more->begin(), more->end());
    return more.status();
  }

  absl::StatusOr<std::vector<int64_t>> Whole(const absl::StatusOr<std::vector<double>>& numbers) const {
    if (!numbers.ok()) return numbers.status();
    std::vector<int64_t> whole;
    for (double number : *numbers) {
      // Below 2^53 every whole number is one of its own; what is no number equals nothing.
      if (!(std::floor(number) == number && std::fabs(number) <= 0x1p53)) {
        return absl::InvalidArgumentError(
            absl::StrCat("array '", name_, "' has the value ", number, ", expected whole numbers"));
      }
      whole.push_back(static_cast<int64_t>(number));
    }
    return whole;
  }

  const VtuPart part_;
  const std::string name_;
  const VtuKind kind_;
  const uint64_t max_bytes_;
  VtuValues values_;
};

}  // namespace

absl::StatusOr<VtuValues> ReadVtuValues(const std::string& path, VtuPart part, const std::string& name,
                                        VtuKind kind, uint64_t max_bytes) {
  try {
    Values values(part, name, kind, max_bytes);
    std::vector<std::string> sources;
    if (absl::Status s = values.AddFile(path, true, &sources); !s.ok()) return s;
    const size_t slash = path.rfind('/');
    const std::string folder = slash == std::string::npos ? "" : path.substr(0, slash + 1);
    for (const std::string& source : sources) {
      const std::string file = !source.empty() && source[0] == '/' ? source : folder + source;
      if (absl::Status s = values.AddFile(file, false, nullptr); !s.ok()) return s;
    }
    return values.Take();
  } catch (const std::bad_alloc&) {
    return absl::ResourceExhaustedError(absl::StrCat(path, ": is too large for the memory there is"));
  }
}

}  // namespace ndmap
