#include "flipfree/distortion/seams/constraints.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "distortion/seams/flat_square.h"
#include "distortion/seams/polycubes.h"

namespace flipfree::distortion::cut_map_test {
namespace {

Vector2 turned(Vector2 p, Index quarter_turns) {
  for (Index k = 0; k < quarter_turns; ++k) p = Vector2(-p.y(), p.x());
  return p;
}

Vector2 edge(const CutMap& map, CornerId from, CornerId to) {
  const auto& faces = map.surface.faces;
  return (map.uv.row(faces(to / 3, to % 3)) - map.uv.row(faces(from / 3, from % 3))).transpose();
}

// Two triangles that share a cut edge, over the plane: corners 0 to 2 of the first, 3 to 5 of the
// second, whose copy of the edge is turned by `angle`.
CutMap two_triangles(double angle) {
  const mesh::Surface surface = test::grid(1, 1);
  const mesh::Adjacency adjacency = mesh::build_adjacency(4, surface.faces);
  mesh::EdgeFlags cuts(6, 0);
  Points2 corners(6, 2);
  for (CornerId c = 0; c < 6; ++c) {
    const Vector2 p = surface.vertices.row(surface.faces(c / 3, c % 3)).head<2>().transpose();
    const Vector2 q(std::cos(angle) * p.x() - std::sin(angle) * p.y(),
                    std::sin(angle) * p.x() + std::cos(angle) * p.y());
    corners.row(c) = (c < 3 ? p : q).transpose();
    cuts[static_cast<std::size_t>(c)] = adjacency.opposite[static_cast<std::size_t>(c)] != kInvalid;
  }
  return cut_map(surface, adjacency, cuts, corners);
}

TEST(CutMap, every_cut_edge_is_a_seam_with_the_turn_that_the_map_has) {
  for (const auto& cells : test::polycubes()) {
    const test::Unfolded u = test::unfold(cells, 2, 5);
    const CutMap map = test::cut_map_of(u);
    std::size_t cut_halfedges = 0;
    for (const char c : u.cuts) cut_halfedges += c != 0 ? 1 : 0;
    EXPECT_EQ(2 * map.seams.size(), cut_halfedges);
    HalfedgeId last = kInvalid;
    for (const auto& [h, o, r] : map.seams) {
      EXPECT_GT(h, last);
      last = h;
      EXPECT_LT(h, o);
      EXPECT_EQ(u.adjacency.opposite[static_cast<std::size_t>(h)], o);
      EXPECT_EQ(turned(edge(map, h, next_corner(h)), r), edge(map, next_corner(o), o));
    }
    // Every corner has its value, and every vertex its place.
    for (CornerId c = 0; c < static_cast<CornerId>(u.uv.rows()); ++c) {
      const VertexId v = map.surface.faces(c / 3, c % 3);
      EXPECT_EQ(map.uv.row(v), u.uv.row(c));
      EXPECT_EQ(map.surface.vertices.row(v), u.surface.vertices.row(u.surface.faces(c / 3, c % 3)));
    }
  }
}

TEST(CutMap, a_seam_that_misses_the_quarter_turns_gets_the_nearest) {
  for (int degrees = -178; degrees < 180; degrees += 2) {
    const CutMap map = two_triangles(degrees * M_PI / 180);
    ASSERT_EQ(map.seams.size(), 1U);
    const auto wanted = static_cast<Index>(std::lround(degrees / 90.0) + 4) % 4;
    EXPECT_EQ(map.seams[0].quarter_turns, wanted) << degrees;
  }
}

TEST(CutMap, a_tie_between_two_turns_goes_to_the_lower) {
  // The edge from (1, 1) to (0, 0), seen from the other side along an axis: halfway between two.
  const Vector2 sides[] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
  std::set<Index> found;
  for (const Vector2& side : sides) {
    const mesh::Surface surface = test::grid(1, 1);
    const mesh::Adjacency adjacency = mesh::build_adjacency(4, surface.faces);
    mesh::EdgeFlags cuts(6, 0);
    CornerId h = kInvalid;
    Points2 corners = Points2::Zero(6, 2);
    for (CornerId c = 5; c >= 0; --c) {
      if (adjacency.opposite[static_cast<std::size_t>(c)] == kInvalid) continue;
      cuts[static_cast<std::size_t>(c)] = 1;
      h = c;
    }
    const CornerId o = adjacency.opposite[static_cast<std::size_t>(h)];
    corners.row(next_corner(h)) << 1, 1;
    corners.row(o) = side.transpose();
    const CutMap map = cut_map(surface, adjacency, cuts, corners);
    ASSERT_EQ(map.seams.size(), 1U);
    const Vector2 a(1, 1);
    Index best = 0;
    for (Index k = 1; k < 4; ++k) {
      if ((turned(a, k) - side).norm() < (turned(a, best) - side).norm()) best = k;
    }
    EXPECT_EQ(map.seams[0].quarter_turns, best);
    found.insert(best);
  }
  EXPECT_EQ(found, (std::set<Index>{0, 1, 2}));  // 0 stands for two of the four ties
}

TEST(StraightBoundary, runs_around_a_square_once_with_each_edge_along_its_axis) {
  const Index n = 4;
  const CutMap map = test::flat_square(n);
  ASSERT_EQ(map.straight.size(), static_cast<std::size_t>(4 * n));
  int count[4] = {0, 0, 0, 0};
  for (const auto& [h, direction] : map.straight) {
    EXPECT_GT(turned(edge(map, h, next_corner(h)), (4 - direction) % 4).x(), 0.0);
    EXPECT_EQ(turned(edge(map, h, next_corner(h)), (4 - direction) % 4).y(), 0.0);
    ++count[direction];
  }
  for (const int c : count) EXPECT_EQ(c, n);
}

}  // namespace
}  // namespace flipfree::distortion::cut_map_test
