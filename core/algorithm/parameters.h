// SPDX-License-Identifier: GPL-3.0-or-later
// Parameters of an algorithm: names and values as text, so that a new algorithm needs no new message on the
// wire.
#pragma once

#include <cstdint>
#include <string>

#include "absl/container/btree_map.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace ndmap {

class Parameters {
 public:
  Parameters() = default;
  explicit Parameters(absl::btree_map<std::string, std::string> values) : values_(std::move(values)) {}

  Parameters& Set(absl::string_view name, absl::string_view value);
  Parameters& Set(absl::string_view name, int64_t value);
  // Written with 17 digits: reads back as the same bits.
  Parameters& Set(absl::string_view name, double value);

  bool Has(absl::string_view name) const;
  // NOT_FOUND without a default when absent; INVALID_ARGUMENT naming parameter and value when it does not
  // parse.
  absl::StatusOr<std::string> Text(absl::string_view name) const;
  absl::StatusOr<int64_t> Integer(absl::string_view name, int64_t lowest, int64_t highest) const;
  absl::StatusOr<double> Real(absl::string_view name) const;
  std::string TextOr(absl::string_view name, absl::string_view otherwise) const;
  absl::StatusOr<int64_t> IntegerOr(absl::string_view name, int64_t otherwise, int64_t lowest,
                                    int64_t highest) const;
  absl::StatusOr<double> RealOr(absl::string_view name, double otherwise) const;

  const absl::btree_map<std::string, std::string>& values() const { return values_; }

 private:
  absl::btree_map<std::string, std::string> values_;
};

}  // namespace ndmap
