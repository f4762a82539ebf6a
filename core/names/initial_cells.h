// SPDX-License-Identifier: GPL-3.0-or-later
// What names need to know of the initial mesh: which initial hexahedron owns a place on the boundary between
// several. Everything else about a cell's id follows from its own hexahedron.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace ndmap {

// A place in an initial hexahedron: coordinates along its three axes, from 0 to kSide.
struct LatticePlace {
  static constexpr int kFinestLevel = 29;
  static constexpr uint32_t kSide = uint32_t{1} << kFinestLevel;

  uint64_t initial = 0;
  std::array<uint32_t, 3> at{};

  friend bool operator==(const LatticePlace&, const LatticePlace&) = default;
};

class InitialCells {
 public:
  virtual ~InitialCells() = default;

  // The same place in the frame of its owner: the lowest-numbered initial hexahedron that the box from
  // `place.at` to place.at + extent (0 on axes across the cell, its length along it) touches. Constant time.
  virtual LatticePlace ToOwner(const LatticePlace& place, const std::array<uint32_t, 3>& extent) const = 0;
  // The same place in the frames of all initial hexahedra that the box touches, `place.initial` first. At
  // most 8 in a grid.
  virtual std::vector<LatticePlace> Around(const LatticePlace& place,
                                           const std::array<uint32_t, 3>& extent) const = 0;
};

// The grid of the main job: hexahedron number i + cells[0] (j + cells[1] k).
class GridCells final : public InitialCells {
 public:
  explicit GridCells(const std::array<uint32_t, 3>& cells) : cells_(cells) {}

  LatticePlace ToOwner(const LatticePlace& place, const std::array<uint32_t, 3>& extent) const override {
    LatticePlace owner = place;
    uint64_t stride = 1;
    for (int c = 0; c < 3; ++c) {
      const uint64_t index = place.initial / stride % cells_[c];
      if (extent[c] == 0 && place.at[c] == 0 && index > 0) {
        owner.initial -= stride;
        owner.at[c] = LatticePlace::kSide;
      }
      stride *= cells_[c];
    }
    return owner;
  }

  std::vector<LatticePlace> Around(const LatticePlace& place,
                                   const std::array<uint32_t, 3>& extent) const override {
    std::vector<LatticePlace> places = {place};
    uint64_t stride = 1;
    for (int c = 0; c < 3; ++c) {
      const uint64_t index = place.initial / stride % cells_[c];
      const bool below = extent[c] == 0 && place.at[c] == 0 && index > 0;
      const bool above = extent[c] == 0 && place.at[c] == LatticePlace::kSide && index + 1 < cells_[c];
      for (size_t i = 0, n = places.size(); (below || above) && i < n; ++i) {
        LatticePlace other = places[i];
        other.initial = below ? other.initial - stride : other.initial + stride;
        other.at[c] = below ? LatticePlace::kSide : 0;
        places.push_back(other);
      }
      stride *= cells_[c];
    }
    return places;
  }

 private:
  const std::array<uint32_t, 3> cells_;
};

}  // namespace ndmap
