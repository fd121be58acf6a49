#include "flipfree/distortion/seams/exact_grid.h"

#include <gtest/gtest.h>

#include <cmath>

#include "distortion/seams/polycubes.h"
#include "flipfree/base/error.h"

namespace flipfree::distortion::exact_grid_test {
namespace {

SeamConstraints eliminated(const CutMap& map) {
  return eliminate_seams(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces,
                         map.seams, ExecutionContext());
}

// The map in whole steps, each checked to be one.
GridPoints in_steps(const Points2& uv, double step) {
  const Points2 whole = uv / step;
  EXPECT_EQ(whole, whole.array().round().matrix());
  EXPECT_LE(whole.cwiseAbs().maxCoeff(), static_cast<double>(kLargestGridNumber));
  return whole.cast<std::int64_t>();
}

// Both ends of every seam edge go over to the other side by its turn and the translation given.
void expect_exact_seams(const CutMap& map, const GridMap& grid) {
  for (std::size_t e = 0; e < map.seams.size(); ++e) {
    const auto& [h, o, r] = map.seams[e];
    for (const auto& [from, to] : {std::pair{h, next_corner(o)}, std::pair{next_corner(h), o}}) {
      Vector2 p = grid.uv.row(map.surface.faces(from / 3, from % 3));
      for (Index k = 0; k < r; ++k) p = Vector2(-p.y(), p.x());
      const Vector2 t = grid.transition.row(static_cast<Eigen::Index>(e));
      EXPECT_EQ(Vector2(p + t), grid.uv.row(map.surface.faces(to / 3, to % 3)).transpose());
    }
  }
}

TEST(RoundToGrid, maps_become_integers_of_24_bits_whose_seams_match_exactly) {
  for (const double scale : {1e-20, 1.0, 3e17}) {
    for (const auto& cells : test::polycubes()) {
      CutMap map = test::perturbed(test::cut_map_of(test::unfold(cells, 3, 4)), 0.3, 4);
      map.uv *= scale;
      const SeamConstraints constraints = eliminated(map);
      ExecutionContext context;
      Stats stats;
      const GridMap grid =
          round_to_grid(constraints, map.surface.faces, map.seams, map.uv, context, stats);
      EXPECT_EQ(std::ldexp(1.0, std::ilogb(grid.step)), grid.step);
      const GridPoints points = in_steps(grid.uv, grid.step);
      EXPECT_TRUE(folded_faces(map.surface.faces, points, context).empty());
      EXPECT_EQ(grid.uv.cast<float>().cast<double>(), grid.uv);
      expect_exact_seams(map, grid);
      // The grid is as fine as 24 bits allow.
      EXPECT_GT(grid.uv.cwiseAbs().maxCoeff(), 0.2 * grid.step * kLargestGridNumber);
    }
  }
}

TEST(RoundToGrid, edges_of_a_branch_share_one_translation_up_to_their_units) {
  const CutMap map =
      test::perturbed(test::cut_map_of(test::unfold(test::polycubes()[3], 3, 2)), 0.3, 1);
  const SeamConstraints constraints = eliminated(map);
  ExecutionContext context;
  Stats stats;
  const GridMap grid =
      round_to_grid(constraints, map.surface.faces, map.seams, map.uv, context, stats);
  std::size_t shared = 0;
  for (std::size_t e = 0; e < map.seams.size(); ++e) {
    const auto first = static_cast<std::size_t>(constraints.branch[e]);
    shared += first != e ? 1 : 0;
    const numeric::GaussianInteger& unit = constraints.branch_unit[e];
    const auto t = grid.transition.row(static_cast<Eigen::Index>(first));
    const auto re = static_cast<double>(unit.re), im = static_cast<double>(unit.im);
    EXPECT_EQ(grid.transition(static_cast<Eigen::Index>(e), 0), re * t[0] - im * t[1]);
    EXPECT_EQ(grid.transition(static_cast<Eigen::Index>(e), 1), re * t[1] + im * t[0]);
  }
  EXPECT_GT(shared, 0U);
}

// Columns of triangles squeezed to a width far below the grid's.
CutMap squeezed(const test::Unfolded& u, double share) {
  CutMap map = test::cut_map_of(u);
  const ExecutionContext context;
  const SeamConstraints c = eliminate_seams(static_cast<Index>(map.surface.vertices.rows()),
                                            map.surface.faces, map.seams, context);
  Points2 nodes = nodes_of(c, map.surface.faces, map.seams, map.uv);
  // Vertices that no seam knows are drawn towards a neighbour.
  for (FaceId f = 0; f < map.surface.faces.rows(); f += 7) {
    const VertexId v = map.surface.faces(f, 0);
    const VertexId w = map.surface.faces(f, 1);
    if (!c.is_own_node(v)) continue;
    const Index n = c.terms[static_cast<std::size_t>(c.begin[static_cast<std::size_t>(v)])].node;
    const Points2 before = nodes;
    nodes.row(n) = map.uv.row(w) + share * (map.uv.row(v) - map.uv.row(w));
    const Points2 uv = map_of(c, nodes);
    if (is_flip_free(map.surface.faces, uv, context)) {
      map.uv = uv;
    } else {
      nodes = before;
    }
  }
  return map;
}

// Rounds the map and expects all that is promised of the result.
Stats expect_rounded(const CutMap& map) {
  ExecutionContext context;
  Stats stats;
  const GridMap grid =
      round_to_grid(eliminated(map), map.surface.faces, map.seams, map.uv, context, stats);
  EXPECT_TRUE(folded_faces(map.surface.faces, in_steps(grid.uv, grid.step), context).empty());
  expect_exact_seams(map, grid);
  return stats;
}

TEST(RoundToGrid, triangles_that_rounding_folds_are_opened_under_the_constraints) {
  std::int64_t folded = 0;
  for (unsigned seed = 0; seed < 6; ++seed) {
    const Stats stats =
        expect_rounded(squeezed(test::unfold(test::polycubes()[seed % 4], 3, seed), 1e-9));
    folded += std::get<std::int64_t>(stats.at("rounding.folded"));
  }
  EXPECT_GT(folded, 0);
}

// No single point finds room, so that regions are opened in 64 bits.
TEST(RoundToGrid, crowds_are_opened_in_64_bits) {
  const CutMap map = test::crowded();
  ASSERT_TRUE(is_flip_free(map.surface.faces, map.uv, ExecutionContext()));
  EXPECT_GT(std::get<std::int64_t>(expect_rounded(map).at("rounding.folded")), 0);
}

// A vertex far outside its star.
CutMap with_flips(const CutMap& flat, const SeamConstraints& constraints) {
  CutMap map = flat;
  Points2 nodes = nodes_of(constraints, flat.surface.faces, flat.seams, flat.uv);
  nodes.row(constraints.position_count() / 2).array() += 1.5;
  map.uv = map_of(constraints, nodes);
  return map;
}

TEST(UnfoldOnGrid, opens_a_few_flips_and_the_seams_match_exactly) {
  const CutMap flat = test::cut_map_of(test::unfold(test::polycubes()[1], 4, 1));
  const SeamConstraints constraints = eliminated(flat);
  const CutMap map = with_flips(flat, constraints);
  ExecutionContext context;
  const std::size_t flips = flipped_faces(map.surface.faces, map.uv, context).size();
  ASSERT_GT(flips, 0U);
  const auto opened =
      unfold_on_grid(constraints, map.surface.faces, map.seams, map.uv, flips, context);
  ASSERT_TRUE(opened.has_value());
  EXPECT_TRUE(is_flip_free(map.surface.faces, *opened, context));
  // The seams still turn as they did, exactly.
  for (const auto& [h, o, r] : map.seams) {
    const auto side = [&](const Points2& uv, CornerId a, CornerId b) -> Vector2 {
      return (uv.row(map.surface.faces(b / 3, b % 3)) - uv.row(map.surface.faces(a / 3, a % 3)))
          .transpose();
    };
    Vector2 p = side(*opened, h, next_corner(h));
    for (Index k = 0; k < r; ++k) p = Vector2(-p.y(), p.x());
    EXPECT_EQ(p, side(*opened, next_corner(o), o));
  }
}

TEST(UnfoldOnGrid, has_nothing_to_say_about_more_flips_than_allowed) {
  const CutMap flat = test::cut_map_of(test::unfold(test::polycubes()[1], 4, 1));
  const SeamConstraints constraints = eliminated(flat);
  const CutMap map = with_flips(flat, constraints);
  ExecutionContext context;
  EXPECT_FALSE(
      unfold_on_grid(constraints, map.surface.faces, map.seams, map.uv, 0, context).has_value());
  const auto same =
      unfold_on_grid(constraints, flat.surface.faces, flat.seams, flat.uv, 0, context);
  ASSERT_TRUE(same.has_value());
  const Eigen::RowVector2d middle =
      0.5 * (flat.uv.colwise().minCoeff() + flat.uv.colwise().maxCoeff());
  EXPECT_LT((*same - (flat.uv.rowwise() - middle)).cwiseAbs().maxCoeff(), 1e-5);
}

}  // namespace
}  // namespace flipfree::distortion::exact_grid_test
