#include "flipfree/matchmaker/smooth/relax.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "flipfree/distortion/energy/energy.h"
#include "flipfree/distortion/energy/rest_shapes.h"
#include "flipfree/matchmaker/smooth/neighbourhood.h"
#include "flipfree/matchmaker/start/first_try.h"
#include "matchmaker/refined_maps.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::relax_test {
namespace {

double energy(const mesh::RefinedMap& map, ExecutionContext& context) {
  const mesh::Surface surface = to_surface(map.surface);
  const auto rest = distortion::build_rest_shapes(surface, context);
  return distortion::sum_energy(surface.faces, rest.triangles, map.uv, context).at_best_scale();
}

TEST(Neighbourhood, RingsOfAGridAreItsHexagons) {
  const mesh::Surface surface = test::grid(20, 20);
  const mesh::RefinedSurface refined = mesh::make_refined_surface(surface);
  const VertexId v = 21 * 10 + 10;
  for (int rings = 0; rings < 5; ++rings) {
    const auto near = vertices_near(refined.mesh, {v, v}, rings);
    EXPECT_EQ(near.size(), static_cast<std::size_t>(1 + 3 * rings * (rings + 1)));
    EXPECT_TRUE(std::is_sorted(near.begin(), near.end()));
  }
  EXPECT_EQ(faces_at(refined.mesh, {v}).size(), 6u);
}

TEST(Neighbourhood, SeesAVertexThatWindsTwiceAmongPositiveTriangles) {
  const mesh::Surface surface = test::grid(20, 20);
  mesh::RefinedMap map{mesh::make_refined_surface(surface), surface.vertices.leftCols(2)};
  const VertexId v = 21 * 10 + 10;
  const std::vector<FaceId> star = faces_at(map.surface.mesh, {v});
  std::vector<mesh::EditableTriangulation::Triangle> triangles;
  for (const FaceId f : star) triangles.push_back(map.surface.mesh.corners(f));
  const Patch patch = make_patch(map, triangles);
  EXPECT_FALSE(winds_more(map, patch.vertices, patch.surface.faces, patch.uv, star));
  // The corners of the star in steps of 120 instead of 60 degrees.
  Points2 twice = patch.uv;
  const Vector2 centre = map.uv.row(v).transpose();
  for (std::size_t i = 0; i < patch.vertices.size(); ++i) {
    const Vector2 d = map.uv.row(patch.vertices[i]).transpose() - centre;
    const double angle = 2 * std::atan2(d.y(), d.x());
    const double radius = patch.vertices[i] == v ? 0 : 1;
    twice.row(static_cast<Eigen::Index>(i)) =
        (centre + radius * Vector2(std::cos(angle), std::sin(angle))).transpose();
  }
  EXPECT_TRUE(winds_more(map, patch.vertices, patch.surface.faces, twice, star));
}

TEST(Relax, NearAPushLowersTheEnergyAndMovesNothingElse) {
  const mesh::Surface surface = test::grid(40, 40);
  const VertexId v = 41 * 20 + 8;
  ExecutionContext context;
  mesh::RefinedMap map = test::drawn_out(surface, v, context);
  const Points2 before = map.uv;
  const double start = energy(map, context);
  const std::vector<VertexId> near = vertices_near(map.surface.mesh, {v}, 4);
  RelaxOptions options;
  numeric::EliminationMemory memory(static_cast<Index>(surface.vertices.rows()));
  options.memory = &memory;
  for (int round = 0; round < 2; ++round) {
    const double was = energy(map, context);
    ASSERT_TRUE(relax_near(map, {v}, 4, {v}, options, context));
    EXPECT_LT(energy(map, context), was);
  }
  EXPECT_LT(energy(map, context), 0.99 * start);
  EXPECT_EQ(map.uv.row(v), before.row(v)) << "a held vertex has moved";
  Index moved = 0;
  for (VertexId w = 0; w < map.surface.mesh.vertex_count(); ++w) {
    if (map.uv.row(w) == before.row(w)) continue;
    ++moved;
    EXPECT_TRUE(std::binary_search(near.begin(), near.end(), w)) << w;
  }
  EXPECT_GT(moved, 10);
  test::expect_valid(map);
}

}  // namespace
}  // namespace flipfree::matchmaker::relax_test
