#include "flipfree/unwrap/repair/given_map.h"

#include <gtest/gtest.h>

#include "flipfree/base/stats.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::rejoin_test {
namespace {

struct Torn {
  mesh::Surface surface = test::grid(6, 6);
  mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  Points2 sound = test::flat(surface);
  Points2 uv = sound;

  Index rejoin(const mesh::EdgeFlags& seams = {}, const std::vector<char>& fixed = {}) {
    return rejoin_torn(surface, adjacency, seams, fixed, uv);
  }
};

TEST(Rejoin, a_sound_map_stays) {
  Torn torn;
  EXPECT_EQ(torn.rejoin(), 0);
  EXPECT_EQ(torn.uv, torn.sound);
}

TEST(Rejoin, faces_and_corners_far_away_come_back) {
  Torn torn;
  torn.uv.middleRows<3>(3 * 30).array() *= -4.0;
  torn.uv.row(3 * 50 + 1) << 7.0, 7.0;
  EXPECT_EQ(torn.rejoin(), 4);
  EXPECT_EQ(torn.uv, torn.sound);
}

TEST(Rejoin, two_faces_that_share_a_torn_corner_come_back_together) {
  Torn torn;
  for (CornerId c = 3 * 40; c < 3 * 42; ++c) {
    if (torn.surface.faces.data()[c] == torn.surface.faces(40, 0)) torn.uv.row(c) << -2.0, 1.0;
  }
  EXPECT_GE(torn.rejoin(), 1);
  EXPECT_EQ(torn.uv, torn.sound);
}

TEST(Rejoin, an_island_that_lies_elsewhere_is_no_torn_face) {
  Torn torn;
  for (FaceId f = 0; f < 24; ++f) torn.uv.middleRows<3>(3 * f).col(0).array() += 3.0;
  const Points2 before = torn.uv;
  EXPECT_EQ(torn.rejoin(), 0);
  EXPECT_EQ(torn.uv, before);
}

TEST(Rejoin, what_would_not_fit_goes_back) {
  Torn torn;
  // An island of two rows at one point, between others that were drawn apart.
  for (FaceId f = 0; f < torn.surface.faces.rows(); ++f) {
    auto own = torn.uv.middleRows<3>(3 * f);
    if (f >= 24 && f < 48) {
      own.setConstant(9.0);
    } else if (f >= 48) {
      own.col(1).array() += 4.0;
    }
  }
  const Points2 before = torn.uv;
  EXPECT_EQ(torn.rejoin(), 0);
  EXPECT_EQ(torn.uv, before);
}

// A long row between two others, turned over; nothing is beside its first two places, so that its
// first face stays what it is. Every place that goes back spoils the next one.
TEST(Rejoin, a_chain_of_places_goes_back_in_time_that_grows_with_its_length) {
  const Index length = 20'000;
  mesh::Surface surface = test::grid(length, 3);
  surface.vertices.col(0) *= static_cast<double>(length);
  surface.vertices.col(1) *= 3.0;
  const Points2 all = test::flat(surface);
  std::vector<FaceId> kept;
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    const Eigen::RowVector2d middle = all.middleRows<3>(3 * f).colwise().mean();
    if (middle.x() > 1.0 || (middle.y() > 1.0 && middle.y() < 2.0)) kept.push_back(f);
  }
  Triangles faces(static_cast<Eigen::Index>(kept.size()), 3);
  for (std::size_t i = 0; i < kept.size(); ++i)
    faces.row(static_cast<Eigen::Index>(i)) = surface.faces.row(kept[i]);
  surface.faces = faces;
  Points2 uv = test::flat(surface);
  for (FaceId f = 0; f < faces.rows(); ++f) {
    auto own = uv.middleRows<3>(3 * f);
    if (own.col(1).mean() > 1.0 && own.col(1).mean() < 2.0) own.col(0) = -10.0 - own.col(0).array();
  }
  const Points2 before = uv;
  const mesh::Adjacency adjacency =
      mesh::build_adjacency(static_cast<Index>(surface.vertices.rows()), surface.faces);
  const Stopwatch watch;
  EXPECT_EQ(rejoin_torn(surface, adjacency, {}, {}, uv), 0);
  EXPECT_LT(watch.seconds(), 20.0);  // a fiftieth of what their square takes
  EXPECT_EQ(uv, before);
}

TEST(Rejoin, seams_and_fixed_corners_are_respected) {
  Torn torn;
  torn.uv.middleRows<3>(3 * 30).array() *= -4.0;
  mesh::EdgeFlags seams(torn.adjacency.opposite.size(), 0);
  for (HalfedgeId h = 3 * 30; h < 3 * 31; ++h) {
    seams[static_cast<std::size_t>(h)] = 1;
    seams[static_cast<std::size_t>(torn.adjacency.opposite[static_cast<std::size_t>(h)])] = 1;
  }
  EXPECT_EQ(torn.rejoin(seams), 0);
  std::vector<char> fixed(torn.adjacency.opposite.size(), 0);
  std::fill(fixed.begin() + 3 * 30, fixed.begin() + 3 * 31, 1);
  EXPECT_EQ(torn.rejoin({}, fixed), 0);
}

}  // namespace
}  // namespace flipfree::unwrap::rejoin_test
