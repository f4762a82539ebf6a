// SPDX-License-Identifier: GPL-3.0-or-later
// Grids of n-cubes for any n, for tests: an n-map from its flags. A flag is (cell, vertex of the cell, order
// of axes); the flags of even orientation are the darts, and with the generalised map's involutions beta_1 =
// alpha_1 after alpha_0, beta_i = alpha_i after alpha_0 for i > 1.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <random>
#include <vector>

#include "core/map/block.h"

namespace ndmap {

template <class Types>
class CubeGrid {
 public:
  static constexpr unsigned n = Types::n;
  using Lcc = typename Types::Lcc;
  using Dart = typename Types::Dart;
  using Sizes = std::array<uint32_t, n>;

  // Makes the grid in an empty map; vertices lie near the integer lattice, moved at random.
  CubeGrid(Lcc& map, const Sizes& sizes, uint64_t seed) : map_(map), sizes_(sizes), random_(seed) {
    uint64_t cells = 1;
    for (uint32_t s : sizes) cells *= s;
    for (uint64_t cell = 0; cell < cells; ++cell) MakeDarts(cell);
    for (const auto& [flag, d] : darts_) Link(flag, d);
    for (const auto& [flag, d] : darts_) MakeCells(flag, d);
  }

 private:
  struct Flag {
    uint64_t cell;
    uint32_t vertex;
    std::array<uint8_t, n> axes;
    auto operator<=>(const Flag&) const = default;
  };

  static bool Even(const Flag& flag) {
    int odd = __builtin_popcount(flag.vertex);
    for (unsigned i = 0; i < n; ++i) {
      for (unsigned j = i + 1; j < n; ++j) odd += flag.axes[i] > flag.axes[j] ? 1 : 0;
    }
    return odd % 2 == 0;
  }

  static Flag Alpha(Flag flag, unsigned i) {
    if (i == 0) {
      flag.vertex ^= 1u << flag.axes[0];
    } else {
      std::swap(flag.axes[i - 1], flag.axes[i]);
    }
    return flag;
  }

  // alpha_n: across the facet that the flag's vertex and its last axis name; false at the border.
  bool Across(Flag* flag) const {
    const unsigned axis = flag->axes[n - 1];
    const bool up = (flag->vertex >> axis & 1) != 0;
    uint64_t stride = 1;
    for (unsigned a = 0; a < axis; ++a) stride *= sizes_[a];
    const uint64_t x = flag->cell / stride % sizes_[axis];
    if (up ? x + 1 == sizes_[axis] : x == 0) return false;
    flag->cell = up ? flag->cell + stride : flag->cell - stride;
    flag->vertex ^= 1u << axis;
    return true;
  }

  void MakeDarts(uint64_t cell) {
    for (uint32_t vertex = 0; vertex < 1u << n; ++vertex) {
      Flag flag{cell, vertex, {}};
      for (unsigned i = 0; i < n; ++i) flag.axes[i] = static_cast<uint8_t>(i);
      do {
        if (Even(flag)) darts_.emplace(flag, map_.create_dart());
      } while (std::next_permutation(flag.axes.begin(), flag.axes.end()));
    }
  }

  void Link(const Flag& flag, Dart d) {
    const Flag end = Alpha(flag, 0);
    map_.basic_link_beta_1(d, darts_.at(Alpha(end, 1)));
    for (unsigned i = 2; i < n; ++i) map_.basic_link_beta_for_involution(d, darts_.at(Alpha(end, i)), i);
    Flag beyond = end;
    if (Across(&beyond)) map_.basic_link_beta_for_involution(d, darts_.at(beyond), n);
  }

  void MakeCells(const Flag& flag, Dart d) {
    if (map_.template attribute<0>(d) == Lcc::null_handle) {
      std::array<double, Types::kAmbient> x{};
      uint64_t cell = flag.cell;
      for (unsigned a = 0; a < n; ++a) {
        x[a] = static_cast<double>(cell % sizes_[a] + (flag.vertex >> a & 1)) +
               1e-3 * static_cast<double>(random_() % 500);
        cell /= sizes_[a];
      }
      map_.template set_attribute<0>(d, map_.template create_attribute<0>(MakePoint(x)));
    }
    if (map_.template attribute<n>(d) == Lcc::null_handle) {
      const auto cell = map_.template create_attribute<n>();
      map_.template info_of_attribute<n>(cell).id = CellId::Initial(flag.cell);
      map_.template info_of_attribute<n>(cell).reference = d;
      map_.template set_attribute<n>(d, cell);
    }
  }

  static typename Types::Point MakePoint(const std::array<double, Types::kAmbient>& x) {
    if constexpr (Types::kAmbient == 3) {
      return {x[0], x[1], x[2]};
    } else {
      return typename Types::Point(static_cast<int>(Types::kAmbient), x.begin(), x.end());
    }
  }

  Lcc& map_;
  const Sizes sizes_;
  std::mt19937_64 random_;
  std::map<Flag, Dart> darts_;
};

}  // namespace ndmap
