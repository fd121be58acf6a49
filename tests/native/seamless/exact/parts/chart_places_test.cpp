#include "flipfree/seamless/exact/parts/chart_places.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace flipfree::seamless::chart_places_test {
namespace {

constexpr double kStep = 0x1p-20;

// Triangles of random size at random places of the grid, one chart each.
Points2 triangles(int count, std::mt19937& random) {
  Points2 uv(3 * count, 2);
  for (int f = 0; f < count; ++f) {
    const auto draw = [&](unsigned most) {
      return kStep * std::floor(static_cast<double>(random() % most));
    };
    const Vector2 place(draw(1 << 20), draw(1 << 20));
    const double width = kStep + draw(1 << 19), height = kStep + draw(1 << 19);
    uv.row(3 * f) = place;
    uv.row(3 * f + 1) = place + Vector2(width, 0);
    uv.row(3 * f + 2) = place + Vector2(0, height);
  }
  return uv;
}

TEST(ChartPlaces, boxesDoNotMeetAndNothingIsRounded) {
  std::mt19937 random(3);
  for (int count = 2; count < 40; ++count) {
    const Points2 before = triangles(count, random);
    Points2 after = before;
    std::vector<Index> chart(static_cast<std::size_t>(count));
    for (int f = 0; f < count; ++f) chart[static_cast<std::size_t>(f)] = f;
    spread_charts(chart, count, kStep, after);
    for (int f = 0; f < count; ++f) {
      const Vector2 a = after.row(3 * f + 1) - after.row(3 * f),
                    b = before.row(3 * f + 1) - before.row(3 * f);
      const Vector2 c = after.row(3 * f + 2) - after.row(3 * f),
                    d = before.row(3 * f + 2) - before.row(3 * f);
      EXPECT_TRUE(a == b && c == d);
      for (int g = 0; g < f; ++g) {
        const bool beside =
            after(3 * f, 0) > after(3 * g + 1, 0) || after(3 * g, 0) > after(3 * f + 1, 0);
        const bool above =
            after(3 * f, 1) > after(3 * g + 2, 1) || after(3 * g, 1) > after(3 * f + 2, 1);
        EXPECT_TRUE(beside || above);
      }
    }
    EXPECT_TRUE((after / kStep).array().round().matrix() == after / kStep);
    EXPECT_LE(after.cwiseAbs().maxCoeff(), 0x1p23 * kStep);
  }
}

TEST(ChartPlaces, oneChartStaysWhereItIs) {
  std::mt19937 random(4);
  const Points2 before = triangles(5, random);
  Points2 after = before;
  spread_charts(std::vector<Index>(5, 0), 1, kStep, after);
  EXPECT_TRUE(after == before);
}

TEST(ChartPlaces, whatWouldNotFitTheGridStays) {
  std::mt19937 random(5);
  const Points2 before = triangles(4, random);
  Points2 after = before;
  spread_charts({0, 1, 2, 3}, 4, kStep * 0x1p-8, after);
  EXPECT_TRUE(after == before);
}

}  // namespace
}  // namespace flipfree::seamless::chart_places_test
