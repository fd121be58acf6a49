#include "flipfree/mesh/topology.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "flipfree/base/error.h"
#include "flipfree/mesh/cut_graph/cut.h"
#include "flipfree/mesh/cut_graph/cut_graph.h"
#include "support/shapes.h"

namespace flipfree::mesh {
namespace {

Adjacency adjacency_of(const Surface& surface) {
  return build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
}

Topology topology_of(const Surface& surface) {
  return topology(surface.faces, adjacency_of(surface));
}

TEST(Adjacency, opposite_is_an_involution_between_reversed_halfedges) {
  for (const Surface& surface : {test::grid(5, 4), test::torus(7, 6), test::sphere(6, 4)}) {
    const Adjacency adjacency = adjacency_of(surface);
    for (HalfedgeId h = 0; h < 3 * surface.faces.rows(); ++h) {
      const HalfedgeId o = adjacency.opposite[static_cast<std::size_t>(h)];
      if (o == kInvalid) continue;
      EXPECT_EQ(adjacency.opposite[static_cast<std::size_t>(o)], h);
      EXPECT_EQ(source(surface.faces, h), target(surface.faces, o));
      EXPECT_EQ(target(surface.faces, h), source(surface.faces, o));
    }
  }
}

TEST(Adjacency, rotation_from_the_stored_halfedge_visits_the_whole_fan) {
  const Surface surface = test::grid(4, 3);
  const Adjacency adjacency = adjacency_of(surface);
  std::vector<Index> degree(static_cast<std::size_t>(surface.vertices.rows()), 0);
  for (const VertexId v : surface.faces.reshaped()) ++degree[static_cast<std::size_t>(v)];
  for (VertexId v = 0; v < surface.vertices.rows(); ++v) {
    const HalfedgeId start = adjacency.vertex_halfedge[static_cast<std::size_t>(v)];
    Index fan = 0;
    for (HalfedgeId h = start; h != kInvalid && (fan == 0 || h != start);
         h = rotate_ccw(adjacency, h))
      ++fan;
    EXPECT_EQ(fan, degree[static_cast<std::size_t>(v)]);
  }
}

TEST(Topology, counts_loops_genus_and_components) {
  const Topology disk = topology_of(test::grid(3, 3));
  EXPECT_TRUE(disk.is_disk());
  EXPECT_EQ(disk.genus(), 0);
  const Topology sphere = topology_of(test::sphere(8, 6));
  EXPECT_EQ(sphere.boundary_loops, 0);
  EXPECT_EQ(sphere.genus(), 0);
  EXPECT_EQ(sphere.euler(), 2);
  const Topology torus = topology_of(test::torus(8, 6));
  EXPECT_EQ(torus.genus(), 1);
  const Topology tube = topology_of(test::cylinder(8, 2));
  EXPECT_EQ(tube.boundary_loops, 2);
  EXPECT_EQ(tube.genus(), 0);
}

TEST(BoundaryLoops, run_with_the_surface_on_the_left) {
  const Surface surface = test::grid(2, 1);
  const auto loops = boundary_loops(surface.faces, adjacency_of(surface));
  ASSERT_EQ(loops.size(), 1U);
  EXPECT_EQ(loops[0], (std::vector<VertexId>{0, 1, 2, 5, 4, 3}));
}

TEST(CutAlong, a_ring_around_a_torus_leaves_a_tube) {
  const Surface surface = test::torus(6, 5);
  const Adjacency adjacency = adjacency_of(surface);
  IndexPairs ring(6, 2);
  for (Index i = 0; i < 6; ++i) ring.row(i) << i, (i + 1) % 6;
  const EdgeFlags flags = flag_edges(surface.faces, adjacency, ring);
  EXPECT_EQ(flagged_edges(surface.faces, adjacency, flags).rows(), 6);
  const CutMesh cut = cut_along(surface.faces, adjacency, flags);
  const auto charts = split_into_charts(surface.vertices, cut);
  ASSERT_EQ(charts.size(), 1U);
  const Topology tube = topology_of(charts[0].surface);
  EXPECT_EQ(tube.boundary_loops, 2);
  EXPECT_EQ(tube.genus(), 0);
  EXPECT_EQ(tube.vertices, surface.vertices.rows() + 6);
  for (std::size_t v = 0; v < cut.vertex_origin.size(); ++v)
    EXPECT_LT(cut.vertex_origin[v], surface.vertices.rows());
}

TEST(CutAlong, nothing_cut_keeps_one_vertex_per_vertex) {
  const Surface surface = test::sphere(7, 5);
  const Adjacency adjacency = adjacency_of(surface);
  const CutMesh cut = cut_along(surface.faces, adjacency, EdgeFlags(adjacency.opposite.size(), 0));
  EXPECT_EQ(static_cast<Eigen::Index>(cut.vertex_origin.size()), surface.vertices.rows());
  for (Eigen::Index f = 0; f < surface.faces.rows(); ++f) {
    for (Index k = 0; k < 3; ++k) {
      EXPECT_EQ(cut.vertex_origin[static_cast<std::size_t>(cut.faces(f, k))], surface.faces(f, k));
    }
  }
}

TEST(FlagEdges, names_the_pair_that_is_no_edge) {
  const Surface surface = test::grid(3, 3);
  IndexPairs pairs(2, 2);
  pairs << 0, 1, 0, 15;
  try {
    flag_edges(surface.faces, adjacency_of(surface), pairs);
    FAIL();
  } catch (const InvalidInput& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kNotAnEdge);
    EXPECT_EQ(e.error().elements, (std::vector<Index>{0, 15}));
  }
}

TEST(UvCuts, welding_back_finds_exactly_the_cut) {
  const Surface surface = test::sphere(9, 6);
  const Adjacency adjacency = adjacency_of(surface);
  IndexPairs path(3, 2);
  path << 0, 2, 2, 11, 11, 20;
  const EdgeFlags flags = flag_edges(surface.faces, adjacency, path);
  const CutMesh cut = cut_along(surface.faces, adjacency, flags);
  // One distinct value per cut vertex: the cut can be read off the corners.
  Points2 uv(3 * surface.faces.rows(), 2);
  for (CornerId c = 0; c < uv.rows(); ++c) uv.row(c) << cut.faces(c / 3, c % 3), 0.5;
  EXPECT_EQ(uv_cuts(adjacency, uv), flags);
}

void expect_planar_after_cut(const Surface& surface) {
  const ExecutionContext context;
  const Adjacency adjacency = adjacency_of(surface);
  const EdgeFlags graph = planar_cut(surface, adjacency, context);
  const auto charts =
      split_into_charts(surface.vertices, cut_along(surface.faces, adjacency, graph));
  ASSERT_EQ(charts.size(), 1U);
  const Topology open = topology_of(charts[0].surface);
  EXPECT_EQ(open.genus(), 0);
  EXPECT_GE(open.boundary_loops, 1);
}

TEST(PlanarCut, opens_spheres_tori_and_their_punctured_versions) {
  expect_planar_after_cut(test::sphere(12, 9));
  expect_planar_after_cut(test::torus(9, 7));
  expect_planar_after_cut(test::tetrahedron());
  Surface punctured = test::torus(12, 10);
  punctured.faces = Triangles(punctured.faces.bottomRows(punctured.faces.rows() - 1));
  expect_planar_after_cut(punctured);
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
    const auto charts =
        split_into_charts(surface.vertices, cut_along(surface.faces, adjacency, graph));
    ASSERT_EQ(charts.size(), 1U);
    EXPECT_EQ(topology_of(charts[0].surface).genus(), 0);
    EXPECT_GE(topology_of(charts[0].surface).boundary_loops, 1);
  }
}

