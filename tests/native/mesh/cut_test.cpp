#include "flipfree/mesh/cut.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/mesh/topology.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::mesh::cut_test {
namespace {

using test::adjacency_of;

EdgeFlags random_cut(const Adjacency& adjacency, unsigned one_in, std::mt19937& random) {
  EdgeFlags flags(adjacency.opposite.size(), 0);
  for (std::size_t h = 0; h < flags.size(); ++h) {
    const HalfedgeId o = adjacency.opposite[h];
    if (o == kInvalid || o < static_cast<HalfedgeId>(h)) continue;
    flags[h] = flags[static_cast<std::size_t>(o)] = random() % one_in == 0;
  }
  return flags;
}

// Corners are one vertex exactly if uncut edges join them; numbers follow the first corners.
TEST(CutAlong, agrees_with_joining_the_corners_at_every_uncut_edge) {
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    const Surface surface = i % 3 == 0   ? test::grid(5, 4)
                            : i % 3 == 1 ? test::torus(5, 4)
                                         : test::sphere(6, 4);
    const Adjacency adjacency = adjacency_of(surface);
    const EdgeFlags flags = random_cut(adjacency, 1 + static_cast<unsigned>(i) % 5, random);
    const auto corners = static_cast<Index>(flags.size());
    DisjointSets sets(corners);
    for (HalfedgeId h = 0; h < corners; ++h) {
      const HalfedgeId o = adjacency.opposite[static_cast<std::size_t>(h)];
      if (o == kInvalid || flags[static_cast<std::size_t>(h)]) continue;
      sets.join(h, next_corner(o));
      sets.join(next_corner(h), o);
    }
    const CutMesh cut = cut_along(surface.faces, adjacency, flags);
    std::vector<VertexId> number(flags.size(), kInvalid);
    VertexId count = 0;
    for (CornerId c = 0; c < corners; ++c) {
      VertexId& mine = number[static_cast<std::size_t>(sets.find(c))];
      if (mine == kInvalid) mine = count++;
      ASSERT_EQ(cut.faces(c / 3, c % 3), mine);
      EXPECT_EQ(cut.vertex_origin[static_cast<std::size_t>(mine)], surface.faces(c / 3, c % 3));
    }
    EXPECT_EQ(static_cast<VertexId>(cut.vertex_origin.size()), count);
  }
}

TEST(SplitIntoCharts, gives_the_pieces_of_the_cut_mesh_in_the_order_of_their_faces) {
  std::mt19937 random(2);
  std::size_t most = 0;
  for (int i = 0; i < 100; ++i) {
    const Surface surface = test::torus(6, 5);
    const Adjacency adjacency = adjacency_of(surface);
    const CutMesh cut = cut_along(surface.faces, adjacency, random_cut(adjacency, 2, random));
    const std::vector<Chart> charts = split_into_charts(surface.vertices, cut);
    most = std::max(most, charts.size());
    std::vector<char> seen(static_cast<std::size_t>(surface.faces.rows()), 0);
    FaceId before = -1;
    for (const Chart& chart : charts) {
      EXPECT_GT(chart.faces.front(), before);
      before = chart.faces.front();
      EXPECT_TRUE(std::is_sorted(chart.faces.begin(), chart.faces.end()));
      EXPECT_EQ(topology(chart.surface.faces, adjacency_of(chart.surface)).components, 1);
      for (std::size_t f = 0; f < chart.faces.size(); ++f) {
        EXPECT_FALSE(seen[static_cast<std::size_t>(chart.faces[f])]++);
        for (Index k = 0; k < 3; ++k) {
          const VertexId v = chart.surface.faces(static_cast<Eigen::Index>(f), k);
          EXPECT_EQ(chart.vertices[static_cast<std::size_t>(v)], cut.faces(chart.faces[f], k));
          EXPECT_EQ(chart.surface.vertices.row(v),
                    surface.vertices.row(surface.faces(chart.faces[f], k)));
        }
      }
    }
    EXPECT_EQ(std::count(seen.begin(), seen.end(), 1), surface.faces.rows());
  }
  EXPECT_GT(most, 5U);
}

TEST(FlagEdges, undoes_naming_the_flagged_edges_and_ignores_the_boundary) {
  std::mt19937 random(3);
  const Surface surface = test::grid(5, 4);
  const Adjacency adjacency = adjacency_of(surface);
  for (int i = 0; i < 50; ++i) {
    const EdgeFlags flags = random_cut(adjacency, 4, random);
    IndexPairs pairs = flagged_edges(surface.faces, adjacency, flags);
    EXPECT_EQ(2 * pairs.rows(), std::count(flags.begin(), flags.end(), 1));
    for (Eigen::Index p = 0; p < pairs.rows(); ++p) {
      EXPECT_LT(pairs(p, 0), pairs(p, 1));
      if (random() % 2 == 0) std::swap(pairs(p, 0), pairs(p, 1));
    }
    pairs.conservativeResize(pairs.rows() + 2, 2);
    pairs.bottomRows<2>() << 0, 1, 1, 0;  // on the boundary
    EXPECT_EQ(flag_edges(surface.faces, adjacency, pairs), flags);
  }
}

TEST(FlagEdges, pairs_beyond_the_mesh_are_refused_and_only_what_exists_is_named) {
  const Surface surface = test::grid(3, 3);
  for (const auto& [a, b, named] :
       {std::tuple{2, 16, std::vector<Index>{2}}, std::tuple{-1, 99, std::vector<Index>{}},
        std::tuple{4, 4, std::vector<Index>{4, 4}}, std::tuple{0, 15, std::vector<Index>{0, 15}}}) {
    IndexPairs pair(1, 2);
    pair << a, b;
    try {
      flag_edges(surface.faces, adjacency_of(surface), pair);
      FAIL();
    } catch (const InvalidInput& e) {
      EXPECT_EQ(e.error().code, ErrorCode::kNotAnEdge);
      EXPECT_EQ(e.error().elements, named);
    }
  }
}

TEST(UvCuts, a_difference_at_one_end_in_one_coordinate_cuts_that_edge_alone) {
  const Surface surface = test::grid(2, 2);
  const Adjacency adjacency = adjacency_of(surface);
  for (HalfedgeId h = 0; h < 24; ++h) {
    for (const Index axis : {0, 1}) {
      Points2 uv = test::flat(surface);
      uv(h, axis) += 1e-16 + std::abs(uv(h, axis)) * 1e-15;
      // The corner's two edges, if somebody is on their other side.
      EdgeFlags expected(24, 0);
      for (const HalfedgeId side : {h, previous_corner(h)}) {
        const HalfedgeId o = adjacency.opposite[static_cast<std::size_t>(side)];
        if (o == kInvalid) continue;
        expected[static_cast<std::size_t>(side)] = expected[static_cast<std::size_t>(o)] = 1;
      }
      EXPECT_EQ(uv_cuts(adjacency, uv), expected);
    }
  }
}

}  // namespace
}  // namespace flipfree::mesh::cut_test
