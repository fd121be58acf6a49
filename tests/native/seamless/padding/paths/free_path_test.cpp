// Shortest ways through free vertices, against Bellman and Ford.
#include "flipfree/seamless/padding/paths/free_path.h"

#include <limits>

#include "seamless/padding/paths/canvases.h"

namespace flipfree::seamless::free_path_test {
namespace {

using test::GridTorus;

double length(const Canvas& canvas, const std::vector<HalfedgeId>& path) {
  double sum = 0.0;
  for (const HalfedgeId h : path) sum += canvas.length(h);
  return sum;
}

// Distances through free vertices, by relaxing all edges until nothing changes.
double slow_distance(const Canvas& canvas, HalfedgeId from, VertexId to) {
  const mesh::EditableTriangulation& mesh = canvas.mesh();
  std::vector<double> distance(static_cast<std::size_t>(canvas.vertex_count()),
                               std::numeric_limits<double>::infinity());
  const auto at = [&](VertexId v) -> double& { return distance[static_cast<std::size_t>(v)]; };
  canvas.for_each_inside(from, [&](HalfedgeId h) {
    if (canvas.is_free(mesh.target(h))) at(mesh.target(h)) = canvas.length(h);
  });
  double best = std::numeric_limits<double>::infinity();
  for (bool changed = true; changed;) {
    changed = false;
    for (HalfedgeId h = 0; h < mesh.halfedge_slots(); ++h) {
      const double next = at(mesh.source(h)) + canvas.length(h);
      if (mesh.target(h) == to) best = std::min(best, next);
      if (!canvas.is_free(mesh.target(h)) || next >= at(mesh.target(h))) continue;
      at(mesh.target(h)) = next;
      changed = true;
    }
  }
  return best;
}

TEST(FreePath, IsTheShortestFromSectorToCone) {
  const GridTorus torus(9, 7);
  for (unsigned seed = 0; seed < 10; ++seed) {
    std::vector<Index> cones = test::scattered(torus.surface, std::vector<Index>(9, 5), seed);
    for (Index i = 0; i < 9; ++i) cones[static_cast<std::size_t>(torus.at(i, 0))] = 4;
    for (Index j = 0; j < 7; ++j) cones[static_cast<std::size_t>(torus.at(0, j))] = 4;
    Canvas canvas(torus.surface, cones);
    test::draw_square(canvas, torus);
    for (const HalfedgeId sector : canvas.drawn_around(torus.at(3, 0))) {
      for (VertexId cone = 0; cone < 63; ++cone) {
        if (canvas.excess(cone) == 0) continue;
        ExecutionContext context;
        const auto path = free_path(canvas, {{sector}, {}},
                                    {nullptr, [&](VertexId v) { return v == cone; }}, context);
        ASSERT_FALSE(path.empty());
        EXPECT_EQ(canvas.sector_of(path.front()), sector);
        EXPECT_EQ(canvas.mesh().target(path.back()), cone);
        for (std::size_t i = 1; i < path.size(); ++i) {
          EXPECT_EQ(canvas.mesh().target(path[i - 1]), canvas.mesh().source(path[i]));
          EXPECT_TRUE(canvas.is_free(canvas.mesh().source(path[i])));
        }
        EXPECT_NEAR(length(canvas, path), slow_distance(canvas, sector, cone), 1e-12);
      }
    }
  }
}

TEST(FreePath, EndsInTheSectorThatIsAskedFor) {
  const GridTorus torus(8, 8);
  Canvas canvas(torus.surface, test::cones_at(torus.surface, {}));
  test::draw_square(canvas, torus);
  ExecutionContext context;
  // From above the row to below it, all the way around.
  const HalfedgeId above = canvas.mesh().find(torus.at(4, 0), torus.at(5, 0));
  const HalfedgeId below = canvas.mesh().find(torus.at(4, 0), torus.at(3, 0));
  const auto path = free_path(canvas, {{above}, {}},
                              {[&](HalfedgeId s) { return s == below; }, nullptr}, context);
  ASSERT_EQ(path.size(), 8u);
  EXPECT_EQ(canvas.mesh().target(path.front()), torus.at(4, 1));
}

TEST(FreePath, NothingWhereAllWaysAreBlocked) {
  const GridTorus torus(8, 8);
  Canvas canvas(torus.surface, test::cones_at(torus.surface, {{torus.at(4, 4), 5}}));
  test::draw_square(canvas, torus);
  test::Chain ring;
  for (Index i = 0; i <= 8; ++i) ring.push_back(torus.at(i, 2));
  canvas.draw(test::along(canvas, ring), Curve::kConnector);
  ExecutionContext context;
  const HalfedgeId above = canvas.mesh().find(torus.at(4, 0), torus.at(5, 0));
  EXPECT_TRUE(
      free_path(canvas, {{above}, {}}, {nullptr, [](VertexId) { return true; }}, context).empty());
}

TEST(FreePath, VerticesOfAFenceAreLeftInAnyDirection) {
  const GridTorus torus(8, 8);
  const VertexId cone = torus.at(3, 3);
  const VertexId other = torus.at(6, 3);
  Canvas canvas(torus.surface, test::cones_at(torus.surface, {{cone, 3}, {other, 5}}));
  ExecutionContext context;
  const auto path =
      free_path(canvas, {{}, {cone}}, {nullptr, [&](VertexId v) { return v == other; }}, context);
  ASSERT_EQ(path.size(), 3u);
  EXPECT_EQ(canvas.mesh().source(path.front()), cone);
}

}  // namespace
}  // namespace flipfree::seamless::free_path_test
