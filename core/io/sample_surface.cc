// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/sample_surface.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"

namespace ndmap {
namespace {

constexpr double kPi = 3.14159265358979323846;

// A torus of nu by nv quads over points at(2 pi i / nu, 2 pi j / nv), each cut from its first corner.
template <class F>
TriangleSurface WrappedGrid(uint32_t nu, uint32_t nv, F at) {
  TriangleSurface s;
  for (uint32_t i = 0; i < nu; ++i) {
    for (uint32_t j = 0; j < nv; ++j) s.points.push_back(at(2 * kPi * i / nu, 2 * kPi * j / nv));
  }
  const auto point = [nu, nv](uint32_t i, uint32_t j) { return i % nu * nv + j % nv; };
  for (uint32_t i = 0; i < nu; ++i) {
    for (uint32_t j = 0; j < nv; ++j) {
      s.triangles.push_back({point(i, j), point(i + 1, j), point(i + 1, j + 1)});
      s.triangles.push_back({point(i, j), point(i + 1, j + 1), point(i, j + 1)});
    }
  }
  return s;
}

// Half as many quads around the tube as along it.
TriangleSurface Torus(uint32_t triangles, double bump) {
  const auto nv = std::max<uint32_t>(4, static_cast<uint32_t>(std::lround(std::sqrt(triangles / 4.0))));
  return WrappedGrid(2 * nv, nv, [bump](double u, double w) -> Point3 {
    const double r = 0.4 * (1 + bump * std::sin(5 * u) * std::sin(4 * w));
    return {(1 + r * std::cos(w)) * std::cos(u), (1 + r * std::cos(w)) * std::sin(u), r * std::sin(w)};
  });
}

// The knot winds twice about the z axis and three times about the circle of radius 1. The normal of the torus
// that it lies on is perpendicular to it and closes after one turn: with the tangent it makes the tube's
// frame.
TriangleSurface Knot(uint32_t triangles) {
  constexpr double kWinding = 0.5, kTube = 0.22;
  const auto nv = std::max<uint32_t>(4, static_cast<uint32_t>(std::lround(std::sqrt(triangles / 16.0))));
  return WrappedGrid(8 * nv, nv, [](double t, double w) -> Point3 {
    const double c2 = std::cos(2 * t), s2 = std::sin(2 * t), c3 = std::cos(3 * t), s3 = std::sin(3 * t);
    const double radius = 1 + kWinding * c3;
    const Point3 centre = {radius * c2, radius * s2, kWinding * s3};
    const Point3 normal = {c3 * c2, c3 * s2, s3};
    const Point3 tangent = {-3 * kWinding * s3 * c2 - 2 * radius * s2,
                            -3 * kWinding * s3 * s2 + 2 * radius * c2, 3 * kWinding * c3};
    const double length = std::hypot(tangent[0], tangent[1], tangent[2]);
    Point3 point;
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, k = (i + 2) % 3;
      const double binormal = (normal[j] * tangent[k] - normal[k] * tangent[j]) / length;
      point[i] = centre[i] + kTube * (std::cos(w) * normal[i] + std::sin(w) * binormal);
    }
    return point;
  });
}

void Append(const TriangleSurface& from, double scale, bool reverse, TriangleSurface* to) {
  const uint32_t offset = static_cast<uint32_t>(to->points.size());
  for (const Point3& p : from.points) to->points.push_back({scale * p[0], scale * p[1], scale * p[2]});
  for (auto [a, b, c] : from.triangles) {
    if (reverse) std::swap(b, c);
    to->triangles.push_back({a + offset, b + offset, c + offset});
  }
}

// The points with |x| + |y| + |z| = n of the integer lattice, moved out to the sphere.
TriangleSurface Sphere(uint32_t triangles) {
  const int n = std::max(2, static_cast<int>(std::lround(std::sqrt(triangles / 8.0))));
  TriangleSurface s;
  absl::flat_hash_map<std::array<int, 3>, uint32_t> numbers;
  const auto point = [&](int x, int y, int z) {
    const auto [it, added] = numbers.try_emplace({x, y, z}, static_cast<uint32_t>(s.points.size()));
    if (added) {
      const double norm = std::sqrt(1.0 * x * x + 1.0 * y * y + 1.0 * z * z);
      s.points.push_back({x / norm, y / norm, z / norm});
    }
    return it->second;
  };
  for (int octant = 0; octant < 8; ++octant) {
    const int sx = octant & 1 ? -1 : 1, sy = octant & 2 ? -1 : 1, sz = octant & 4 ? -1 : 1;
    const auto corner = [&](int i, int j) { return point(sx * i, sy * j, sz * (n - i - j)); };
    const auto add = [&](uint32_t a, uint32_t b, uint32_t c) {
      if (sx * sy * sz < 0) std::swap(b, c);
      s.triangles.push_back({a, b, c});
    };
    for (int i = 0; i < n; ++i) {
      for (int j = 0; i + j < n; ++j) {
        add(corner(i, j), corner(i + 1, j), corner(i, j + 1));
        if (i + j + 2 <= n) add(corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1));
      }
    }
  }
  return s;
}

