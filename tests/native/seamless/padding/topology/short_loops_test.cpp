// Loops that open all handles and nothing else.
#include "flipfree/seamless/padding/topology/short_loops.h"

#include "flipfree/base/disjoint_sets.h"
#include "seamless/padding/paths/canvases.h"

namespace flipfree::seamless::short_loops_test {
namespace {

// Pieces of the surface cut along what is drawn.
Index pieces(const Canvas& canvas) {
  DisjointSets sets(canvas.mesh().face_slots());
  Index count = canvas.mesh().face_slots();
  for (HalfedgeId h = 0; h < canvas.mesh().halfedge_slots(); ++h) {
    if (!canvas.is_drawn(h) && sets.join(h / 3, canvas.mesh().opposite(h) / 3)) --count;
  }
  return count;
}

TEST(ShortLoops, AreDisjointSpareConesAndLeaveTheSurfaceConnected) {
  for (const Index genus : {1, 2, 3, 5, 9}) {
    for (unsigned seed = 0; seed < 5; ++seed) {
      const mesh::Surface surface = test::of_genus(genus, 1);
      Canvas canvas(surface, test::scattered(surface, std::vector<Index>(20, 5), seed));
      ExecutionContext context;
      const auto loops = draw_short_loops(canvas, genus, {}, nullptr, context);
      ASSERT_EQ(loops.size(), static_cast<std::size_t>(genus));
      EXPECT_EQ(pieces(canvas), 1);
      EXPECT_EQ(test::unrefined_edge(canvas), kInvalid);
      std::set<VertexId> visited;
      for (const auto& loop : loops) {
        for (std::size_t i = 0; i < loop.size(); ++i) {
          EXPECT_TRUE(visited.insert(loop[i]).second);
          EXPECT_EQ(canvas.excess(loop[i]), 0);
          EXPECT_EQ(canvas.drawn_around(loop[i]).size(), 2u);
          const HalfedgeId h = canvas.mesh().find(loop[i], loop[(i + 1) % loop.size()]);
          ASSERT_NE(h, kInvalid);
          EXPECT_EQ(canvas.curve(h), Curve::kLoop);
        }
      }
    }
  }
}

TEST(ShortLoops, GoAroundTheTubeOfAThinTorus) {
  const mesh::Surface surface = test::torus(60, 12, 0.1);
  Canvas canvas(surface, std::vector<Index>(720, 4));
  ExecutionContext context;
  const auto loops = draw_short_loops(canvas, 1, {}, nullptr, context);
  ASSERT_EQ(loops.size(), 1u);
  EXPECT_EQ(loops.front().size(), 12u);
}

}  // namespace
}  // namespace flipfree::seamless::short_loops_test
