#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <limits>
#include <random>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/certify/certify.h"
#include "flipfree/certify/measures.h"
#include "fuzz/rational.h"
#include "support/corner_maps.h"
#include "support/dense.h"
#include "support/shapes.h"

namespace flipfree::certify::measures_test {
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

// What is said of pins of a mesh of two triangles; no words: nothing.
template <typename Require>
Error refusal(Require require, const std::vector<CornerPin>& pins) {
  try {
    require(pins, Index{6});
  } catch (const InvalidInput& e) {
    return e.error();
  }
  return {};
}

TEST(Pins, of_corners_that_exist_may_lie_anywhere) {
  const double beyond = 2.0 * std::numeric_limits<float>::max();
  EXPECT_NO_THROW(require_corners({{0, {0, 0}}, {5, {beyond, 0}}}, 6));
  EXPECT_NO_THROW(require_corners({}, 0));
}

TEST(Pins, of_corners_that_do_not_exist_are_refused_by_name) {
  for (const CornerId corner : {-1, 6}) {
    for (const Error& error : {refusal(require_corners, {{2, {0, 0}}, {corner, {0, 0}}}),
                               refusal(require_storable_pins, {{2, {0, 0}}, {corner, {0, 0}}})}) {
      EXPECT_EQ(error.code, ErrorCode::kBadPins);
      EXPECT_NE(rendered(error.message).find("corner " + std::to_string(corner) + ","),
                std::string::npos);
      EXPECT_TRUE(error.elements.empty());
    }
  }
}

TEST(Pins, must_be_where_32_bits_reach) {
  const double most = std::numeric_limits<float>::max();
  EXPECT_NO_THROW(require_storable_pins({{0, {most, -most}}, {1, {1e-300, 0}}}, 6));
  for (const double bad : {2 * most, std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::quiet_NaN()}) {
    for (const Vector2& uv : {Vector2(bad, 0), Vector2(0, -bad)}) {
      const Error error = refusal(require_storable_pins, {{3, {0, 0}}, {4, uv}});
      EXPECT_EQ(error.code, ErrorCode::kBadPins);
      EXPECT_EQ(error.kind, ElementKind::kCorner);
      EXPECT_EQ(error.elements, std::vector<Index>{4});
    }
  }
}

// A grid whose first face is split at its centroid, with what says where everything lies.
struct Refined {
  mesh::Surface parent = test::bumpy_grid(3, 3, 0.3, 2.0);
  mesh::Surface surface;
  std::vector<FaceId> parent_face;
  std::vector<FaceId> vertex_parent;
  Points3 weights;

