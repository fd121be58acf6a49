#include "flipfree/certify/measures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "fuzz/rational.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::certify::seamless_test {
namespace {

using test::adjacency_of;
using test::flat;

// Two triangles with a common edge, the second one's values turned and moved.
struct Seam {
  mesh::Surface surface = test::grid(1, 1);
  mesh::Adjacency adjacency = adjacency_of(surface);
  Points2 uv = flat(surface);
  // The common edge's half-edges, lower first.
  HalfedgeId first = kInvalid, second = kInvalid;
  Seam() {
    for (HalfedgeId h = 0; h < 3; ++h) {
      if (adjacency.opposite[static_cast<std::size_t>(h)] == kInvalid) continue;
      first = h;
      second = adjacency.opposite[static_cast<std::size_t>(h)];
    }
  }
  std::vector<HalfedgeId> failures() const {
    return seam_failures(adjacency, mesh::EdgeFlags(6, 1), uv);
  }
  // Is one side's vector a quarter turn of the other's, in rational numbers?
  bool fits() const {
    const auto vector = [&](CornerId from, CornerId to) {
      const fuzz::Point a = fuzz::exact(uv.row(from).transpose());
      const fuzz::Point b = fuzz::exact(uv.row(to).transpose());
      return fuzz::Point{b.x - a.x, b.y - a.y};
    };
    const fuzz::Point p = vector(first, next_corner(first));
    fuzz::Point q = vector(next_corner(second), second);
    for (int turn = 0; turn < 4; ++turn) {
      if (p == q) return true;
      q = {-q.y, q.x};
    }
    return false;
  }
};

TEST(Seams, are_judged_as_rational_numbers_judge_them) {
  std::mt19937 random(2);
  int fitting = 0;
  for (int i = 0; i < 4000; ++i) {
    Seam seam;
    // Values whose differences round, now and then.
    const auto value = [&] {
      const double x = static_cast<double>(random() % 8) - 4.0;
      return random() % 2 == 0 ? x : std::ldexp(x, -static_cast<int>(random() % 80));
    };
    const Vector2 vector(value(), value());
    const Vector2 from(value(), value());
    const Vector2 other(value(), value());
    Vector2 turned = vector;
    for (unsigned turn = random() % 4; turn > 0; --turn) turned = {-turned.y(), turned.x()};
    seam.uv.row(seam.first) = from;
    seam.uv.row(next_corner(seam.first)) = from + vector;
    seam.uv.row(next_corner(seam.second)) = other;
    seam.uv.row(seam.second) = other + turned;
    const bool fits = seam.fits();
    fitting += fits;
    EXPECT_EQ(seam.failures(),
              fits ? std::vector<HalfedgeId>{} : std::vector<HalfedgeId>{seam.first});
  }
  EXPECT_GT(fitting, 1000);
  EXPECT_LT(fitting, 3900);
}

TEST(Seams, values_that_are_no_numbers_are_a_failure) {
  Seam seam;
  seam.uv(seam.second, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(seam.failures(), std::vector<HalfedgeId>{seam.first});
}

TEST(Seams, only_cut_edges_with_two_sides_are_judged) {
  const mesh::Surface surface = test::grid(1, 1);
  const mesh::Adjacency adjacency = adjacency_of(surface);
  Points2 uv = flat(surface);
  EXPECT_TRUE(seam_failures(adjacency, mesh::EdgeFlags(6, 1), uv).empty());
  uv.bottomRows(3) *= 2.0;
  EXPECT_TRUE(seam_failures(adjacency, mesh::EdgeFlags(6, 0), uv).empty());
  EXPECT_EQ(seam_failures(adjacency, mesh::EdgeFlags(6, 1), uv).size(), 1U);
}

TEST(Seams, deviation_and_quarter_turn_are_those_of_the_nearest_turn) {
  const mesh::Surface surface = test::grid(1, 1);
  const mesh::Adjacency adjacency = adjacency_of(surface);
  Points2 uv = flat(surface);
  for (CornerId c = 3; c < 6; ++c) {
    const Vector2 p = uv.row(c);
    uv.row(c) << 4 - p.y(), 3 + p.x();
  }
  const auto exact = measure_seams(adjacency, mesh::EdgeFlags(6, 1), uv);
  ASSERT_EQ(exact.size(), 1U);
  EXPECT_EQ(exact[0].quarter_turns, 1);
  EXPECT_EQ(exact[0].translation, Vector2(4, 3));
  EXPECT_EQ(exact[0].deviation, 0.0);
  uv.bottomRows(3) *= 1.5;
  const auto scaled = measure_seams(adjacency, mesh::EdgeFlags(6, 1), uv);
  EXPECT_EQ(scaled[0].quarter_turns, 1);
  EXPECT_NEAR(scaled[0].deviation, 0.5 * std::sqrt(2.0), 1e-15);
}

}  // namespace
}  // namespace flipfree::certify::seamless_test
