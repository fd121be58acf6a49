#include "flipfree/distortion/minimize/boundary_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "fuzz/rational.h"
#include "support/shapes.h"

namespace flipfree::distortion::boundary_grid_test {
namespace {

// A closed polygon of its own: edges i -> i + 1.
Boundary polygon(Index count) {
  Boundary boundary;
  boundary.loops.resize(1);
  for (Index v = 0; v < count; ++v) {
    boundary.edges.push_back({v, (v + 1) % count});
    boundary.vertices.push_back(v);
    boundary.loops[0].push_back(v);
  }
  return boundary;
}

// Do two edges have a point in common other than a vertex of both? In rational numbers.
bool conflict(const Boundary& boundary, const Points2& uv, std::size_t e, std::size_t f) {
  const auto [a, b] = boundary.edges[e];
  const auto [c, d] = boundary.edges[f];
  const auto at = [&](VertexId v) { return fuzz::exact(uv.row(v).transpose()); };
  const fuzz::Meeting meeting = fuzz::meeting(at(a), at(b), at(c), at(d));
  if (!meeting.meet) return false;
  if (meeting.along) return true;
  for (const VertexId v : {a, b}) {
    if ((v == c || v == d) && at(v) == meeting.at) return false;
  }
  return true;
}

TEST(BoundaryGrid, finds_a_conflict_exactly_if_one_of_all_pairs_has_one) {
  std::mt19937 random(1);
  int found = 0, none = 0;
  for (int i = 0; i < 1500; ++i) {
    const Index count = 3 + static_cast<Index>(random() % 9);
    const Boundary boundary = polygon(count);
    Points2 uv(count, 2);
    // Coarse places, where much touches; every third one star-shaped, which mostly has none.
    for (Index v = 0; v < count; ++v) {
      const double angle = 2.0 * M_PI * (v + 0.4) / count;
      const double radius = 1.0 + static_cast<double>(random() % 8);
      if (i % 3 == 0) {
        uv.row(v) << std::round(4 * radius * std::cos(angle)),
            std::round(4 * radius * std::sin(angle));
      } else {
        uv.row(v) << static_cast<double>(random() % 6), static_cast<double>(random() % 6);
      }
    }
    bool distinct = true;  // edges without length are no edges
    for (const auto& [a, b] : boundary.edges) distinct = distinct && uv.row(a) != uv.row(b);
    if (!distinct) continue;
    bool any = false;
    for (std::size_t e = 0; e < boundary.edges.size(); ++e) {
      for (std::size_t f = 0; f < e; ++f) any = any || conflict(boundary, uv, e, f);
    }
    const auto [e, f] = BoundaryGrid(boundary, uv).first_conflict(ExecutionContext());
    ASSERT_EQ(e != kInvalid, any);
    (any ? found : none)++;
    if (any) {
      EXPECT_TRUE(conflict(boundary, uv, static_cast<std::size_t>(e), static_cast<std::size_t>(f)));
    }
    EXPECT_EQ(overlaps_itself(boundary, uv, ExecutionContext()), any);
  }
  EXPECT_GT(found, 300);
  EXPECT_GT(none, 100);
}

TEST(BoundaryGrid, near_edges_are_all_named_at_any_scale) {
  std::mt19937 random(2);
  for (const double unit : {1e-200, 1.0, 1e150}) {
    for (int i = 0; i < 60; ++i) {
      const Index count = 4 + static_cast<Index>(random() % 60);
      const Boundary boundary = polygon(count);
      std::uniform_real_distribution<double> place(0.0, 1.0);
      Points2 uv(count, 2);
      for (Index v = 0; v < count; ++v) uv.row(v) << place(random), 0.1 * place(random);
      const Vector2 point(2 * place(random) - 0.5, 2 * place(random) - 0.5);
      const double radius = 0.3 * place(random);
      std::vector<Index> expected;
      for (std::size_t e = 0; e < boundary.edges.size(); ++e) {
        const Vector2 a = uv.row(boundary.edges[e][0]), b = uv.row(boundary.edges[e][1]);
        const double t = std::clamp((point - a).dot(b - a) / (b - a).squaredNorm(), 0.0, 1.0);
        if ((point - a - t * (b - a)).norm() < radius) expected.push_back(static_cast<Index>(e));
      }
      const Points2 scaled = unit * uv;
      std::vector<Index> near{99};
      BoundaryGrid(boundary, scaled).near(unit * point, unit * radius, near);
      EXPECT_TRUE(std::is_sorted(near.begin(), near.end()));
      EXPECT_TRUE(std::includes(near.begin(), near.end(), expected.begin(), expected.end()));
    }
  }
}

TEST(FindBoundary, has_every_open_edge_once_with_the_surface_on_its_left) {
  const mesh::Surface tube = test::cylinder(7, 3);
  const Boundary boundary = find_boundary(28, tube.faces);
  EXPECT_EQ(boundary.edges.size(), 14U);
  EXPECT_EQ(boundary.loops.size(), 2U);
  EXPECT_EQ(boundary.vertices.size(), 14U);
  EXPECT_TRUE(std::is_sorted(boundary.vertices.begin(), boundary.vertices.end()));
  for (const auto& [a, b] : boundary.edges) {
    bool found = false;
    for (Eigen::Index f = 0; f < tube.faces.rows(); ++f) {
      for (Index k = 0; k < 3; ++k)
        found = found || (tube.faces(f, k) == a && tube.faces(f, (k + 1) % 3) == b);
    }
    EXPECT_TRUE(found);
  }
  const Boundary none = find_boundary(4, test::tetrahedron().faces);
  EXPECT_TRUE(none.edges.empty() && none.vertices.empty() && none.loops.empty());
  EXPECT_FALSE(overlaps_itself(none, Points2::Zero(4, 2), ExecutionContext()));
}

TEST(TurnedLoops, holes_run_clockwise_and_one_that_does_not_is_turned) {
  // A square with a triangular hole, the hole's loop either way round.
  Boundary boundary = polygon(4);
  boundary.loops.push_back({4, 5, 6});
  for (Index v = 4; v < 7; ++v) {
    boundary.edges.push_back({v, v == 6 ? 4 : v + 1});
    boundary.vertices.push_back(v);
  }
  Points2 uv(7, 2);
  uv << 0, 0, 9, 0, 9, 9, 0, 9, 3, 3, 3, 6, 6, 3;
  EXPECT_TRUE(turned_loops(boundary, uv).empty());
  EXPECT_FALSE(overlaps_itself(boundary, uv, ExecutionContext()));
  uv.row(5).swap(uv.row(6));
  EXPECT_EQ(turned_loops(boundary, uv), std::vector<std::size_t>{1});
  EXPECT_TRUE(overlaps_itself(boundary, uv, ExecutionContext()));
}

}  // namespace
}  // namespace flipfree::distortion::boundary_grid_test
