// Frames of scaled surfaces, against angles of scaled triangles.
#include "flipfree/field/guidance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>

#include "field/fields.h"
#include "flipfree/base/error.h"

namespace flipfree::field::sized_frames_test {
namespace {

std::vector<double> random_sizes(const Place& p, double reach) {
  std::mt19937 random(4);
  std::vector<double> sizing;
  for (Eigen::Index v = 0; v < p.surface.vertices.rows(); ++v)
    sizing.push_back(std::exp(std::uniform_real_distribution<double>(-reach, reach)(random)));
  return sizing;
}

TEST(SizedFrames, EdgesTurnAgainstEachOtherAsTheScaledTrianglesCornersChange) {
  constexpr double kSmall = 1e-4;
  for (const Place& p : places()) {
    const std::vector<double> sizing = random_sizes(p, kSmall);
    const Frames sized = sized_frames(p.surface, p.adjacency, p.frames, sizing);
    const auto length = [&](VertexId a, VertexId b) {
      return (p.surface.vertices.row(a) - p.surface.vertices.row(b)).norm() *
             std::sqrt(sizing[at(a)] * sizing[at(b)]);
    };
    for (HalfedgeId h = 0; at(h) < sized.direction.size(); ++h) {
      const HalfedgeId before = previous_corner(h);
      // Edges along the boundary are what corners there are counted from.
      if (p.adjacency.opposite[at(h)] == kInvalid || p.adjacency.opposite[at(before)] == kInvalid)
        continue;
      const VertexId j = mesh::source(p.surface.faces, h);
      const VertexId k = mesh::target(p.surface.faces, h);
      const VertexId i = mesh::source(p.surface.faces, before);
      const double c = length(i, j), a = length(j, k), b = length(k, i);
      const double corner = std::acos((a * a + c * c - b * b) / (2.0 * a * c));
      const auto change = [&](HalfedgeId e) {
        return sized.direction[at(e)] - p.frames.direction[at(e)];
      };
      EXPECT_NEAR(change(before) - change(h), corner - p.frames.corner[at(h)],
                  100.0 * kSmall * kSmall);
      EXPECT_EQ(sized.corner[at(h)], p.frames.corner[at(h)]);
    }
  }
}

TEST(SizedFrames, JumpsOfSizeTurnNoEdgeByMoreThanAnEighthOfPi) {
  for (const Place& p : places()) {
    const Frames sized = sized_frames(p.surface, p.adjacency, p.frames, random_sizes(p, 700.0));
    for (std::size_t h = 0; h < sized.direction.size(); ++h)
      EXPECT_LE(std::abs(sized.direction[h] - p.frames.direction[h]),
                0.125 * std::numbers::pi + 1e-12);
  }
}

TEST(SizedFrames, SizesThatAreNoneAreRefusedByVertex) {
  const Place p(test::cylinder(8, 3));
  const auto count = at(static_cast<Index>(p.surface.vertices.rows()));
  EXPECT_NO_THROW(check_sizing({}, p.surface));
  EXPECT_NO_THROW(check_sizing(std::vector<double>(count, 2.0), p.surface));
  EXPECT_THROW(check_sizing({1.0}, p.surface), InvalidInput);
  for (const double wrong : {0.0, -1.0, std::numeric_limits<double>::infinity()}) {
    std::vector<double> sizing(count, 1.0);
    sizing[5] = wrong;
    try {
      check_sizing(sizing, p.surface);
      ADD_FAILURE() << wrong << " is not refused";
    } catch (const InvalidInput& error) {
      EXPECT_NE(std::string(error.what()).find("vertex 5"), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace flipfree::field::sized_frames_test
