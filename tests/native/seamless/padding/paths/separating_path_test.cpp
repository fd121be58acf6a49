// Paths that leave the right cones on either side.
#include "flipfree/seamless/padding/paths.h"

#include "seamless/padding/paths/canvases.h"

namespace flipfree::seamless::separating_path_test {
namespace {

using test::GridTorus;

Index excess_of(const Canvas& canvas, const std::set<VertexId>& cones) {
  Index sum = 0;
  for (const VertexId v : cones) sum += canvas.excess(v);
  return sum;
}

TEST(SeparatingPath, BothPartsHaveTheCornersOfTheirCones) {
  const GridTorus torus(12, 10);
  ExecutionContext context;
  for (unsigned seed = 0; seed < 30; ++seed) {
    std::vector<Index> cones =
        test::scattered(torus.surface, {3, 5, 3, 5, 2, 6, 3, 5, 7, 1, 3, 5}, seed);
    // None on the curves: the sum of what is left may be anything but must be that of the corners.
    Index sum = 0;
    for (Index i = 0; i < 12; ++i) cones[static_cast<std::size_t>(torus.at(i, 0))] = 4;
    for (Index j = 0; j < 10; ++j) cones[static_cast<std::size_t>(torus.at(0, j))] = 4;
    for (const Index k : cones) sum += k - 4;
    cones[static_cast<std::size_t>(torus.at(6, 5))] -= sum;
    Canvas canvas(torus.surface, cones);
    test::draw_square(canvas, torus);
    const DiskBoundary boundary = disk_boundary(canvas);
    std::vector<Index> from;
    for (Index i = 0; i < boundary.size(); ++i) {
      if (boundary.corner[static_cast<std::size_t>(i)] == 0) from.push_back(i);
    }
    const auto path = shortest_separating_path(
        canvas, boundary, from, from, [](const PathEnds&) { return true; }, context);
    ASSERT_TRUE(path.has_value());
    EXPECT_EQ(path->corners, left_corners(boundary, path->ends));
    EXPECT_NE(path->corners % 4, 0);
    EXPECT_EQ(boundary.place[static_cast<std::size_t>(canvas.sector_of(path->halfedges.front()))],
              path->ends.from);
    std::set<VertexId> visited;
    for (const HalfedgeId h : path->halfedges)
      EXPECT_TRUE(visited.insert(canvas.mesh().source(h)).second);
    const VertexId second = canvas.mesh().target(path->halfedges.front());
    const VertexId first = canvas.mesh().source(path->halfedges.front());
    canvas.draw(path->halfedges, Curve::kExtra);
    const HalfedgeId h = canvas.mesh().find(first, second);
    EXPECT_EQ(4 + excess_of(canvas, test::cones_beside(canvas, h)), path->corners);
    EXPECT_EQ(4 + excess_of(canvas, test::cones_beside(canvas, canvas.mesh().opposite(h))),
              8 - path->corners);
  }
}

TEST(SeparatingPath, IsAsShortAsItCanBe) {
  // Around a cone with k = 3 between two places of one side, one of them a corner's neighbour: the
  // path has to pass beyond the cone.
  const GridTorus torus(12, 12);
  Canvas canvas(torus.surface,
                test::cones_at(torus.surface, {{torus.at(2, 2), 3}, {torus.at(8, 8), 5}}));
  test::draw_square(canvas, torus);
  const DiskBoundary boundary = disk_boundary(canvas);
  ExecutionContext context;
  const HalfedgeId start = canvas.mesh().find(torus.at(4, 0), torus.at(5, 0));
  const HalfedgeId end = canvas.mesh().find(torus.at(0, 4), torus.at(0, 3));
  const Index from = boundary.place[static_cast<std::size_t>(start)];
  const Index to = boundary.place[static_cast<std::size_t>(end)];
  const auto path = shortest_separating_path(
      canvas, boundary, {from}, {to}, [](const PathEnds&) { return true; }, context);
  ASSERT_TRUE(path.has_value());
  EXPECT_EQ(path->corners, 3);
  canvas.draw(path->halfedges, Curve::kExtra);
  EXPECT_EQ(test::cones_beside(canvas, canvas.mesh().find(torus.at(1, 0), torus.at(2, 0))),
            std::set<VertexId>{torus.at(2, 2)});
}

TEST(SeparatingPath, NothingWithoutCones) {
  const GridTorus torus(6, 6);
  Canvas canvas(torus.surface, test::cones_at(torus.surface, {}));
  test::draw_square(canvas, torus);
  const DiskBoundary boundary = disk_boundary(canvas);
  ExecutionContext context;
  std::vector<Index> from(static_cast<std::size_t>(boundary.size()));
  std::iota(from.begin(), from.end(), 0);
  EXPECT_FALSE(shortest_separating_path(
                   canvas, boundary, from, from, [](const PathEnds&) { return true; }, context)
                   .has_value());
}

}  // namespace
}  // namespace flipfree::seamless::separating_path_test
