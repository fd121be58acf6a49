#include "flipfree/seamless/exact/seamless_map.h"

#include <gtest/gtest.h>

#include "flipfree/base/error.h"
#include "support/shapes.h"

namespace flipfree::seamless {
namespace {

std::vector<Index> cones_of_a_torus(const mesh::Surface& surface) {
  std::vector<Index> cones(static_cast<std::size_t>(surface.vertices.rows()), 4);
  cones[0] = cones[20] = 3;
  cones[9] = cones[33] = 5;
  return cones;
}

TEST(SeamlessMap, seamsAreExactAndConesWherePrescribed) {
  const mesh::Surface surface = test::torus(12, 8);
  ExecutionContext context;
  const certify::Parametrization map =
      compute_seamless_map(surface, cones_of_a_torus(surface), {}, context);
  EXPECT_TRUE(map.certificate.ok);
  EXPECT_GT(map.certificate.seam_edges, 0);
  EXPECT_EQ(map.certificate.seams_exact32, map.certificate.seam_edges);
  EXPECT_EQ(map.certificate.cone_failures, 0);
  EXPECT_EQ(map.transitions.size(), static_cast<std::size_t>(map.cut_edges.rows()));
}

TEST(SeamlessMap, hasTheSameBitsForAnyNumberOfThreads) {
  const mesh::Surface surface = test::torus(12, 8);
  ExecutionContext one, three;
  one.threads = 1;
  three.threads = 3;
  const auto a = compute_seamless_map(surface, cones_of_a_torus(surface), {}, one);
  const auto b = compute_seamless_map(surface, cones_of_a_torus(surface), {}, three);
  EXPECT_TRUE(a.uv == b.uv);
  EXPECT_TRUE(a.uv32 == b.uv32);
}

TEST(SeamlessMap, endsWithItsTime) {
  const mesh::Surface surface = test::torus(60, 40);
  SeamlessOptions options;
  options.max_seconds = 1e-9;
  ExecutionContext context;
  try {
    compute_seamless_map(surface, cones_of_a_torus(surface), options, context);
    ADD_FAILURE() << "a nanosecond was enough";
  } catch (const NotConverged& error) {
    EXPECT_EQ(error.error().code, ErrorCode::kTimeLimit);
  }
}

}  // namespace
}  // namespace flipfree::seamless
