#include "flipfree/certify/measures/quarter_turns.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::certify {
namespace {

using test::adjacency_of;
using test::flat;

TEST(QuarterTurns, of_a_tetrahedron_whose_corners_are_right_angles_or_half) {
  const mesh::Surface surface = test::tetrahedron();
  const mesh::Adjacency adjacency = adjacency_of(surface);
  // Every face a right triangle: only sums over whole turns are meaningful, but each corner enters
  // as many quadrants as the reference says: 1 at the right angle, and 1 or 0 at the others.
  Points2 uv(12, 2);
  for (Index f = 0; f < 4; ++f) uv.middleRows<3>(3 * f) << 0, 0, 1, 0, 0, 1;
  const auto turns = quarter_turns_around(adjacency, uv);
  Index sum = 0;
  for (const Index k : turns) sum += k;
  EXPECT_EQ(sum, 4 * 2);  // half a turn per triangle
}

TEST(QuarterTurns, are_four_inside_a_grid_and_not_counted_on_its_boundary) {
  const mesh::Surface surface = test::grid(3, 3);
  const Points2 plane = flat(surface);
  const double c = std::cos(0.3);
  const double s = std::sin(0.3);
  Points2 uv(plane.rows(), 2);
  uv.col(0) = c * plane.col(0) - s * plane.col(1);
  uv.col(1) = s * plane.col(0) + c * plane.col(1);
  const auto turns = quarter_turns_around(adjacency_of(surface), uv);
  for (VertexId v = 0; v < 16; ++v) {
    const bool inside = v % 4 > 0 && v % 4 < 3 && v / 4 > 0 && v / 4 < 3;
    EXPECT_EQ(turns[static_cast<std::size_t>(v)], inside ? 4 : kInvalid);
  }
}

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

}  // namespace
}  // namespace flipfree::certify
