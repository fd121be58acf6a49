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

// A plate with a handle through it and three holes: corners are chosen, and every boundary edge
// runs along an axis in the stored values.
mesh::Surface plate_with_holes() {
  mesh::Surface surface = test::perforated_plate(1, 4);
  Triangles kept(surface.faces.rows(), 3);
  Eigen::Index count = 0;
  for (Eigen::Index f = 0; f < surface.faces.rows(); ++f) {
    if (f % 97 != 5) kept.row(count++) = surface.faces.row(f);
  }
  surface.faces = kept.topRows(count);
  return surface;
}

std::vector<Index> no_cones(const mesh::Surface& surface) {
  std::vector<Index> cones(static_cast<std::size_t>(surface.vertices.rows()), 4);
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(cones.size()), surface.faces);
  for (std::size_t h = 0; h < adjacency.opposite.size(); ++h) {
    if (adjacency.opposite[h] == kInvalid)
      cones[static_cast<std::size_t>(mesh::source(surface.faces, static_cast<HalfedgeId>(h)))] =
          kNotGiven;
  }
  return cones;
}

Index edges_off_axis(const certify::Parametrization& map) {
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces);
  Index off = 0;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency.opposite.size()); ++h) {
    if (adjacency.opposite[static_cast<std::size_t>(h)] != kInvalid) continue;
    const auto along = (map.uv32.row(next_corner(h)) - map.uv32.row(h)).eval();
    off += along[0] != 0.0F && along[1] != 0.0F ? 1 : 0;
  }
  return off;
}

TEST(SeamlessMap, alignedBoundariesRunAlongTheAxesExactly) {
  const mesh::Surface surface = plate_with_holes();
  auto cones = no_cones(surface);
  // Small triangular holes have three vertices: two straight ones are asked for nowhere.
  ExecutionContext context;
  const certify::Parametrization map = compute_seamless_map(surface, cones, {}, context);
  EXPECT_TRUE(map.certificate.ok);
  EXPECT_EQ(map.certificate.seams_exact32, map.certificate.seam_edges);
  EXPECT_EQ(edges_off_axis(map), 0);
}

TEST(SeamlessMap, freeBoundariesKeepTheirShape) {
  const mesh::Surface surface = plate_with_holes();
  SeamlessOptions options;
  options.boundary = Boundary::kFree;
  ExecutionContext context;
  const certify::Parametrization map =
      compute_seamless_map(surface, no_cones(surface), options, context);
  EXPECT_TRUE(map.certificate.ok);
  EXPECT_EQ(map.certificate.seams_exact32, map.certificate.seam_edges);
  EXPECT_GT(edges_off_axis(map), 0);
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
