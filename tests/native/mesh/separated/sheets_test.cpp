#include "flipfree/mesh/separated/sheets.h"

#include <gtest/gtest.h>

#include <vector>

#include "flipfree/mesh/adjacency.h"
#include "support/shapes.h"

namespace flipfree::mesh::sheets_test {
namespace {

TEST(Sheets, OfAManifoldAreItsVertices) {
  const Surface s = test::torus(7, 5);
  std::vector<HalfedgeId> opposite =
      build_adjacency(static_cast<Index>(s.vertices.rows()), s.faces).opposite;
  const Sheets sheets = make_sheets(s.faces, opposite, {});
  EXPECT_EQ(sheets.origin.size(), static_cast<std::size_t>(s.vertices.rows()));
  for (CornerId c = 0; c < static_cast<CornerId>(s.faces.size()); ++c)
    EXPECT_EQ(sheets.vertex[static_cast<std::size_t>(c)], s.faces(c / 3, c % 3));
  EXPECT_TRUE(sheets.parted.empty());
}

TEST(Sheets, FansWithoutMatesAreApart) {
  Triangles faces(2, 3);
  faces << 0, 1, 2, 0, 2, 3;
  std::vector<HalfedgeId> opposite(6, kInvalid);
  EXPECT_EQ(make_sheets(faces, opposite, {}).origin, (std::vector<VertexId>{0, 0, 1, 2, 2, 3}));
  opposite[2] = 3;
  opposite[3] = 2;
  EXPECT_EQ(make_sheets(faces, opposite, {}).origin, (std::vector<VertexId>{0, 1, 2, 3}));
}

// Around the vertices 0 and 1 one closed fan each, which passes the edge between them twice: a
// tetrahedron's faces 0 1 2 and 0 3 1 and, through the same edge, 0 1 4 and 0 5 1, joined in turn.
TEST(Sheets, AnEdgeThatAFanPassesTwiceIsParted) {
  Triangles faces(8, 3);
  faces << 0, 1, 2, 1, 0, 3, 0, 1, 4, 1, 0, 5,  // at the edge
      0, 2, 5, 2, 1, 5,                         // from the first to the last
      0, 4, 3, 4, 1, 3;                         // from the second to the third
  std::vector<HalfedgeId> opposite(24, kInvalid);
  const auto join = [&](HalfedgeId a, HalfedgeId b) {
    ASSERT_EQ(source(faces, a), target(faces, b));
    ASSERT_EQ(source(faces, b), target(faces, a));
    opposite[static_cast<std::size_t>(a)] = b;
    opposite[static_cast<std::size_t>(b)] = a;
  };
  join(0, 3);    // 0 1 of face 0, 1 0 of face 1
  join(6, 9);    // 0 1 of face 2, 1 0 of face 3
  join(2, 12);   // 2 0, 0 2
  join(1, 15);   // 1 2, 2 1
  join(10, 14);  // 0 5, 5 0
  join(11, 16);  // 5 1, 1 5
  join(13, 17);  // 2 5, 5 2
  join(8, 18);   // 4 0, 0 4
  join(7, 21);   // 1 4, 4 1
  join(4, 20);   // 0 3, 3 0
  join(5, 22);   // 3 1, 1 3
  join(19, 23);  // 4 3, 3 4
  // With polygons of two triangles wherever a cut went before, it goes beside them.
  std::vector<Index> polygon = {0, 1, 2, 3, 4, 5, 6, 7};
  for (int round = 0; round < 3; ++round) {
    std::vector<HalfedgeId> own = opposite;
    const Sheets sheets = make_sheets(faces, own, {{0, 3, 6, 9}}, &polygon);
    ASSERT_FALSE(sheets.parted.empty());
    const auto end = [&](HalfedgeId h) { return sheets.vertex[static_cast<std::size_t>(h)]; };
    EXPECT_TRUE(end(0) != end(6) || end(1) != end(7));
    for (const HalfedgeId h : sheets.parted) {
      const HalfedgeId o = opposite[static_cast<std::size_t>(h)];
      const auto polygon_of = [&](HalfedgeId g) {
        return polygon[static_cast<std::size_t>(g / 3)];
      };
      EXPECT_NE(polygon_of(h), polygon_of(o)) << round;
    }
    const HalfedgeId h = sheets.parted.front();
    polygon[static_cast<std::size_t>(opposite[static_cast<std::size_t>(h)] / 3)] =
        polygon[static_cast<std::size_t>(h / 3)];
  }
}

}  // namespace
}  // namespace flipfree::mesh::sheets_test
