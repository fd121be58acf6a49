#include "flipfree/intrinsic/layout/refine/developed_angles.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "flipfree/base/plane.h"
#include "flipfree/intrinsic/layout/refine/face_triangulations.h"
#include "intrinsic/layout/refine/edge_points.h"

namespace flipfree::intrinsic::developed_angles_test {
namespace {

// One triangle, whose image has its corner 0 at the origin and sides that bend.
class DevelopedAngles : public testing::Test {
 protected:
  DevelopedAngles() {
    surface_.vertices.resize(3, 3);
    surface_.vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0;
    surface_.faces.resize(1, 3);
    surface_.faces << 0, 1, 2;
    adjacency_ = mesh::build_adjacency(3, surface_.faces);
  }
  template <typename Place>
  void lay(int points, const Place& place) {
    map_ = test::edge_points(surface_, adjacency_, points, place);
  }
  std::vector<PolygonVertex> polygon(bool with_points) const {
    FaceTriangulations faces(surface_, map_);
    for (std::size_t p = 0; p < map_.points.size() && with_points; ++p)
      faces.use(static_cast<std::int64_t>(p), true);
    std::vector<PolygonVertex> out;
    faces.build_polygon(0, out);
    return out;
  }
  mesh::Surface surface_;
  mesh::Adjacency adjacency_;
  EdgePointMap map_;
};

TEST_F(DevelopedAngles, OfAFlatTriangleAreItsOwn) {
  lay(3, [](const Vector2& p) { return p; });
  const std::vector<double> corners = developed_angles(map_, 3, 0, polygon(false));
  ASSERT_EQ(corners.size(), 3U);
  EXPECT_NEAR(corners[0], std::numbers::pi / 2, 1e-12);
  EXPECT_NEAR(corners[1], std::numbers::pi / 4, 1e-12);
  const std::vector<double> all = developed_angles(map_, 3, 0, polygon(true));
  double sum = 0.0;
  for (const double a : all) sum += a;
  EXPECT_NEAR(sum, static_cast<double>(all.size() - 2) * std::numbers::pi, 1e-9);
}

// A corner of 1.5 pi: its triangle (0, 1, 2) as it stands would turn the other way round.
}  // namespace
}  // namespace flipfree::intrinsic::developed_angles_test
