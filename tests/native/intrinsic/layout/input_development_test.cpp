// The development of a surface from that of the finer one it was split into.
#include "flipfree/intrinsic/layout/input_development.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "intrinsic/layout/traced.h"
#include "intrinsic/refined_start/flat_surfaces.h"

namespace flipfree::intrinsic::input_development_test {
namespace {

using test::to_plane;
using test::Traced;

TEST(NumberEdges, gives_both_sides_of_an_edge_one_number) {
  const mesh::Surface s = test::bumpy_grid(5, 4, 0.2, 2);
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(s.vertices.rows()), s.faces);
  const InputEdges edges = number_edges(adjacency);
  std::set<std::pair<VertexId, VertexId>> all;
  for (HalfedgeId h = 0; h < static_cast<Index>(edges.of_corner.size()); ++h) {
    all.insert(std::minmax(mesh::source(s.faces, h), mesh::target(s.faces, h)));
    const Index e = edges.of_corner[at(h)];
    const HalfedgeId first = edges.halfedge[at(e)];
    EXPECT_TRUE(first == h || adjacency.opposite[at(h)] == first);
    EXPECT_LE(first, h);
  }
  EXPECT_EQ(edges.halfedge.size(), all.size());
}

// The surface that the split one is, in the same plane.
mesh::Surface in_plane(const mesh::Surface& input, const SplitSurface& split) {
  mesh::Surface fine{input.vertices, split.faces};
  const auto known = input.vertices.rows();
  fine.vertices.conservativeResize(split.vertex_count, 3);
  for (std::size_t i = 0; i < split.added.size(); ++i) {
    Eigen::RowVector3d p = Eigen::RowVector3d::Zero();
    for (int k = 0; k < 3; ++k)
      p += split.added[i].weight[k] * input.vertices.row(input.faces(split.added[i].face, k));
    fine.vertices.row(known + static_cast<Eigen::Index>(i)) = p;
  }
  return fine;
}

struct Composed {
  mesh::Surface input;
  mesh::Adjacency adjacency;
  SplitSurface split;
  InputEdges edges;
  InputDevelopment developed;
};

// A sheared grid with points on edges and in faces.
Composed composed(unsigned seed) {
  Composed out;
  out.input = test::sheared_grid(seed);
  const FlatSurface flat = test::flat(out.input);
  out.adjacency = flat.adjacency;
  std::vector<AddedPoint> points;
  for (HalfedgeId h = 0; h < 3 * static_cast<Index>(out.input.faces.rows()); h += 7) {
    AddedPoint point;
    point.place.face = h / 3;
    const Vector2 a = flat.corner_at(h), b = flat.corner_at(next_corner(h));
    const double share = 0.25 + 0.5 * (h % 5) / 5.0;
    point.edge = h % 3 == 0 ? kInvalid : h;
    point.share = share;
    point.place.at = a + share * (b - a);
    if (h % 3 == 0) {
      point.place.at = (a + b + flat.corner_at(previous_corner(h))) / 3.0;
    }
    points.push_back(point);
  }
  EXPECT_TRUE(split_surface(flat, points, ExecutionContext(), out.split));
  const Traced traced(in_plane(out.input, out.split));
  const Development fine = traced.developed();
  out.edges = number_edges(out.adjacency);
  out.developed = composed_development(
      {&fine, &traced.overlaid.overlay.trace, &traced.overlaid.overlay.positions,
       &traced.overlaid.edges, &traced.adjacency},
      out.split, out.edges);
  return out;
}

TEST(ComposedDevelopment, has_the_inputs_faces_as_they_are) {
  for (unsigned seed = 1; seed < 5; ++seed) {
    const Composed c = composed(seed);
    ASSERT_GT(c.split.added.size(), 10U);
    const Development& d = c.developed.development;
    EXPECT_EQ(d.chart_count, 1);
    ASSERT_EQ(d.corner.size(), static_cast<std::size_t>(3 * c.input.faces.rows()));
    ASSERT_EQ(d.chart_of_face.size(), static_cast<std::size_t>(c.input.faces.rows()));
    for (CornerId k = 0; k < static_cast<Index>(d.corner.size()); ++k) {
      const auto place = [&](CornerId x) { return to_plane(d.corner[at(x)]); };
      const auto vertex = [&](CornerId x) -> Vector2 {
        return c.input.vertices.row(c.input.faces(x / 3, x % 3)).head<2>().transpose();
      };
      const CornerId n = next_corner(k), p = previous_corner(k);
      EXPECT_NEAR((place(k) - place(n)).norm(), (vertex(k) - vertex(n)).norm(), 1e-12);
      const Vector2 a = vertex(n) - vertex(k), b = vertex(p) - vertex(k);
      EXPECT_NEAR(d.corner_angle[at(k)], std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b)),
                  1e-11);
    }
  }
}

TEST(ComposedDevelopment, has_points_along_edges_in_order_with_their_places) {
  const Composed c = composed(3);
  const Development& d = c.developed.development;
  ASSERT_EQ(c.developed.begin.size(), c.edges.halfedge.size() + 1);
  ASSERT_EQ(c.developed.along.size(), d.crossing.size());
  std::size_t added = 0;
  for (std::size_t e = 0; e < c.edges.halfedge.size(); ++e) {
    const HalfedgeId h = c.edges.halfedge[e];
    const Vector2 from = to_plane(d.corner[at(h)]), to = to_plane(d.corner[at(next_corner(h))]);
    double last = 0.0;
    for (auto i = static_cast<std::size_t>(c.developed.begin[e]);
         i < static_cast<std::size_t>(c.developed.begin[e + 1]); ++i) {
      const Between& along = c.developed.along[i];
      EXPECT_NEAR(along.source + along.target, 1.0, 1e-14);
      EXPECT_GT(along.target, last);
      last = along.target;
      const Vector2 wanted = along.source * from + along.target * to;
      EXPECT_LT((to_plane(d.crossing[i][0]) - wanted).norm(), 1e-11);
      if (c.adjacency.opposite[at(h)] != kInvalid) {
        EXPECT_LT((to_plane(d.crossing[i][1]) - wanted).norm(), 1e-11);
      }
      const Index pieces = c.split.piece_begin[at(h) + 1] - c.split.piece_begin[at(h)];
      added += pieces > 1 ? 1 : 0;
    }
    EXPECT_LT(last, 1.0);
  }
  EXPECT_GT(added, 5U);
}

TEST(OwnDevelopment, keeps_what_was_traced) {
  const Traced traced(test::sheared_grid());
  const Overlay& overlay = traced.overlaid.overlay;
  const InputDevelopment own =
      own_development(traced.developed(), overlay.trace, overlay.positions);
  EXPECT_EQ(own.begin, overlay.trace.begin);
  ASSERT_EQ(own.along.size(), overlay.trace.crossings.size());
  EXPECT_EQ(own.development.crossing.size(), own.along.size());
}

}  // namespace
}  // namespace flipfree::intrinsic::input_development_test
