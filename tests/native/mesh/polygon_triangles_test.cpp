#include "flipfree/mesh/polygon_triangles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <random>
#include <set>
#include <tuple>
#include <utility>
#include <vector>

#include "faults/samples.h"

namespace flipfree::mesh::polygon_triangles_test {
namespace {

using Place = std::array<std::int64_t, 2>;
using Outline2 = std::vector<Place>;
using Random = std::mt19937;

std::int64_t twice(const Place& a, const Place& b, const Place& c) {
  return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
}
std::int64_t twice_area_of(const Outline2& p) {
  std::int64_t sum = 0;
  for (std::size_t i = 1; i + 1 < p.size(); ++i) sum += twice(p[0], p[i], p[i + 1]);
  return sum;
}
int sign(std::int64_t x) { return x > 0 ? 1 : x < 0 ? -1 : 0; }

// A plane of whole numbers in space, so that the judge's are exact whatever the solver rounds.
struct Plane3 {
  std::array<int, 3> u{1, 0, 0}, v{0, 1, 0}, at{0, 0, 0};
  std::vector<Vector3> lift(const Outline2& p) const {
    std::vector<Vector3> lifted;
    for (const auto& [x, y] : p) {
      Vector3 q;
      for (std::size_t i = 0; i < 3; ++i)
        q[static_cast<Eigen::Index>(i)] = static_cast<double>(at[i] + u[i] * x + v[i] * y);
      lifted.push_back(q);
    }
    return lifted;
  }
};
constexpr std::size_t kAxes = 4;  // of these planes' normals are axes: nothing is rounded
const std::vector<Plane3> kPlanes{{},
                                  {{0, 1, 0}, {0, 0, 1}, {7, 0, 0}},
                                  {{0, 0, 1}, {1, 0, 0}, {0, -5, 3}},
                                  {{0, 1, 0}, {1, 0, 0}, {0, 0, 100}},  // seen from behind
                                  {{1, 0, 1}, {0, 1, 0}, {1, 2, 3}},
                                  {{3, 1, -2}, {1, 4, 5}, {1000, 0, 7}}};

// Sides once, diagonals twice and against each other.
void expect_a_triangulation(std::size_t n, const std::vector<PolygonTriangle>& triangles) {
  ASSERT_EQ(triangles.size(), n - 2);
  std::set<std::pair<Index, Index>> edges;
  for (const PolygonTriangle& t : triangles)
    for (std::size_t k = 0; k < 3; ++k) ASSERT_TRUE(edges.insert({t[k], t[(k + 1) % 3]}).second);
  for (Index i = 0; i < static_cast<Index>(n); ++i) {
    const std::pair<Index, Index> side{i, (i + 1) % static_cast<Index>(n)};
    ASSERT_EQ(edges.count(side), 1U);
    ASSERT_EQ(edges.count({side.second, side.first}), 0U);
    edges.erase(side);
  }
  for (const auto& [a, b] : edges) ASSERT_EQ(edges.count({b, a}), 1U);
}

// Areas without sign sum up to the polygon's, in whole numbers: nothing lies outside or twice.
void expect_inside(const Outline2& outline, bool strictly) {
  for (std::size_t p = 0; p < kPlanes.size(); ++p) {
    const Plane3& plane = kPlanes[p];
    const auto triangles = triangles_of_polygon(plane.lift(outline));
    expect_a_triangulation(outline.size(), triangles);
    std::int64_t sum = 0;
    for (const PolygonTriangle& t : triangles) {
      const std::int64_t area = twice(outline[at(t[0])], outline[at(t[1])], outline[at(t[2])]);
      sum += std::abs(area);
      ASSERT_TRUE(area > 0 || !strictly || p >= kAxes);
    }
    ASSERT_EQ(sum, twice_area_of(outline));
  }
}
void expect_inside_from_any_corner(Outline2 outline, bool strictly) {
  if (twice_area_of(outline) < 0) std::reverse(outline.begin(), outline.end());
  const std::size_t step = 1 + outline.size() / 16;
  for (std::size_t first = 0; first < outline.size(); first += step) {
    std::rotate(outline.begin(), outline.begin() + static_cast<std::ptrdiff_t>(step),
                outline.end());
    expect_inside(outline, strictly);
    if (testing::Test::HasFatalFailure()) return;
  }
}

bool on_segment(const Place& a, const Place& b, const Place& p) {
  return twice(a, b, p) == 0 && std::min(a[0], b[0]) <= p[0] && p[0] <= std::max(a[0], b[0]) &&
         std::min(a[1], b[1]) <= p[1] && p[1] <= std::max(a[1], b[1]);
}
bool meet(const Place& a, const Place& b, const Place& c, const Place& d) {
  return (sign(twice(a, b, c)) * sign(twice(a, b, d)) < 0 &&
          sign(twice(c, d, a)) * sign(twice(c, d, b)) < 0) ||
         on_segment(a, b, c) || on_segment(a, b, d) || on_segment(c, d, a) || on_segment(c, d, b);
}
bool is_simple(const Outline2& p) {
  const std::size_t n = p.size();
  for (std::size_t i = 0; i < n; ++i) {
    const Place &a = p[i], &b = p[(i + 1) % n], &c = p[(i + 2) % n];
    if (a == b || (twice(a, b, c) == 0 && (on_segment(a, b, c) || on_segment(b, c, a))))
      return false;
    for (std::size_t k = i + 2; k < n; ++k)
      if ((k + 1) % n != i && meet(a, b, p[k], p[(k + 1) % n])) return false;
  }
  return true;
}

// Random places in random order, uncrossed (2-opt shortens the tour with each step).
Outline2 uncrossed(Random& random, std::size_t n, int extent) {
  std::uniform_int_distribution<int> coordinate(0, extent);
  std::set<Place> places;
  while (places.size() < n) places.insert({coordinate(random), coordinate(random)});
  Outline2 tour(places.begin(), places.end());
  std::shuffle(tour.begin(), tour.end(), random);
  const auto length = [](const Place& a, const Place& b) {
    return std::hypot(static_cast<double>(a[0] - b[0]), static_cast<double>(a[1] - b[1]));
  };
  for (bool changed = true; changed;) {
    changed = false;
    for (std::size_t i = 0; i + 1 < n; ++i) {
      for (std::size_t k = i + 2; k < n; ++k) {
        if ((k + 1) % n == i) continue;
        const Place &a = tour[i], &b = tour[i + 1], &c = tour[k], &d = tour[(k + 1) % n];
        if (length(a, c) + length(b, d) + 1e-9 >= length(a, b) + length(c, d)) continue;
        std::reverse(tour.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                     tour.begin() + static_cast<std::ptrdiff_t>(k) + 1);
        changed = true;
      }
    }
  }
  return tour;
}

TEST(PolygonTriangles, ConcavePolygonsStayInsideFromAnyFirstCorner) {
  const std::vector<unsigned> trials = test::sampled_seeds(4000);
  std::size_t tried = 0;
  for (const unsigned trial : trials) {
    Random random(trial);
    const std::size_t n = 4 + static_cast<std::size_t>(random() % (trial % 40 == 0 ? 60 : 14));
    const Outline2 outline = uncrossed(random, n, trial % 3 == 0 ? 9 : 1000);
    if (!is_simple(outline)) continue;
    ++tried;
    expect_inside_from_any_corner(outline, true);
    ASSERT_FALSE(HasFatalFailure()) << "polygon " << trial;
  }
  EXPECT_GT(4 * tried, 3 * trials.size());
}

TEST(PolygonTriangles, ConvexPolygonsAreFansAndQuadsAreSplitAsBlenderDoes) {
  for (const std::size_t n : {3U, 4U, 5U, 8U, 100U}) {
    std::vector<Vector3> corners;
    for (std::size_t i = 0; i < n; ++i) {
      const double angle = 6.283185307179586 * static_cast<double>(i) / static_cast<double>(n);
      corners.emplace_back(std::cos(angle), std::sin(angle), 0.25 * std::cos(2.0 * angle));
    }
    const auto triangles = triangles_of_polygon(corners);
    for (std::size_t t = 0; t < triangles.size(); ++t)
      EXPECT_EQ(triangles[t],
                (PolygonTriangle{0, static_cast<Index>(t) + 1, static_cast<Index>(t) + 2}));
  }
  // An arrow, its notch at corner 1 or 3: by the other diagonal.
  const std::vector<Vector3> arrow{{0, 0, 0}, {1, 1, 0}, {2, 0, 0}, {1, 4, 0}};
  const std::vector<PolygonTriangle> other{{0, 1, 3}, {1, 2, 3}};
  EXPECT_EQ(triangles_of_polygon(arrow), other);
}

TEST(PolygonTriangles, WhatHasNoInsideIsStillTriangulated) {
  Random random(38);
  std::uniform_int_distribution<int> coordinate(0, 4);
  for (int trial = 0; trial < 5000; ++trial) {
    // Corners at one place, spikes, eights, lines, points.
    std::vector<Vector3> corners;
    const std::size_t n = 3 + random() % 12;
    for (std::size_t i = 0; i < n; ++i)
      corners.emplace_back(coordinate(random), trial % 5 == 0 ? 0 : coordinate(random),
                           trial % 3 == 0 ? coordinate(random) : 0);
    expect_a_triangulation(n, triangles_of_polygon(corners));
    ASSERT_FALSE(HasFatalFailure()) << "polygon " << trial;
    const double scale = std::ldexp(1.0, trial % 2 == 0 ? 900 : -900);
    std::vector<Vector3> scaled;
    for (const Vector3& p : corners) scaled.emplace_back(scale * p);
    ASSERT_EQ(triangles_of_polygon(scaled), triangles_of_polygon(corners));
  }
}

TEST(PolygonTriangles, PolygonsThatTouchThemselvesOrHaveCornersTwiceStayInside) {
  // Corners twice; two squares at a point; a window whose corner lies on the wall's side.
  for (Outline2 outline :
       {Outline2{{0, 0}, {0, 0}, {4, 0}, {4, 4}, {4, 4}, {2, 1}, {0, 4}, {0, 0}},
        Outline2{{0, 0}, {1, 0}, {1, 1}, {2, 1}, {2, 2}, {1, 2}, {1, 1}, {0, 1}},
        Outline2{{0, 0}, {8, 0}, {8, 8}, {0, 8}, {4, 4}, {6, 3}, {4, 0}, {2, 3}, {4, 4}, {0, 8}}}) {
    for (std::size_t first = 0; first < outline.size(); ++first) {
      std::rotate(outline.begin(), outline.begin() + 1, outline.end());
      expect_inside(outline, false);
      ASSERT_FALSE(HasFatalFailure()) << "from corner " << first;
    }
  }
}

}  // namespace
}  // namespace flipfree::mesh::polygon_triangles_test
