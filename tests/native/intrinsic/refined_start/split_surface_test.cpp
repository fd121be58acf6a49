#include "flipfree/intrinsic/refined_start/split_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "flipfree/base/plane.h"
#include "intrinsic/refined_start/flat_surfaces.h"

namespace flipfree::intrinsic::split_surface_test {
namespace {

AddedPoint inside(FaceId f, const FlatSurface& surface, const Vector3& weights) {
  AddedPoint point;
  point.place.face = f;
  point.place.at = weights[0] * surface.corner_at(3 * f) +
                   weights[1] * surface.corner_at(3 * f + 1) +
                   weights[2] * surface.corner_at(3 * f + 2);
  return point;
}
AddedPoint on_edge(HalfedgeId h, double share, const FlatSurface& surface) {
  AddedPoint point;
  const FaceId f = h / 3;
  const Vector2 a = surface.corner_at(h), b = surface.corner_at(3 * f + (h + 1) % 3);
  point.place.face = f;
  point.place.at = a + share * (b - a);
  point.edge = h;
  point.share = share;
  return point;
}

// Area of a triangle with these sides.
double area(const Points3& lengths, Eigen::Index f) {
  return 0.25 * quadruple_area(lengths(f, 0), lengths(f, 1), lengths(f, 2));
}

TEST(SplitSurface, WithoutPointsIsTheSurfaceItself) {
  const mesh::Surface s = test::bumpy_grid(5, 4, 0.2, 2);
  SplitSurface split;
  ASSERT_TRUE(split_surface(test::flat(s), {}, ExecutionContext(), split));
  EXPECT_EQ(split.faces, s.faces);
  EXPECT_EQ(split.vertex_count, s.vertices.rows());
  EXPECT_TRUE(split.added.empty());
}

TEST(SplitSurface, PointsInFacesAndOnEdgesBecomeVerticesAndNoAreaIsLost) {
  const mesh::Surface s = test::bumpy_grid(6, 5, 0.3, 2);
  const FlatSurface surface = test::flat(s);
  HalfedgeId inner = 0;
  while (surface.adjacency.opposite[static_cast<std::size_t>(inner)] == kInvalid) ++inner;
  HalfedgeId outer = 0;
  while (surface.adjacency.opposite[static_cast<std::size_t>(outer)] != kInvalid) ++outer;
  const std::vector<AddedPoint> points{
      inside(7, surface, {0.2, 0.3, 0.5}), inside(7, surface, {0.6, 0.3, 0.1}),
      on_edge(inner, 0.25, surface), on_edge(inner, 0.75, surface), on_edge(outer, 0.5, surface)};
  SplitSurface split;
  ASSERT_TRUE(split_surface(surface, points, ExecutionContext(), split));
  EXPECT_EQ(find_broken_invariant(surface, split), "");
  ASSERT_EQ(split.added.size(), 5U);
  EXPECT_EQ(split.vertex_count, s.vertices.rows() + 5);
  // Two in a face, two on an edge of two faces, one on the boundary.
  EXPECT_EQ(split.faces.rows(), s.faces.rows() + 2 * 2 + 2 * 2 + 1);
  EXPECT_EQ(std::count(split.added_on_boundary.begin(), split.added_on_boundary.end(), 1), 1);
  std::vector<double> parts(static_cast<std::size_t>(s.faces.rows()), 0.0);
  for (Eigen::Index f = 0; f < split.faces.rows(); ++f)
    parts[static_cast<std::size_t>(split.parent_face[static_cast<std::size_t>(f)])] +=
        area(split.lengths, f);
  const Points3 own = lengths_of(s.vertices, s.faces);
  for (Eigen::Index f = 0; f < s.faces.rows(); ++f)
    EXPECT_NEAR(parts[static_cast<std::size_t>(f)], area(own, f), 1e-14);
}

TEST(SplitSurface, EdgesAreChainsOfPiecesSeenFromBothSides) {
  const mesh::Surface s = test::grid(4, 4);
  const FlatSurface surface = test::flat(s);
  HalfedgeId h = 0;
  while (surface.adjacency.opposite[static_cast<std::size_t>(h)] == kInvalid) ++h;
  const HalfedgeId back = surface.adjacency.opposite[static_cast<std::size_t>(h)];
  SplitSurface split;
  ASSERT_TRUE(split_surface(surface, {on_edge(h, 0.5, surface), on_edge(h, 0.125, surface)},
                            ExecutionContext(), split));
  const auto pieces = [&](HalfedgeId g) {
    std::vector<double> from;
    for (Index i = split.piece_begin[static_cast<std::size_t>(g)];
         i < split.piece_begin[static_cast<std::size_t>(g) + 1]; ++i)
      from.push_back(split.piece_from[static_cast<std::size_t>(i)]);
    return from;
  };
  EXPECT_EQ(pieces(h), (std::vector<double>{0.0, 0.125, 0.5}));
  EXPECT_EQ(pieces(back), (std::vector<double>{0.0, 0.5, 0.875}));
  const HalfedgeId first =
      split.piece[static_cast<std::size_t>(split.piece_begin[static_cast<std::size_t>(h)])];
  EXPECT_EQ(mesh::source(split.faces, first), mesh::source(s.faces, h));
}

TEST(SplitSurface, AFaceWithAnotherParentIsFound) {
  const mesh::Surface s = test::bumpy_grid(3, 2, 0.3, 2);
  const FlatSurface surface = test::flat(s);
  std::vector<AddedPoint> points{inside(4, surface, {0.25, 0.25, 0.5})};
  for (HalfedgeId h = 0; h < 3 * static_cast<Index>(s.faces.rows()); h += 4)
    points.push_back(on_edge(h, 0.375, surface));
  SplitSurface split;
  ASSERT_TRUE(split_surface(surface, points, ExecutionContext(), split));
  for (FaceId& parent : split.parent_face) {
    const FaceId own = parent;
    for (parent = 0; parent < static_cast<FaceId>(s.faces.rows()); ++parent)
      EXPECT_EQ(find_broken_invariant(surface, split) == "", parent == own) << own << " " << parent;
    parent = own;
  }
}

TEST(SplitSurface, PointsInOnePlaceAreOne) {
  const mesh::Surface s = test::grid(3, 3);
  const FlatSurface surface = test::flat(s);
  const AddedPoint point = inside(4, surface, {0.25, 0.25, 0.5});
  SplitSurface split;
  ASSERT_TRUE(split_surface(surface, {point, point}, ExecutionContext(), split));
  EXPECT_EQ(split.added.size(), 1U);
}

}  // namespace
}  // namespace flipfree::intrinsic::split_surface_test