TEST(PlanarCut, passes_through_avoided_vertices_only_where_there_is_no_other_way) {
  const ExecutionContext context;
  for (const Surface& surface :
       {test::torus(9, 7), test::sphere(12, 9), test::tetrahedron(), test::sphere(4, 3)}) {
    const Adjacency adjacency = adjacency_of(surface);
    const auto through = [&](const std::vector<char>& avoided) {
      const EdgeFlags graph = planar_cut(surface, adjacency, context, {}, avoided);
      const auto charts =
          split_into_charts(surface.vertices, cut_along(surface.faces, adjacency, graph));
      EXPECT_EQ(charts.size(), 1U);
      EXPECT_EQ(topology_of(charts[0].surface).genus(), 0);
      EXPECT_GE(topology_of(charts[0].surface).boundary_loops, 1);
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

TEST(PlanarCut, leaves_planar_surfaces_alone) {
  const ExecutionContext context;
  const Surface surface = test::cylinder(8, 3);
  const EdgeFlags graph = planar_cut(surface, adjacency_of(surface), context);
  EXPECT_EQ(std::count(graph.begin(), graph.end(), 1), 0);
}

TEST(PlanarCut, of_a_torus_is_not_much_longer_than_its_two_shortest_loops) {
  const Surface surface = test::torus(60, 30, 0.4);
  const ExecutionContext context;
  const Adjacency adjacency = adjacency_of(surface);
  const IndexPairs edges =
      flagged_edges(surface.faces, adjacency, planar_cut(surface, adjacency, context));
  double length = 0.0;
  for (Eigen::Index i = 0; i < edges.rows(); ++i) {
    length += (surface.vertices.row(edges(i, 0)) - surface.vertices.row(edges(i, 1))).norm();
  }
  // 2 pi 0.4 around the tube and 2 pi 0.6 along the inner equator.
  EXPECT_LT(length, 1.6 * 2.0 * 3.15 * (0.4 + 0.6));
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
}  // namespace flipfree::mesh
