#include "flipfree/seamless/exact/take_back.h"

#include <gtest/gtest.h>

#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/certify.h"
#include "flipfree/seamless/penner/penner.h"
#include "support/shapes.h"

namespace flipfree::seamless {
namespace {

// Two cones of half a turn near each pole of a ball: far from its own curvature, so that the engine
// has to refine.
struct Pressed {
  mesh::Surface surface = test::sphere(20, 14);
  std::vector<Index> cones;
  PennerMap map;

  Pressed() {
    cones.assign(static_cast<std::size_t>(surface.vertices.rows()), 4);
    for (const std::size_t v : {60U, 70U, 81U, 95U}) cones[v] = 2;
    ExecutionContext context;
    PennerMapOptions options;
    options.metric.relaxation = 6;
    map = compute_penner_map(surface, cones, {}, options, context);
  }
};

TEST(TakeBack, LeavesFewerVerticesAndAMapThatHolds) {
  Pressed pressed;
  const auto own = pressed.surface.vertices.rows();
  certify::Parametrization& map = pressed.map.map;
  const auto before = map.surface.vertices.rows() - own;
  ASSERT_GT(before, 0);  // else nothing is tested
  ExecutionContext context;
  take_back(pressed.surface, false, 15, map, context);
  EXPECT_LT(map.surface.vertices.rows() - own, before);
  EXPECT_EQ(std::get<std::int64_t>(map.stats.at("taken_back.vertices")),
            before - (map.surface.vertices.rows() - own));
  map.uv32 = map.uv.cast<float>();
  certify::CertifyRequest request;
  request.measure_overlaps = false;
  certify::certify_map(map, pressed.surface, request, context);
  EXPECT_EQ(map.certificate.flips64, 0);
  // Seams still match up to rounding.
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces);
  const mesh::EdgeFlags cut = mesh::flag_edges(map.surface.faces, adjacency, map.cut_edges);
  const auto branches = seam_branches(map.surface.faces, adjacency, cut, {60, 70, 81, 95}, map.uv);
  EXPECT_LE(largest_seam_error(branches, adjacency, map.uv), 1e-9);
}

TEST(TakeBack, LeavesAMapOnTheInputsOwnTrianglesAlone) {
  const mesh::Surface surface = test::torus(12, 8);
  std::vector<Index> cones(96, 4);
  ExecutionContext context;
  PennerMap found = compute_penner_map(surface, cones, {}, {}, context);
  ASSERT_EQ(found.map.surface.vertices.rows(), 96);
  const Points2 uv = found.map.uv;
  take_back(surface, false, 15, found.map, context);
  EXPECT_TRUE(found.map.uv == uv);
}

}  // namespace
}  // namespace flipfree::seamless
