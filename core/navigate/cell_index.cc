// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/navigate/cell_index.h"

#include <algorithm>
// The deprecated header that it includes says so in every compilation.
#define BOOST_ALLOW_DEPRECATED_HEADERS
#include <boost/geometry.hpp>
#include <boost/geometry/index/rtree.hpp>
#include <cmath>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/algorithm/refine/frame.h"
#include "core/names/cell_names.h"

namespace ndmap {
namespace {

namespace bg = boost::geometry;
using TreePoint = bg::model::point<double, 3, bg::cs::cartesian>;
using TreeBox = bg::model::box<TreePoint>;
using TreeValue = std::pair<TreeBox, uint32_t>;

TreePoint ToTree(const Point3& p) { return {p[0], p[1], p[2]}; }
TreeBox ToTree(const Box3& b) { return {ToTree(b.lo), ToTree(b.hi)}; }

CellId Lengthened(CellId id) {
  if (id.is_polygon()) return id;
  while (id.level() < CellId::kMaxLevel) id = id.Child(0);
  return id;
}

CellId KeyOf(const LatticePlace& place) {
  CellId id = CellId::Initial(place.initial);
  for (uint32_t bit = LatticePlace::kSide >> 1; bit > 0; bit >>= 1) {
    id = id.Child((place.at[0] & bit ? 1 : 0) | (place.at[1] & bit ? 2 : 0) | (place.at[2] & bit ? 4 : 0));
  }
  return id;
}

CellId IdOf(const CellIndex::Entry& entry) {
  CellId id = entry.key;
  while (id.level() > entry.level) id = id.Parent();
  return id;
}

}  // namespace

struct CellIndex::Tree {
  bg::index::rtree<TreeValue, bg::index::rstar<16>> tree;
};

CellIndex::CellIndex() = default;
CellIndex::~CellIndex() = default;

const CellIndex::Entry* CellIndex::Find(const CellId& id) const {
  if (!id.is_cell()) return nullptr;
  const CellId key = Lengthened(id);
  const auto it = std::lower_bound(entries_.begin(), entries_.end(), key,
                                   [](const Entry& e, const CellId& k) { return e.key < k; });
  return it != entries_.end() && it->key == key && it->level == id.level() ? &*it : nullptr;
}

const CellIndex::Entry* CellIndex::At(const LatticePlace& place) const {
  const CellId key = KeyOf(place);
  auto it = std::upper_bound(entries_.begin(), entries_.end(), key,
                             [](const CellId& k, const Entry& e) { return k < e.key; });
  if (it == entries_.begin()) return nullptr;
  --it;
  // The last that begins at or before the place; it may end before it.
  CellId around = key;
  while (around.level() > it->level) around = around.Parent();
  return around == IdOf(*it) ? &*it : nullptr;
}

std::vector<const CellIndex::Entry*> CellIndex::Meeting(const Box3& box) const {
  std::vector<const Entry*> found;
  if (tree_ == nullptr) return found;
  for (auto it = tree_->tree.qbegin(bg::index::intersects(ToTree(box))); it != tree_->tree.qend(); ++it) {
    found.push_back(&entries_[it->second]);
  }
  return found;
}

std::vector<std::pair<double, const CellIndex::Entry*>> CellIndex::Nearest(const Point3& point,
                                                                           size_t most) const {
  std::vector<std::pair<double, const Entry*>> found;
  const TreePoint p = ToTree(point);
  for (auto it = tree_->tree.qbegin(bg::index::nearest(p, static_cast<unsigned>(most)));
       it != tree_->tree.qend(); ++it) {
    found.emplace_back(bg::comparable_distance(p, it->first), &entries_[it->second]);
  }
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
    return std::pair(a.first, a.second->key) < std::pair(b.first, b.second->key);
  });
  return found;
}

bool CellIndex::IsFar(const Point3& point) const {
  if (entries_.empty()) return false;
  const TreeBox all = tree_->tree.bounds();
  const Point3 lo = {bg::get<bg::min_corner, 0>(all), bg::get<bg::min_corner, 1>(all),
                     bg::get<bg::min_corner, 2>(all)};
  const Point3 hi = {bg::get<bg::max_corner, 0>(all), bg::get<bg::max_corner, 1>(all),
                     bg::get<bg::max_corner, 2>(all)};
  double extent = 0, away = 0;
  for (size_t c = 0; c < 3; ++c) {
    extent = std::max(extent, hi[c] - lo[c]);
    away = std::max({away, lo[c] - point[c], point[c] - hi[c]});
  }
  constexpr double kLarge = 1e150, kFar = 1e6;
  return !(away < kFar * extent && extent < kLarge && extent > 1 / kLarge);
}

