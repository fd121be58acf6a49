#include "flipfree/certify/measures.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::certify::quarter_turns_test {
namespace {

using test::adjacency_of;
using test::flat;

// A grid of unit squares whose inner corners are turned, face by face, by random quarters: no count
// changes. Cones: k right corners around a vertex.
TEST(QuarterTurns, do_not_depend_on_how_the_faces_are_turned) {
  for (Index k = 3; k <= 9; ++k) {
    // k squares around vertex 0, each two triangles, whose diagonal leaves from there.
    mesh::Surface surface;
    surface.vertices = Points3::Zero(2 * k + 1, 3);
    surface.faces.resize(2 * k, 3);
    Points2 uv(6 * k, 2);
    for (Index i = 0; i < k; ++i) {
      const Index a = 2 * i + 1, b = 2 * i + 2, c = (2 * i + 2) % (2 * k) + 1;
      surface.faces.row(2 * i) << 0, a, b;
      surface.faces.row(2 * i + 1) << 0, b, c;
      Points2 square(6, 2);
      square << 0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 1;
      for (Index turn = 0; turn < (7 * i + k) % 4; ++turn) {
        const Points2 before = square;
        square.col(0) = -before.col(1);
        square.col(1) = before.col(0);
      }
      uv.middleRows<6>(6 * i) = square.array() + 3.0 * i;
    }
    EXPECT_EQ(quarter_turns_around(adjacency_of(surface), uv)[0], k);
  }
}

// Around a torus of squares that is cut open and turned face by face: a strip along a row of
// squares goes straight on; around a vertex it turns once.
TEST(QuarterTurns, along_strips_are_none_around_a_row_and_four_around_a_vertex) {
  const Index n = 4;
  mesh::Surface surface;
  surface.vertices = Points3::Zero(n * n, 3);
  surface.faces.resize(2 * n * n, 3);
  Points2 uv(6 * n * n, 2);
  for (Index y = 0; y < n; ++y) {
    for (Index x = 0; x < n; ++x) {
      const Index square = y * n + x, right = (x + 1) % n, up = (y + 1) % n;
      surface.faces.row(2 * square) << y * n + x, y * n + right, up * n + right;
      surface.faces.row(2 * square + 1) << y * n + x, up * n + right, up * n + x;
      Points2 corners(6, 2);
      corners << 0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 1;
      for (Index turn = 0; turn < (3 * square) % 4; ++turn) {
        const Points2 before = corners;
        corners.col(0) = -before.col(1);
        corners.col(1) = before.col(0);
      }
      uv.middleRows<6>(6 * square) = corners;
    }
  }
  const mesh::Adjacency adjacency = adjacency_of(surface);
  std::vector<HalfedgeId> row, around;
  for (Index x = 0; x < n; ++x) {
    // From the upper left triangle over the diagonal into the lower right one, out at its right.
    row.push_back(3 * (2 * x + 1));
    row.push_back(3 * (2 * x) + 1);
  }
  EXPECT_EQ(quarter_turns_along(adjacency, uv, row), 0);
  HalfedgeId h = adjacency.vertex_halfedge[5];
  do {
    around.push_back(previous_corner(h));
    h = mesh::rotate_ccw(adjacency, h);
  } while (h != adjacency.vertex_halfedge[5]);
  EXPECT_EQ(quarter_turns_along(adjacency, uv, around), 4);
  std::vector<HalfedgeId> back;
  for (auto i = around.rbegin(); i != around.rend(); ++i)
    back.push_back(adjacency.opposite[static_cast<std::size_t>(*i)]);
  EXPECT_EQ(quarter_turns_along(adjacency, uv, back), -4);
  EXPECT_EQ(quarter_turns_along(adjacency, uv, {0, 1}), kNoStrip);
  EXPECT_EQ(quarter_turns_along(adjacency, uv, {-1}), kNoStrip);
}

}  // namespace
}  // namespace flipfree::certify::quarter_turns_test
