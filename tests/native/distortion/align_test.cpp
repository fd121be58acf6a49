#include "flipfree/distortion/alignment/align.h"

#include <gtest/gtest.h>

#include <cmath>

#include "distortion/polycubes.h"
#include "flipfree/base/error.h"
#include "flipfree/distortion/energy/energy.h"
#include "support/shapes.h"

namespace flipfree::distortion::align_test {
namespace {

// Per face of a map the direction that it takes to +u, from the half-edge 3 f, if it is an
// isometry.
std::vector<double> directions_of(const CutMap& map) {
  std::vector<double> direction;
  for (Eigen::Index f = 0; f < map.surface.faces.rows(); ++f) {
    const Vector2 edge = map.uv.row(map.surface.faces(f, 1)) - map.uv.row(map.surface.faces(f, 0));
    direction.push_back(-std::atan2(edge.y(), edge.x()));
  }
  return direction;
}

double mean_angle(const CutMap& map, const std::vector<double>& direction, const Points2& uv) {
  const Points2 off = angles_off(map, direction, uv, ExecutionContext());
  return off.col(0).dot(off.col(1)) / off.col(1).sum();
}

CutMap plane(Index columns, Index rows) {
  CutMap map;
  map.surface = test::grid(columns, rows);
  map.uv = map.surface.vertices.leftCols<2>();
  return map;
}

TEST(Align, perturbed_polycubes_come_back_to_follow_their_edges_and_keep_their_seams) {
  for (const auto& cells : test::polycubes()) {
    for (unsigned seed = 0; seed < 3; ++seed) {
      const CutMap flat = test::cut_map_of(test::unfold(cells, 4, seed));
      const std::vector<double> direction = directions_of(flat);
      EXPECT_LT(mean_angle(flat, direction, flat.uv), 1e-9);
      const CutMap map = test::perturbed(flat, 0.3, seed);
      EXPECT_GT(mean_angle(map, direction, map.uv), 0.02);
      AlignOptions options;
      options.direction = direction;
      ExecutionContext context;
      Stats stats;
      const Points2 uv = align(map, options, context, stats);
      EXPECT_TRUE(is_flip_free(map.surface.faces, uv, context));
      EXPECT_LT(mean_angle(map, direction, uv), 1e-3);
      EXPECT_LT(std::get<double>(stats.at("alignment.energy")),
                1e-2 * std::get<double>(stats.at("alignment.energy_start")));
      for (const auto& [h, o, r] : map.seams) {
        Vector2 edge = uv.row(map.surface.faces(next_corner(h) / 3, next_corner(h) % 3)) -
                       uv.row(map.surface.faces(h / 3, h % 3));
        for (Index i = 0; i < r; ++i) edge = Vector2(-edge.y(), edge.x());
        const Vector2 other = uv.row(map.surface.faces(o / 3, o % 3)) -
                              uv.row(map.surface.faces(next_corner(o) / 3, next_corner(o) % 3));
        EXPECT_LT((edge - other).norm(), 1e-9);
      }
    }
  }
}

TEST(Align, folded_maps_and_missing_directions_are_refused) {
  CutMap map = plane(3, 3);
  ExecutionContext context;
  Stats stats;
  EXPECT_THROW(align(map, {}, context, stats), InvalidInput);
  AlignOptions options;
  options.direction = directions_of(map);
  map.uv.row(5) << 9.0, 9.0;
  EXPECT_THROW(align(map, options, context, stats), InvalidInput);
}

}  // namespace
}  // namespace flipfree::distortion::align_test
