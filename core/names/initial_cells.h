// SPDX-License-Identifier: GPL-3.0-or-later
// What names need to know of the initial mesh: which initial hexahedron owns a place on the boundary between
// several; of a surface, which of its faces. Everything else about a cell's id follows from its own
// hexahedron.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace ndmap {

class MeshCells;
class PolygonCells;

// A place in an initial hexahedron: coordinates along its three axes, from 0 to kSide.
struct LatticePlace {
  static constexpr int kFinestLevel = 29;
  static constexpr uint32_t kSide = uint32_t{1} << kFinestLevel;

  uint64_t initial = 0;
  std::array<uint32_t, 3> at{};

  friend bool operator==(const LatticePlace&, const LatticePlace&) = default;
};

// A box of the lattice: a cell's lowest corner, and how long it is along each axis: 0, or one common power of
// two. A vertex has no extent, an edge one axis, a face two, a hexahedron three.
struct LatticeBox {
  LatticePlace low;
  std::array<uint32_t, 3> extent{};

  friend bool operator==(const LatticeBox&, const LatticeBox&) = default;
};

class InitialCells {
 public:
  virtual ~InitialCells() = default;

  // The same box in the frame of its owner: the lowest-numbered initial hexahedron that it touches.
  virtual LatticeBox ToOwner(const LatticeBox& box) const = 0;
  // The same box in the frames of the initial hexahedra that it touches, as far as they are known here. At
  // most 8 in a grid.
  virtual std::vector<LatticeBox> Around(const LatticeBox& box) const = 0;
  // What is known of a mesh in which not all initial cells are hexahedra, or axes are not parallel; null for
  // a grid and for a surface.
  virtual const MeshCells* mesh() const { return nullptr; }
  // What is known of a surface, whose map has dimension 2; null for the others.
  virtual const PolygonCells* polygons() const { return nullptr; }
};

// The grid of the main job: hexahedron number i + cells[0] (j + cells[1] k).
class GridCells final : public InitialCells {
 public:
  explicit GridCells(const std::array<uint32_t, 3>& cells) : cells_(cells) {}

  // Constant time, as Around().
  LatticeBox ToOwner(const LatticeBox& box) const override {
    LatticeBox owner = box;
    uint64_t stride = 1;
    for (int c = 0; c < 3; ++c) {
      const uint64_t index = box.low.initial / stride % cells_[c];
      if (box.extent[c] == 0 && box.low.at[c] == 0 && index > 0) {
        owner.low.initial -= stride;
        owner.low.at[c] = LatticePlace::kSide;
      }
      stride *= cells_[c];
    }
    return owner;
  }

  // The box's own hexahedron first.
  std::vector<LatticeBox> Around(const LatticeBox& box) const override {
    std::vector<LatticeBox> boxes = {box};
    uint64_t stride = 1;
    for (int c = 0; c < 3; ++c) {
      const uint64_t index = box.low.initial / stride % cells_[c];
      const bool across = box.extent[c] == 0;
      const bool below = across && box.low.at[c] == 0 && index > 0;
      const bool above = across && box.low.at[c] == LatticePlace::kSide && index + 1 < cells_[c];
      for (size_t i = 0, n = boxes.size(); (below || above) && i < n; ++i) {
        LatticeBox other = boxes[i];
        other.low.initial = below ? other.low.initial - stride : other.low.initial + stride;
        other.low.at[c] = below ? LatticePlace::kSide : 0;
        boxes.push_back(other);
      }
      stride *= cells_[c];
    }
    return boxes;
  }

 private:
  const std::array<uint32_t, 3> cells_;
};

}  // namespace ndmap
