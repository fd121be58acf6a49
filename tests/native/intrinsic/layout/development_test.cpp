// Developments of flat surfaces against the surfaces themselves.
#include "flipfree/intrinsic/layout/development.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "flipfree/base/error.h"
#include "flipfree/numeric/big_float.h"
#include "intrinsic/layout/traced.h"

namespace flipfree::intrinsic::development_test {
namespace {

using test::to_plane;
using test::Traced;

double angle_at(const mesh::Surface& s, CornerId c) {
  const auto vertex = [&](CornerId k) -> Vector3 {
    return s.vertices.row(s.faces(k / 3, k % 3)).transpose();
  };
  const Vector3 a = vertex(next_corner(c)) - vertex(c), b = vertex(previous_corner(c)) - vertex(c);
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

void expect_isometric(const Traced& traced, const Development& d, double tolerance) {
  const mesh::Surface& s = traced.surface;
  for (CornerId c = 0; c < 3 * static_cast<Index>(s.faces.rows()); ++c) {
    const CornerId n = next_corner(c);
    EXPECT_NEAR(
        (to_plane(d.corner[at(c)]) - to_plane(d.corner[at(n)])).norm(),
        (s.vertices.row(s.faces(c / 3, c % 3)) - s.vertices.row(s.faces(n / 3, n % 3))).norm(),
        tolerance);
  }
}

TEST(Development, of_a_flat_disk_is_the_disk_and_its_parts_fit_bit_for_bit) {
  const Traced traced(test::sheared_grid());
  ASSERT_GT(traced.metric.euclidean_flips, 10U);
  const Development d = traced.developed();
  EXPECT_EQ(d.chart_count, 1);
  EXPECT_LT(d.closing_error, 1e-12);
  expect_isometric(traced, d, 1e-12);
  for (HalfedgeId h = 0; h < static_cast<Index>(traced.adjacency.opposite.size()); ++h) {
    const HalfedgeId o = traced.adjacency.opposite[at(h)];
    if (o == kInvalid) continue;
    EXPECT_EQ(to_plane(d.corner[at(h)]), to_plane(d.corner[at(next_corner(o))]));
  }
}

TEST(Development, crossings_lie_on_their_straight_edges_where_the_overlay_says) {
  const Traced traced(test::sheared_grid(5));
  const Development d = traced.developed();
  const Overlay& overlay = traced.overlaid.overlay;
  std::size_t seen = 0;
  for (std::size_t e = 0; e < traced.overlaid.edges.halfedge.size(); ++e) {
    const HalfedgeId h = traced.overlaid.edges.halfedge[e];
    const Vector2 from = to_plane(d.corner[at(h)]), to = to_plane(d.corner[at(next_corner(h))]);
    for (auto i = static_cast<std::size_t>(overlay.trace.begin[e]);
         i < static_cast<std::size_t>(overlay.trace.begin[e + 1]); ++i) {
      const Between& along = overlay.positions.on_curve[i];
      const Vector2 wanted = along.source * from + along.target * to;
      const auto& [left, right] = d.crossing[i];
      EXPECT_LT((to_plane(left) - wanted).norm(), 1e-11);
      if (traced.adjacency.opposite[at(h)] != kInvalid) {
        EXPECT_EQ(to_plane(left), to_plane(right));
      }
      ++seen;
    }
  }
  EXPECT_GT(seen, 20U);
}

TEST(Development, angles_are_those_of_the_surface_where_a_face_is_crossed) {
  const Traced traced(test::sheared_grid());
  const Development d = traced.developed();
  std::size_t crossed = 0;
  for (CornerId c = 0; c < static_cast<Index>(d.corner_angle.size()); ++c) {
    if (d.corner_angle[at(c)] == 0.0) continue;
    ++crossed;
    EXPECT_NEAR(d.corner_angle[at(c)], angle_at(traced.surface, c), 1e-11);
  }
  EXPECT_GT(crossed, 30U);
}

TEST(Development, every_piece_between_cuts_is_a_chart_of_its_own) {
  Traced traced(test::sheared_grid());
  // All edges of one face, and all others of another chart.
  mesh::EdgeFlags cuts(traced.adjacency.opposite.size(), 0);
  for (const FaceId f : {7, 22}) {
    for (CornerId c = 3 * f; c < 3 * f + 3; ++c) {
      cuts[at(c)] = 1;
      const HalfedgeId o = traced.adjacency.opposite[at(c)];
      if (o != kInvalid) cuts[at(o)] = 1;
    }
  }
  traced.cut_along(cuts);
  const Development d = traced.developed();
  EXPECT_EQ(d.chart_count, 3);
  expect_isometric(traced, d, 1e-12);
  const Index other = d.chart_of_face[0];
  for (FaceId f = 0; f < static_cast<Index>(d.chart_of_face.size()); ++f)
    EXPECT_EQ(d.chart_of_face[at(f)] == other, f != 7 && f != 22) << f;
  EXPECT_NE(d.chart_of_face[7], d.chart_of_face[22]);
}

// A cone that no cut passes: going around it, a place is reached twice, apart.
TEST(Development, the_gap_of_a_metric_that_is_not_flat_is_measured) {
  mesh::Surface pyramid = test::grid(2, 2);
  pyramid.vertices(4, 2) = 0.5;
  const Traced traced(pyramid);
  const Development d = traced.developed();
  EXPECT_GT(d.closing_error, 0.1);
}

TEST(Development, is_the_same_in_every_precision) {
  const Traced traced(test::sheared_grid(9));
  const Development d = traced.developed();
  std::vector<numeric::BigFloat<4>> precise;
  for (const double l : traced.lengths()) precise.emplace_back(l);
  const Development p = develop(traced.input(), precise, ExecutionContext());
  ASSERT_EQ(p.corner.size(), d.corner.size());
  for (std::size_t c = 0; c < d.corner.size(); ++c)
    EXPECT_LT((to_plane(d.corner[c]) - to_plane(p.corner[c])).norm(), 1e-12);
  // Lengths beyond the squares of doubles are developed in 80 bits.
  std::vector<double> tiny = traced.lengths();
  for (double& l : tiny) l *= 1e-200;
  const Development t = develop(traced.input(), tiny, ExecutionContext());
  for (std::size_t c = 0; c < d.corner.size(); ++c) {
    EXPECT_NEAR(static_cast<double>(t.corner[c].x * 1e200L), to_plane(d.corner[c]).x(), 1e-12);
    EXPECT_NEAR(static_cast<double>(t.corner[c].y * 1e200L), to_plane(d.corner[c]).y(), 1e-12);
  }
}

TEST(Development, can_be_cancelled) {
  const Traced traced(test::grid(40, 40));
  ExecutionContext context;
  context.cancel();
  EXPECT_THROW((void)develop(traced.input(), traced.lengths(), context), Cancelled);
}

}  // namespace
}  // namespace flipfree::intrinsic::development_test
