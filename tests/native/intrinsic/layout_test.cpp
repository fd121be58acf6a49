// Flat surfaces are laid out as they are, whatever was flipped on the way.
#include "flipfree/intrinsic/layout/layout.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "flipfree/mesh/cut_graph.h"
#include "support/flipped_metrics.h"
#include "support/shapes.h"

namespace flipfree::intrinsic::layout_test {
namespace {

// Its triangulation is far from Delaunay.
mesh::Surface sheared_grid() {
  mesh::Surface surface = test::grid(6, 5);
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(-0.02, 0.02);
  for (Eigen::Index v = 0; v < surface.vertices.rows(); ++v) {
    const double x = surface.vertices(v, 0), y = surface.vertices(v, 1);
    surface.vertices.row(v) << x + 1.3 * y + uniform(random), y + uniform(random), 0.0;
  }
  return surface;
}

MetricLayout lay_out(const mesh::Surface& surface, const FlippedMetric& metric,
                     Refinement refinement, const mesh::EdgeFlags& cuts) {
  ExecutionContext context;
  const mesh::Adjacency adjacency = mesh::build_adjacency(surface);
  const MetricOverlay overlay = overlay_metric(metric, nullptr, adjacency, kMaxCrossings, context);
  return lay_out_metric(surface, adjacency, overlay, cuts, refinement, context);
}

// Every triangle of the map is the surface's at one scale.
void expect_isometric(const mesh::Surface& surface, const Points2& uv, double tolerance) {
  double scale = 0.0;
  for (Index f = 0; f < static_cast<Index>(surface.faces.rows()); ++f) {
    for (Index k = 0; k < 3; ++k) {
      const double on_surface = (surface.vertices.row(surface.faces(f, k)) -
                                 surface.vertices.row(surface.faces(f, (k + 1) % 3)))
                                    .norm();
      const double in_plane = (uv.row(3 * f + k) - uv.row(3 * f + (k + 1) % 3)).norm();
      if (scale == 0.0) scale = in_plane / on_surface;
      EXPECT_NEAR(in_plane, scale * on_surface, tolerance);
    }
  }
}

TEST(LayOutMetric, AFlatDiskComesOutAsItIsWithoutAddedVertices) {
  const mesh::Surface surface = sheared_grid();
  const std::vector<double> u(static_cast<std::size_t>(surface.vertices.rows()), 0.0);
  const FlippedMetric metric = test::scaled_metric(surface, u);
  ASSERT_GT(metric.euclidean_flips, 10u);
  const mesh::EdgeFlags none(static_cast<std::size_t>(3 * surface.faces.rows()), 0);
  const MetricLayout layout = lay_out(surface, metric, Refinement::kAuto, none);
  EXPECT_EQ(layout.chart_count, 1);
  EXPECT_TRUE(layout.too_small.empty());
  EXPECT_EQ(layout.map.surface.faces, surface.faces);
  EXPECT_EQ(layout.cut_edges.rows(), 0);
  EXPECT_LT(layout.closing_error, 1e-12);
  EXPECT_EQ(find_broken_invariant(surface, layout.map), "");
  expect_isometric(surface, layout.map.uv, 1e-12);
  EXPECT_GE(layout.map.uv.minCoeff(), -1e-12);
  EXPECT_LE(layout.map.uv.maxCoeff(), 1.0 + 1e-12);
}

TEST(LayOutMetric, FullRefinementHasEveryCrossingAndKeepsTheShape) {
  const mesh::Surface surface = sheared_grid();
  const std::vector<double> u(static_cast<std::size_t>(surface.vertices.rows()), 0.0);
  const FlippedMetric metric = test::scaled_metric(surface, u);
  const mesh::EdgeFlags none(static_cast<std::size_t>(3 * surface.faces.rows()), 0);
  const MetricLayout layout = lay_out(surface, metric, Refinement::kFull, none);
  EXPECT_GT(layout.map.surface.vertices.rows(), surface.vertices.rows() + 10);
  EXPECT_EQ(find_broken_invariant(surface, layout.map), "");
  expect_isometric(layout.map.surface, layout.map.uv, 1e-12);
}

TEST(LayOutMetric, ATetrahedronIsCutOpenAtItsCones) {
  // Scaled by nothing: four cones of angle pi, on the cut; the faces come out equilateral.
  const mesh::Surface surface = test::tetrahedron();
  const mesh::Adjacency adjacency = mesh::build_adjacency(4, surface.faces);
  const ExecutionContext context;
  const mesh::EdgeFlags cuts =
      mesh::cut_to_disks(surface, adjacency, {}, {0, 1, 2, 3}, {}, context);
  EXPECT_EQ(mesh::find_broken_disks(surface, adjacency, cuts, {0, 1, 2, 3}), "");
  const MetricLayout layout = lay_out(
      surface, test::scaled_metric(surface, std::vector<double>(4, 0.0)), Refinement::kAuto, cuts);
  EXPECT_EQ(layout.chart_count, 1);
  EXPECT_EQ(layout.cut_edges.rows(), 3);
  expect_isometric(surface, layout.map.uv, 1e-14);
}

}  // namespace
}  // namespace flipfree::intrinsic::layout_test
