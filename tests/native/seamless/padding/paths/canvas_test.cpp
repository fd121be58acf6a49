// Drawing, refinement and sectors of a canvas.
#include "flipfree/seamless/padding/paths/canvas.h"

#include <algorithm>

#include "seamless/padding/paths/canvases.h"

namespace flipfree::seamless::canvas_test {
namespace {

using test::GridTorus;

TEST(Canvas, EdgesBetweenConesAreSplitAtTheirMiddle) {
  const GridTorus torus(6, 5);
  const Canvas canvas(torus.surface,
                      test::cones_at(torus.surface, {{torus.at(1, 1), 3}, {torus.at(2, 1), 5}}));
  EXPECT_EQ(canvas.vertex_count(), 31);
  EXPECT_EQ(canvas.mesh().find(torus.at(1, 1), torus.at(2, 1)), kInvalid);
  EXPECT_TRUE(canvas.is_free(30));
  EXPECT_EQ(canvas.excess(torus.at(1, 1)), -1);
  EXPECT_EQ(canvas.excess(30), 0);
  const mesh::Surface surface = canvas.surface();
  EXPECT_EQ(surface.vertices.row(30), (0.5 * (torus.surface.vertices.row(torus.at(1, 1)) +
                                              torus.surface.vertices.row(torus.at(2, 1))))
                                          .eval());
}

TEST(Canvas, NoUndrawnEdgeJoinsVerticesThatAreNotFree) {
  const GridTorus torus(4, 3);
  std::mt19937 random(1);
  for (int run = 0; run < 20; ++run) {
    Canvas canvas(torus.surface,
                  test::scattered(torus.surface, {3, 5, 3, 5}, static_cast<unsigned>(run)));
    for (int curve = 0; curve < 4; ++curve) {
      // Any walk through free vertices.
      std::vector<HalfedgeId> path;
      std::vector<VertexId> visited;
      VertexId v = static_cast<VertexId>(random() % static_cast<unsigned>(canvas.vertex_count()));
      for (int step = 0; step < 5 && canvas.is_free(v); ++step) {
        std::vector<HalfedgeId> ways;
        canvas.mesh().for_each_outgoing(v, [&](HalfedgeId h) {
          const VertexId w = canvas.mesh().target(h);
          if (canvas.is_free(w) && std::find(visited.begin(), visited.end(), w) == visited.end())
            ways.push_back(h);
        });
        visited.push_back(v);
        if (ways.empty()) break;
        path.push_back(ways[random() % ways.size()]);
        v = canvas.mesh().target(path.back());
      }
      if (path.empty()) continue;
      canvas.draw(path, Curve::kConnector);
      ASSERT_EQ(test::unrefined_edge(canvas), kInvalid);
      for (const VertexId w : visited) EXPECT_FALSE(canvas.is_free(w));
    }
    canvas.mesh().check_invariants();
  }
}

TEST(Canvas, ProvenanceIsExact) {
  const GridTorus torus(4, 3);
  const std::vector<Index> cones = test::scattered(torus.surface, std::vector<Index>(12, 3), 1);
  Canvas canvas(torus.surface, cones);
  AdmissibleCut cut;
  cut.surface = canvas.surface();
  cut.provenance = canvas.provenance();
  // No branches: the judge looks at the provenance first and then finds that this is no sphere.
  EXPECT_EQ(test::AdmissibleJudge(cut, torus.surface, cones).complaint(), "no cut, and no sphere");
  cut.provenance.vertex.back().weight[0] += 0x1p-52;
  EXPECT_NE(test::AdmissibleJudge(cut, torus.surface, cones).complaint(), "no cut, and no sphere");
}

TEST(Canvas, SectorsAreNamedByTheirFirstEdge) {
  const GridTorus torus(6, 6);
  Canvas canvas(torus.surface, test::cones_at(torus.surface, {}));
  test::draw_square(canvas, torus);
  const VertexId node = torus.at(0, 0);
  const std::vector<HalfedgeId> drawn = canvas.drawn_around(node);
  ASSERT_EQ(drawn.size(), 4u);
  const HalfedgeId right = canvas.mesh().find(node, torus.at(1, 0));
  const HalfedgeId up = canvas.mesh().find(node, torus.at(0, 1));
  EXPECT_EQ(canvas.sector_of(canvas.mesh().find(node, torus.at(1, 1))), right);
  EXPECT_EQ(canvas.sector_of(right), right);
  std::vector<VertexId> inside;
  canvas.for_each_inside(right, [&](HalfedgeId h) { inside.push_back(canvas.mesh().target(h)); });
  EXPECT_EQ(inside, std::vector<VertexId>{torus.at(1, 1)});
  inside.clear();
  canvas.for_each_inside(up, [&](HalfedgeId h) { inside.push_back(canvas.mesh().target(h)); });
  EXPECT_EQ(inside.size(), 1u);  // of the edge from (0, 1) to (-1, 0), which was split
}

TEST(Canvas, DividingABranchKeepsItDrawn) {
  const GridTorus torus(3, 3);
  Canvas canvas(torus.surface, test::cones_at(torus.surface, {}));
  test::draw_square(canvas, torus);
  const test::Chain row = {torus.at(0, 0), torus.at(1, 0), torus.at(2, 0), torus.at(3, 0)};
  canvas.divide(test::along(canvas, row), 7);
  std::size_t length = 0;
  HalfedgeId h = canvas.drawn_around(torus.at(0, 0)).front();
  for (const HalfedgeId start : canvas.drawn_around(torus.at(0, 0))) {
    if (canvas.curve(start) == Curve::kLoop) h = start;
  }
  do {
    ++length;
    const VertexId v = canvas.mesh().target(h);
    const std::vector<HalfedgeId> drawn = canvas.drawn_around(v);
    if (drawn.size() != 2) break;
    h = drawn[0] == canvas.mesh().opposite(h) ? drawn[1] : drawn[0];
    EXPECT_EQ(canvas.curve(h), Curve::kLoop);
  } while (length < 20);
  EXPECT_EQ(length, 7u);
  EXPECT_EQ(test::unrefined_edge(canvas), kInvalid);
}

TEST(Canvas, FencesCanBeRemoved) {
  const GridTorus torus(8, 8);
  const VertexId cone = torus.at(4, 4);
  Canvas canvas(torus.surface, test::cones_at(torus.surface, {{cone, 5}}));
  test::draw_square(canvas, torus);
  const VertexId root = torus.at(4, 0);
  canvas.draw(test::along(canvas, {root, torus.at(4, 1), torus.at(4, 2), torus.at(4, 3), cone}),
              Curve::kFence);
  EXPECT_FALSE(canvas.is_free(torus.at(4, 2)));
  EXPECT_FALSE(canvas.on_curve(torus.at(4, 2)));
  EXPECT_EQ(canvas.drawn_around(root).size(), 3u);
  canvas.remove_fences();
  EXPECT_TRUE(canvas.is_free(torus.at(4, 2)));
  EXPECT_FALSE(canvas.is_free(cone));
  EXPECT_TRUE(canvas.on_curve(root));
  EXPECT_EQ(canvas.drawn_around(root).size(), 2u);
}

}  // namespace
}  // namespace flipfree::seamless::canvas_test