std::vector<const CellIndex::Entry*> CellIndex::PerhapsNearest(const Point3& point) const {
  // Squared distances less that of the point from the origin, which is the same for all: |x|^2 - 2 x point.
  // Of a box the least and the most, and how much rounding may have taken from either. A long double holds
  // squares of all doubles.
  struct Range {
    long double least = 0, most = 0, error = 0;
  };
  const auto range = [&point](const TreeBox& box) {
    const Point3 lo = {bg::get<bg::min_corner, 0>(box), bg::get<bg::min_corner, 1>(box),
                       bg::get<bg::min_corner, 2>(box)};
    const Point3 hi = {bg::get<bg::max_corner, 0>(box), bg::get<bg::max_corner, 1>(box),
                       bg::get<bg::max_corner, 2>(box)};
    Range r;
    for (size_t c = 0; c < 3; ++c) {
      const auto value = [&](double x) {
        const long double wide = x;
        return wide * (wide - 2 * static_cast<long double>(point[c]));
      };
      r.least += value(std::clamp(point[c], lo[c], hi[c]));
      r.most += std::max(value(lo[c]), value(hi[c]));
      const long double largest = std::max(std::abs(lo[c]), std::abs(hi[c]));
      r.error += largest * (largest + 2 * std::abs(static_cast<long double>(point[c])));
    }
    r.error *= 16 * std::numeric_limits<long double>::epsilon();
    return r;
  };
  long double enough = std::numeric_limits<long double>::infinity();
  for (const auto& [box, entry] : tree_->tree) {
    const Range r = range(box);
    enough = std::min(enough, r.most + r.error);
  }
  std::vector<const Entry*> found;
  for (const auto& [box, entry] : tree_->tree) {
    const Range r = range(box);
    if (!(r.least - r.error > enough)) found.push_back(&entries_[entry]);
  }
  return found;
}

CellIndexBuilder::CellIndexBuilder() = default;
CellIndexBuilder::~CellIndexBuilder() = default;

template <class BlockT>
absl::StatusOr<bool> CellIndexBuilder::Step(BlockT& block, size_t budget) {
  constexpr unsigned n = BlockT::n;
  auto& map = block.map();
  if (version_ == 0) version_ = block.version();
  if (version_ != block.version()) {
    return absl::AbortedError(absl::StrCat("block ", block.id().value, " changed during the query"));
  }
  if (!begun_) {
    begun_ = true;
    auto& cells = map.template attributes<n>();
    todo_.reserve(cells.size());
    for (auto it = cells.begin(); it != cells.end(); ++it) {
      todo_.push_back(IndexOf(map, map.template info_of_attribute<n>(it).reference));
    }
    read_.reserve(todo_.size());
  }
  for (size_t k = 0; k < budget && !todo_.empty(); ++k) {
    const DartIndex reference = todo_.back();
    todo_.pop_back();
    const auto d = DartAt(map, reference);
    if (d == BlockT::Lcc::null_handle || map.template attribute<0>(d) == BlockT::Lcc::null_handle ||
        (map.template info<n>(d).id.level() == 0 && !HasVertices<BlockT>(map, d))) {
      return absl::FailedPreconditionError(absl::StrCat("block ", block.id().value, " is being built"));
    }
    const auto cell = map.template attribute<n>(d);
    const CellId id = map.template info_of_attribute<n>(cell).id;
    const Box3 box = CellBox<BlockT>(map, cell);
    read_.push_back({{Lengthened(id), reference, static_cast<uint8_t>(id.level())}, box});
  }
  return todo_.empty();
}

template absl::StatusOr<bool> CellIndexBuilder::Step(Block2& block, size_t budget);
template absl::StatusOr<bool> CellIndexBuilder::Step(Block3& block, size_t budget);

