#include "flipfree/distortion/minimize/boundary_barrier.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "support/shapes.h"

namespace flipfree::distortion::boundary_barrier_test {
namespace {

// A strip bent into a C whose ends come near each other, its boundary a little ragged.
Points2 bent(const mesh::Surface& strip, double gap, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> noise(-0.01, 0.01);
  Points2 uv(strip.vertices.rows(), 2);
  for (VertexId v = 0; v < uv.rows(); ++v) {
    const double angle = (2.0 * M_PI - gap) * strip.vertices(v, 0);
    const double radius = 1.0 - 0.3 * strip.vertices(v, 1);
    uv.row(v) << radius * std::cos(angle) + noise(random), radius * std::sin(angle) + noise(random);
  }
  return uv;
}

struct Bent {
  mesh::Surface strip = test::grid(20, 2);
  BoundaryBarrier barrier{strip};
  BoundaryBarrier::Reach reach;
  Bent() {
    reach.unit = 6.0;
    reach.weight = 0.7;
  }
};

TEST(BoundaryBarrier, contacts_are_the_pairs_within_reach_with_their_distance) {
  Bent bent_strip;
  const BoundaryBarrier& barrier = bent_strip.barrier;
  int contacts = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    const Points2 uv = bent(bent_strip.strip, 0.02 + 0.01 * seed, seed);
    double sum = 0.0;
    std::vector<std::array<VertexId, 3>> found;
    for (const BoundaryBarrier::Contact& c : barrier.contacts(uv, bent_strip.reach)) {
      ++contacts;
      found.push_back(c.vertices);
      const auto [p, a, b] = c.vertices;
      EXPECT_TRUE(p != a && p != b);
      EXPECT_NEAR(c.normal.norm(), 1.0, 1e-12);
      EXPECT_GT(c.value, 0.0);
      EXPECT_LT(c.slope, 0.0);
      EXPECT_GT(c.curvature, 0.0);
      // The closest point: no other of the edge is nearer.
      const Vector2 point = uv.row(p), from = uv.row(a), to = uv.row(b);
      const double distance = (point - from - c.t * (to - from)).norm();
      for (int i = 0; i <= 100; ++i)
        EXPECT_GE((point - from - 0.01 * i * (to - from)).norm(), distance * (1 - 1e-12));
      // value = weight (h / d - 1)^2, slope its derivative by d: both for one h.
      const double h = distance * (1 + std::sqrt(c.value / bent_strip.reach.weight));
      EXPECT_NEAR(c.slope,
                  -2 * bent_strip.reach.weight * (h / distance - 1) * h / (distance * distance),
                  1e-9 * std::abs(c.slope));
      sum += c.value;
    }
    EXPECT_NEAR(barrier.value(uv, bent_strip.reach), sum, 1e-12 * (1 + sum));
    std::sort(found.begin(), found.end());
    EXPECT_EQ(std::adjacent_find(found.begin(), found.end()), found.end()) << "a pair twice";
  }
  EXPECT_GT(contacts, 100);
}

TEST(BoundaryBarrier, contacts_give_the_gradient_of_the_value) {
  Bent bent_strip;
  for (const double factor : {1.0, 3.0}) {
    bent_strip.reach.factor = factor;
    const Points2 uv = bent(bent_strip.strip, 0.05, 3);
    Points2 gradient = Points2::Zero(uv.rows(), 2);
    const auto contacts = bent_strip.barrier.contacts(uv, bent_strip.reach);
    ASSERT_FALSE(contacts.empty());
    for (const BoundaryBarrier::Contact& c : contacts) {
      const double share[3] = {1.0, -(1.0 - c.t), -c.t};
      for (std::size_t i = 0; i < 3; ++i)
        gradient.row(c.vertices[i]) += c.slope * share[i] * c.normal.transpose();
    }
    for (VertexId v = 0; v < uv.rows(); ++v) {
      for (Index axis = 0; axis < 2; ++axis) {
        const double h = 1e-7;
        Points2 plus = uv, minus = uv;
        plus(v, axis) += h;
        minus(v, axis) -= h;
        const double difference = (bent_strip.barrier.value(plus, bent_strip.reach) -
                                   bent_strip.barrier.value(minus, bent_strip.reach)) /
                                  (2 * h);
        EXPECT_NEAR(gradient(v, axis), difference, 1e-4 * (1 + gradient.cwiseAbs().maxCoeff()));
      }
    }
  }
}

TEST(BoundaryBarrier, couplings_hold_for_contacts_after_motions_below_half_of_the_reach) {
  Bent bent_strip;
  std::mt19937 random(4);
  for (unsigned seed = 0; seed < 30; ++seed) {
    const Points2 uv = bent(bent_strip.strip, 0.1, seed);
    const auto couplings = bent_strip.barrier.couplings(uv, bent_strip.reach);
    EXPECT_TRUE(std::is_sorted(couplings.begin(), couplings.end()));
    EXPECT_EQ(std::adjacent_find(couplings.begin(), couplings.end()), couplings.end());
    // The shortest boundary edge is 1 / 20 long, of whose reach a share is left to either side.
    std::uniform_real_distribution<double> motion(-0.005, 0.005);
    Points2 moved = uv;
    for (double& x : moved.reshaped()) x += motion(random);
    for (const auto& c : bent_strip.barrier.contacts(moved, bent_strip.reach)) {
      for (const VertexId end : {c.vertices[1], c.vertices[2]}) {
        const std::array<VertexId, 2> pair = {std::min(c.vertices[0], end),
                                              std::max(c.vertices[0], end)};
        EXPECT_TRUE(std::binary_search(couplings.begin(), couplings.end(), pair));
      }
    }
  }
}

TEST(BoundaryBarrier, an_isometric_chart_with_room_has_no_contacts) {
  const mesh::Surface grid = test::grid(8, 8);
  const BoundaryBarrier barrier(grid);
  EXPECT_TRUE(barrier.contacts(grid.vertices.leftCols<2>(), {}).empty());
  EXPECT_EQ(barrier.value(grid.vertices.leftCols<2>(), {}), 0.0);
}

}  // namespace
}  // namespace flipfree::distortion::boundary_barrier_test
