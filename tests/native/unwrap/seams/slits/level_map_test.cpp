#include "flipfree/unwrap/seams/slits/level_map.h"

#include <gtest/gtest.h>

#include "flipfree/certify/measures.h"
#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/unwrap/seams/search/trial_map.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::level_map_test {
namespace {

TEST(LevelMap, is_as_good_as_the_map_made_at_once) {
  const mesh::Surface dome = test::bumpy_grid(120, 120, 0.6, 1.0);
  const mesh::Adjacency adjacency = test::adjacency_of(dome);
  const mesh::EdgeFlags none(adjacency.opposite.size(), 0);
  ExecutionContext context;
  const LevelMap map = map_by_levels(dome, adjacency, none, none, {}, context);
  TrialMap at_once(dome);
  EXPECT_NEAR(map.stretch.energy, at_once.relax(adjacency, none, 1e-4, context).energy, 2e-3);
  EXPECT_DOUBLE_EQ(map.stretch.energy,
                   certify::symmetric_dirichlet(dome, map.slits.corner_uv).mean);
  EXPECT_EQ(map.slits.cut, none);
}

// The sides of a slit into a saddle lie on each other.
mesh::Surface saddle(Index n) {
  mesh::Surface surface = test::grid(n, n);
  const double width = surface.vertices.col(0).maxCoeff(),
               height = surface.vertices.col(1).maxCoeff();
  for (Eigen::Index v = 0; v < surface.vertices.rows(); ++v) {
    const double x = 2.0 * surface.vertices(v, 0) / width - 1.0;
    const double y = 2.0 * surface.vertices(v, 1) / height - 1.0;
    surface.vertices.row(v) << x, y, 1.2 * x * y;
  }
  return surface;
}

TEST(LevelMap, is_held_apart_or_divided_where_it_would_lie_on_itself) {
  const Index n = 100;
  const mesh::Surface surface = saddle(n);
  const mesh::Adjacency adjacency = test::adjacency_of(surface);
  IndexPairs slit(n / 2, 2);
  for (Index i = 0; i < n / 2; ++i) slit.row(i) << (n + 1) * n / 2 + i, (n + 1) * n / 2 + i + 1;
  const mesh::EdgeFlags cut = mesh::flag_edges(surface.faces, adjacency, slit);
  const mesh::EdgeFlags none(cut.size(), 0);
  ExecutionContext context;
  SlitOptions options;
  options.bijective = false;
  const LevelMap free = map_by_levels(surface, adjacency, cut, none, options, context);
  options.bijective = true;
  options.bound = {10.0, 100.0};
  const LevelMap held = map_by_levels(surface, adjacency, cut, none, options, context);
  EXPECT_EQ(held.slits.cut, cut);
  EXPECT_GT(held.stretch.energy, free.stretch.energy);
  options.bound = {1.0, 100.0};
  const LevelMap divided = map_by_levels(surface, adjacency, cut, none, options, context);
  EXPECT_NE(divided.slits.cut, cut);
  EXPECT_EQ(divided.slits.apart.rows(), 0);
  const std::vector<mesh::Chart> pieces = mesh::split_into_charts(
      surface.vertices, mesh::cut_along(surface.faces, adjacency, divided.slits.cut));
  EXPECT_GT(pieces.size(), 1u);
  for (const mesh::Chart& piece : pieces) {
    const auto count = static_cast<Index>(piece.vertices.size());
    Points2 uv(count, 2);
    for (std::size_t h = 0; h < 3 * piece.faces.size(); ++h) {
      const auto corner = 3 * piece.faces[h / 3] + static_cast<Index>(h % 3);
      uv.row(piece.surface.faces.data()[h]) = divided.slits.corner_uv.row(corner);
    }
    EXPECT_TRUE(distortion::is_flip_free(piece.surface.faces, uv, context));
    EXPECT_FALSE(distortion::overlaps_itself(distortion::find_boundary(count, piece.surface.faces),
                                             uv, context));
  }
}

}  // namespace
}  // namespace flipfree::unwrap::level_map_test
