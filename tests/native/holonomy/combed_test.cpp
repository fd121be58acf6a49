#include "flipfree/holonomy/combed.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>

#include "flipfree/mesh/cut_graph/cut.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::holonomy::combed_test {
namespace {

struct Plane {
  mesh::Surface surface = test::grid(5, 4);
  mesh::Adjacency adjacency = test::adjacency_of(surface);
  std::vector<FaceId> same = [&] {
    std::vector<FaceId> ids(static_cast<std::size_t>(surface.faces.rows()));
    std::iota(ids.begin(), ids.end(), 0);
    return ids;
  }();
  Refined refined() const { return {surface, adjacency, same}; }

  // One of four parallel directions in each face, 0.3 radians from the x axis.
  field::CrossField scattered() const {
    Points3 d(surface.faces.rows(), 3);
    for (Eigen::Index f = 0; f < d.rows(); ++f) {
      const double a = 0.3 + static_cast<double>((7 * f + f / 3) % 4) * 0.5 * std::numbers::pi;
      d.row(f) << std::cos(a), std::sin(a), 0.0;
    }
    return field::match_nearest(adjacency, field::measure_frames(surface),
                                field::angles_of(surface, d));
  }
};

TEST(Combed, ParallelCrossesBecomeParallelDirections) {
  const Plane p;
  const mesh::EdgeFlags none(p.adjacency.opposite.size(), 0);
  const std::vector<double> angle =
      combed_directions(p.refined(), none, p.surface, p.adjacency, p.scattered());
  const Points3 d = field::directions_of(p.surface, angle);
  for (Eigen::Index f = 0; f < d.rows(); ++f) EXPECT_LT((d.row(f) - d.row(0)).norm(), 1e-9);
}

TEST(Combed, AMapIsTurnedUntilTheDirectionsAreHorizontal) {
  const Plane p;
  const mesh::EdgeFlags none(p.adjacency.opposite.size(), 0);
  const std::vector<double> angle =
      combed_directions(p.refined(), none, p.surface, p.adjacency, p.scattered());
  const Points3 d = field::directions_of(p.surface, angle);
  Points2 uv = test::flat(p.surface);
  turn_towards(p.refined(), angle, false, uv);
  // The plane's own map, turned by the direction's angle backwards.
  const double a = -std::atan2(d(0, 1), d(0, 0));
  const Points2 flat = test::flat(p.surface);
  for (Eigen::Index c = 0; c < uv.rows(); ++c) {
    EXPECT_NEAR(uv(c, 0), std::cos(a) * flat(c, 0) - std::sin(a) * flat(c, 1), 1e-9);
    EXPECT_NEAR(uv(c, 1), std::sin(a) * flat(c, 0) + std::cos(a) * flat(c, 1), 1e-9);
  }
}

TEST(Combed, AMapAlongTheAxesIsTurnedByQuarters) {
  const Plane p;
  const mesh::EdgeFlags none(p.adjacency.opposite.size(), 0);
  std::vector<double> angle =
      combed_directions(p.refined(), none, p.surface, p.adjacency, p.scattered());
  const Points2 flat = test::flat(p.surface);
  Points2 uv = flat;
  turn_towards(p.refined(), angle, true, uv);
  for (Eigen::Index c = 0; c < uv.rows(); ++c) {
    EXPECT_DOUBLE_EQ(std::abs(uv(c, 0)) + std::abs(uv(c, 1)),
                     std::abs(flat(c, 0)) + std::abs(flat(c, 1)));
  }
}

}  // namespace
}  // namespace flipfree::holonomy::combed_test
