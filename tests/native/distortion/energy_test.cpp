#include "flipfree/distortion/energy/energy.h"

#include <gtest/gtest.h>

#include <cmath>

#include "distortion/random_maps.h"
#include "fuzz/rational.h"

namespace flipfree::distortion::energy_test {
namespace {

using test::random_map;

struct Map {
  mesh::Surface surface = flipfree::test::bumpy_grid(6, 5, 0.4, 2.0);
  std::vector<RestTriangle> rest = build_rest_shapes(surface, ExecutionContext()).triangles;
  Points2 uv;
  explicit Map(unsigned seed) {
    std::mt19937 random(seed);
    uv = random_map(surface, 0.1, random);
  }
  EnergySums sums(const Points2& at) const {
    return sum_energy(surface.faces, rest, at, ExecutionContext());
  }
};

TEST(Energy, the_best_scale_is_the_best_and_its_energy_is_foretold) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    const Map map(seed);
    const EnergySums before = map.sums(map.uv);
    const EnergySums after = map.sums(before.best_scale() * map.uv);
    EXPECT_NEAR(after.value() / before.at_best_scale(), 1.0, 1e-12);
    for (const double beside : {0.99, 1.01}) {
      EXPECT_GT(map.sums(beside * before.best_scale() * map.uv).value(), after.value());
    }
    EXPECT_NEAR(after.log_area - before.log_area, 2.0 * std::log(before.best_scale()), 1e-12);
    double largest = 0.0, sum = 0.0;
    for (std::size_t f = 0; f < map.rest.size(); ++f) {
      const auto at = [&](Index k) {
        return map.uv.data() + 2 * map.surface.faces(static_cast<Eigen::Index>(f), k);
      };
      const Jacobian j = jacobian(map.rest[f], at(0), at(1), at(2));
      const std::array<double, 2> s = singular_values(j);
      const double a = s[0] * before.best_scale(), b = s[1] * before.best_scale();
      const double energy = 0.25 * (a * a + b * b + 1 / (a * a) + 1 / (b * b));
      largest = std::max(largest, energy);
      sum += map.rest[f].weight * energy;
    }
    EXPECT_NEAR(sum / after.value(), 1.0, 1e-11);
    EXPECT_GE(before.worst_at_best_scale(), largest * (1 - 1e-12));
    EXPECT_LE(before.worst_at_best_scale(), 2.0 * largest);
  }
}

TEST(Energy, directional_derivatives_agree_with_differences_of_the_value) {
  for (unsigned seed = 0; seed < 50; ++seed) {
    const Map map(seed);
    std::mt19937 random(seed + 1000);
    std::uniform_real_distribution<double> unit(-1, 1);
    Points2 direction(map.uv.rows(), 2);
    for (double& x : direction.reshaped()) x = unit(random);
    const double step = 1e-7 * step_to_first_flip(map.surface.faces, map.uv, direction, {});
    ASSERT_GT(step, 0.0);
    const double difference = (map.sums(map.uv + step * direction).value() -
                               map.sums(map.uv - step * direction).value()) /
                              (2 * step);
    const double slope =
        directional_derivative(map.surface.faces, map.rest, map.uv, direction, ExecutionContext());
    EXPECT_NEAR(slope, difference, 1e-5 * map.sums(map.uv).value() / (1e7 * step) + 1e-6);
  }
}

TEST(StepToFirstFlip, the_map_is_flip_free_just_before_it_and_not_just_after) {
  const ExecutionContext context;
  int finite = 0, endless = 0;
  for (unsigned seed = 0; seed < 300; ++seed) {
    const Map map(seed);
    std::mt19937 random(seed + 2000);
    std::uniform_real_distribution<double> unit(-1, 1);
    Points2 direction(map.uv.rows(), 2);
    if (seed % 3 == 0) {
      direction = map.uv;  // growing for ever
    } else {
      for (double& x : direction.reshaped()) x = unit(random);
    }
    const double step = step_to_first_flip(map.surface.faces, map.uv, direction, context);
    const auto good = [&](double t) {
      return is_flip_free(map.surface.faces, map.uv + t * direction, context);
    };
    if (std::isfinite(step)) {
      ++finite;
      EXPECT_TRUE(good(0.5 * step));
      EXPECT_TRUE(good(step * (1 - 1e-6)));
      EXPECT_FALSE(good(step * (1 + 1e-6)));
    } else {
      ++endless;
      EXPECT_TRUE(good(1.0));
      EXPECT_TRUE(good(100.0));
    }
  }
  EXPECT_GT(finite, 100);
  EXPECT_GT(endless, 50);
}

TEST(FlipFree, agrees_with_rational_numbers_for_any_number_of_threads) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> place(-1, 1);
  constexpr Index kFaces = 20000;
  Triangles faces(kFaces, 3);
  Points2 uv(3 * kFaces, 2);
  std::vector<FaceId> expected;
  for (Index f = 0; f < kFaces; ++f) {
    faces.row(f) << 3 * f, 3 * f + 1, 3 * f + 2;
    uv.middleRows<2>(3 * f) << place(random), place(random), place(random), place(random);
    uv.row(3 * f + 2) = uv.row(3 * f) + place(random) * (uv.row(3 * f + 1) - uv.row(3 * f));
    const auto at = [&](Index k) { return fuzz::exact(uv.row(3 * f + k).transpose()); };
    if (fuzz::side(at(0), at(1), at(2)) <= 0) expected.push_back(f);
  }
  for (const int threads : {1, 3}) {
    ExecutionContext context;
    context.threads = threads;
    EXPECT_EQ(flipped_faces(faces, uv, context), expected);
    EXPECT_FALSE(is_flip_free(faces, uv, context));
  }
  Triangles good(kFaces - static_cast<Index>(expected.size()), 3);
  Index next = 0;
  for (Index f = 0; f < kFaces; ++f) {
    if (!std::binary_search(expected.begin(), expected.end(), f)) good.row(next++) = faces.row(f);
  }
  EXPECT_TRUE(is_flip_free(good, uv, ExecutionContext()));
}

}  // namespace
}  // namespace flipfree::distortion::energy_test
