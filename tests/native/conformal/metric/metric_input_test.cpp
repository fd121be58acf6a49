#include "flipfree/conformal/metric.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "flipfree/base/error.h"
#include "support/shapes.h"

namespace flipfree::conformal::metric_input_test {
namespace {

using std::numbers::pi;

Points3 lengths_of(const mesh::Surface& surface) {
  Points3 lengths(surface.faces.rows(), 3);
  for (Index f = 0; f < static_cast<Index>(surface.faces.rows()); ++f) {
    for (Index k = 0; k < 3; ++k)
      lengths(f, k) = (surface.vertices.row(surface.faces(f, k)) -
                       surface.vertices.row(surface.faces(f, (k + 1) % 3)))
                          .norm();
  }
  return lengths;
}

template <typename Exception, typename Work>
Error error_of(const Work& work) {
  try {
    work();
  } catch (const Exception& e) {
    return e.error();
  }
  ADD_FAILURE() << "nothing was thrown";
  return {};
}

TEST(MetricInput, LengthsOfACoverAreThoseOfItsFirstCopy) {
  const mesh::Surface surface = test::grid(3, 2);
  const Points3 lengths = lengths_of(surface);
  const EngineInput input = checked_input(surface, &lengths, {});
  const intrinsic::IntrinsicMesh& mesh = input.setup.mesh;
  ASSERT_EQ(input.edge_length.size(), mesh.edge_count());
  for (std::size_t e = 0; e < mesh.edge_count(); ++e) {
    EXPECT_GT(input.edge_length[e], 0.0);
    const auto mirror = static_cast<std::size_t>(mesh.reflection[2 * e] >> 1);
    EXPECT_EQ(input.edge_length[e], input.edge_length[mirror]);
  }
  EXPECT_EQ(input.positions, nullptr);
}

TEST(MetricInput, LengthsThatAreNoTrianglesOrDisagreeNameTheFace) {
  const mesh::Surface surface = test::tetrahedron();
  Points3 lengths = lengths_of(surface);
  lengths(2, 1) *= 3.0;
  Error error = error_of<InvalidInput>([&] { checked_input(surface, &lengths, {}); });
  EXPECT_EQ(error.code, ErrorCode::kZeroAreaFace);
  EXPECT_EQ(error.elements, std::vector<Index>{2});
  lengths = lengths_of(surface);
  lengths(3, 0) *= 1.0 + 1e-6;
  error = error_of<InvalidInput>([&] { checked_input(surface, &lengths, {}); });
  EXPECT_EQ(error.code, ErrorCode::kBadShape);
  const Points3 too_few = lengths.topRows(3);
  error = error_of<InvalidInput>([&] { checked_input(surface, &too_few, {}); });
  EXPECT_EQ(error.code, ErrorCode::kBadShape);
}

TEST(MetricInput, OptionsOutOfRangeAreRefused) {
  const mesh::Surface surface = test::tetrahedron();
  for (const int bits : {1, 52, kLargestBits + 1}) {
    MetricOptions options;
    options.bits = bits;
    EXPECT_EQ(error_of<InvalidInput>([&] { checked_input(surface, nullptr, options); }).code,
              ErrorCode::kBadOption);
  }
  for (const double tolerance : {0.0, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    MetricOptions options;
    options.tolerance = tolerance;
    EXPECT_EQ(error_of<InvalidInput>([&] { checked_input(surface, nullptr, options); }).code,
              ErrorCode::kBadOption);
  }
}

TEST(MetricInput, WhatRoundingLeavesOfGaussBonnetIsSpread) {
  const mesh::Surface surface = test::torus(6, 5);
  const EngineInput input = checked_input(surface, nullptr, {});
  std::vector<double> target(30, 2.0 * pi);
  target[4] += 1e-12;
  const std::vector<double> spread = checked_targets(target, input, 1e-10);
  long double sum = 0.0L;
  for (const double t : spread) sum += t;
  EXPECT_NEAR(static_cast<double>(sum), 60.0 * pi, 1e-12);
}

TEST(MetricInput, CurvatureThatDoesNotAddUpIsInfeasibleWithItsSums) {
  const mesh::Surface surface = test::torus(6, 5);
  const EngineInput input = checked_input(surface, nullptr, {});
  std::vector<double> target(30, 2.0 * pi);
  target[4] += 0.5 * pi;
  const Error error = error_of<Infeasible>([&] { checked_targets(target, input, 1e-10); });
  EXPECT_EQ(error.code, ErrorCode::kGaussBonnet);
  ASSERT_EQ(error.witness.numbers.size(), 2u);
  EXPECT_NEAR(error.witness.numbers[0].second[0] - error.witness.numbers[1].second[0], 0.5 * pi,
              1e-12);
  target[4] = 0.0;
  EXPECT_EQ(error_of<InvalidInput>([&] { checked_targets(target, input, 1e-10); }).elements,
            std::vector<Index>{4});
  target.pop_back();
  EXPECT_EQ(error_of<InvalidInput>([&] { checked_targets(target, input, 1e-10); }).code,
            ErrorCode::kBadShape);
}

}  // namespace
}  // namespace flipfree::conformal::metric_input_test
