#include "flipfree/certify/measures.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <random>

#include "fuzz/rational.h"
#include "support/corner_maps.h"
#include "support/dense.h"
#include "support/shapes.h"

namespace flipfree::certify::energy_test {
namespace {

using test::adjacency_of;
using test::corners;
using test::flat;

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Triangles in space and in the plane, positive there.
struct Soup {
  mesh::Surface surface;
  Points2 uv;
};
Soup random_soup(Index faces, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> coordinate(-1.0, 1.0);
  Soup soup;
  soup.surface.vertices.resize(3 * faces, 3);
  soup.surface.faces = Triangles(Triangles::NullaryExpr(
      faces, 3, [](Eigen::Index f, Eigen::Index k) { return static_cast<VertexId>(3 * f + k); }));
  soup.uv.resize(3 * faces, 2);
  for (double& x : soup.surface.vertices.reshaped()) x = coordinate(random);
  for (double& x : soup.uv.reshaped()) x = coordinate(random);
  for (Index f = 0; f < faces; ++f) {
    Eigen::Matrix2d sides;
    sides << soup.uv.row(3 * f + 1) - soup.uv.row(3 * f),
        soup.uv.row(3 * f + 2) - soup.uv.row(3 * f);
    if (sides.determinant() < 0) soup.uv.row(3 * f + 1).swap(soup.uv.row(3 * f + 2));
  }
  return soup;
}

// Singular values of the map of face f, from the triangle laid into the plane.
Vector2 stretches(const Soup& soup, FaceId f) {
  const auto at = [&](Index k) -> Vector3 { return soup.surface.vertices.row(3 * f + k); };
  const Vector3 side = at(1) - at(0);
  const Vector3 other = at(2) - at(0);
  const double along = other.dot(side) / side.norm();
  Eigen::Matrix2d rest;
  rest << side.norm(), along, 0.0, (other - along * side.normalized()).norm();
  Eigen::Matrix2d image;
  image.col(0) = soup.uv.row(3 * f + 1) - soup.uv.row(3 * f);
  image.col(1) = soup.uv.row(3 * f + 2) - soup.uv.row(3 * f);
  return test::singular_values(image * rest.inverse()).values;
}

TEST(Energy, parts_are_the_singular_values_and_the_area_of_every_face) {
  const Soup soup = random_soup(300, 1);
  const Points3 parts = symmetric_dirichlet_parts(soup.surface, soup.uv);
  for (FaceId f = 0; f < 300; ++f) {
    const Vector2 s = stretches(soup, f);
    EXPECT_NEAR(parts(f, 0) / s.squaredNorm(), 1.0, 1e-9);
    EXPECT_NEAR(parts(f, 1) / s.cwiseInverse().squaredNorm(), 1.0, 1e-9);
    const Vector3 a = soup.surface.vertices.row(3 * f);
    const Vector3 b = soup.surface.vertices.row(3 * f + 1);
    const Vector3 c = soup.surface.vertices.row(3 * f + 2);
    EXPECT_NEAR(parts(f, 2), 0.5 * (b - a).cross(c - a).norm(), 1e-14);
  }
}

TEST(Energy, the_scale_is_the_best_one_and_percentile_and_maximum_are_taken_there) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const Soup soup = random_soup(150, seed);
    const EnergyFigures figures = symmetric_dirichlet(soup.surface, soup.uv);
    double area = 0.0;
    const auto mean_at = [&](double scale, std::vector<std::pair<double, double>>* of_face) {
      double sum = 0.0;
      area = 0.0;
      for (FaceId f = 0; f < 150; ++f) {
        const Vector2 s = scale * stretches(soup, f);
        const double energy = (s.squaredNorm() + s.cwiseInverse().squaredNorm()) / 4.0;
        const double weight = symmetric_dirichlet_parts(soup.surface, soup.uv)(f, 2);
        sum += weight * energy;
        area += weight;
        if (of_face != nullptr) of_face->emplace_back(energy, weight);
      }
      return sum / area;
    };
    std::vector<std::pair<double, double>> of_face;
    EXPECT_NEAR(mean_at(figures.scale, &of_face) / figures.mean, 1.0, 1e-9);
    EXPECT_GT(mean_at(figures.scale * 1.001, nullptr), figures.mean * (1 - 1e-12));
    EXPECT_GT(mean_at(figures.scale / 1.001, nullptr), figures.mean * (1 - 1e-12));
    double above = 0.0, not_below = 0.0, worst = 0.0;
    for (const auto& [energy, weight] : of_face) {
      worst = std::max(worst, energy);
      if (energy > figures.percentile99 * (1 + 1e-9)) above += weight;
      if (energy > figures.percentile99 * (1 - 1e-9)) not_below += weight;
    }
    EXPECT_NEAR(worst / figures.maximum, 1.0, 1e-9);
    EXPECT_LE(above, 0.01 * area);
    EXPECT_GT(not_below, 0.01 * area);
  }
}

TEST(Energy, of_positive_triangles_too_thin_for_doubles_is_that_of_their_true_area) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> place(0.0, 1.0);
  mesh::Surface surface = test::grid(1, 1);
  surface.faces = Triangles(surface.faces.triangles().topRows(1));
  Index thin = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vector2 a(place(random), place(random));
    const Vector2 b(place(random), place(random));
    const Vector2 c = a + place(random) * (b - a);
    const fuzz::Rational exact = fuzz::area(fuzz::exact(a), fuzz::exact(b), fuzz::exact(c));
    if (exact <= 0) continue;
    const double area = static_cast<double>(exact);
    Points2 uv(3, 2);
    uv << a.transpose(), b.transpose(), c.transpose();
    const double inverse = symmetric_dirichlet_parts(surface, uv)(0, 1);
    const Vector2 d1 = b - a, d2 = c - a;
    if (d1.x() * d2.y() - d1.y() * d2.x() > 0.0) continue;  // doubles see it
    ++thin;
    // |J|^2 times the square of the area in space, of the triangle in `grid`: two unit sides.
    const Vector3 p = surface.vertices.row(surface.faces(0, 0));
    const Vector3 e1 = surface.vertices.row(surface.faces(0, 1)).transpose() - p;
    const Vector3 e2 = surface.vertices.row(surface.faces(0, 2)).transpose() - p;
    const double numerator =
        (d1 * e2.norm() - d2 * e1.dot(e2) / e2.norm()).squaredNorm() +
        d2.squaredNorm() * (e1 - e2 * (e1.dot(e2) / e2.squaredNorm())).squaredNorm();
    EXPECT_NEAR(inverse / (numerator / area / area), 1.0, 1e-9);
  }
  EXPECT_GT(thin, 100);
}

TEST(Energy, of_flipped_maps_is_infinite_and_of_surfaces_without_area_not_a_number) {
  mesh::Surface surface = test::grid(2, 2);
  Points2 uv = flat(surface);
  uv.row(0).swap(uv.row(1));
  EXPECT_EQ(symmetric_dirichlet(surface, uv).maximum, kInfinite);
  // A face without area is left out; where all are, nothing is left.
  uv.row(0).swap(uv.row(1));
  surface.vertices.row(surface.faces(0, 0)) = surface.vertices.row(surface.faces(0, 1)).eval();
  EXPECT_TRUE(std::isfinite(symmetric_dirichlet(surface, uv).mean));
  surface.vertices.setZero();
  const EnergyFigures none = symmetric_dirichlet(surface, flat(test::grid(2, 2)));
  EXPECT_TRUE(std::isnan(none.mean));
  EXPECT_TRUE(std::isnan(none.percentile99));
}

}  // namespace
}  // namespace flipfree::certify::energy_test
