// Orders of holes: what they must fulfil, and how short they are.
#include "flipfree/seamless/padding/straight/hole_tour.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <random>
#include <set>

#include "flipfree/seamless/padding/topology/holes.h"

namespace flipfree::seamless::hole_tour_test {
namespace {

using Costs = std::vector<std::vector<double>>;

// Distances of random places in a square.
Costs random_costs(Index holes, unsigned seed) {
  std::mt19937 random(seed);
  const auto coordinate = [&] { return static_cast<double>(random() % 1000) / 1000.0; };
  std::vector<Vector2> places;
  for (Index i = 0; i < holes; ++i) places.emplace_back(coordinate(), coordinate());
  Costs cost(at(holes), std::vector<double>(at(holes)));
  for (std::size_t i = 0; i < cost.size(); ++i) {
    for (std::size_t j = 0; j < cost.size(); ++j) cost[i][j] = (places[i] - places[j]).norm();
  }
  return cost;
}

bool has_odd_couple(const std::vector<Index>& order) {
  for (std::size_t i = 1; i + 1 < order.size(); ++i) {
    for (std::size_t j = i + 2; j + 1 < order.size(); j += 2) {
      if (order[j] == partner_of(order[i])) return true;
    }
  }
  return false;
}

TEST(HoleTour, EndsInPartnersWithAnOddCoupleAndIsShorterThanFromNearestToNearest) {
  for (const Index loops : {1, 2, 3, 4, 7, 20, 40}) {
    const Costs cost = random_costs(2 * loops, static_cast<unsigned>(loops));
    ExecutionContext context;
    const std::vector<Index> order = hole_tour(cost, loops > 2, context);
    ASSERT_EQ(order.size(), cost.size());
    EXPECT_EQ(std::set<Index>(order.begin(), order.end()).size(), order.size());
    EXPECT_EQ(order.back(), partner_of(order.front()));
    EXPECT_EQ(has_odd_couple(order), loops > 2);
    std::vector<HolePair> pairs;
    for (Index a = 0; a < 2 * loops; ++a) {
      for (Index b = a + 1; b < 2 * loops; ++b) pairs.push_back({a, b, cost[at(a)][at(b)]});
    }
    const std::vector<Index> greedy = hole_order(2 * loops, pairs, loops > 2);
    EXPECT_LE(tour_cost(cost, order), tour_cost(cost, greedy) * (1.0 + 1e-12));
    if (loops > 10) {
      EXPECT_LT(tour_cost(cost, order), 0.95 * tour_cost(cost, greedy));
    }
    EXPECT_EQ(hole_tour(cost, loops > 2, context), order);
  }
}

TEST(HoleTour, IsMostlyTheShortestOfAllWhereAllCanBeTried) {
  Index shortest = 0;
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Costs cost = random_costs(8, 100 + seed);
    ExecutionContext context;
    const double found = tour_cost(cost, hole_tour(cost, true, context));
    double least = std::numeric_limits<double>::infinity();
    for (Index first = 0; first < 8; first += 2) {
      std::vector<Index> middle;
      for (Index hole = 0; hole < 8; ++hole) {
        if (hole / 2 != first / 2) middle.push_back(hole);
      }
      do {
        std::vector<Index> order = {first};
        order.insert(order.end(), middle.begin(), middle.end());
        order.push_back(partner_of(first));
        if (has_odd_couple(order)) least = std::min(least, tour_cost(cost, order));
      } while (std::next_permutation(middle.begin(), middle.end()));
    }
    EXPECT_GE(found, least * (1.0 - 1e-12));
    EXPECT_LE(found, 1.25 * least);
    shortest += found <= least * (1.0 + 1e-12);
  }
  EXPECT_GE(shortest, 14);
}

}  // namespace
}  // namespace flipfree::seamless::hole_tour_test
