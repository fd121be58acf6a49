// What may be asked of a certificate, and how much it says.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "flipfree/certify/certify.h"
#include "flipfree/certify/measures.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::certify::request_test {
namespace {

using test::corners;
using test::flat;

struct Case {
  mesh::Surface surface = test::grid(3, 3);
  Points2 uv = flat(surface);
  CertifyRequest request;
  Case() { refer(); }
  void refer() {
    request.surface = &surface;
    request.uv = &uv;
  }
  Certificate measure() { return certify(request, ExecutionContext()); }
  ErrorCode refusal() {
    try {
      measure();
    } catch (const InvalidInput& e) {
      return e.error().code;
    }
    return ErrorCode::kInternal;
  }
};

TEST(CertifyRequest, figures_are_those_of_the_stored_map_where_it_is_worse) {
  const mesh::Surface surface = test::grid(6, 5);
  const Points2 uv = flat(surface);
  Points2 moved = surface.vertices.leftCols<2>();
  moved.row(8) += Eigen::RowVector2d(0.12, 0.0);
  const Points2f stored = corners(surface, moved).cast<float>();
  CertifyRequest request;
  request.surface = &surface;
  request.uv = &uv;
  request.uv32 = &stored;
  const Certificate c = certify(request, ExecutionContext());
  const Certificate worse = test::measure(surface, stored.cast<double>());
  EXPECT_TRUE(c.ok);
  EXPECT_GT(worse.max_energy, 1.5);
  EXPECT_EQ(c.energy, worse.energy);
  EXPECT_EQ(c.max_energy, worse.max_energy);
  EXPECT_EQ(c.energy_p99, worse.energy_p99);
}

TEST(CertifyRequest, maps_of_another_shape_are_refused) {
  Case c;
  c.request.surface = nullptr;
  EXPECT_EQ(c.refusal(), ErrorCode::kBadShape);
  c.refer();
  c.request.uv = nullptr;
  EXPECT_EQ(c.refusal(), ErrorCode::kBadShape);
  const Points2 fewer = c.uv.topRows(3);
  c.request.uv = &fewer;
  EXPECT_EQ(c.refusal(), ErrorCode::kBadShape);
  c.refer();
  const Points2f stored = fewer.cast<float>();
  c.request.uv32 = &stored;
  EXPECT_EQ(c.refusal(), ErrorCode::kBadShape);
}

TEST(CertifyRequest, pins_and_cones_that_do_not_exist_are_refused) {
  for (const CornerId corner : {-1, 54}) {
    Case c;
    c.request.pins = {{corner, Vector2(0, 0)}};
    EXPECT_EQ(c.refusal(), ErrorCode::kBadPins);
  }
  const double infinite = std::numeric_limits<double>::infinity();
  for (const auto& cone : {std::pair{-1, 1.0}, std::pair{16, 1.0}, std::pair{5, infinite}}) {
    Case c;
    c.request.cone_angles = {cone};
    EXPECT_EQ(c.refusal(), ErrorCode::kBadAngles);
  }
}

TEST(CertifyRequest, pins_are_judged_in_each_coordinate_in_64_and_in_32_bits) {
  Case c;
  Points2f stored = c.uv.cast<float>();
  c.request.uv32 = &stored;
  const CornerId corner = 7;
  c.request.pins = {{corner, c.uv.row(corner).transpose()}};
  EXPECT_EQ(c.measure().pin_failures, 0);
  for (const Index axis : {0, 1}) {
    const double before = c.uv(corner, axis);
    c.uv(corner, axis) += 1e-12;
    EXPECT_EQ(c.measure().pin_failures, 1);
    c.uv(corner, axis) = before;
    stored(corner, axis) += 1e-6F;
    EXPECT_EQ(c.measure().pin_failures, 1);
    stored(corner, axis) = static_cast<float>(before);
  }
}

TEST(CertifyRequest, a_prescribed_angle_excuses_the_winding_at_its_vertex_alone) {
  // Fans of eight triangles wound twice around their centres, side by side.
  Case c;
  c.surface.vertices = Points3::Zero(18, 3);
  Triangles faces(16, 3);
  Points2 places = Points2::Zero(18, 2);
  for (Index fan = 0; fan < 2; ++fan) {
    for (Index i = 0; i < 8; ++i) {
      const double once = 2.0 * std::numbers::pi * i / 8;
      c.surface.vertices.row(9 * fan + i) << std::cos(once) + 9 * fan, std::sin(once), 0.0;
      places.row(9 * fan + i) << std::cos(2 * once) + 9 * fan, std::sin(2 * once);
      faces.row(8 * fan + i) << 9 * fan + 8, 9 * fan + i, 9 * fan + (i + 1) % 8;
    }
    c.surface.vertices.row(9 * fan + 8) << 9 * fan, 0.0, 0.0;
    places.row(9 * fan + 8) << 9 * fan, 0.0;
  }
  c.surface.faces = std::move(faces);
  c.uv = corners(c.surface, places);
  EXPECT_EQ(c.measure().winding_failures, 2);
  c.request.cone_angles = {{17, 4.0 * std::numbers::pi}};
  const Certificate one = c.measure();
  EXPECT_EQ(one.winding_failures, 1);
  EXPECT_EQ(one.cone_failures, 1);  // the other one has no prescription, so 2 pi
  c.request.cone_angles.emplace_back(8, 4.0 * std::numbers::pi);
  EXPECT_TRUE(c.measure().ok);
}

// Sizes so far apart that the mean is a number and the worst triangle is not.
TEST(CertifyRequest, a_worst_triangle_beyond_doubles_is_a_failure_beside_a_finite_mean) {
  Case c;
  c.surface.vertices.resize(6, 3);
  c.surface.vertices << 0, 0, 0, 1e-70, 0, 0, 0, 1e-70, 0, 0, 0, 0, 1e50, 0, 0, 0, 1e50, 0;
  c.surface.faces = Triangles{{0, 1, 2}, {3, 4, 5}};
  c.uv.resize(6, 2);
  c.uv << 0, 0, 1e38, 0, 0, 1e38, -1, -1, -1 + 1e-7, -1, -1, -1 + 1e-7;
  const Certificate reached = c.measure();
  EXPECT_TRUE(reached.ok);
  c.uv.bottomRows(3) << 0, 0, 1e-37, 0, 0, 1e-37;
  c.request.measure_overlaps = false;
  const Certificate certificate = c.measure();
  EXPECT_TRUE(std::isfinite(certificate.energy));
  EXPECT_FALSE(std::isfinite(certificate.max_energy));
  EXPECT_FALSE(certificate.ok);
  EXPECT_EQ(certificate.failures.size(), 1U);
}

TEST(CertifyRequest, distortion_that_is_not_required_is_minus_one_unless_it_is_finite) {
  Case c;
  c.request.require_distortion = false;
  EXPECT_NEAR(c.measure().energy, 1.0, 1e-12);
  c.surface.vertices.setZero();
  const Certificate certificate = c.measure();
  EXPECT_TRUE(certificate.ok);
  EXPECT_EQ(certificate.energy, -1.0);
  EXPECT_EQ(certificate.max_energy, -1.0);
  EXPECT_EQ(certificate.energy_p99, -1.0);
}

TEST(CertifyRequest, all_angles_that_are_not_met_are_counted) {
  Case c;
  c.request.cone_angles = {{5, 2.0 * std::numbers::pi}};
  EXPECT_EQ(c.measure().cone_failures, 0);
  c.request.cone_angles = {{5, 1.0}, {6, 1.0}};
  EXPECT_EQ(c.measure().cone_failures, 2);
}

TEST(CertifyRequest, what_is_not_finite_is_flipped) {
  const double infinite = std::numeric_limits<double>::infinity();
  for (const double wrong : {infinite, -infinite, std::numeric_limits<double>::quiet_NaN()}) {
    for (CornerId corner = 3; corner < 6; ++corner) {
      Case c;
      c.uv(corner, corner % 2) = wrong;
      EXPECT_EQ(c.measure().flips64, 1);
      EXPECT_EQ(c.measure().flips32, 1);
    }
  }
}

// The second half-edge is of no face that the first one enters.
TEST(CertifyRequest, what_is_no_strip_of_faces_turns_by_no_number) {
  Case c;
  c.request.require_seamless = true;
  for (Index turns = -8; turns <= 8; ++turns) {
    c.request.loops = {{{2, 9}, turns}};
    EXPECT_EQ(c.measure().holonomy_failures, 1);
  }
}

TEST(CertifyRequest, at_most_a_thousand_faces_are_named) {
  Case c;
  c.surface = test::grid(40, 20);
  c.uv = -flat(c.surface);
  c.uv.col(0) *= -1.0;  // every face is flipped
  c.request.require_disjoint = true;
  const Certificate certificate = c.measure();
  EXPECT_EQ(certificate.flips64, 1600);
  EXPECT_EQ(certificate.failed_faces.size(), 1000U);
  // Triangles apart from each other in space, all in one place in the plane: a million pairs, no
  // more.
  constexpr Index kTriangles = 1500;
  c.surface.vertices = Points3::Random(3 * kTriangles, 3);
  c.surface.faces =
      Triangles(Triangles::NullaryExpr(kTriangles, 3, [](Eigen::Index f, Eigen::Index k) {
        return static_cast<VertexId>(3 * f + k);
      }));
  c.uv = (Points2(3, 2) << 0, 0, 1, 0, 0, 1).finished().replicate(kTriangles, 1);
  const Certificate stacked = c.measure();
  EXPECT_EQ(stacked.island_overlaps, IslandOverlaps::kMostPairs);
  EXPECT_EQ(stacked.island_overlap_faces.size(), 1000U);
}

}  // namespace
}  // namespace flipfree::certify::request_test
