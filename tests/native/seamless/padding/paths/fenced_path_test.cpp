// Paths around any set of cones.
#include "flipfree/seamless/padding/paths/fenced_path.h"

#include "seamless/padding/paths/canvases.h"

namespace flipfree::seamless::fenced_path_test {
namespace {

using test::GridTorus;

TEST(FencedPath, HasExactlyTheChosenConesOnItsLeft) {
  const GridTorus torus(7, 6);
  ExecutionContext context;
  for (unsigned seed = 0; seed < 40; ++seed) {
    std::vector<Index> cones = test::scattered(torus.surface, std::vector<Index>(15, 5), seed);
    for (Index i = 0; i < 7; ++i) cones[static_cast<std::size_t>(torus.at(i, 0))] = 4;
    for (Index j = 0; j < 6; ++j) cones[static_cast<std::size_t>(torus.at(0, j))] = 4;
    std::mt19937 random(seed);
    std::set<VertexId> inside;
    for (VertexId v = 0; v < 42; ++v) {
      if (cones[static_cast<std::size_t>(v)] != 4 && random() % 2 == 0) inside.insert(v);
    }
    Canvas canvas(torus.surface, cones);
    test::draw_square(canvas, torus);
    const DiskBoundary boundary = disk_boundary(canvas);
    PathEnds ends;
    do {
      ends.from = static_cast<Index>(random() % static_cast<unsigned>(boundary.size()));
      ends.to = static_cast<Index>(random() % static_cast<unsigned>(boundary.size()));
    } while (ends.from == ends.to || boundary.places_between(ends.from, ends.to).empty() ||
             boundary.places_between(ends.to, ends.from).empty());
    const VertexId root =
        canvas.mesh().source(boundary.halfedges[static_cast<std::size_t>(ends.from)]);
    const VertexId end =
        canvas.mesh().source(boundary.halfedges[static_cast<std::size_t>(ends.to)]);
    const auto path = fenced_path(canvas, boundary, ends, {inside.begin(), inside.end()}, context);
    EXPECT_EQ(canvas.mesh().source(path.front()), root);
    EXPECT_EQ(canvas.mesh().target(path.back()), end);
    const VertexId second = canvas.mesh().target(path.front());
    canvas.draw(path, Curve::kExtra);
    EXPECT_EQ(test::cones_beside(canvas, canvas.mesh().find(root, second)), inside);
  }
}

TEST(FencedPath, LoopsGoAroundOneCone) {
  const GridTorus torus(7, 6);
  ExecutionContext context;
  const std::vector<std::pair<VertexId, Index>> given = {
      {torus.at(3, 3), 1}, {torus.at(3, 2), 5}, {torus.at(4, 3), 5}, {torus.at(2, 3), 5}};
  for (const auto& [cone, k] : given) {
    Canvas canvas(torus.surface, test::cones_at(torus.surface, given));
    test::draw_square(canvas, torus);
    const DiskBoundary boundary = disk_boundary(canvas);
    const VertexId root = torus.at(5, 0);
    const Index place =
        boundary.place[static_cast<std::size_t>(canvas.mesh().find(root, torus.at(6, 0)))];
    const auto loop = fenced_loop(canvas, boundary, place, cone, context);
    EXPECT_EQ(canvas.mesh().source(loop.front()), root);
    EXPECT_EQ(canvas.mesh().target(loop.back()), root);
    const VertexId second = canvas.mesh().target(loop.front());
    canvas.draw(loop, Curve::kExtra);
    const HalfedgeId h = canvas.mesh().find(root, second);
    EXPECT_EQ(test::cones_beside(canvas, canvas.mesh().opposite(h)), std::set<VertexId>{cone});
    EXPECT_EQ(test::cones_beside(canvas, h).size(), given.size() - 1);
  }
}

}  // namespace
}  // namespace flipfree::seamless::fenced_path_test