TriangleSurface Shells(uint32_t triangles) {
  TriangleSurface s;
  Append(Sphere(triangles / 3), 1, false, &s);
  Append(Sphere(triangles / 3), 0.5, true, &s);
  Append(Sphere(triangles / 3), 0.25, false, &s);
  return s;
}

// Every point moves to the mean of its neighbours. O(triangles) a round.
void Smooth(int rounds, TriangleSurface* s) {
  for (int round = 0; round < rounds; ++round) {
    std::vector<Point3> sum(s->points.size(), Point3{});
    std::vector<int> count(s->points.size(), 0);
    for (const auto& t : s->triangles) {
      for (int c = 0; c < 3; ++c) {
        for (int x = 0; x < 3; ++x) sum[t[c]][x] += s->points[t[(c + 1) % 3]][x];
        ++count[t[c]];
      }
    }
    for (size_t i = 0; i < sum.size(); ++i) {
      for (int x = 0; x < 3; ++x) s->points[i][x] = sum[i][x] / count[i];
    }
  }
}

// The boundary of a plate of 5 x 3 x 1 unit cubes without the two that make the holes, each square cut into n
// x n.
TriangleSurface DoubleTorus(uint32_t triangles) {
  constexpr int kSquares =
      52;  // 13 cubes: 26 above and below, 16 around, 8 in the holes; and 2 to spare in rounding.
  const int n = std::max(2, static_cast<int>(std::lround(std::sqrt(triangles / (2.0 * kSquares)))));
  const auto solid = [](const std::array<int, 3>& c) {
    return c[0] >= 0 && c[0] < 5 && c[1] >= 0 && c[1] < 3 && c[2] == 0 &&
           !(c[1] == 1 && (c[0] == 1 || c[0] == 3));
  };
  TriangleSurface s;
  absl::flat_hash_map<std::array<int, 3>, uint32_t> numbers;
  const auto point = [&](const std::array<int, 3>& p) {
    const auto [it, added] = numbers.try_emplace(p, static_cast<uint32_t>(s.points.size()));
    if (added)
      s.points.push_back(
          {(1.0 * p[0] / n - 2.5) / 2, (1.0 * p[1] / n - 1.5) / 2, (1.0 * p[2] / n - 0.5) / 2});
    return it->second;
  };
  // The square of cube c on its low (side 0) or high side of an axis; u × v points along the axis.
  const auto add_square = [&](const std::array<int, 3>& c, int axis, int side) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        std::array<uint32_t, 4> q;
        for (int k = 0; k < 4; ++k) {
          std::array<int, 3> p = {c[0] * n, c[1] * n, c[2] * n};
          p[axis] += side * n;
          p[u] += i + (k == 1 || k == 2);
          p[v] += j + (k == 2 || k == 3);
          q[k] = point(p);
        }
        if (side == 0) std::swap(q[1], q[3]);
        s.triangles.push_back({q[0], q[1], q[2]});
        s.triangles.push_back({q[0], q[2], q[3]});
      }
    }
  };
  for (int x = 0; x < 5; ++x) {
    for (int y = 0; y < 3; ++y) {
      const std::array<int, 3> c = {x, y, 0};
      for (int axis = 0; solid(c) && axis < 3; ++axis) {
        for (int side : {0, 1}) {
          std::array<int, 3> neighbour = c;
          neighbour[axis] += 2 * side - 1;
          if (!solid(neighbour)) add_square(c, axis, side);
        }
      }
    }
  }
  Smooth(std::min(n * n / 4, 100), &s);
  return s;
}

}  // namespace

std::vector<std::string> SampleKinds() {
  return {"sphere", "torus", "bumpy-torus", "knot", "double-torus", "shells"};
}

absl::StatusOr<TriangleSurface> MakeSample(absl::string_view kind, const SampleOptions& options) {
  if (options.triangles < 100 || options.triangles > 20000000) {
    return absl::InvalidArgumentError(
        absl::StrCat("a sample of ", options.triangles, " triangles; 100 to 20000000 expected"));
  }
  if (!(options.scale > 0) || !std::isfinite(options.scale)) {
    return absl::InvalidArgumentError(absl::StrCat("scale ", options.scale, " is not a positive number"));
  }
  TriangleSurface s;
  if (kind == "sphere") {
    s = Sphere(options.triangles);
  } else if (kind == "torus") {
    s = Torus(options.triangles, 0);
  } else if (kind == "bumpy-torus") {
    s = Torus(options.triangles, 0.15);
  } else if (kind == "knot") {
    s = Knot(options.triangles);
  } else if (kind == "double-torus") {
    s = DoubleTorus(options.triangles);
  } else if (kind == "shells") {
    s = Shells(options.triangles);
  } else {
    return absl::InvalidArgumentError(
        absl::StrCat("no sample surface '", kind, "'; there are ", absl::StrJoin(SampleKinds(), ", ")));
  }
  for (Point3& p : s.points) {
    for (double& x : p) x *= options.scale;
  }
  return s;
}

}  // namespace ndmap
