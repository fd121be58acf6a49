#include "flipfree/mesh/cut_graph/fill.h"

#include <gtest/gtest.h>

#include "flipfree/mesh/topology.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::mesh::fill_test {
namespace {

using test::adjacency_of;

TEST(FillHoles, closes_the_given_loops_and_keeps_what_was_there) {
  Surface holed = test::torus(8, 6);
  holed.faces.row(10) = holed.faces.row(95).eval();
  holed.faces.conservativeResize(95, 3);
  holed.faces.row(40) = holed.faces.row(94).eval();
  holed.faces.conservativeResize(94, 3);
  for (const Surface& surface : {holed, test::grid(4, 3), test::cylinder(7, 2)}) {
    const auto loops = boundary_halfedge_loops(surface.faces, adjacency_of(surface));
    const Topology before = topology(surface.faces, adjacency_of(surface));
    for (std::size_t count = 0; count <= loops.size(); ++count) {
      const std::vector<std::vector<HalfedgeId>> some(
          loops.begin(), loops.begin() + static_cast<std::ptrdiff_t>(count));
      const Surface filled = fill_holes(surface, some).surface;
      const Eigen::Index n = surface.vertices.rows();
      EXPECT_EQ(filled.faces.topRows(surface.faces.rows()), surface.faces);
      EXPECT_EQ(filled.vertices.topRows(n), surface.vertices);
      ASSERT_EQ(filled.vertices.rows(), n + static_cast<Eigen::Index>(count));
      const Adjacency adjacency = adjacency_of(filled);
      const Topology after = topology(filled.faces, adjacency);
      EXPECT_EQ(after.boundary_loops, before.boundary_loops - static_cast<Index>(count));
      EXPECT_EQ(after.genus(), before.genus());
      // An edge twice in the same direction would have no opposite: with every face's orientation
      // that of its neighbours, the open edges are those of the loops left.
      std::size_t open = 0, expected = 0;
      for (const HalfedgeId o : adjacency.opposite) open += o == kInvalid;
      for (std::size_t i = count; i < loops.size(); ++i) expected += loops[i].size();
      EXPECT_EQ(open, expected);
      for (std::size_t i = 0; i < count; ++i) {
        Vector3 centre = Vector3::Zero();
        for (const HalfedgeId h : loops[i])
          centre += surface.vertices.row(source(surface.faces, h)).transpose();
        centre /= static_cast<double>(loops[i].size());
        EXPECT_LT(
            (filled.vertices.row(n + static_cast<Eigen::Index>(i)).transpose() - centre).norm(),
            1e-14);
      }
    }
  }
}

TEST(FillHoles, fans_turn_as_the_surface_does) {
  const Surface surface = test::grid(3, 3);
  const auto loops = boundary_halfedge_loops(surface.faces, adjacency_of(surface));
  const Surface filled = fill_holes(surface, loops).surface;
  const Adjacency adjacency = adjacency_of(filled);
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(adjacency.opposite.size()); ++h) {
    const HalfedgeId o = adjacency.opposite[static_cast<std::size_t>(h)];
    ASSERT_NE(o, kInvalid);
    EXPECT_EQ(source(filled.faces, h), target(filled.faces, o));
    EXPECT_EQ(target(filled.faces, h), source(filled.faces, o));
  }
}

}  // namespace
}  // namespace flipfree::mesh::fill_test
