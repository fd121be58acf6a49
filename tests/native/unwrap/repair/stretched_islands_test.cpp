#include "flipfree/unwrap/repair/mend_chart.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "flipfree/certify/measures.h"
#include "support/shapes.h"

namespace flipfree::unwrap::stretched_islands_test {
namespace {

// A sheet over the unit square, the only chart of its map, whose map is drawn out by `stretch`
// along one axis.
struct Only {
  mesh::Chart chart;
  std::vector<VertexId> origin;
  Points2 places;
  std::vector<char> unknown;
  std::vector<std::pair<VertexId, Vector2>> pins;
  mesh::EdgeFlags seams;
  RepairOptions options;
  MendedChart mended;

  explicit Only(Index cells, double stretch) {
    chart.surface = test::bumpy_grid(cells, cells, 0.1, 2.0);
    chart.faces.resize(static_cast<std::size_t>(chart.surface.faces.rows()));
    std::iota(chart.faces.begin(), chart.faces.end(), 0);
    chart.vertices.resize(static_cast<std::size_t>(chart.surface.vertices.rows()));
    std::iota(chart.vertices.begin(), chart.vertices.end(), 0);
    origin = chart.vertices;
    places = chart.surface.vertices.leftCols<2>();
    places.col(0) *= stretch;
    places.col(1) /= stretch;
    unknown.assign(origin.size(), 0);
    seams.assign(3 * chart.faces.size(), 0);
    mended.uv.resize(chart.surface.faces.size(), 2);
    for (Eigen::Index c = 0; c < mended.uv.rows(); ++c)
      mended.uv.row(c) = places.row(chart.surface.faces.data()[c]);
    mended.place.assign(chart.faces.size(), Place::kStays);
    mended.remade.assign(chart.faces.size(), 0);
  }

