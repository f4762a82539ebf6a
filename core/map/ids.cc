// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/map/ids.h"

#include "absl/algorithm/container.h"
#include "absl/numeric/bits.h"
#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"

namespace ndmap {
namespace {

constexpr int kPathBits = 94;
constexpr int kPartBits = 5;
constexpr int kRankBits = 31;
// The part of the path that lies in the upper word.
constexpr uint64_t kUpperPathMask = (uint64_t{1} << (kPathBits - 64)) - 1;

// The first letter of an id's text, by dimension.
constexpr absl::string_view kPrefixes = "vefh";

// The number of a part among those of its dimension: corner x + 2 y + 4 z; edge 4 axis + low sides of the
// other two axes as bits; face 0 z=0, 1 z=1, 2 y=0, 3 y=1, 4 x=0, 5 x=1.
unsigned NumberOfPart(unsigned part) {
  const unsigned x = part % 3, y = part / 3 % 3, z = part / 9;
  const unsigned whole = (x == 2 ? 1 : 0) + (y == 2 ? 1 : 0) + (z == 2 ? 1 : 0);
  if (whole == 0) return x + 2 * y + 4 * z;
  if (whole == 1) return x == 2 ? y + 2 * z : y == 2 ? 4 + x + 2 * z : 8 + x + 2 * y;
  return z != 2 ? z : y != 2 ? 2 + y : 4 + x;
}

// Digits alone: SimpleAtoi would take blanks and signs too.
bool IsNumber(absl::string_view text) {
  return !text.empty() && absl::c_all_of(text, [](char c) { return absl::ascii_isdigit(c); });
}

}  // namespace

std::string ToString(const Label& label) { return absl::StrFormat("%x:%x", label.root, label.path); }

CellId CellId::Initial(uint64_t number) { return CellId(number << (kPathBits - 64), 1); }

CellId CellId::Polygon(uint64_t number) { return CellId(number << (kPathBits - 64), 2); }

CellId CellId::FromWords(uint64_t hi, uint64_t lo) { return CellId(hi, lo); }

CellId CellId::Child(unsigned c) const {
  const uint64_t upper = ((hi_ & kUpperPathMask) << 3 | lo_ >> 61) & kUpperPathMask;
  return CellId((hi_ & ~kUpperPathMask) | upper, lo_ << 3 | c);
}

CellId CellId::Parent() const {
  const uint64_t upper = hi_ & kUpperPathMask;
  return CellId((hi_ & ~kUpperPathMask) | upper >> 3, lo_ >> 3 | upper << 61);
}

int CellId::Sentinel() const {
  const uint64_t upper = hi_ & kUpperPathMask;
  const int bits =
      upper != 0 ? 64 + static_cast<int>(absl::bit_width(upper)) : static_cast<int>(absl::bit_width(lo_));
  return bits - 1;
}

bool CellId::IsWellFormed() const {
  const int sentinel = Sentinel();
  if (sentinel < 0) return false;
  if (is_polygon()) return lo_ == 2;
  if (is_cell()) return sentinel <= 3 * kMaxLevel;
  if (is_part()) return sentinel >= kPartBits && level() <= kMaxLevel && part() < kWholePart;
  return sentinel == kRankBits;
}

CellId CellId::Part(const CellId& hexahedron, unsigned part) {
  if (part == kWholePart) return hexahedron;
  const uint64_t upper =
      ((hexahedron.hi_ & kUpperPathMask) << kPartBits | hexahedron.lo_ >> (64 - kPartBits)) & kUpperPathMask;
  return CellId((hexahedron.hi_ & ~kUpperPathMask) | upper, hexahedron.lo_ << kPartBits | part);
}

CellId CellId::hexahedron() const {
  const uint64_t upper = hi_ & kUpperPathMask;
  return CellId((hi_ & ~kUpperPathMask) | upper >> kPartBits, lo_ >> kPartBits | upper << (64 - kPartBits));
}

CellId CellId::Rank(uint64_t initial, unsigned dimension, uint32_t rank) {
  return CellId(initial << (kPathBits - 64), uint64_t{1} << kRankBits | uint64_t{dimension} << 29 | rank);
}

unsigned CellId::dimension(unsigned n) const {
  if (is_polygon()) return 2;
  if (is_cell()) return n;
  if (is_rank()) return static_cast<unsigned>(lo_ >> 29 & 3);
  const unsigned p = part();
  return (p % 3 == 2 ? 1 : 0) + (p / 3 % 3 == 2 ? 1 : 0) + (p / 9 == 2 ? 1 : 0);
}

int CellId::level() const {
  const int sentinel = Sentinel();
  if (is_part()) return (sentinel - kPartBits) / 3;
  return is_cell() ? sentinel / 3 : 0;
}

unsigned CellId::digit(int i) const {
  const int shift = 3 * (level() - i);
  const uint64_t upper = hi_ & kUpperPathMask;
  uint64_t word = shift >= 64 ? upper >> (shift - 64) : lo_ >> shift;
  if (shift < 64 && shift > 61) word |= upper << (64 - shift);
  return static_cast<unsigned>(word & 7);
}

std::string CellId::ToString() const {
  if (is_rank()) return absl::StrCat(kPrefixes.substr(dimension(), 1), initial(), "#", rank());
  if (is_part()) {
    const CellId h = hexahedron();
    return absl::StrCat(kPrefixes.substr(dimension(), 1), h.ToString().substr(1), ":", NumberOfPart(part()));
  }
  std::string text = absl::StrCat(is_polygon() ? "f" : "h", initial());
  for (int i = 1; i <= level(); ++i) absl::StrAppend(&text, i == 1 ? "/" : ".", digit(i));
  return text;
}

absl::StatusOr<CellId> CellId::Parse(absl::string_view text) {
  const absl::Status bad = absl::InvalidArgumentError(
      absl::StrCat("'", text.substr(0, 200),
                   "', expected the id of a cell, for example h12/0.3.7 (a hexahedron), "
                   "v12/0.3.7:5 (a vertex), e12:11 (an edge), f12/0:2 (a face), f12 (a polygon)"));
  const size_t dimension = text.empty() ? absl::string_view::npos : kPrefixes.find(text[0]);
  if (dimension == absl::string_view::npos) return bad;
  absl::string_view rest = text.substr(1);
  const bool ranked = absl::StrContains(rest, '#');
  const bool polygon = dimension == 2 && rest.find_first_of("#:/") == absl::string_view::npos;
  // The number after ':' or '#': which part.
  uint32_t which = 0;
  if (ranked || (dimension < 3 && !polygon)) {
    const std::pair<absl::string_view, absl::string_view> halves =
        absl::StrSplit(rest, absl::MaxSplits(ranked ? '#' : ':', 1));
    if (halves.first.size() == rest.size() || !IsNumber(halves.second) ||
        !absl::SimpleAtoi(halves.second, &which))
      return bad;
    rest = halves.first;
  }
  const std::pair<absl::string_view, absl::string_view> parts = absl::StrSplit(rest, absl::MaxSplits('/', 1));
  uint64_t number = 0;
  if (!IsNumber(parts.first) || !absl::SimpleAtoi(parts.first, &number) || number > kMaxInitial) return bad;
  if (ranked) {
    return which <= kMaxRank && parts.first.size() == rest.size()
               ? absl::StatusOr<CellId>(Rank(number, static_cast<unsigned>(dimension), which))
               : bad;
  }
  if (polygon) return Polygon(number);
  CellId id = Initial(number);
  if (parts.first.size() != rest.size()) {
    for (absl::string_view digit : absl::StrSplit(parts.second, '.')) {
      if (digit.size() != 1 || digit[0] < '0' || digit[0] > '7' || id.level() == kMaxLevel) return bad;
      id = id.Child(static_cast<unsigned>(digit[0] - '0'));
    }
  }
  if (dimension == 3) return id;
  for (unsigned part = 0; part < kWholePart; ++part) {
    const CellId candidate = Part(id, part);
    if (candidate.dimension() == dimension && NumberOfPart(part) == which) return candidate;
  }
  return bad;
}

absl::StatusOr<absl::flat_hash_set<CellId>> ParseCellIds(absl::string_view text) {
  absl::flat_hash_set<CellId> cells;
  for (absl::string_view word : absl::StrSplit(text, ' ', absl::SkipEmpty())) {
    absl::StatusOr<CellId> id = CellId::Parse(word);
    if (!id.ok()) return id.status();
    if (!id->is_cell()) {
      return absl::InvalidArgumentError(
          absl::StrCat("'", word,
                       "', expected the id of a hexahedron (or of a surface's face), for example "
                       "h12/0.3.7 (or f12)"));
    }
    cells.insert(*id);
  }
  return cells;
}

std::string Digest::ToString() const { return absl::StrFormat("%016x%016x", hi, lo); }

}  // namespace ndmap
