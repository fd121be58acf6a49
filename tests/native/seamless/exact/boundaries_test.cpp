#include "flipfree/seamless/exact/boundaries.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

#include "flipfree/seamless/bordered/boundary_cones.h"
#include "support/shapes.h"

namespace flipfree::seamless::boundaries_test {
namespace {

mesh::Surface both(const mesh::Surface& a, const mesh::Surface& b) {
  mesh::Surface all = a;
  all.vertices.conservativeResize(a.vertices.rows() + b.vertices.rows(), 3);
  all.vertices.bottomRows(b.vertices.rows()) = b.vertices;
  all.faces.conservativeResize(a.faces.rows() + b.faces.rows(), 3);
  all.faces.bottomRows(b.faces.rows()) = b.faces.array() + static_cast<Index>(a.vertices.rows());
  return all;
}

struct Sample {
  mesh::Surface surface;
  mesh::Adjacency adjacency;
  std::vector<Index> cones;  // nothing given

  explicit Sample(mesh::Surface s)
      : surface(std::move(s)),
        adjacency(
            mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces)),
        cones(flat_inside(
            std::vector<Index>(static_cast<std::size_t>(surface.vertices.rows()), kNotGiven),
            adjacency)) {}
};

TEST(Boundaries, PartsKnowWhetherTheyHaveOneAndWhatIsGivenThere) {
  Sample sample(both(test::torus(6, 5), both(test::grid(2, 2), test::grid(3, 3))));
  sample.cones[30 + 9] = 1;  // a corner of the larger sheet
  const auto parts = parts_with_boundaries(sample.surface, sample.adjacency, sample.cones);
  ASSERT_EQ(parts.size(), 3U);
  EXPECT_FALSE(parts[0].bordered || parts[0].corners_given);
  EXPECT_TRUE(parts[1].bordered && !parts[1].corners_given);
  EXPECT_TRUE(parts[2].bordered && parts[2].corners_given);
  EXPECT_EQ(parts[2].surface.vertices.rows(), 16);
}

TEST(Boundaries, FreedPartsHaveNoCornersAndAreNotAligned) {
  const Sample sample(both(test::grid(2, 2), test::grid(3, 3)));
  const auto parts = parts_with_boundaries(sample.surface, sample.adjacency, sample.cones);
  ExecutionContext context;
  const auto cones = with_corners(parts, {1, 0}, sample.cones, context);
  EXPECT_TRUE(std::equal(cones.begin(), cones.begin() + 9, sample.cones.begin()));
  EXPECT_EQ(std::count(cones.begin() + 9, cones.end(), 1), 4);
  EXPECT_EQ(std::count(cones.begin() + 9, cones.end(), kNotGiven), 0);
  const auto aligned = aligned_faces(sample.surface, sample.adjacency, cones);
  EXPECT_EQ(std::count(aligned.begin(), aligned.begin() + 8, 1), 0);
  EXPECT_EQ(std::count(aligned.begin() + 8, aligned.end(), 1), 18);
}

TEST(Boundaries, OnlyEdgesOfAlignedPartsAreStraight) {
  const Sample sample(both(test::grid(2, 2), test::grid(3, 3)));
  std::vector<FaceId> parent;
  Points2 uv(3 * sample.surface.faces.rows(), 2);
  for (FaceId f = 0; f < static_cast<FaceId>(sample.surface.faces.rows()); ++f) {
    parent.push_back(f);
    for (int k = 0; k < 3; ++k)
      uv.row(3 * f + k) = sample.surface.vertices.row(sample.surface.faces(f, k)).head<2>();
  }
  const mesh::EdgeFlags none(sample.adjacency.opposite.size(), 0);
  const distortion::CutMap cut = distortion::cut_map(sample.surface, sample.adjacency, none, uv);
  std::vector<char> aligned(26, 0);
  std::fill(aligned.begin() + 8, aligned.end(), 1);
  const auto edges = straight_where(aligned, parent, cut, sample.adjacency);
  EXPECT_EQ(edges.size(), 12U);
  for (const auto& edge : edges) EXPECT_GE(edge.h / 3, 8);
}

}  // namespace
}  // namespace flipfree::seamless::boundaries_test
