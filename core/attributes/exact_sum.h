// SPDX-License-Identifier: GPL-3.0-or-later
// Sums of doubles without any rounding until the end: the same bits whatever the order of what is added and
// however it was divided into partial sums.
#pragma once

#include <gmpxx.h>

#include <cstdint>
#include <optional>
#include <string>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace ndmap {

class ExactSum {
 public:
  // Finite. Some hundred nanoseconds.
  void Add(double value);
  void Add(int64_t value);
  void Add(const ExactSum& other) { units_ += other.units_; }

  // To the nearest double, halves to the even one; infinite when it is beyond all doubles.
  double Rounded() const;
  // The sum itself, when it is an integer of 64 bits.
  std::optional<int64_t> Integer() const;

  // A sign byte (1: negative) and the magnitude, big-endian, in units of 2^-1074.
  std::string Encode() const;
  // INVALID_ARGUMENT if it is not what Encode() makes.
  static absl::StatusOr<ExactSum> Decode(absl::string_view bytes);

 private:
  // In units of the smallest double, 2^-1074.
  mpz_class units_;
};

}  // namespace ndmap
