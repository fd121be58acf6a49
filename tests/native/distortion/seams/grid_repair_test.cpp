#include "flipfree/distortion/seams/exact_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "distortion/seams/flat_square.h"
#include "distortion/seams/polycubes.h"
#include "flipfree/base/error.h"

namespace flipfree::distortion::grid_repair_test {
namespace {

// A map of integers on a grid so fine that points have room to move.
constexpr std::int64_t kUnit = 64;

GridPoints grid_points(const CutMap& map) { return (kUnit * map.uv).cast<std::int64_t>(); }

SeamConstraints eliminated(const CutMap& map) {
  return eliminate_seams(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces,
                         map.seams, map.straight, ExecutionContext());
}

// The translation of every seam edge, from its two ends; both must be the same.
std::vector<Eigen::Matrix<std::int64_t, 2, 2>> translations(const CutMap& map,
                                                            const GridPoints& points) {
  std::vector<Eigen::Matrix<std::int64_t, 2, 2>> all;
  for (const auto& [h, o, r] : map.seams) {
    Eigen::Matrix<std::int64_t, 2, 2> both;
    int row = 0;
    for (const auto& [from, to] : {std::pair{h, next_corner(o)}, std::pair{next_corner(h), o}}) {
      const auto p = points.row(map.surface.faces(from / 3, from % 3));
      const auto q = points.row(map.surface.faces(to / 3, to % 3));
      const auto turned = numeric::quarter_turn(r) * numeric::GaussianInteger{p[0], p[1]};
      both.row(row++) << q[0] - turned.re, q[1] - turned.im;
    }
    all.push_back(both);
  }
  return all;
}

TEST(TwiceGridArea, is_exact_for_the_largest_numbers_that_may_occur) {
  Triangles face(1, 3);
  face << 0, 1, 2;
  std::mt19937 random(3);
  std::uniform_int_distribution<std::int64_t> any(-kLargestGridNumber, kLargestGridNumber);
  for (int round = 0; round < 1000; ++round) {
    GridPoints p(3, 2);
    for (std::int64_t& x : p.reshaped())
      x = round % 2 == 0 ? any(random) : (any(random) > 0 ? 1 : -1) * kLargestGridNumber;
    // The shoelace formula, which has other intermediate values.
    std::int64_t shoelace = 0;
    for (int k = 0; k < 3; ++k) {
      const int n = (k + 1) % 3;
      shoelace += p(k, 0) * p(n, 1) - p(n, 0) * p(k, 1);
    }
    EXPECT_EQ(twice_grid_area(face, p, 0), shoelace);
  }
}

TEST(FoldedFaces, are_those_without_positive_area_in_order) {
  const CutMap map = test::flat_square(12);
  std::mt19937 random(7);
  std::uniform_int_distribution<std::int64_t> move(-8, 8);
  GridPoints points = grid_points(map);
  for (std::int64_t& x : points.reshaped()) x += move(random);
  points.row(17) = points.row(18);  // of no area, too
  std::vector<FaceId> wanted;
  for (FaceId f = 0; f < map.surface.faces.rows(); ++f) {
    if (twice_grid_area(map.surface.faces, points, f) <= 0) wanted.push_back(f);
  }
  ASSERT_FALSE(wanted.empty());
  EXPECT_EQ(folded_faces(map.surface.faces, points, ExecutionContext()), wanted);
  ExecutionContext cancelled;
  cancelled.cancel();
  EXPECT_THROW((void)folded_faces(map.surface.faces, points, cancelled), Cancelled);
}

TEST(GridRepair, opens_what_was_folded_and_no_translation_changes) {
  for (unsigned seed = 0; seed < 8; ++seed) {
    const CutMap map = test::cut_map_of(test::unfold(test::polycubes()[seed % 4], 4, seed));
    const SeamConstraints constraints = eliminated(map);
    GridPoints points = grid_points(map);
    const auto before = translations(map, points);
    // Some vertices onto a neighbour, as far as they are their own nodes.
    std::mt19937 random(seed);
    std::vector<char> used(constraints.divisor.size(), 0);
    for (int i = 0; i < 12; ++i) {
      const auto f =
          static_cast<FaceId>(random() % static_cast<unsigned>(map.surface.faces.rows()));
      const VertexId v = map.surface.faces(f, 0);
      if (!constraints.is_own_node(v) || used[static_cast<std::size_t>(v)] != 0) continue;
      bool seam = false;  // its copies would have to follow
      for (const auto& [h, o, r] : map.seams) {
        for (const CornerId c : {h, next_corner(h), o, next_corner(o)})
          seam = seam || map.surface.faces(c / 3, c % 3) == v;
      }
      if (seam) continue;
      points.row(v) = points.row(map.surface.faces(f, 1));
      used[static_cast<std::size_t>(v)] = 1;
    }
    const ExecutionContext context;
    const std::vector<FaceId> folded = folded_faces(map.surface.faces, points, context);
    ASSERT_FALSE(folded.empty());
    GridRepair repair(constraints, map.surface.faces, points, context);
    EXPECT_TRUE(repair.sweep(folded).empty());
    EXPECT_TRUE(folded_faces(map.surface.faces, points, context).empty());
    EXPECT_EQ(translations(map, points), before);
  }
}

TEST(GridRepair, boundary_vertices_stay_on_their_straight_line) {
  CutMap map = test::flat_square(6);
  const SeamConstraints constraints = eliminated(map);
  GridPoints points = grid_points(map);
  for (std::int64_t& x : points.reshaped()) x *= 6;
  const GridPoints before = points;
  // A vertex inside the lower side beyond its neighbour there.
  const VertexId v = 3;
  ASSERT_EQ(points(v, 1), 0);
  points(v, 0) = points(v + 1, 0) + 5;
  const ExecutionContext context;
  const std::vector<FaceId> folded = folded_faces(map.surface.faces, points, context);
  ASSERT_FALSE(folded.empty());
  GridRepair repair(constraints, map.surface.faces, points, context);
  EXPECT_TRUE(repair.sweep(folded).empty());
  for (const auto& [h, direction] : map.straight) {
    const VertexId w = map.surface.faces(h / 3, h % 3);
    const int held = direction % 2 == 0 ? 1 : 0;
    EXPECT_EQ(points(w, held), before(w, held)) << w;
  }
}

TEST(GridRepair, says_which_faces_it_cannot_open) {
  // Nine inner vertices and a square of two steps, whose corners cannot move: no grid has room.
  CutMap map = test::flat_square(4);
  const SeamConstraints constraints = eliminated(map);
  GridPoints points = (4 * map.uv).cast<std::int64_t>() / 2;
  const ExecutionContext context;
  const std::vector<FaceId> folded = folded_faces(map.surface.faces, points, context);
  ASSERT_FALSE(folded.empty());
  GridRepair repair(constraints, map.surface.faces, points, context);
  const std::vector<FaceId> left = repair.sweep(folded);
  EXPECT_FALSE(left.empty());
  EXPECT_EQ(left, folded_faces(map.surface.faces, points, context));
}

TEST(GridRepair, a_region_grows_over_faces_and_seams) {
  const CutMap map = test::cut_map_of(test::unfold(test::polycubes()[2], 2, 3));
  const SeamConstraints constraints = eliminated(map);
  GridPoints points = grid_points(map);
  const ExecutionContext context;
  const GridRepair repair(constraints, map.surface.faces, points, context);
  std::set<VertexId> region = {map.surface.faces(0, 0)};
  for (;;) {
    const std::vector<VertexId> grown = repair.grow({region.begin(), region.end()});
    ASSERT_TRUE(std::is_sorted(grown.begin(), grown.end()));
    std::set<VertexId> wanted = region;
    for (FaceId f = 0; f < map.surface.faces.rows(); ++f) {
      bool touches = false;
      for (int k = 0; k < 3; ++k) touches = touches || region.count(map.surface.faces(f, k)) != 0;
      for (int k = 0; touches && k < 3; ++k) wanted.insert(map.surface.faces(f, k));
    }
    // Copies of a vertex have the same position node.
    const auto node = [&](VertexId v) {
      for (Index t = constraints.begin[static_cast<std::size_t>(v)];
           t < constraints.begin[static_cast<std::size_t>(v) + 1]; ++t) {
        const Index n = constraints.terms[static_cast<std::size_t>(t)].node;
        if (n < constraints.position_count()) return n;
      }
      return kInvalid;
    };
    std::set<Index> nodes;
    for (const VertexId v : wanted) nodes.insert(node(v));
    nodes.erase(kInvalid);
    for (VertexId v = 0; v < static_cast<VertexId>(constraints.divisor.size()); ++v)
      if (nodes.count(node(v)) != 0) wanted.insert(v);
    EXPECT_EQ(std::set<VertexId>(grown.begin(), grown.end()), wanted);
    if (wanted.size() == region.size()) break;
    region = wanted;
  }
  EXPECT_EQ(region.size(), static_cast<std::size_t>(map.surface.vertices.rows()));
}

}  // namespace
}  // namespace flipfree::distortion::grid_repair_test
