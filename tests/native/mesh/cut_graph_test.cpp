#include "flipfree/mesh/cut_graph.h"

#include <gtest/gtest.h>

#include "flipfree/base/error.h"
#include "flipfree/mesh/topology.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::mesh::cut_graph_test {
namespace {

using test::adjacency_of;

Topology topology_of(const Surface& surface) {
  return topology(surface.faces, adjacency_of(surface));
}

// Cut along the graph, the surface is one piece in the plane.
void expect_planar(const Surface& surface, const EdgeFlags& graph) {
  const auto charts =
      split_into_charts(surface.vertices, cut_along(surface.faces, adjacency_of(surface), graph));
  ASSERT_EQ(charts.size(), 1U);
  const Topology open = topology_of(charts[0].surface);
  EXPECT_EQ(open.genus(), 0);
  EXPECT_GE(open.boundary_loops, 1);
}

TEST(PlanarCut, opens_spheres_tori_and_their_punctured_versions) {
  for (const Surface& surface :
       {test::sphere(12, 9), test::torus(9, 7), test::tetrahedron(),
        test::faces_where(test::torus(12, 10), [](FaceId f) { return f > 0; })})
    expect_planar(surface, planar_cut(surface, adjacency_of(surface), ExecutionContext()));
}

TEST(PlanarCut, refuses_uncuttable_edges_that_leave_no_way) {
  const ExecutionContext context;
  for (const Surface& surface : {test::tetrahedron(), test::torus(9, 7)}) {
    const Adjacency adjacency = adjacency_of(surface);
    EdgeFlags uncuttable(adjacency.opposite.size(), 1);
    EXPECT_THROW(planar_cut(surface, adjacency, context, uncuttable), InvalidInput);
    uncuttable[0] = uncuttable[static_cast<std::size_t>(adjacency.opposite[0])] = 0;
    EXPECT_THROW(planar_cut(surface, adjacency, context, uncuttable), InvalidInput);
  }
}

TEST(PlanarCut, avoids_the_diagonals_of_polygons) {
  const ExecutionContext context;
  for (const Surface& surface : {test::torus(9, 7), test::sphere(12, 9)}) {
    const Adjacency adjacency = adjacency_of(surface);
    const EdgeFlags free_graph = planar_cut(surface, adjacency, context);
    // Pair triangles to quads greedily, first across the edges that the free graph would use.
    EdgeFlags diagonals(adjacency.opposite.size(), 0);
    std::vector<char> paired(static_cast<std::size_t>(surface.faces.rows()), 0);
    for (const bool used : {true, false}) {
      for (std::size_t h = 0; h < diagonals.size(); ++h) {
        const auto o = static_cast<std::size_t>(adjacency.opposite[h]);
        if ((free_graph[h] != 0) != used || paired[h / 3] || paired[o / 3]) continue;
        paired[h / 3] = paired[o / 3] = 1;
        diagonals[h] = diagonals[o] = 1;
      }
    }
    const EdgeFlags graph = planar_cut(surface, adjacency, context, diagonals);
    for (std::size_t h = 0; h < graph.size(); ++h) EXPECT_FALSE(graph[h] && diagonals[h]);
    expect_planar(surface, graph);
  }
}

TEST(PlanarCut, passes_through_avoided_vertices_only_where_there_is_no_other_way) {
  const ExecutionContext context;
  for (const Surface& surface :
       {test::torus(9, 7), test::sphere(12, 9), test::tetrahedron(), test::sphere(4, 3)}) {
    const Adjacency adjacency = adjacency_of(surface);
    const auto through = [&](const std::vector<char>& avoided) {
      const EdgeFlags graph = planar_cut(surface, adjacency, context, {}, avoided);
      expect_planar(surface, graph);
      std::vector<int> degree(avoided.size(), 0);
      for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(graph.size()); ++h)
        degree[static_cast<std::size_t>(source(surface.faces, h))] +=
            graph[static_cast<std::size_t>(h)];
      int crossed = 0;
      for (std::size_t v = 0; v < avoided.size(); ++v) crossed += avoided[v] && degree[v] > 1;
      return crossed;
    };
    const auto vertices = static_cast<std::size_t>(surface.vertices.rows());
    for (std::size_t v = 0; v < vertices; ++v) {
      std::vector<char> avoided(vertices, 0);
      avoided[v] = 1;
      EXPECT_EQ(through(avoided), 0) << "vertex " << v << " of " << vertices;
    }
    EXPECT_GT(through(std::vector<char>(vertices, 1)), 0);
  }
}

TEST(PlanarCut, lengths_beyond_doubles_and_lengths_that_vanish_leave_one_planar_piece) {
  // Tori with two holes; all shortest paths tie where lengths vanish.
  Surface surface = test::torus(6, 5);
  surface.faces.row(20) = surface.faces.row(58).eval();
  surface.faces.conservativeResize(58, 3);
  const Adjacency adjacency = adjacency_of(surface);
  ASSERT_EQ(topology_of(surface).boundary_loops, 2);
  const ExecutionContext context;
  for (const double unit : {1e-200, 1.0, 1e200, 1e307}) {
    SCOPED_TRACE(unit);
    Surface scaled = surface;
    scaled.vertices *= unit;
    // One vertex far away makes all other lengths vanish.
    for (const bool thrown : {false, true}) {
      if (thrown) scaled.vertices(0, 0) = 1e300;
      const EdgeFlags graph = planar_cut(scaled, adjacency, context);
      const CutMesh cut = cut_along(scaled.faces, adjacency, graph);
      const Topology t = topology(
          cut.faces, build_adjacency(static_cast<Index>(cut.vertex_origin.size()), cut.faces));
      EXPECT_EQ(t.components, 1);
      EXPECT_EQ(t.genus(), 0);
    }
  }
}

}  // namespace
}  // namespace flipfree::mesh::cut_graph_test
