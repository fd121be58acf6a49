#include "flipfree/seamless/exact/edge_directions.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/shapes.h"

namespace flipfree::seamless::edge_directions_test {
namespace {

// The sides of two bars of cubes, a chart each, every square a picture of its own, all turned.
struct Cubes {
  mesh::Surface surface;
  std::vector<Index> chart;
  IndexPairs diagonals;
  Points2 uv;

  Cubes(double first, double second) {
    const mesh::Surface bar = test::perforated_plate(0, 1);
    surface.vertices.resize(2 * bar.vertices.rows(), 3);
    surface.vertices << bar.vertices, bar.vertices;
    surface.faces.resize(2 * bar.faces.rows(), 3);
    surface.faces << bar.faces, bar.faces.array() + static_cast<Index>(bar.vertices.rows());
    const Index count = static_cast<Index>(surface.faces.rows());
    uv.resize(3 * count, 2);
    std::vector<std::pair<Index, Index>> slanted;
    for (Index f = 0; f < count; ++f) {
      chart.push_back(f < count / 2 ? 0 : 1);
      const double angle = chart.back() == 0 ? first : second;
      const Vector3 a = surface.vertices.row(surface.faces(f, 0)),
                    b = surface.vertices.row(surface.faces(f, 1)),
                    c = surface.vertices.row(surface.faces(f, 2));
      // The plane of the face: some coordinate is the same all over.
      Index flat = 0;
      while (!(a[flat] == b[flat] && a[flat] == c[flat])) ++flat;
      const Index x = (flat + 1) % 3, y = (flat + 2) % 3;
      for (int k = 0; k < 3; ++k) {
        const Vector3 p = surface.vertices.row(surface.faces(f, k));
        const Vector3 q = surface.vertices.row(surface.faces(f, (k + 1) % 3));
        uv.row(3 * f + k) << std::cos(angle) * p[x] - std::sin(angle) * p[y],
            std::sin(angle) * p[x] + std::cos(angle) * p[y];
        if (p[x] != q[x] && p[y] != q[y])
          slanted.emplace_back(surface.faces(f, k), surface.faces(f, (k + 1) % 3));
      }
    }
    diagonals.resize(static_cast<Eigen::Index>(slanted.size()), 2);
    for (std::size_t e = 0; e < slanted.size(); ++e)
      diagonals.row(static_cast<Eigen::Index>(e)) << slanted[e].first, slanted[e].second;
  }

  void turn() {
    const auto adjacency =
        mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
    turn_along_edges(surface.faces, adjacency, chart, 2, diagonals, uv);
  }

  // The largest distance of a side of a square from the axes.
  double slant() const {
    double most = 0.0;
    for (Index f = 0; f < static_cast<Index>(surface.faces.rows()); ++f) {
      for (int k = 0; k < 3; ++k) {
        const Vector2 along = uv.row(3 * f + (k + 1) % 3) - uv.row(3 * f + k);
        if (along.norm() < 1.2) most = std::max(most, along.cwiseAbs().minCoeff());
      }
    }
    return most;
  }
};

TEST(EdgeDirections, becomeTheAxesChartByChart) {
  for (const double angle : {0.0, 0.3, -0.7, 2.0, 3.1}) {
    Cubes cubes(angle, 1.7 * angle + 0.2);
    cubes.turn();
    EXPECT_LT(cubes.slant(), 1e-14);
  }
}

TEST(EdgeDirections, turnByAnEighthAtMost) {
  Cubes cubes(0.6, 0.6);
  const Vector2 before = cubes.uv.row(1) - cubes.uv.row(0);
  cubes.turn();
  const Vector2 after = cubes.uv.row(1) - cubes.uv.row(0);
  EXPECT_NEAR(after.norm(), before.norm(), 1e-15);
  EXPECT_GT(after.dot(before), 0.7 * before.squaredNorm());
}

TEST(EdgeDirections, areTheBoundarysWhereThereIsOne) {
  Cubes cubes(0.6, 0.3);
  const Points2 before = cubes.uv;
  const Eigen::Index half = before.rows() / 2;
  cubes.surface.faces.conservativeResize(cubes.surface.faces.rows() - 1, 3);
  cubes.chart.pop_back();
  cubes.uv.conservativeResize(cubes.uv.rows() - 3, 2);
  cubes.turn();
  EXPECT_FALSE(cubes.uv.topRows(half) == before.topRows(half));
  EXPECT_TRUE(cubes.uv.bottomRows(half - 3) == before.middleRows(half, half - 3));
}

}  // namespace
}  // namespace flipfree::seamless::edge_directions_test
