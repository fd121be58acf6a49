#include "flipfree/seamless/exact/take_back.h"

#include <gtest/gtest.h>

#include <utility>

#include "flipfree/certify/certified_map.h"
#include "flipfree/certify/certify.h"
#include "flipfree/conformal/map.h"
#include "flipfree/seamless/penner/penner.h"
#include "support/shapes.h"

namespace flipfree::seamless::take_back_test {
namespace {

// A ball with eight cones, written with a vertex wherever its metric crosses an edge.
struct Crossed {
  mesh::Surface surface = test::sphere(20, 14);
  std::vector<VertexId> cones = {20, 45, 77, 110, 150, 180, 210, 250};
  certify::Parametrization map;

  Crossed() {
    std::vector<Index> turns(static_cast<std::size_t>(surface.vertices.rows()), 4);
    for (const VertexId v : cones) turns[static_cast<std::size_t>(v)] = 3;
    ExecutionContext context;
    PennerMetric metric = compute_penner_metric(surface, turns, {}, {}, context);
    conformal::ConformalMapOptions options;
    options.refinement = intrinsic::Refinement::kFull;
    conformal::RefinedMetric solved;
    solved.metric = std::move(metric.metric);
    map =
        conformal::map_from_metric(surface, metric.angles, std::move(solved), options, context).map;
  }
};

std::vector<char> free_faces(const mesh::Surface& surface) {
  return std::vector<char>(static_cast<std::size_t>(surface.faces.rows()), 0);
}

TEST(TakeBack, LeavesTheInputsTrianglesAndAMapThatHolds) {
  Crossed crossed;
  const auto own = crossed.surface.vertices.rows();
  certify::Parametrization& map = crossed.map;
  const auto before = map.surface.vertices.rows() - own;
  ASSERT_GT(before, 0);  // else nothing is tested
  ExecutionContext context;
  take_back(crossed.surface, free_faces(crossed.surface), {}, 15, map, context);
  EXPECT_EQ(map.surface.vertices.rows(), own);
  EXPECT_EQ(std::get<std::int64_t>(map.stats.at("taken_back.vertices")),
            before - (map.surface.vertices.rows() - own));
  map.uv32 = map.uv.cast<float>();
  certify::CertifyRequest request;
  request.measure_overlaps = false;
  certify::certify_map(map, crossed.surface, request, context);
  EXPECT_EQ(map.certificate.flips64, 0);
  // Seams still match up to rounding.
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces);
  const mesh::EdgeFlags cut = mesh::flag_edges(map.surface.faces, adjacency, map.cut_edges);
  const auto branches = seam_branches(map.surface.faces, adjacency, cut, crossed.cones, map.uv);
  EXPECT_LE(largest_seam_error(branches, adjacency, map.uv), 1e-9);
}

TEST(TakeBack, LeavesAMapOnTheInputsOwnTrianglesAlone) {
  const mesh::Surface surface = test::torus(12, 8);
  std::vector<Index> cones(96, 4);
  ExecutionContext context;
  PennerMap found = compute_penner_map(surface, cones, {}, {}, context);
  ASSERT_EQ(found.map.surface.vertices.rows(), 96);
  const Points2 uv = found.map.uv;
  take_back(surface, free_faces(surface), {}, 15, found.map, context);
  EXPECT_TRUE(found.map.uv == uv);
}

}  // namespace
}  // namespace flipfree::seamless::take_back_test
