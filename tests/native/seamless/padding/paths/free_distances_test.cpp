// Distances through free vertices.
#include "flipfree/seamless/padding/paths/free_distances.h"

#include <algorithm>

#include "seamless/padding/paths/canvases.h"

namespace flipfree::seamless::free_distances_test {
namespace {

TEST(FreeDistances, NoEdgeLeadsNearerAndArrivalsAddUp) {
  const test::GridTorus torus(9, 7);
  for (unsigned seed = 0; seed < 10; ++seed) {
    std::vector<Index> cones = test::scattered(torus.surface, std::vector<Index>(9, 5), seed);
    for (Index i = 0; i < 9; ++i) cones[static_cast<std::size_t>(torus.at(i, 0))] = 4;
    for (Index j = 0; j < 7; ++j) cones[static_cast<std::size_t>(torus.at(0, j))] = 4;
    Canvas canvas(torus.surface, cones);
    test::draw_square(canvas, torus);
    const mesh::EditableTriangulation& mesh = canvas.mesh();
    std::vector<HalfedgeId> first;
    canvas.for_each_inside(mesh.find(torus.at(3, 0), torus.at(4, 0)),
                           [&](HalfedgeId h) { first.push_back(h); });
    ExecutionContext context;
    const FreeDistances found = free_distances(canvas, first, kInvalid, context);
    const auto distance = [&](VertexId v) { return found.distance[static_cast<std::size_t>(v)]; };
    Index reached = 0;
    for (VertexId v = 0; v < canvas.vertex_count(); ++v) {
      EXPECT_EQ(distance(v) < FreeDistances::kUnreached, canvas.is_free(v));
      if (!canvas.is_free(v)) continue;
      ++reached;
      const HalfedgeId arrival = found.arrival[static_cast<std::size_t>(v)];
      const bool is_first = std::find(first.begin(), first.end(), arrival) != first.end();
      EXPECT_EQ(mesh.target(arrival), v);
      EXPECT_EQ(distance(v),
                (is_first ? 0.0 : distance(mesh.source(arrival))) + canvas.length(arrival));
      mesh.for_each_outgoing(v, [&](HalfedgeId h) {
        if (canvas.is_free(mesh.target(h))) {
          EXPECT_LE(distance(mesh.target(h)), distance(v) + canvas.length(h));
        }
      });
    }
    EXPECT_EQ(static_cast<Index>(found.order.size()), reached);
    EXPECT_TRUE(std::is_sorted(found.order.begin(), found.order.end(),
                               [&](VertexId a, VertexId b) { return distance(a) < distance(b); }));
  }
}

TEST(FreeDistances, BeginAtARoot) {
  const test::GridTorus torus(6, 6);
  const Canvas canvas(torus.surface, test::cones_at(torus.surface, {{torus.at(3, 3), 5}}));
  ExecutionContext context;
  const FreeDistances found = free_distances(canvas, {}, torus.at(1, 1), context);
  EXPECT_EQ(found.order.front(), torus.at(1, 1));
  EXPECT_EQ(found.order.size(), 35u);
  EXPECT_EQ(found.distance[static_cast<std::size_t>(torus.at(1, 1))], 0.0);
  EXPECT_EQ(found.arrival[static_cast<std::size_t>(torus.at(1, 1))], kInvalid);
}

}  // namespace
}  // namespace flipfree::seamless::free_distances_test
