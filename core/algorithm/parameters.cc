// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/algorithm/parameters.h"

#include <cmath>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"

namespace ndmap {

Parameters& Parameters::Set(absl::string_view name, absl::string_view value) {
  values_[std::string(name)] = std::string(value);
  return *this;
}
Parameters& Parameters::Set(absl::string_view name, int64_t value) { return Set(name, absl::StrCat(value)); }
Parameters& Parameters::Set(absl::string_view name, double value) {
  return Set(name, absl::StrFormat("%.17g", value));
}

bool Parameters::Has(absl::string_view name) const { return values_.contains(std::string(name)); }

absl::StatusOr<std::string> Parameters::Text(absl::string_view name) const {
  auto it = values_.find(std::string(name));
  if (it == values_.end()) return absl::NotFoundError(absl::StrCat("parameter '", name, "' is missing"));
  return it->second;
}

absl::StatusOr<int64_t> Parameters::Integer(absl::string_view name, int64_t lowest, int64_t highest) const {
  absl::StatusOr<std::string> text = Text(name);
  if (!text.ok()) return text.status();
  int64_t value = 0;
  if (!absl::SimpleAtoi(*text, &value) || value < lowest || value > highest) {
    return absl::InvalidArgumentError(absl::StrCat("parameter '", name, "' is '", *text,
                                                   "', expected an integer from ", lowest, " to ", highest));
  }
  return value;
}

absl::StatusOr<double> Parameters::Real(absl::string_view name) const {
  absl::StatusOr<std::string> text = Text(name);
  if (!text.ok()) return text.status();
  double value = 0;
  if (!absl::SimpleAtod(*text, &value) || !std::isfinite(value)) {
    return absl::InvalidArgumentError(
        absl::StrCat("parameter '", name, "' is '", *text, "', expected a finite number"));
  }
  return value;
}

std::string Parameters::TextOr(absl::string_view name, absl::string_view otherwise) const {
  auto it = values_.find(std::string(name));
  return it == values_.end() ? std::string(otherwise) : it->second;
}

absl::StatusOr<int64_t> Parameters::IntegerOr(absl::string_view name, int64_t otherwise, int64_t lowest,
                                              int64_t highest) const {
  if (!Has(name)) return otherwise;
  return Integer(name, lowest, highest);
}

absl::StatusOr<double> Parameters::RealOr(absl::string_view name, double otherwise) const {
  if (!Has(name)) return otherwise;
  return Real(name);
}

}  // namespace ndmap