  void judge(StretchedIslands what) {
    options.stretched = what;
    ExecutionContext context;
    judge_stretched({chart, origin, places, unknown, pins, seams, {}, 1.0}, options, mended,
                    context);
  }
  double energy() const { return certify::symmetric_dirichlet(chart.surface, mended.uv).mean; }
  void pin(VertexId v) { pins.emplace_back(v, places.row(v).transpose()); }
};

TEST(StretchedIslands, a_map_near_its_unwrap_is_none) {
  Only only(6, 1.1);
  const Points2 before = only.mended.uv;
  only.judge(StretchedIslands::kImprove);
  EXPECT_EQ(only.mended.uv, before);
  EXPECT_EQ(only.mended.stretched.left, 0);
  EXPECT_EQ(only.mended.stretched.improved, 0);
}

TEST(StretchedIslands, they_are_counted_and_stay) {
  Only only(6, 1.6);
  const Points2 before = only.mended.uv;
  only.judge(StretchedIslands::kCount);
  EXPECT_EQ(only.mended.uv, before);
  EXPECT_EQ(only.mended.stretched.left, 1);
  only.mended.stretched = {};
  only.judge(StretchedIslands::kIgnore);
  EXPECT_EQ(only.mended.stretched.left, 0);
}

TEST(StretchedIslands, they_are_made_better_where_they_are_and_at_their_size) {
  Only only(8, 1.6);
  const Points2 before = only.mended.uv;
  only.judge(StretchedIslands::kImprove);
  EXPECT_EQ(only.mended.stretched.improved, 1);
  EXPECT_EQ(only.mended.stretched.left, 0);
  EXPECT_EQ(only.mended.place.front(), Place::kWhereItWas);
  EXPECT_EQ(only.mended.remade, std::vector<char>(only.mended.remade.size(), 1));
  EXPECT_EQ(only.mended.before, before);
  EXPECT_LT(only.energy(), 1.05);
  EXPECT_TRUE(certify::flipped_faces(only.mended.uv).empty());
  const Eigen::RowVector2d middle = only.mended.uv.colwise().mean();
  EXPECT_LT((middle - before.colwise().mean()).norm(), 0.02);
  const Eigen::RowVector2d size =
      only.mended.uv.colwise().maxCoeff() - only.mended.uv.colwise().minCoeff();
  EXPECT_NEAR(size.x(), 1.0, 0.1);
  EXPECT_NEAR(size.y(), 1.0, 0.1);
}

// A cylinder drawn as a ring, with a seam that would open it.
struct Ring : Only {
  Ring() : Only(2, 1.0) {
    chart.surface = test::cylinder(24, 6);
    chart.surface.vertices.col(2) *= 5.0;
    const Points3& points = chart.surface.vertices;
    const Triangles& faces = chart.surface.faces;
    places.resize(points.rows(), 2);
    for (const double side : {1.0, -1.0}) {
      for (VertexId v = 0; v < points.rows(); ++v)
        places.row(v) = (1.0 + points(v, 2)) *
                        points.row(v).head<2>().cwiseProduct(Eigen::RowVector2d(side, 1.0));
      mended.uv.resize(faces.size(), 2);
      for (Eigen::Index c = 0; c < mended.uv.rows(); ++c)
        mended.uv.row(c) = places.row(faces.data()[c]);
      if (certify::flipped_faces(mended.uv).empty()) break;
    }
    chart.faces.resize(static_cast<std::size_t>(faces.rows()));
    std::iota(chart.faces.begin(), chart.faces.end(), 0);
    chart.vertices.resize(static_cast<std::size_t>(points.rows()));
    std::iota(chart.vertices.begin(), chart.vertices.end(), 0);
    origin = chart.vertices;
    unknown.assign(origin.size(), 0);
    mended.place.assign(chart.faces.size(), Place::kStays);
    mended.remade.assign(chart.faces.size(), 0);
    seams.assign(3 * chart.faces.size(), 0);
  }
  void mark_seam() {
    const Triangles& faces = chart.surface.faces;
    const auto on_it = [&](VertexId v) {
      return std::abs(chart.surface.vertices(v, 1)) < 1e-9 && chart.surface.vertices(v, 0) > 0.0;
    };
    for (CornerId c = 0; c < static_cast<CornerId>(faces.size()); ++c)
      seams[static_cast<std::size_t>(c)] =
          on_it(faces.data()[c]) && on_it(faces(c / 3, (c + 1) % 3));
  }
};

TEST(StretchedIslands, what_no_descent_makes_better_is_unwrapped_again_along_its_seams) {
  Ring ring;
  ASSERT_TRUE(certify::flipped_faces(ring.mended.uv).empty());
  ring.mark_seam();
  ASSERT_EQ(std::count(ring.seams.begin(), ring.seams.end(), 1), 12);
  const Points2 before = ring.mended.uv;
  ring.judge(StretchedIslands::kImprove);
  EXPECT_EQ(ring.mended.stretched.anew, 1);
  EXPECT_EQ(ring.mended.stretched.improved, 0);
  EXPECT_EQ(ring.mended.stretched.left, 0);
  EXPECT_EQ(ring.mended.cut, ring.seams);
  EXPECT_LT(ring.energy(), 1.01);
  EXPECT_LT((ring.mended.uv.colwise().mean() - before.colwise().mean()).norm(), 0.5);
}

TEST(StretchedIslands, pins_hold_and_those_that_force_it_are_counted) {
  Only only(8, 1.0);
  // A row pinned at half its length: the rest can only follow.
  for (VertexId v = 0; v < only.places.rows(); ++v) {
    const double x = only.chart.surface.vertices(v, 0);
    only.places.row(v) << (x < 0.5 ? 0.1 * x : 0.05 + 1.9 * (x - 0.5)), only.places(v, 1);
  }
  for (VertexId v = 0; v < only.places.rows(); ++v) only.pin(v);
  for (Eigen::Index c = 0; c < only.mended.uv.rows(); ++c)
    only.mended.uv.row(c) = only.places.row(only.chart.surface.faces.data()[c]);
  const Points2 before = only.mended.uv;
  only.judge(StretchedIslands::kImprove);
  EXPECT_EQ(only.mended.uv, before);
  // The unwrap with all these pins is that map.
  EXPECT_EQ(only.mended.stretched.left, 0);
  only.pins.resize(2);
  only.judge(StretchedIslands::kImprove);
  EXPECT_EQ(only.mended.stretched.improved + only.mended.stretched.anew, 1);
  EXPECT_LT(only.energy(), 1.3);
  for (Eigen::Index c = 0; c < only.mended.uv.rows(); ++c) {
    if (only.chart.surface.faces.data()[c] < 2) {
      EXPECT_EQ(only.mended.uv.row(c), before.row(c));
    }
  }
}

TEST(StretchedIslands, what_was_unwrapped_is_not_judged) {
  Only only(6, 2.0);
  only.mended.change = Change::kAnew;
  only.judge(StretchedIslands::kImprove);
  EXPECT_EQ(only.mended.before.rows(), 0);
}

TEST(StretchedIslands, a_count_ends_with_its_time_but_does_not_fail) {
  Only only(6, 2.0);
  only.options.stretched = StretchedIslands::kCount;
  ExecutionContext context;
  const TimeLimit limit(context, 0.0);
  EXPECT_NO_THROW(judge_stretched(
      {only.chart, only.origin, only.places, only.unknown, only.pins, only.seams, {}, 1.0},
      only.options, only.mended, context));
  EXPECT_EQ(only.mended.stretched.left, 0);
}

}  // namespace
}  // namespace flipfree::unwrap::stretched_islands_test
