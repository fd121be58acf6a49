#include "flipfree/matchmaker/finish/usable_map.h"

#include <gtest/gtest.h>

#include "flipfree/base/error.h"
#include "flipfree/distortion/untangle.h"
#include "matchmaker/refined_maps.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::store_map_test {
namespace {

constexpr Index kSide = 24;

// A grid with one face as small as 32 bits allow, and a vertex added inside it. `corners` receives
// those of the face.
mesh::RefinedMap filled_speck(const mesh::Surface& surface, std::vector<VertexId>& corners) {
  mesh::RefinedMap map = test::identity_map(surface);
  const FaceId f = kSide * kSide;  // in the middle
  const auto c = map.surface.mesh.corners(f);
  corners.assign(c.begin(), c.end());
  Vector2 corner[3];
  for (std::size_t k = 0; k < 3; ++k) corner[k] = kSide * map.uv.row(c[k]).transpose();
  const Vector2 middle = (corner[0] + corner[1] + corner[2]) / (3 * kSide);
  map.uv = (map.uv.rowwise() - middle.transpose()).array() + 1.0;
  Vector2 speck[3];  // the face, smaller
  for (std::size_t k = 0; k < 3; ++k) {
    speck[k] = Vector2(1, 1) + 0x1p-23 * (corner[k] - corner[0]);
    map.uv.row(c[k]) = speck[k].transpose();
  }
  const mesh::Support where = mesh::rounded_between(
      map.surface.support[static_cast<std::size_t>(c[2])],
      mesh::rounded_between(map.surface.support[static_cast<std::size_t>(c[0])],
                            map.surface.support[static_cast<std::size_t>(c[1])], 0.5),
      0.5);
  map.surface.split_face(f, where);
  map.uv.conservativeResize(map.uv.rows() + 1, 2);
  map.uv.bottomRows(1) = 0.25 * (speck[0] + speck[1] + 2 * speck[2]).transpose();
  return map;
}

// A grid drawn together to a thread where floats are further apart than it is wide.
mesh::RefinedMap thread(const mesh::Surface& surface) {
  mesh::RefinedMap map = test::identity_map(surface);
  map.uv.col(0) = 1.0 + 1e-9 * map.uv.col(0).array();
  return map;
}

std::int64_t rooms(const Stats& stats) {
  return std::get<std::int64_t>(stats.at("rounding.rooms"));
}

TEST(StoreMap, OrdinaryMapsAreRoundedAndLeftAlone) {
  const mesh::Surface surface = test::grid(kSide, kSide);
  mesh::RefinedMap map = test::identity_map(surface);
  ExecutionContext context;
  Stats stats;
  const Points2f stored =
      store_map(map, {}, static_cast<Index>(surface.vertices.rows()), false, context, stats);
  EXPECT_EQ(stored, map.uv.cast<float>());
  EXPECT_EQ(rooms(stats), 0);
}

TEST(StoreMap, TakesAwayAnAddedVertexForWhichThereIsNoRoom) {
  const mesh::Surface surface = test::grid(kSide, kSide);
  std::vector<VertexId> held;
  mesh::RefinedMap map = filled_speck(surface, held);
  ExecutionContext context;
  ASSERT_TRUE(distortion::find_flips(map.surface.mesh.faces(), map.uv, context).empty());
  const Points2 before = map.uv;
  Stats stats;
  const auto keep = static_cast<Index>(surface.vertices.rows());
  const Points2f stored = store_map(map, held, keep, false, context, stats);
  EXPECT_GT(rooms(stats), 0);
  EXPECT_EQ(map.surface.mesh.vertex_count(), keep);
  EXPECT_TRUE(
      distortion::find_flips(map.surface.mesh.faces(), stored.cast<double>(), context).empty());
  for (const VertexId v : held) EXPECT_EQ(stored.row(v), before.row(v).cast<float>());
  test::expect_valid(map);
}

TEST(StoreMap, NamesInputFacesWhereHeldVerticesLeaveNoRoom) {
  const mesh::Surface surface = test::grid(kSide, kSide);
  mesh::RefinedMap map = thread(surface);
  std::vector<VertexId> held;
  for (VertexId v = 0; v < map.surface.mesh.vertex_count(); ++v) held.push_back(v);
  ExecutionContext context;
  Stats stats;
  try {
    store_map(map, held, static_cast<Index>(surface.vertices.rows()), false, context, stats);
    FAIL() << "collapsed triangles were accepted";
  } catch (const NotConverged& failure) {
    EXPECT_EQ(failure.error().code, ErrorCode::kRoundingFlips);
    EXPECT_EQ(failure.error().kind, ElementKind::kFace);
    ASSERT_FALSE(failure.error().elements.empty());
    EXPECT_LT(failure.error().elements.back(), static_cast<FaceId>(surface.faces.rows()));
  }
}

}  // namespace
}  // namespace flipfree::matchmaker::store_map_test
