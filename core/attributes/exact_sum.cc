// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/attributes/exact_sum.h"

#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"

namespace ndmap {
namespace {

constexpr int kUnitExponent = -1074;
constexpr int kMantissaBits = std::numeric_limits<double>::digits;
// 2^64 of the largest doubles.
constexpr size_t kMostBytes = (1024 + 1074 + 64) / 8 + 1;

}  // namespace

void ExactSum::Add(double value) {
  if (value == 0) return;
  int exponent = 0;
  // value = mantissa 2^exponent with an integer of 53 bits; of small ones the low bits are 0.
  double mantissa = std::frexp(value, &exponent);
  int shift = exponent - kMantissaBits - kUnitExponent;
  int bits = kMantissaBits;
  if (shift < 0) {
    bits += shift;
    shift = 0;
  }
  mpz_class term(static_cast<long>(std::ldexp(mantissa, bits)));
  term <<= static_cast<mp_bitcnt_t>(shift);
  units_ += term;
}

void ExactSum::Add(int64_t value) {
  mpz_class term(static_cast<long>(value));
  term <<= static_cast<mp_bitcnt_t>(-kUnitExponent);
  units_ += term;
}

double ExactSum::Rounded() const {
  const mpz_class magnitude = abs(units_);
  const size_t bits = mpz_sizeinbase(magnitude.get_mpz_t(), 2);
  double rounded;
  if (bits <= static_cast<size_t>(kMantissaBits)) {
    rounded = std::ldexp(magnitude.get_d(), kUnitExponent);
  } else {
    const mp_bitcnt_t shift = bits - kMantissaBits;
    mpz_class top = magnitude >> shift;
    const mpz_class rest = magnitude - (top << shift);
    const mpz_class half = mpz_class(1) << (shift - 1);
    if (rest > half || (rest == half && mpz_odd_p(top.get_mpz_t()) != 0)) ++top;
    rounded = std::ldexp(top.get_d(), static_cast<int>(shift) + kUnitExponent);
  }
  return sgn(units_) < 0 ? -rounded : rounded;
}

std::optional<int64_t> ExactSum::Integer() const {
  const mpz_class whole = units_ >> static_cast<mp_bitcnt_t>(-kUnitExponent);
  if ((whole << static_cast<mp_bitcnt_t>(-kUnitExponent)) != units_ || !whole.fits_slong_p())
    return std::nullopt;
  return whole.get_si();
}

std::string ExactSum::Encode() const {
  std::string bytes(1, sgn(units_) < 0 ? '\1' : '\0');
  const size_t size = sgn(units_) == 0 ? 0 : (mpz_sizeinbase(units_.get_mpz_t(), 2) + 7) / 8;
  bytes.resize(1 + size);
  if (size > 0) mpz_export(bytes.data() + 1, nullptr, 1, 1, 1, 0, units_.get_mpz_t());
  return bytes;
}

absl::StatusOr<ExactSum> ExactSum::Decode(absl::string_view bytes) {
  if (bytes.empty() || bytes.size() > 1 + kMostBytes || static_cast<unsigned char>(bytes[0]) > 1) {
    return absl::InvalidArgumentError(absl::StrCat("not an exact sum: ", bytes.size(), " bytes"));
  }
  ExactSum sum;
  mpz_import(sum.units_.get_mpz_t(), bytes.size() - 1, 1, 1, 1, 0, bytes.data() + 1);
  if (bytes[0] == 1) sum.units_ = -sum.units_;
  return sum;
}

}  // namespace ndmap
