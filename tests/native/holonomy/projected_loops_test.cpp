#include "flipfree/holonomy/projected_loops.h"

#include <gtest/gtest.h>

#include <numeric>

#include "flipfree/field/topology/tree_cotree.h"
#include "support/shapes.h"

namespace flipfree::holonomy::projected_loops_test {
namespace {

mesh::Adjacency adjacency_of(const mesh::Surface& s) {
  return mesh::build_adjacency(static_cast<Index>(s.vertices.rows()), s.faces);
}

// Every face in three, around its centroid.
struct Split {
  explicit Split(const mesh::Surface& s) {
    const auto n = s.vertices.rows(), m = s.faces.rows();
    surface.vertices.resize(n + m, 3);
    surface.vertices.topRows(n) = s.vertices;
    surface.faces.resize(3 * m, 3);
    for (Eigen::Index f = 0; f < m; ++f) {
      surface.vertices.row(n + f).setZero();
      for (int k = 0; k < 3; ++k) {
        surface.vertices.row(n + f) += s.vertices.row(s.faces(f, k)) / 3.0;
        surface.faces.row(3 * f + k) << s.faces(f, k), s.faces(f, (k + 1) % 3),
            static_cast<Index>(n + f);
        parent.push_back(static_cast<FaceId>(f));
      }
    }
    adjacency = adjacency_of(surface);
  }
  mesh::Surface surface;
  mesh::Adjacency adjacency;
  std::vector<FaceId> parent;
};

TEST(ProjectedLoops, AMeshThatIsNotRefinedHasItsOwnLoops) {
  const mesh::Surface s = test::perforated_plate(2, 1);
  const mesh::Adjacency adjacency = adjacency_of(s);
  std::vector<FaceId> same(static_cast<std::size_t>(s.faces.rows()));
  std::iota(same.begin(), same.end(), 0);
  const Refined refined{s, adjacency, same};
  const ExecutionContext context;
  for (const DualLoop& loop : field::tree_cotree(s, adjacency, context).loops)
    EXPECT_EQ(projected(refined, s, adjacency, loop), loop);
}

TEST(ProjectedLoops, LoopsOfARefinementAreStripsThatDoNotTurnBack) {
  const mesh::Surface s = test::perforated_plate(2, 1);
  const mesh::Adjacency adjacency = adjacency_of(s);
  const Split split(s);
  const Refined refined{split.surface, split.adjacency, split.parent};
  const ExecutionContext context;
  for (const DualLoop& loop : field::tree_cotree(split.surface, split.adjacency, context).loops) {
    const DualLoop strip = projected(refined, s, adjacency, loop);
    ASSERT_FALSE(strip.empty());
    for (std::size_t i = 0; i < strip.size(); ++i) {
      const HalfedgeId entered = adjacency.opposite[static_cast<std::size_t>(strip[i])];
      const HalfedgeId after = strip[(i + 1) % strip.size()];
      EXPECT_EQ(entered / 3, after / 3);
      EXPECT_NE(entered, after);
    }
  }
}

TEST(ProjectedLoops, ALoopInsideAFaceShrinksToNothing) {
  const mesh::Surface s = test::torus(6, 5);
  const mesh::Adjacency adjacency = adjacency_of(s);
  const Split split(s);
  const Refined refined{split.surface, split.adjacency, split.parent};
  // Around the centroid of face 4: from the part at side k across its second edge.
  const DualLoop around = {3 * 12 + 1, 3 * 13 + 1, 3 * 14 + 1};
  EXPECT_TRUE(projected(refined, s, adjacency, around).empty());
  EXPECT_EQ(input_halfedge(refined, s, adjacency, 3 * 12 + 1), kInvalid);
  EXPECT_EQ(input_halfedge(refined, s, adjacency, 3 * 13), 3 * 4 + 1);
}

}  // namespace
}  // namespace flipfree::holonomy::projected_loops_test
