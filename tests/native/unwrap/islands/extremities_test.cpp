#include "flipfree/unwrap/islands/scale_field.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "flipfree/mesh/topology.h"
#include "flipfree/unwrap/islands/islands.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::extremities_test {
namespace {

using test::adjacency_of;

std::vector<VertexId> ends_of(const mesh::Surface& surface, const mesh::EdgeFlags& cut) {
  std::vector<VertexId> vertices;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut.size()); ++h) {
    if (cut[static_cast<std::size_t>(h)]) vertices.push_back(mesh::source(surface.faces, h));
  }
  return vertices;
}

TEST(Extremities, a_closed_tube_is_slit_from_its_rim_to_its_tip) {
  const mesh::Surface tube = test::tube(8, 12);
  ExecutionContext context;
  const mesh::EdgeFlags cut = cut_to_extremities(tube, adjacency_of(tube), {}, context);
  const std::vector<VertexId> ends = ends_of(tube, cut);
  const auto tip = static_cast<VertexId>(tube.vertices.rows() - 1);
  EXPECT_EQ(std::count(ends.begin(), ends.end(), tip), 1);
  EXPECT_EQ(std::count(cut.begin(), cut.end(), 1), 2 * 12);  // one edge for each ring
}

TEST(Extremities, slits_leave_one_planar_piece) {
  const mesh::Surface sphere = test::sphere(12, 9);
  mesh::Surface spiky = sphere;
  for (Eigen::Index v = 0; v < spiky.vertices.rows(); ++v) {
    // Eight horns along the diagonals.
    const Vector3 p = spiky.vertices.row(v);
    const double along = p.cwiseAbs().minCoeff() * std::sqrt(3.0);
    spiky.vertices.row(v) *= 1.0 + 12.0 * std::pow(along, 8.0);
  }
  ExecutionContext context;
  const mesh::Adjacency adjacency = adjacency_of(spiky);
  const mesh::EdgeFlags none(adjacency.opposite.size(), 0);
  const Islands plain = make_islands(spiky, adjacency, none, {}, false, context);
  const Islands slit = make_islands(spiky, adjacency, none, {}, true, context);
  EXPECT_GT(std::count(slit.added.begin(), slit.added.end(), 1),
            std::count(plain.added.begin(), plain.added.end(), 1));
  ASSERT_EQ(slit.charts.size(), 1U);
  const mesh::Surface& chart = slit.charts[0].surface;
  const mesh::Topology shape = mesh::topology(chart.faces, adjacency_of(chart));
  EXPECT_EQ(shape.genus(), 0);
  EXPECT_EQ(shape.boundary_loops, 1);
}

TEST(Extremities, a_sphere_and_a_bumpy_sheet_need_no_slit) {
  ExecutionContext context;
  const mesh::Surface sheet = test::bumpy_grid(20, 20, 0.1, 3.0);
  const mesh::EdgeFlags cut = cut_to_extremities(sheet, adjacency_of(sheet), {}, context);
  EXPECT_EQ(std::count(cut.begin(), cut.end(), 1), 0);
  const mesh::Surface sphere = test::sphere(24, 16);
  const mesh::Adjacency adjacency = adjacency_of(sphere);
  const mesh::EdgeFlags none(adjacency.opposite.size(), 0);
  EXPECT_EQ(make_islands(sphere, adjacency, none, {}, true, context).added,
            make_islands(sphere, adjacency, none, {}, false, context).added);
}

TEST(Extremities, islands_that_seams_opened_are_left_alone) {
  const mesh::Surface tube = test::tube(8, 12);
  ExecutionContext context;
  const mesh::Adjacency adjacency = adjacency_of(tube);
  const mesh::EdgeFlags none(adjacency.opposite.size(), 0);
  const Islands islands = make_islands(tube, adjacency, none, {}, true, context);
  EXPECT_EQ(islands.opened, 0);
  EXPECT_EQ(islands.added, none);
}

TEST(Extremities, edges_that_must_not_be_cut_are_avoided) {
  const mesh::Surface tube = test::tube(8, 12);
  const mesh::Adjacency adjacency = adjacency_of(tube);
  ExecutionContext context;
  const mesh::EdgeFlags free = cut_to_extremities(tube, adjacency, {}, context);
  // Forbid the slit that it chooses, edge for edge: it takes another way to the tip.
  const mesh::EdgeFlags other = cut_to_extremities(tube, adjacency, free, context);
  EXPECT_GT(std::count(other.begin(), other.end(), 1), 0);
  for (std::size_t h = 0; h < free.size(); ++h) EXPECT_FALSE(free[h] && other[h]);
}

}  // namespace
}  // namespace flipfree::unwrap::extremities_test
