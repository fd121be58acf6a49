#include "flipfree/embedding/tutte/tutte.h"

#include <gtest/gtest.h>

#include "flipfree/embedding/disk/disk.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/topology.h"
#include "support/shapes.h"

namespace flipfree::embedding::tutte_test {
namespace {

struct Disk {
  mesh::Surface surface;
  std::vector<VertexId> loop;
  Points2 circle;
};

Disk disk(Index columns, Index rows) {
  Disk d;
  d.surface = test::bumpy_grid(columns, rows, 0.2, 3.0);
  const auto adjacency =
      mesh::build_adjacency(static_cast<Index>(d.surface.vertices.rows()), d.surface.faces);
  d.loop = mesh::boundary_loops(d.surface.faces, adjacency).front();
  const std::vector<double> lengths(d.loop.size(), 1.0);
  d.circle = place_boundary(BoundaryShape::kCircle, lengths).positions;
  return d;
}

TEST(Tutte, UniformMapOfAGridOntoTheCircleHasNoFlips) {
  const Disk d = disk(20, 13);
  ExecutionContext context;
  const auto n = static_cast<Index>(d.surface.vertices.rows());
  const Points2 uv = tutte_uniform(d.surface.faces, n, d.loop, d.circle, context);
  EXPECT_EQ(count_flips(d.surface.faces, uv, context), 0U);
  EXPECT_TRUE(find_flips(d.surface.faces, uv).empty());
  for (std::size_t i = 0; i < d.loop.size(); ++i) {
    EXPECT_EQ(uv.row(d.loop[i]), d.circle.row(static_cast<Index>(i)));
  }
}

TEST(Tutte, EveryInnerVertexIsTheMeanOfItsNeighbours) {
  const Disk d = disk(9, 7);
  ExecutionContext context;
  const auto n = static_cast<Index>(d.surface.vertices.rows());
  const Points2 uv = tutte_uniform(d.surface.faces, n, d.loop, d.circle, context);
  Points2 sum = Points2::Zero(n, 2);
  Eigen::VectorXd count = Eigen::VectorXd::Zero(n);
  for (HalfedgeId h = 0; h < d.surface.faces.size(); ++h) {
    sum.row(mesh::source(d.surface.faces, h)) += uv.row(mesh::target(d.surface.faces, h));
    count(mesh::source(d.surface.faces, h)) += 1;
  }
  for (const VertexId v : d.loop) count(v) = 0;
  for (Index v = 0; v < n; ++v) {
    if (count(v) > 0) {
      EXPECT_LT((sum.row(v) / count(v) - uv.row(v)).norm(), 1e-13);
    }
  }
}

TEST(Tutte, MeanValueWeightsReproduceADrawing) {
  const Disk d = disk(12, 12);
  ExecutionContext context;
  const auto n = static_cast<Index>(d.surface.vertices.rows());
  const Points2 drawing = tutte_uniform(d.surface.faces, n, d.loop, d.circle, context);
  const Points2 again = tutte_mean_value(d.surface.faces, drawing, d.loop, d.circle, context);
  EXPECT_LT((again - drawing).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(Tutte, MeanValueMapOfASurfaceHasNoFlips) {
  const Disk d = disk(17, 23);
  ExecutionContext context;
  const Points2 uv =
      tutte_mean_value(d.surface.faces, d.surface.vertices, d.loop, d.circle, context);
  EXPECT_EQ(count_flips(d.surface.faces, uv, context), 0U);
}

}  // namespace
}  // namespace flipfree::embedding::tutte_test
