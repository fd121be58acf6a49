// Places on the boundary of a disk, and the excess that paths cross.
#include "flipfree/seamless/padding/paths/disk_boundary.h"

#include "flipfree/base/error.h"
#include "seamless/padding/paths/canvases.h"

namespace flipfree::seamless::disk_boundary_test {
namespace {

using test::GridTorus;

TEST(DiskBoundary, GoesAroundASquareTorus) {
  const GridTorus torus(6, 5);
  Canvas canvas(torus.surface, test::cones_at(torus.surface, {}));
  test::draw_square(canvas, torus);
  const DiskBoundary boundary = disk_boundary(canvas);
  ASSERT_EQ(boundary.size(), 22);
  EXPECT_EQ(boundary.corners_below.back(), 4);
  for (Index i = 0; i < 22; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const HalfedgeId h = boundary.halfedges[at];
    EXPECT_EQ(boundary.place[static_cast<std::size_t>(h)], i);
    EXPECT_EQ(canvas.mesh().target(h),
              canvas.mesh().source(boundary.halfedges[static_cast<std::size_t>((i + 1) % 22)]));
    EXPECT_EQ(boundary.corner[at] != 0, canvas.mesh().source(h) == torus.at(0, 0));
    const Index mate = boundary.place[static_cast<std::size_t>(canvas.mesh().opposite(h))];
    EXPECT_EQ(boundary.branch[at], boundary.branch[static_cast<std::size_t>(mate)]);
    EXPECT_EQ(canvas.curve(h) == Curve::kLoop,
              boundary.branch[at] ==
                  boundary.branch[static_cast<std::size_t>(boundary.place[static_cast<std::size_t>(
                      canvas.mesh().find(torus.at(2, 0), torus.at(3, 0)))])]);
    for (Index j = 0; j < 22; ++j) {
      if (i == j) continue;
      Index corners = 0;
      const std::vector<Index> between = boundary.places_between(i, j);
      for (const Index p : between) corners += boundary.corner[static_cast<std::size_t>(p)];
      EXPECT_EQ(boundary.corners_between(i, j), corners);
    }
  }
}

TEST(DiskBoundary, AnAnnulusIsNoDisk) {
  const GridTorus torus(6, 5);
  Canvas canvas(torus.surface, test::cones_at(torus.surface, {}));
  canvas.draw(test::along(canvas, {0, 1, 2, 3, 4, 5, 0}), Curve::kLoop);
  EXPECT_THROW(disk_boundary(canvas), InternalError);  // no node
  const test::Chain arc = {torus.at(2, 0), torus.at(2, 1), torus.at(3, 1), torus.at(3, 0)};
  canvas.draw(test::along(canvas, arc), Curve::kConnector);
  EXPECT_THROW(disk_boundary(canvas), InternalError);  // an annulus and a disk
}

TEST(DiskBoundary, ClosedPathsCrossTheExcessThatTheyEnclose) {
  const GridTorus torus(9, 8);
  Canvas canvas(torus.surface, test::cones_at(torus.surface, {{torus.at(2, 2), 3},
                                                              {torus.at(3, 2), 7},
                                                              {torus.at(6, 5), 1},
                                                              {torus.at(7, 6), 6}}));
  test::draw_square(canvas, torus);
  const DiskBoundary boundary = disk_boundary(canvas);
  const std::vector<Index> crossed = excess_crossed(canvas, boundary);
  const mesh::EditableTriangulation& mesh = canvas.mesh();
  for (HalfedgeId h = 0; h < mesh.halfedge_slots(); ++h) {
    if (!canvas.is_drawn(h)) {
      EXPECT_EQ(crossed[static_cast<std::size_t>(h)],
                -crossed[static_cast<std::size_t>(mesh.opposite(h))]);
    }
  }
  Index around = 0;
  for (const HalfedgeId h : boundary.halfedges) around += crossed[static_cast<std::size_t>(h)];
  EXPECT_EQ(around, -1 + 3 - 3 + 2);
  // Around every vertex inside whose neighbours are no cones.
  for (VertexId v = 0; v < canvas.vertex_count(); ++v) {
    if (canvas.on_curve(v)) continue;
    Index sum = 0;
    bool is_clear = true;
    mesh.for_each_outgoing(v, [&](HalfedgeId h) {
      sum += crossed[static_cast<std::size_t>(next_corner(h))];
      if (canvas.excess(mesh.target(h)) != 0) is_clear = false;
    });
    if (is_clear) {
      EXPECT_EQ(sum, canvas.excess(v)) << v;
    }
  }
}

}  // namespace
}  // namespace flipfree::seamless::disk_boundary_test
