#include "flipfree/mesh/cut_graph.h"

#include <gtest/gtest.h>

#include <algorithm>

#include <random>

#include "flipfree/mesh/topology.h"
#include "support/shapes.h"

namespace flipfree::mesh::map_cut_test {
namespace {

// Charts of the surface cut along `cut`; every one must be a disk with the cones on its boundary.
void expect_disks(const Surface& surface, const EdgeFlags& cut,
                  const std::vector<VertexId>& cones) {
  const Adjacency adjacency =
      build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  const CutMesh mesh = cut_along(surface.faces, adjacency, cut);
  for (const Chart& chart : split_into_charts(surface.vertices, mesh)) {
    const Adjacency own =
        build_adjacency(static_cast<Index>(chart.surface.vertices.rows()), chart.surface.faces);
    EXPECT_TRUE(topology(chart.surface.faces, own).is_disk());
  }
  const Adjacency cut_adjacency =
      build_adjacency(static_cast<Index>(mesh.vertex_origin.size()), mesh.faces);
  for (Index v = 0; v < static_cast<Index>(mesh.vertex_origin.size()); ++v) {
    const VertexId origin = mesh.vertex_origin[static_cast<std::size_t>(v)];
    if (std::find(cones.begin(), cones.end(), origin) == cones.end()) continue;
    const HalfedgeId h = cut_adjacency.vertex_halfedge[static_cast<std::size_t>(v)];
    EXPECT_EQ(cut_adjacency.opposite[static_cast<std::size_t>(h)], kInvalid) << "cone " << origin;
  }
}

TEST(MapCut, OpensEveryTopologyIntoDisksWithTheConesOnTheBoundary) {
  std::mt19937 random(2);
  for (const Surface& surface : {test::sphere(16, 12), test::torus(18, 10), test::cylinder(14, 8),
                                 test::grid(9, 7), test::tetrahedron()}) {
    const auto n = static_cast<Index>(surface.vertices.rows());
    const Adjacency adjacency = build_adjacency(n, surface.faces);
    const ExecutionContext context;
    for (const std::size_t count :
         {std::size_t{0}, std::size_t{1}, std::size_t{2}, std::size_t{7}}) {
      std::vector<VertexId> cones;
      for (std::size_t i = 0; i < count; ++i) {
        cones.push_back(static_cast<VertexId>(random() % static_cast<unsigned>(n)));
      }
      // A closed sphere with fewer than two cones stays closed: it has no flat metric either.
      if (count < 2 && topology(surface.faces, adjacency).euler() == 2) continue;
      std::sort(cones.begin(), cones.end());
      cones.erase(std::unique(cones.begin(), cones.end()), cones.end());
      if (cones.size() < 2 && count >= 2) continue;
      expect_disks(surface, cut_to_disks(surface, adjacency, {}, cones, {}, context), cones);
    }
  }
}

TEST(MapCut, GivenCutsStayAndConesOnThemNeedNothing) {
  const Surface surface = test::grid(10, 10);
  const Adjacency adjacency =
      build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  IndexPairs path(3, 2);
  path << 11 * 3 + 3, 11 * 3 + 4, 11 * 3 + 4, 11 * 3 + 5, 11 * 3 + 5, 11 * 3 + 6;
  const EdgeFlags given = flag_edges(surface.faces, adjacency, path);
  const ExecutionContext context;
  const EdgeFlags cut = cut_to_disks(surface, adjacency, given, {11 * 3 + 4}, {}, context);
  for (std::size_t h = 0; h < given.size(); ++h) EXPECT_LE(given[h], cut[h]);
  // The island of cuts is joined to the boundary once: three edges more.
  EXPECT_EQ(flagged_edges(surface.faces, adjacency, cut).rows(), 3 + 3);
  expect_disks(surface, cut, {11 * 3 + 4});
}

TEST(MapCut, AvoidedEdgesAreCutOnlyWhereThereIsNoOtherWay) {
  const Surface surface = test::torus(9, 7);
  const Adjacency adjacency =
      build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  const ExecutionContext context;
  const std::vector<VertexId> cones = {3, 40};
  const EdgeFlags first = cut_to_disks(surface, adjacency, {}, cones, {}, context);
  const EdgeFlags second = cut_to_disks(surface, adjacency, {}, cones, first, context);
  for (std::size_t h = 0; h < first.size(); ++h) EXPECT_FALSE(first[h] && second[h]);
  expect_disks(surface, second, cones);
  const EdgeFlags everything(first.size(), 1);
  expect_disks(surface, cut_to_disks(surface, adjacency, {}, cones, everything, context), cones);
}

}  // namespace
}  // namespace flipfree::mesh::map_cut_test
