// The unit square as a target, with points in it.
#pragma once

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "flipfree/base/plane.h"
#include "flipfree/matchmaker/target/target_domain.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::test {

inline const matchmaker::Polygon kSquare = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};

inline std::vector<Vector2> scattered(int count) {
  std::mt19937 random(5);
  std::vector<Vector2> points;
  for (int i = 0; i < count; ++i) {
    const double x = static_cast<double>(random()) * 0x1p-32;
    points.emplace_back(0.05 + 0.9 * x, 0.05 + 0.9 * static_cast<double>(random()) * 0x1p-32);
  }
  return points;
}

inline Vector2 at(const matchmaker::TargetDomain& domain, VertexId v) {
  return domain.point[static_cast<std::size_t>(v)];
}

inline double area(const matchmaker::TargetDomain& domain) {
  double twice = 0;
  for (FaceId f = 0; f < domain.triangulation.face_slots(); ++f) {
    if (!domain.triangulation.alive(f)) continue;
    const auto c = domain.triangulation.corners(f);
    EXPECT_GT(numeric::orientation(at(domain, c[0]), at(domain, c[1]), at(domain, c[2])), 0);
    twice += twice_area(at(domain, c[0]), at(domain, c[1]), at(domain, c[2]));
  }
  return 0.5 * twice;
}

}  // namespace flipfree::test
