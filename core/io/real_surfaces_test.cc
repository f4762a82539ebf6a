// SPDX-License-Identifier: GPL-3.0-or-later
// Real surfaces, where their folder is there: NDMAP_MESHES.
#include <ostream>
#include <string>

#include "core/io/surface_reader.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace ndmap {
namespace {

using ::testing::HasSubstr;

struct RealSurface {
  std::string file;
  size_t points, triangles;
  size_t intersecting_pairs;

  friend std::ostream& operator<<(std::ostream& out, const RealSurface& real) { return out << real.file; }
};

#ifdef NDMAP_MESHES
std::string SurfacePath(const std::string& file) { return std::string(NDMAP_MESHES) + "/surfaces/" + file; }

class RealSurfaceTest : public testing::TestWithParam<RealSurface> {};

TEST_P(RealSurfaceTest, LoadsAsItsDescriptionSays) {
  const RealSurface& real = GetParam();
  ReadLimits limits;
  limits.check_self_intersections = real.triangles < 300000;
  const auto file = ReadSurface(SurfacePath(real.file), limits);
  ASSERT_TRUE(file.ok()) << file.status();
  EXPECT_EQ(file->surface.points.size(), real.points);
  EXPECT_EQ(file->surface.triangles.size(), real.triangles);
  EXPECT_TRUE(ValidateClosedSurface(file->surface).ok());
  if (real.intersecting_pairs == 0 || !limits.check_self_intersections) {
    EXPECT_THAT(file->warnings, testing::IsEmpty());
  } else {
    EXPECT_THAT(file->warnings,
                testing::ElementsAre(
                    HasSubstr("intersects itself: " + std::to_string(real.intersecting_pairs) + " pairs")));
  }
}

// A polygon of n corners gives n - 2 triangles. The cow has two of its 2,904 points in the same place.
INSTANTIATE_TEST_SUITE_P(
    Surfaces, RealSurfaceTest,
    testing::Values(RealSurface{"armadillo.off", 26002, 52000, 0}, RealSurface{"cow.off", 2903, 5804, 101},
                    RealSurface{"elephant.off", 2775, 5558, 0},
                    RealSurface{"bunny_52000.off", 26002, 52000, 0},
                    RealSurface{"bunny00.off.xz", 37706, 75408, 0},
                    RealSurface{"turbineblade_199k.off.xz", 99519, 199034, 0},
                    RealSurface{"dragon_871k.off.xz", 435545, 871306, 206},
                    RealSurface{"lucy_100k.off.xz", 49987, 99970, 0},
                    RealSurface{"cheese.off", 8629, 17786, 0}, RealSurface{"fertility.off", 4494, 9000, 0},
                    RealSurface{"knot2.off", 5760, 11520, 0}, RealSurface{"gears.off", 9723, 19426, 110},
                    RealSurface{"3torus.off", 19, 46, 0},
                    RealSurface{"double-torus-example.off", 231, 466, 0},
                    RealSurface{"blade_cgal_filled.off", 8273, 16542, 0},
                    RealSurface{"dlr_f6_halfmodel_surface.off.xz", 43167, 86334, 0}),
    [](const auto& info) {
      std::string name = info.param.file;
      name.resize(name.find('.'));
      for (char& c : name) c = c == '-' ? '_' : c;
      return name;
    });

TEST(RealSurfacesTest, TheOpenBladeIsRefused) {
  const auto file = ReadSurface(SurfacePath("blade_cgal_open.off"));
  ASSERT_FALSE(file.ok());
  EXPECT_THAT(
      std::string(file.status().message()),
      HasSubstr("not closed: 240 edges without exactly two faces (240 with one, in 2 border cycles)"));
}
#endif

}  // namespace
}  // namespace ndmap
