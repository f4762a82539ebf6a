// SPDX-License-Identifier: GPL-3.0-or-later
// The names by which parts of a distributed map are known: blocks, darts, labels of critical darts, and ids
// of cells. All are values, comparable and hashable with absl::Hash; none is a bare integer at our
// interfaces.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <utility>

#include "absl/container/flat_hash_set.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace ndmap {

// A block of a map: 0 ... k-1.
struct BlockId {
  static constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();
  uint32_t value = kNone;

  bool valid() const { return value != kNone; }
  friend bool operator==(BlockId a, BlockId b) = default;
  friend auto operator<=>(BlockId a, BlockId b) = default;
  template <typename H>
  friend H AbslHashValue(H h, BlockId b) {
    return H::combine(std::move(h), b.value);
  }
};

// A dart of one block, by its index in the block's storage: stable between changes of the block.
struct DartIndex {
  static constexpr uint32_t kNone = std::numeric_limits<uint32_t>::max();
  uint32_t value = kNone;

  bool valid() const { return value != kNone; }
  friend bool operator==(DartIndex a, DartIndex b) = default;
  friend auto operator<=>(DartIndex a, DartIndex b) = default;
  template <typename H>
  friend H AbslHashValue(H h, DartIndex d) {
    return H::combine(std::move(h), d.value);
  }
};

// The label of a critical dart: 128 bits, carried by exactly two critical darts, in two different blocks.
// core/map stores, pairs and looks up labels; what the bits mean belongs to the algorithm that made them
// (hexahedral refinement: core/algorithm/refine/label.h). `path` is never 0 in a label in use.
struct Label {
  uint64_t root = 0;
  uint64_t path = 0;

  friend bool operator==(const Label&, const Label&) = default;
  friend auto operator<=>(const Label&, const Label&) = default;
  template <typename H>
  friend H AbslHashValue(H h, const Label& l) {
    return H::combine(std::move(h), l.root, l.path);
  }
};

// "root:path" in hexadecimal, for messages to people.
std::string ToString(const Label& label);

// The id of a cell of any dimension: 128 bits, the same for any number of blocks, any order of messages and
// any server, and never changed by what happens to other cells (docs/ids.md). The upper 34 bits hold the
// number of an initial n-cell, the lower 94 a sentinel bit and what follows it; where the sentinel stands
// says which of four kinds the id is of:
//
//   3-cell   path of child numbers, 3 bits a level                            "h12/0.3.7"
//   part     path of a hexahedron and, in 5 bits, one of its 26 vertices,     "v12/0.3.7:5" "e12:11"
//   "f12/0:2"
//            edges and faces
//   rank     2 bits of dimension and 29 of a number within the initial cell   "v12#5" "e12#0" "f12#3"
//   polygon  the face of a surface: an n-cell with n = 2                      "f12"
class CellId {
 public:
  static constexpr int kMaxLevel = 29;
  static constexpr uint64_t kMaxInitial = (uint64_t{1} << 34) - 1;
  static constexpr uint32_t kMaxRank = (uint32_t{1} << 29) - 1;
  // Parts of a hexahedron: x + 3 y + 9 z with 0 for the low side of an axis, 1 for the high side, 2 for its
  // whole extent. 26 is the hexahedron itself.
  static constexpr unsigned kWholePart = 26;

  CellId() = default;
  static CellId Initial(uint64_t number);
  static CellId FromWords(uint64_t hi, uint64_t lo);
  // A vertex, edge or face of a hexahedron (which need not exist): part < kWholePart; the hexahedron itself
  // for kWholePart.
  static CellId Part(const CellId& hexahedron, unsigned part);
  // A face of a map of dimension 2, by its number.
  static CellId Polygon(uint64_t number);
  // A cell of dimension 0 ... 3 known by its rank in an initial cell.
  static CellId Rank(uint64_t initial, unsigned dimension, uint32_t rank);

  // Whether FromWords was given an id: what arrives from outside may be none.
  bool IsWellFormed() const;

  // Child c (0 ... 7) of this n-cell; level() must be below kMaxLevel.
  CellId Child(unsigned c) const;
  CellId Parent() const;

  uint64_t initial() const { return hi_ >> 30; }
  // An n-cell: of a map of dimension 3, or a polygon.
  bool is_cell() const { return Sentinel() % 3 == 0 || is_polygon(); }
  bool is_polygon() const { return Sentinel() == 1; }
  bool is_part() const { return Sentinel() % 3 == 2; }
  bool is_rank() const { return Sentinel() % 3 == 1 && !is_polygon(); }
  // n-cells that are no polygons have the dimension of their map, which is given back.
  unsigned dimension(unsigned n = 3) const;
  // Of a part: which, and of which hexahedron.
  unsigned part() const { return static_cast<unsigned>(lo_ & 31); }
  CellId hexahedron() const;
  // Of a rank.
  uint32_t rank() const { return static_cast<uint32_t>(lo_) & kMaxRank; }

  // Of an n-cell or a part: the number of digits of its path. 0 for ranks.
  int level() const;
  // The child number at depth i of an n-cell, 1 <= i <= level().
  unsigned digit(int i) const;
  unsigned last_digit() const { return static_cast<unsigned>(lo_ & 7); }
  uint64_t hi() const { return hi_; }
  uint64_t lo() const { return lo_; }
  bool valid() const { return hi_ != 0 || lo_ != 0; }

  // "h12/0.3.7": initial cell 12, child 0, of it child 3, of it child 7; "h12" at level 0. "v12/0.3.7:5",
  // "e…:11", "f…:2": vertex 5 (0 ... 7), edge 11 (0 ... 11), face 2 (0 ... 5) of that hexahedron. "f12":
  // polygon 12.
  std::string ToString() const;
  // Reads ToString()'s form; INVALID_ARGUMENT otherwise.
  static absl::StatusOr<CellId> Parse(absl::string_view text);

  friend bool operator==(const CellId&, const CellId&) = default;
  friend auto operator<=>(const CellId&, const CellId&) = default;
  template <typename H>
  friend H AbslHashValue(H h, const CellId& id) {
    return H::combine(std::move(h), id.hi_, id.lo_);
  }

 private:
  CellId(uint64_t hi, uint64_t lo) : hi_(hi), lo_(lo) {}
  // Bits below the sentinel.
  int Sentinel() const;
  uint64_t hi_ = 0;
  uint64_t lo_ = 0;
};

// Ids of n-cells in text form, separated by spaces. INVALID_ARGUMENT names the word that is none.
absl::StatusOr<absl::flat_hash_set<CellId>> ParseCellIds(absl::string_view text);

// A sum modulo 2^128 of XXH3-128 values: blocks add up theirs in any order.
struct Digest {
  uint64_t hi = 0;
  uint64_t lo = 0;

  void Add(const Digest& other) {
    const uint64_t before = lo;
    lo += other.lo;
    hi += other.hi + (lo < before ? 1 : 0);
  }
  // 32 hexadecimal digits.
  std::string ToString() const;
  friend bool operator==(const Digest&, const Digest&) = default;
};

}  // namespace ndmap
