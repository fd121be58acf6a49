#include "flipfree/certify/measures.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::certify::winding_test {
namespace {

using test::adjacency_of;

// `count` triangles around vertex 0; the rim closed or not.
mesh::Surface fan(Index count) {
  mesh::Surface surface;
  surface.vertices = Points3::Zero(count + 1, 3);
  surface.faces.resize(count, 3);
  for (Index f = 0; f < count; ++f) surface.faces.row(f) << 0, f + 1, (f + 1) % count + 1;
  return surface;
}

TEST(Winding, of_random_fans_is_counted) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> share(0.02, 1.0);
  std::uniform_real_distribution<double> radius(1e-3, 1e3);
  for (int i = 0; i < 400; ++i) {
    const Index turns = 1 + i % 3;
    const Index count = 2 * turns + 2 + static_cast<Index>(random() % 6);
    // Angles below pi that sum to so many turns.
    std::vector<double> angle;
    double sum = 0.0;
    for (Index k = 0; k < count; ++k) sum += angle.emplace_back(share(random));
    for (double& a : angle) a *= 2.0 * std::numbers::pi * turns / sum;
    if (*std::max_element(angle.begin(), angle.end()) > 3.0) continue;
    const mesh::Surface surface = fan(count);
    Points2 uv(count + 1, 2);
    uv.row(0) << radius(random), -radius(random);
    double direction = radius(random);
    for (Index k = 0; k < count; ++k) {
      uv.row(k + 1) =
          uv.row(0) + radius(random) * Eigen::RowVector2d(std::cos(direction), std::sin(direction));
      direction += angle[static_cast<std::size_t>(k)];
    }
    const auto cut = static_cast<std::size_t>(3 * count);
    const std::vector<VertexId> found = winding_failures(
        adjacency_of(surface), mesh::EdgeFlags(cut, 0), test::corners(surface, uv));
    EXPECT_EQ(found, turns == 1 ? std::vector<VertexId>{} : std::vector<VertexId>{0});
  }
}

TEST(Winding, directions_along_the_axes_count_once) {
  // Each of the four is the beginning or the end of a half-plane for somebody.
  const mesh::Surface surface = fan(4);
  Points2 uv(5, 2);
  for (Index first = 0; first < 4; ++first) {
    uv.row(0).setZero();
    const double step[4][2] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    for (Index k = 0; k < 4; ++k)
      uv.row(k + 1) << step[(first + k) % 4][0], step[(first + k) % 4][1];
    EXPECT_TRUE(
        winding_failures(adjacency_of(surface), mesh::EdgeFlags(12, 0), test::corners(surface, uv))
            .empty());
  }
}

TEST(Winding, vertices_at_a_cut_or_on_the_boundary_may_wind_as_they_like) {
  mesh::Surface surface = fan(7);
  Points2 uv(8, 2);
  uv.row(0).setZero();
  for (Index k = 0; k < 7; ++k) {
    const double angle = 4.0 * std::numbers::pi * k / 7.0;
    uv.row(k + 1) << std::cos(angle), std::sin(angle);
  }
  const Points2 corner = test::corners(surface, uv);
  const mesh::Adjacency closed = adjacency_of(surface);
  EXPECT_EQ(winding_failures(closed, mesh::EdgeFlags(21, 0), corner), std::vector<VertexId>{0});
  for (HalfedgeId h = 0; h < 21; ++h) {
    if (closed.opposite[static_cast<std::size_t>(h)] == kInvalid) continue;
    mesh::EdgeFlags cut(21, 0);
    cut[static_cast<std::size_t>(h)] = 1;
    cut[static_cast<std::size_t>(closed.opposite[static_cast<std::size_t>(h)])] = 1;
    EXPECT_TRUE(winding_failures(closed, cut, corner).empty());
  }
  surface.faces.conservativeResize(6, 3);
  EXPECT_TRUE(
      winding_failures(adjacency_of(surface), mesh::EdgeFlags(18, 0), corner.topRows(18)).empty());
}

}  // namespace
}  // namespace flipfree::certify::winding_test
