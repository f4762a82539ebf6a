// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/map/ids.h"

#include "absl/numeric/bits.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"

namespace ndmap {
namespace {

constexpr int kPathBits = 94;
// The part of the path that lies in the upper word.
constexpr uint64_t kUpperPathMask = (uint64_t{1} << (kPathBits - 64)) - 1;

}  // namespace

std::string ToString(const Label& label) { return absl::StrFormat("%x:%x", label.root, label.path); }

CellId CellId::Initial(uint64_t number) { return CellId(number << (kPathBits - 64), 1); }

CellId CellId::FromWords(uint64_t hi, uint64_t lo) { return CellId(hi, lo); }

CellId CellId::Child(unsigned c) const {
  const uint64_t upper = ((hi_ & kUpperPathMask) << 3 | lo_ >> 61) & kUpperPathMask;
  return CellId((hi_ & ~kUpperPathMask) | upper, lo_ << 3 | c);
}

CellId CellId::Parent() const {
  const uint64_t upper = hi_ & kUpperPathMask;
  return CellId((hi_ & ~kUpperPathMask) | upper >> 3, lo_ >> 3 | upper << 61);
}

int CellId::level() const {
  const uint64_t upper = hi_ & kUpperPathMask;
  const int bits =
      upper != 0 ? 64 + static_cast<int>(absl::bit_width(upper)) : static_cast<int>(absl::bit_width(lo_));
  return bits == 0 ? 0 : (bits - 1) / 3;
}

unsigned CellId::digit(int i) const {
  const int shift = 3 * (level() - i);
  const uint64_t upper = hi_ & kUpperPathMask;
  uint64_t word = shift >= 64 ? upper >> (shift - 64) : lo_ >> shift;
  if (shift < 64 && shift > 61) word |= upper << (64 - shift);
  return static_cast<unsigned>(word & 7);
}

std::string CellId::ToString() const {
  std::string text = absl::StrCat("h", initial());
  for (int i = 1; i <= level(); ++i) absl::StrAppend(&text, i == 1 ? "/" : ".", digit(i));
  return text;
}

absl::StatusOr<CellId> CellId::Parse(absl::string_view text) {
  const absl::Status bad = absl::InvalidArgumentError(
      absl::StrCat("'", text, "', expected the id of a hexahedron, for example h12/0.3.7"));
  absl::string_view rest = text;
  if (!absl::ConsumePrefix(&rest, "h")) return bad;
  const std::pair<absl::string_view, absl::string_view> parts = absl::StrSplit(rest, absl::MaxSplits('/', 1));
  uint64_t number = 0;
  if (!absl::SimpleAtoi(parts.first, &number) || number > kMaxInitial) return bad;
  CellId id = Initial(number);
  if (parts.first.size() == rest.size()) return id;
  for (absl::string_view digit : absl::StrSplit(parts.second, '.')) {
    if (digit.size() != 1 || digit[0] < '0' || digit[0] > '7' || id.level() == kMaxLevel) return bad;
    id = id.Child(static_cast<unsigned>(digit[0] - '0'));
  }
  return id;
}

absl::StatusOr<absl::flat_hash_set<CellId>> ParseCellIds(absl::string_view text) {
  absl::flat_hash_set<CellId> cells;
  for (absl::string_view word : absl::StrSplit(text, ' ', absl::SkipEmpty())) {
    absl::StatusOr<CellId> id = CellId::Parse(word);
    if (!id.ok()) return id.status();
    cells.insert(*id);
  }
  return cells;
}

std::string Digest::ToString() const { return absl::StrFormat("%016x%016x", hi, lo); }

}  // namespace ndmap