  Refined() {
    const Eigen::Index n = parent.vertices.rows();
    const Eigen::Index m = parent.faces.rows();
    const Index a = parent.faces(0, 0), b = parent.faces(0, 1), c = parent.faces(0, 2);
    surface.vertices.resize(n + 1, 3);
    surface.vertices.topRows(n) = parent.vertices;
    surface.vertices.row(n) =
        (parent.vertices.row(a) + parent.vertices.row(b) + parent.vertices.row(c)) / 3.0;
    Triangles faces(m + 2, 3);
    faces.topRows(m) = parent.faces.triangles();
    faces.row(0) << a, b, static_cast<Index>(n);
    faces.row(m) << b, c, static_cast<Index>(n);
    faces.row(m + 1) << c, a, static_cast<Index>(n);
    surface.faces = std::move(faces);
    for (FaceId f = 0; f < m; ++f) parent_face.push_back(f);
    parent_face.insert(parent_face.end(), {0, 0});
    vertex_parent.assign(static_cast<std::size_t>(n + 1), 0);
    weights = Points3::Zero(n + 1, 3);
    weights.row(n).setConstant(1.0 / 3.0);
  }
  ProvenanceReport check() const {
    return check_provenance(surface, {&parent, &parent_face, &vertex_parent, &weights});
  }
};

TEST(Provenance, says_in_which_way_it_is_wrong) {
  struct Wrong {
    const char* sentence;
    std::function<void(Refined&)> make;
  };
  const auto last = [](Refined& r) { return r.surface.vertices.rows() - 1; };
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const Wrong cases[] = {
      {"sizes", [](Refined& r) { r.parent_face.pop_back(); }},
      {"sizes", [](Refined& r) { r.vertex_parent.pop_back(); }},
      {"sizes", [](Refined& r) { r.weights.conservativeResize(2, 3); }},
      {"sizes", [](Refined& r) { r.parent.vertices.conservativeResize(40, 3); }},
      {"of the input was moved", [](Refined& r) { r.surface.vertices(3, 1) += 1e-15; }},
      {"no valid place", [](Refined& r) { r.vertex_parent.back() = -1; }},
      {"no valid place", [](Refined& r) { r.vertex_parent.back() = 18; }},
      {"no valid place", [&](Refined& r) { r.weights.row(last(r)) << -0.5, 0.5, 1.0; }},
      {"no valid place", [&](Refined& r) { r.weights.row(last(r)) << 0.5, 0.5, 0.5; }},
      {"no valid place", [&](Refined& r) { r.weights(last(r), 0) = nan; }},
      {"does not lie where", [&](Refined& r) { r.surface.vertices(last(r), 2) += 1e-3; }},
      {"does not lie where", [&](Refined& r) { r.surface.vertices(last(r), 2) = nan; }},
      {"has no parent", [](Refined& r) { r.parent_face.back() = -1; }},
      {"has no parent", [](Refined& r) { r.parent_face.back() = 18; }},
      {"leaves its parent", [](Refined& r) { r.parent_face.back() = 9; }},
      {"turned over",
       [](Refined& r) {
         Triangles faces = r.surface.faces;
         std::swap(faces(0, 0), faces(0, 1));
         r.surface.faces = std::move(faces);
       }},
      {"not covered exactly once",
       [](Refined& r) {
         Triangles faces = r.surface.faces;
         faces.row(5) = r.surface.faces.row(4);
         r.surface.faces = std::move(faces);
         r.parent_face[5] = 4;
       }},
  };
  EXPECT_EQ(Refined().check().failures, 0);
  for (const Wrong& wrong : cases) {
    Refined refined;
    wrong.make(refined);
    const ProvenanceReport report = refined.check();
    EXPECT_GT(report.failures, 0) << wrong.sentence;
    EXPECT_NE(report.first.find(wrong.sentence), std::string::npos)
        << wrong.sentence << " / " << report.first;
  }
}

TEST(Provenance, vertices_of_neighbouring_faces_are_found_on_the_common_edge) {
  // A vertex on the edge between the first two faces belongs to one of them and is a corner of
  // triangles in both.
  mesh::Surface parent = test::grid(1, 1);
  mesh::Surface surface;
  surface.vertices.resize(5, 3);
  surface.vertices << parent.vertices, 0.5, 0.5, 0.0;
  // Faces are (0, 1, 3) and (0, 3, 2), the diagonal 0-3.
  surface.faces = Triangles{{0, 1, 4}, {1, 3, 4}, {0, 4, 2}, {4, 3, 2}};
  const std::vector<FaceId> parent_face{0, 0, 1, 1};
  std::vector<FaceId> vertex_parent{0, 0, 1, 0, 0};
  Points3 weights = Points3::Zero(5, 3);
  weights.row(4) << 0.5, 0.0, 0.5;
  const Provenance provenance{&parent, &parent_face, &vertex_parent, &weights};
  EXPECT_EQ(check_provenance(surface, provenance).failures, 0);
  vertex_parent[4] = -1;
  EXPECT_GT(check_provenance(surface, provenance).failures, 0);
}

// A square of two faces, the diagonal split in one of them only: all areas are right, and the map
// may gape there.
TEST(Provenance, refinement_that_does_not_meet_across_an_edge_is_a_tear) {
  mesh::Surface parent;
  parent.vertices.resize(4, 3);
  parent.vertices << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0;
  parent.faces = Triangles{{0, 1, 2}, {0, 2, 3}};
  mesh::Surface torn;
  torn.vertices.resize(5, 3);
  torn.vertices << parent.vertices, 0.5, 0.5, 0.0;
  torn.faces = Triangles{{0, 1, 4}, {1, 2, 4}, {0, 2, 3}};
  const std::vector<FaceId> parent_face{0, 0, 1}, vertex_parent{0, 0, 0, 1, 0};
  Points3 weights = Points3::Zero(5, 3);
  weights.row(4) << 0.5, 0.0, 0.5;
  const ProvenanceReport report =
      check_provenance(torn, {&parent, &parent_face, &vertex_parent, &weights});
  EXPECT_EQ(report.failures, 3);
  EXPECT_NE(report.first.find("torn"), std::string::npos);
}

// Two faces of the same half of a parent, none of the other half: the area is right.
TEST(Provenance, a_half_that_is_covered_twice_does_not_stand_for_the_other) {
  mesh::Surface parent;
  parent.vertices.resize(3, 3);
  parent.vertices << 0, 0, 0, 1, 0, 0, 0, 1, 0;
  parent.faces = Triangles{{0, 1, 2}};
  mesh::Surface twice;
  twice.vertices.resize(6, 3);
  twice.vertices << parent.vertices, 0.5, 0.5, 0, 0.5, 0.5, 0, 1, 0, 0;
  twice.faces = Triangles{{0, 1, 3}, {0, 5, 4}};
  const std::vector<FaceId> parent_face{0, 0}, vertex_parent{0, 0, 0, 0, 0, 0};
  Points3 weights = Points3::Zero(6, 3);
  weights.row(3) << 0.0, 0.5, 0.5;
  weights.row(4) << 0.0, 0.5, 0.5;
  weights.row(5) << 0.0, 1.0, 0.0;
  EXPECT_GT(check_provenance(twice, {&parent, &parent_face, &vertex_parent, &weights}).failures, 0);
}

}  // namespace
}  // namespace flipfree::certify::measures_test
