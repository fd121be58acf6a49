#include "flipfree/mesh/adjacency.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::mesh::adjacency_test {
namespace {

using test::adjacency_of;

// Every half-edge's partner from a table of all vertex pairs, on meshes with holes whose faces,
// corners and vertices come in any order.
TEST(Adjacency, agrees_with_a_table_of_all_pairs_whatever_the_order) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    std::mt19937 random(seed);
    Surface surface = seed % 2 == 0 ? test::torus(6, 5) : test::sphere(7, 5);
    const auto n = static_cast<Index>(surface.vertices.rows());
    std::vector<VertexId> rename(static_cast<std::size_t>(n));
    for (VertexId v = 0; v < n; ++v) rename[static_cast<std::size_t>(v)] = v;
    std::shuffle(rename.begin(), rename.end(), random);
    std::vector<std::array<VertexId, 3>> kept;
    // Every third face of a random choice goes; vertices may be left where two fans meet.
    for (Index f = 0; f < surface.faces.rows(); ++f) {
      if (random() % 10 == 0) continue;
      const Index turn = static_cast<Index>(random() % 3);
      std::array<VertexId, 3> face{};
      for (Index k = 0; k < 3; ++k)
        face[static_cast<std::size_t>(k)] =
            rename[static_cast<std::size_t>(surface.faces(f, (k + turn) % 3))];
      kept.push_back(face);
    }
    std::shuffle(kept.begin(), kept.end(), random);
    Triangles faces(static_cast<Eigen::Index>(kept.size()), 3);
    std::map<std::pair<VertexId, VertexId>, HalfedgeId> halfedge;
    for (std::size_t f = 0; f < kept.size(); ++f) {
      for (std::size_t k = 0; k < 3; ++k) {
        faces(static_cast<Eigen::Index>(f), static_cast<Eigen::Index>(k)) = kept[f][k];
        halfedge[{kept[f][k], kept[f][(k + 1) % 3]}] = static_cast<HalfedgeId>(3 * f + k);
      }
    }
    const Adjacency adjacency = build_adjacency(n, faces);
    ASSERT_EQ(adjacency.opposite.size(), 3 * kept.size());
    for (const auto& [ends, h] : halfedge) {
      const auto other = halfedge.find({ends.second, ends.first});
      EXPECT_EQ(adjacency.opposite[static_cast<std::size_t>(h)],
                other == halfedge.end() ? kInvalid : other->second);
      EXPECT_EQ(source(faces, h), ends.first);
      EXPECT_EQ(target(faces, h), ends.second);
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

}  // namespace
}  // namespace flipfree::mesh::adjacency_test
