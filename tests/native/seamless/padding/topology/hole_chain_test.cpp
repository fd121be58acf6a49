// Chains of holes: nodes and disk.
#include "flipfree/seamless/padding/topology/hole_chain.h"

#include <map>

#include "seamless/padding/topology/paths/canvases.h"

namespace flipfree::seamless {
namespace {

std::map<std::size_t, Index> node_degrees(const Canvas& canvas) {
  std::map<std::size_t, Index> count;
  for (VertexId v = 0; v < canvas.vertex_count(); ++v) {
    if (canvas.on_curve(v) && canvas.drawn_around(v).size() > 2)
      ++count[canvas.drawn_around(v).size()];
  }
  return count;
}

TEST(HoleChain, HasNodesOfDegreeFourAndOneDisk) {
  for (const Index genus : {1, 2, 3, 4, 7}) {
    for (unsigned seed = 0; seed < 4; ++seed) {
      const mesh::Surface surface = test::of_genus(genus, 1);
      Canvas canvas(surface, test::scattered(surface, std::vector<Index>(10, 5), seed));
      ExecutionContext context;
      draw_hole_chain(canvas, genus, context);
      EXPECT_EQ(node_degrees(canvas), (std::map<std::size_t, Index>{{4, 2 * genus - 1}}));
      EXPECT_EQ(disk_boundary(canvas).corners_below.back(), 8 * genus - 4);
    }
  }
}

TEST(HoleChain, TNodesAreWhereAPathCanJoinThem) {
  for (const Index genus : {1, 2}) {
    for (unsigned seed = 0; seed < 4; ++seed) {
      const mesh::Surface surface = test::of_genus(genus, 2);
      Canvas canvas(surface, test::scattered(surface, std::vector<Index>(10, 5), seed));
      ExecutionContext context;
      const auto [a, b] = draw_chain_with_t_nodes(canvas, genus, context);
      const auto degrees = node_degrees(canvas);
      EXPECT_EQ(degrees.at(3), 2);
      EXPECT_EQ(degrees.size(), genus == 1 ? 1u : 2u);
      const DiskBoundary boundary = disk_boundary(canvas);
      EXPECT_EQ(boundary.corners_below.back(), 8 * genus - 2);
      // Corners of the smaller part of every path that joins them.
      std::set<Index> parts;
      for (const HalfedgeId from : canvas.drawn_around(a)) {
        for (const HalfedgeId to : canvas.drawn_around(b)) {
          const Index corners =
              2 + boundary.corners_between(boundary.place[static_cast<std::size_t>(from)],
                                           boundary.place[static_cast<std::size_t>(to)]);
          parts.insert(std::min(corners, 8 * genus - corners));
        }
      }
      if (genus == 1) {
        EXPECT_EQ(parts, (std::set<Index>{2, 4}));
      } else {
        for (const Index corners : {2, 3, 5, 6, 7}) EXPECT_TRUE(parts.contains(corners)) << corners;
      }
    }
  }
}

}  // namespace
}  // namespace flipfree::seamless
