// Which turns are chosen for loops: judged by trying all.
#include "flipfree/seamless/near_turns.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include "flipfree/base/error.h"

namespace flipfree::seamless::near_turns_test {
namespace {

constexpr double kQuarterTurn = std::numbers::pi / 2;

// Cones among flat vertices.
std::vector<Index> with(std::vector<Index> cones) {
  cones.insert(cones.end(), 5, 4);
  return cones;
}

std::vector<double> quarters(std::vector<double> turns) {
  for (double& t : turns) t *= kQuarterTurn;
  return turns;
}

const Eigen::MatrixXd kPlain = Eigen::MatrixXd::Identity(2, 2);

std::string anything(const std::vector<Index>&) { return ""; }

double cost(const std::vector<Index>& turns, const std::vector<double>& angles,
            const Eigen::MatrixXd& norm) {
  double sum = 0.0;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    for (std::size_t k = 0; k < turns.size(); ++k) {
      sum += norm(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) *
             (turns[i] - angles[i] / kQuarterTurn) * (turns[k] - angles[k] / kQuarterTurn);
    }
  }
  return sum;
}

struct Problem {
  std::vector<double> angles;
  Eigen::MatrixXd norm;
};

// `shear`: how far from loops that cost alike and do not touch each other.
Problem at_random(std::mt19937& random, Eigen::Index count, double shear) {
  std::normal_distribution<double> normal;
  Problem problem;
  Eigen::MatrixXd a = Eigen::MatrixXd::Identity(count, count);
  for (double& x : a.reshaped()) x += shear * normal(random);
  problem.norm = a.transpose() * a + 1e-3 * Eigen::MatrixXd::Identity(count, count);
  for (Eigen::Index i = 0; i < count; ++i) problem.angles.push_back(3.0 * normal(random));
  return problem;
}

TEST(NearTurns, TakesTheNearestThatExist) {
  const auto nearest = [](const std::vector<Index>& cones, const std::vector<double>& turns) {
    return near_turns(cones, 1, quarters(turns), kPlain, 1).front();
  };
  EXPECT_EQ(nearest(with({3, 5, 3, 5}), {0.4, -1.7}), (std::vector<Index>{0, -2}));
  // Both even: the second loop, which is nearest to another number, gives way.
  EXPECT_EQ(nearest(with({2, 6}), {0.1, 1.7}), (std::vector<Index>{0, 1}));
  EXPECT_THROW(nearest(with({3, 5}), {0.0, 0.0}), Infeasible);
}

TEST(NearTurns, OffersOthersByRisingCost) {
  const auto turns = near_turns(with({3, 5, 3, 5}), 1, quarters({0.1, -1.7}), kPlain, 5);
  ASSERT_EQ(turns.size(), 4u);
  EXPECT_EQ(turns[0], (std::vector<Index>{0, -2}));
  EXPECT_EQ(turns[1], (std::vector<Index>{0, -1}));
  EXPECT_EQ(turns[2], (std::vector<Index>{1, -2}));
  EXPECT_EQ(turns[3], (std::vector<Index>{1, -1}));
}

// Of up to four loops, beside all numbers within three of the angles. Those of the reduced basis
// that no two changes improve need not be the nearest, but hardly ever are not.
TEST(NearTurns, NothingIsNearerThanTheFirst) {
  std::mt19937 random(7);
  int missed = 0;
  constexpr int kTries = 2000;
  for (int i = 0; i < kTries; ++i) {
    const Eigen::Index count = 1 + i % 4;
    const Problem problem = at_random(random, count, i % 2 == 0 ? 0.3 : 1.0);
    const auto found = near_turns(problem.angles, problem.norm, 1, anything).front();
    double best = std::numeric_limits<double>::infinity();
    std::vector<Index> tried(found.size());
    int ways = 1;
    for (Eigen::Index k = 0; k < count; ++k) ways *= 7;
    for (int way = 0; way < ways; ++way) {
      for (std::size_t k = 0, left = static_cast<std::size_t>(way); k < tried.size();
           ++k, left /= 7) {
        tried[k] = static_cast<Index>(std::lround(problem.angles[k] / kQuarterTurn)) +
                   static_cast<Index>(left % 7) - 3;
      }
      best = std::min(best, cost(tried, problem.angles, problem.norm));
    }
    std::vector<Index> rounded;
    for (const double x : problem.angles)
      rounded.push_back(static_cast<Index>(std::lround(x / kQuarterTurn)));
    const double of_found = cost(found, problem.angles, problem.norm);
    EXPECT_LE(of_found, cost(rounded, problem.angles, problem.norm) * (1.0 + 1e-9));
    if (of_found > best * (1.0 + 1e-6)) ++missed;
  }
  EXPECT_LE(missed, kTries / 200);
}

TEST(NearTurns, WithoutANormEveryLoopCountsAlone) {
  const Eigen::MatrixXd none = Eigen::MatrixXd::Constant(2, 2, std::nan(""));
  EXPECT_EQ(near_turns(quarters({0.4, -1.7}), none, 1, anything).front(),
            (std::vector<Index>{0, -2}));
  const Eigen::MatrixXd negative = -Eigen::MatrixXd::Identity(2, 2);
  EXPECT_EQ(near_turns(quarters({2.6, 0.1}), negative, 1, anything).front(),
            (std::vector<Index>{3, 0}));
}

}  // namespace
}  // namespace flipfree::seamless::near_turns_test
