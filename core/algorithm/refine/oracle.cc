// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/algorithm/refine/oracle.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_set.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "core/algorithm/refine/frame.h"
#include "core/algorithm/refine/hexahedron.h"
#include "core/geometry/surface_index.h"

namespace ndmap {
namespace {

class SurfaceOracle final : public RefineOracle {
 public:
  explicit SurfaceOracle(std::shared_ptr<const SurfaceIndex> index) : index_(std::move(index)) {}
  bool Refine(const CellId&, const std::array<Point3, 8>& corners) override {
    return index_->Meets(CornerBox(corners));
  }
  bool tells_cut() const override { return true; }
  std::array<bool, 8> CutEach(const std::array<Box3, 8>& boxes) override { return index_->MeetEach(boxes); }

 private:
  const std::shared_ptr<const SurfaceIndex> index_;
};

class EverythingOracle final : public RefineOracle {
 public:
  bool Refine(const CellId&, const std::array<Point3, 8>&) override { return true; }
};

class BoxOracle final : public RefineOracle {
 public:
  explicit BoxOracle(const Box3& box) : box_(box) {}
  bool Refine(const CellId&, const std::array<Point3, 8>& corners) override {
    const Box3 cell = CornerBox(corners);
    for (int c = 0; c < 3; ++c) {
      if (cell.hi[c] < box_.lo[c] || cell.lo[c] > box_.hi[c]) return false;
    }
    return true;
  }

 private:
  const Box3 box_;
};

class SphereOracle final : public RefineOracle {
 public:
  SphereOracle(const Point3& centre, double radius) : centre_(centre), radius_(radius) {}
  bool Refine(const CellId&, const std::array<Point3, 8>& corners) override {
    const Box3 cell = CornerBox(corners);
    double squared = 0;
    for (int c = 0; c < 3; ++c) {
      const double d = std::max({cell.lo[c] - centre_[c], 0.0, centre_[c] - cell.hi[c]});
      squared += d * d;
    }
    return squared <= radius_ * radius_;
  }

 private:
  const Point3 centre_;
  const double radius_;
};

class SizeOracle final : public RefineOracle {
 public:
  explicit SizeOracle(double size) : squared_(size * size) {}
  bool Refine(const CellId&, const std::array<Point3, 8>& corners) override {
    for (unsigned role = 0; role < hexahedron::kRoles; ++role) {
      const Point3& a = corners[hexahedron::StartCorner(role)];
      const Point3& b = corners[hexahedron::EndCorner(role)];
      double squared = 0;
      for (int c = 0; c < 3; ++c) squared += (b[c] - a[c]) * (b[c] - a[c]);
      if (squared > squared_) return true;
    }
    return false;
  }

 private:
  const double squared_;
};

class ListOracle final : public RefineOracle {
 public:
  explicit ListOracle(absl::flat_hash_set<CellId> cells) : cells_(std::move(cells)) {}
  bool Refine(const CellId& id, const std::array<Point3, 8>&) override { return cells_.contains(id); }
  bool Lists(const CellId& id) const override { return cells_.contains(id); }
  std::optional<size_t> CountListed(absl::FunctionRef<bool(const CellId&)> wanted) const override {
    return std::count_if(cells_.begin(), cells_.end(), wanted);
  }

 private:
  const absl::flat_hash_set<CellId> cells_;
};

absl::StatusOr<Point3> PointParameter(const Parameters& parameters, absl::string_view name) {
  absl::StatusOr<std::string> text = parameters.Text(name);
  if (!text.ok()) return text.status();
  absl::StatusOr<Point3> point = ParsePoint(*text);
  if (point.ok()) return point;
  return absl::InvalidArgumentError(absl::StrCat("parameter '", name, "': ", point.status().message()));
}

absl::StatusOr<std::unique_ptr<RefineOracle>> MakeList(const Parameters& parameters) {
  absl::StatusOr<std::string> text = parameters.Text("cells");
  if (!text.ok()) return text.status();
  absl::StatusOr<absl::flat_hash_set<CellId>> cells = ParseCellIds(*text);
  if (!cells.ok()) return cells.status();
  return std::make_unique<ListOracle>(*std::move(cells));
}

}  // namespace

absl::StatusOr<Point3> ParsePoint(absl::string_view text) {
  const std::vector<absl::string_view> parts = absl::StrSplit(text, ',');
  Point3 p{};
  bool good = parts.size() == 3;
  for (size_t c = 0; good && c < 3; ++c) good = absl::SimpleAtod(parts[c], &p[c]) && std::isfinite(p[c]);
  if (!good) return absl::InvalidArgumentError(absl::StrCat("'", text, "', expected a point x,y,z"));
  return p;
}

std::string FormatPoint(const Point3& p) { return absl::StrFormat("%.17g,%.17g,%.17g", p[0], p[1], p[2]); }

absl::StatusOr<std::unique_ptr<RefineOracle>> MakeOracle(const Parameters& parameters,
                                                         const Environment& environment,
                                                         absl::FunctionRef<Box3()> region) {
  const std::string name = parameters.TextOr("oracle", "surface");
  if (name == "surface") {
    absl::StatusOr<std::shared_ptr<const SurfaceIndex>> index = environment.Index(region);
    if (!index.ok()) return index.status();
    return std::make_unique<SurfaceOracle>(*std::move(index));
  }
  if (name == "everything") return std::make_unique<EverythingOracle>();
  if (name == "box") {
    absl::StatusOr<Point3> lo = PointParameter(parameters, "lo");
    if (!lo.ok()) return lo.status();
    absl::StatusOr<Point3> hi = PointParameter(parameters, "hi");
    if (!hi.ok()) return hi.status();
    for (size_t c = 0; c < 3; ++c) {
      if ((*lo)[c] <= (*hi)[c]) continue;
      return absl::InvalidArgumentError(absl::StrCat("an empty box: parameter 'lo' is ", (*lo)[c], " in ",
                                                     std::string(1, "xyz"[c]), ", above 'hi', which is ",
                                                     (*hi)[c]));
    }
    return std::make_unique<BoxOracle>(Box3{*lo, *hi});
  }
  if (name == "sphere") {
    absl::StatusOr<Point3> centre = PointParameter(parameters, "centre");
    if (!centre.ok()) return centre.status();
    absl::StatusOr<double> radius = parameters.Real("radius");
    if (!radius.ok()) return radius.status();
    if (*radius < 0) {
      return absl::InvalidArgumentError(absl::StrCat("parameter 'radius' is ", *radius, ", below 0"));
    }
    return std::make_unique<SphereOracle>(*centre, *radius);
  }
  if (name == "size") {
    absl::StatusOr<double> size = parameters.Real("size");
    if (!size.ok()) return size.status();
    if (*size <= 0) return absl::InvalidArgumentError("parameter 'size' is not above 0");
    return std::make_unique<SizeOracle>(*size);
  }
  if (name == "list") return MakeList(parameters);
  return absl::InvalidArgumentError(absl::StrCat(
      "parameter 'oracle' is '", name, "', expected surface, everything, box, sphere, size or list"));
}

}  // namespace ndmap