std::shared_ptr<const CellIndex> CellIndexBuilder::Build() {
  std::sort(read_.begin(), read_.end(),
            [](const auto& a, const auto& b) { return a.first.key < b.first.key; });
  std::shared_ptr<CellIndex> index(new CellIndex);
  index->version_ = version_;
  std::vector<TreeValue> boxes;
  boxes.reserve(read_.size());
  index->entries_.reserve(read_.size());
  for (const auto& [entry, box] : read_) {
    boxes.emplace_back(ToTree(box), static_cast<uint32_t>(index->entries_.size()));
    index->entries_.push_back(entry);
  }
  read_ = {};
  index->tree_ = std::make_unique<CellIndex::Tree>();
  // From a range: packed, and in O(cells log cells).
  index->tree_->tree = bg::index::rtree<TreeValue, bg::index::rstar<16>>(boxes.begin(), boxes.end());
  return index;
}

namespace {

// In a hexahedron that has the part as a corner, edge or side.
DartIndex FindPart(Block3& block, const CellIndex& index, const InitialCells& initial, const CellId& id) {
  const LatticeBox box = BoxOf(id);
  const unsigned dimension = id.dimension();
  HexahedronLattice<Block3> lattice(block.map());
  for (const LatticeBox& here : initial.Around(box)) {
    // The hexahedra on either side of it, along the axes that it does not extend along.
    for (unsigned octant = 0; octant < 8; ++octant) {
      LatticePlace beside = here.low;
      bool inside = true;
      for (int c = 0; c < 3; ++c) {
        const bool below = (octant >> c & 1) != 0;
        if (below) inside = inside && here.extent[c] == 0 && beside.at[c]-- > 0;
        inside = inside && beside.at[c] < LatticePlace::kSide;
      }
      const CellIndex::Entry* entry = inside ? index.At(beside) : nullptr;
      if (entry == nullptr) continue;
      for (const auto& placed : lattice.Of(block.map().attribute<3>(DartAt(block.map(), entry->reference)))) {
        if ((dimension == 0 ? placed.vertex : dimension == 1 ? placed.edge : placed.face) == here) {
          return IndexOf(block.map(), placed.dart);
        }
      }
    }
  }
  return DartIndex{};
}

// In a cell of the mesh that is no hexahedron and has the part.
DartIndex FindInMesh(Block3& block, const CellIndex& index, const MeshCells& mesh, const CellId& id) {
  const MeshCells::Place place = mesh.Find(id);
  CellNames<Block3> names(block.map(), mesh);
  for (uint32_t cell : place.cells) {
    if (mesh.kind(cell) == CellKind::kHexahedron) continue;
    const CellIndex::Entry* entry = index.Find(CellId::Initial(mesh.piece().numbers[cell]));
    if (entry == nullptr) continue;
    const size_t darts = names.Look(block.map().attribute<3>(DartAt(block.map(), entry->reference)));
    for (size_t i = 0; i < darts; ++i) {
      if (names.Name(i, id.dimension()) == place.id) return IndexOf(block.map(), names.dart(i));
    }
  }
  return DartIndex{};
}

// At a corner or side of a face of the block that is still there.
DartIndex FindOnSurface(Block2& block, const CellIndex& index, const PolygonCells& surface,
                        const CellId& id) {
  for (const SideLink& at : surface.Find(id).at) {
    const CellIndex::Entry* entry = index.Find(CellId::Polygon(surface.piece().numbers[at.face]));
    if (entry == nullptr) continue;
    auto d = DartAt(block.map(), entry->reference);
    for (uint32_t i = 0; i < at.side; ++i) d = block.map().beta<1>(d);
    return IndexOf(block.map(), d);
  }
  return DartIndex{};
}

}  // namespace

template <class BlockT>
DartIndex FindCell(BlockT& block, const CellIndex& index, const InitialCells& initial, const CellId& id) {
  if (id.is_cell()) {
    const CellIndex::Entry* entry = index.Find(id);
    return entry == nullptr ? DartIndex{} : entry->reference;
  }
  if constexpr (BlockT::n == 2) {
    const PolygonCells* surface = initial.polygons();
    return surface == nullptr ? DartIndex{} : FindOnSurface(block, index, *surface, id);
  } else {
    if (id.is_part()) {
      if (const DartIndex d = FindPart(block, index, initial, id); d.valid()) return d;
    }
    return initial.mesh() == nullptr ? DartIndex{} : FindInMesh(block, index, *initial.mesh(), id);
  }
}

template DartIndex FindCell(Block2&, const CellIndex&, const InitialCells&, const CellId&);
template DartIndex FindCell(Block3&, const CellIndex&, const InitialCells&, const CellId&);

}  // namespace ndmap
