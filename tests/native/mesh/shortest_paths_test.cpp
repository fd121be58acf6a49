#include "flipfree/mesh/shortest_paths.h"

#include <gtest/gtest.h>

#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::mesh::shortest_paths_test {
namespace {

std::vector<double> lengths(const Surface& surface) {
  std::vector<double> result;
  for (HalfedgeId h = 0; h < 3 * surface.faces.rows(); ++h) {
    result.push_back((surface.vertices.row(source(surface.faces, h)) -
                      surface.vertices.row(target(surface.faces, h)))
                         .norm());
  }
  return result;
}

using test::adjacency_of;

// Bellman and Ford: every edge relaxed until nothing changes.
std::vector<double> reference(const Surface& surface, const std::vector<double>& length,
                              const std::vector<VertexId>& sources) {
  std::vector<double> distance(static_cast<std::size_t>(surface.vertices.rows()),
                               ShortestPaths::kUnreached);
  for (const VertexId v : sources) distance[static_cast<std::size_t>(v)] = 0.0;
  for (bool changed = true; changed;) {
    changed = false;
    for (HalfedgeId h = 0; h < 3 * surface.faces.rows(); ++h) {
      double& a = distance[static_cast<std::size_t>(source(surface.faces, h))];
      double& b = distance[static_cast<std::size_t>(target(surface.faces, h))];
      const double l = length[static_cast<std::size_t>(h)];
      if (a + l < b) b = a + l, changed = true;
      if (b + l < a) a = b + l, changed = true;
    }
  }
  return distance;
}

TEST(ShortestPaths, agree_with_relaxing_every_edge_and_follow_their_arrivals) {
  const ExecutionContext context;
  for (const Surface& surface :
       {test::bumpy_grid(9, 7, 0.3, 5.0), test::torus(9, 7), test::cylinder(8, 5)}) {
    const Adjacency adjacency = adjacency_of(surface);
    const std::vector<double> length = lengths(surface);
    ShortestPaths paths(surface.faces, adjacency, length);
    std::vector<VertexId> sources;
    for (const VertexId v : {0, 17, 30}) {  // each brought up to date with those before
      sources.push_back(v);
      paths.add_source(v);
      paths.grow(context);
      const std::vector<double> expected = reference(surface, length, sources);
      for (VertexId w = 0; w < surface.vertices.rows(); ++w) {
        EXPECT_DOUBLE_EQ(paths.distance(w), expected[static_cast<std::size_t>(w)]);
        const HalfedgeId h = paths.arrival(w);
        if (h == kInvalid) {
          EXPECT_EQ(paths.distance(w), 0.0);
        } else {
          EXPECT_DOUBLE_EQ(paths.distance(paths.before(w)) + length[static_cast<std::size_t>(h)],
                           paths.distance(w));
        }
      }
    }
  }
}

}  // namespace
}  // namespace flipfree::mesh::shortest_paths_test
