#include "flipfree/seamless/exact/seamless_map.h"

#include <gtest/gtest.h>

#include <array>
#include <vector>

#include "flipfree/base/error.h"
#include "support/shapes.h"

namespace flipfree::seamless::seamless_map_test {
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

// A disk of the faces near the middle of a grid: its border has steps and triangles that stick out.
mesh::Surface ragged_disk(Index size) {
  const mesh::Surface grid = test::bumpy_grid(size, size, 0.05, 3.0);
  mesh::Surface disk;
  std::vector<VertexId> number(static_cast<std::size_t>(grid.vertices.rows()), kInvalid);
  std::vector<std::array<Index, 3>> faces;
  Index count = 0;
  const Vector3 middle = grid.vertices.colwise().mean();
  const double radius = 0.45 * (grid.vertices.col(0).maxCoeff() - grid.vertices.col(0).minCoeff());
  for (Eigen::Index f = 0; f < grid.faces.rows(); ++f) {
    Vector3 centre = Vector3::Zero();
    for (int k = 0; k < 3; ++k) centre += grid.vertices.row(grid.faces(f, k)).transpose() / 3.0;
    if ((centre - middle).head<2>().norm() > radius) continue;
    auto& face = faces.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      VertexId& v = number[static_cast<std::size_t>(grid.faces(f, static_cast<Index>(k)))];
      if (v == kInvalid) v = count++;
      face[k] = v;
    }
  }
  disk.vertices.resize(count, 3);
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] != kInvalid)
      disk.vertices.row(number[v]) = grid.vertices.row(static_cast<Eigen::Index>(v));
  }
  disk.faces.resize(static_cast<Eigen::Index>(faces.size()), 3);
  for (std::size_t f = 0; f < faces.size(); ++f)
    disk.faces.row(static_cast<Eigen::Index>(f)) << faces[f][0], faces[f][1], faces[f][2];
  return disk;
}

TEST(SeamlessMap, raggedBordersAreAlignedWithModerateDistortion) {
  for (const Index size : {12, 20, 33}) {
    const mesh::Surface surface = ragged_disk(size);
    ExecutionContext context;
    const certify::Parametrization map =
        compute_seamless_map(surface, no_cones(surface), {}, context);
    EXPECT_TRUE(map.certificate.ok);
    EXPECT_EQ(edges_off_axis(map), 0);
    EXPECT_LT(map.certificate.energy, 1.5) << size;
    EXPECT_EQ(map.certificate.provenance_failures, 0);
  }
}

// Two parts: a grid, and a triangle whose three vertices leave no room for four corners.
mesh::Surface sheet_and_triangle() {
  mesh::Surface surface = test::grid(4, 4);
  const Eigen::Index n = surface.vertices.rows(), m = surface.faces.rows();
  surface.vertices.conservativeResize(n + 3, 3);
  surface.vertices.bottomRows(3) << 9, 0, 0, 10, 0, 0, 9, 1, 0;
  surface.faces.conservativeResize(m + 1, 3);
  surface.faces.row(m) << static_cast<Index>(n), static_cast<Index>(n + 1),
      static_cast<Index>(n + 2);
  return surface;
}

TEST(SeamlessMap, partsThatCannotBeAlignedAreFreeIfTheCallerAllowsIt) {
  const mesh::Surface surface = sheet_and_triangle();
  ExecutionContext context;
  EXPECT_THROW(compute_seamless_map(surface, no_cones(surface), {}, context), Infeasible);
  SeamlessOptions options;
  options.boundary = Boundary::kAlignedOrFree;
  const certify::Parametrization map =
      compute_seamless_map(surface, no_cones(surface), options, context);
  EXPECT_TRUE(map.certificate.ok);
  EXPECT_EQ(std::get<std::int64_t>(map.stats.at("freed_boundaries")), 1);
  EXPECT_GT(edges_off_axis(map), 0);  // the hypotenuse, if not more
  // What can be aligned is, with nothing to say about it.
  const mesh::Surface sheet = test::grid(4, 4);
  const certify::Parametrization straight =
      compute_seamless_map(sheet, no_cones(sheet), options, context);
  EXPECT_EQ(straight.stats.count("freed_boundaries"), 0U);
  EXPECT_EQ(edges_off_axis(straight), 0);
}

TEST(SeamlessMap, cornersThatAreGivenAreNeverFreed) {
  const mesh::Surface surface = sheet_and_triangle();
  std::vector<Index> cones = no_cones(surface);
  for (std::size_t v = cones.size() - 3; v < cones.size(); ++v) cones[v] = 1;
  SeamlessOptions options;
  options.boundary = Boundary::kAlignedOrFree;
  ExecutionContext context;
  EXPECT_THROW(compute_seamless_map(surface, cones, options, context), Infeasible);
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
}  // namespace flipfree::seamless::seamless_map_test
