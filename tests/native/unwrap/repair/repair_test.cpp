#include "flipfree/unwrap/repair/repair.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "flipfree/base/error.h"
#include "flipfree/certify/measures.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::repair_test {
namespace {

std::int64_t count(const certify::Parametrization& map, const char* key) {
  return std::get<std::int64_t>(map.stats.at(key));
}

certify::Parametrization repaired(const mesh::Surface& surface, const Points2& uv,
                                  const RepairOptions& options = {}) {
  ExecutionContext context;
  return repair(surface, uv, options, context);
}

// All corners of a vertex.
void put(const mesh::Surface& surface, VertexId v, const Vector2& place, Points2& uv) {
  for (CornerId c = 0; c < static_cast<CornerId>(surface.faces.size()); ++c) {
    if (surface.faces.data()[c] == v) uv.row(c) = place.transpose();
  }
}

Eigen::Index corners_kept(const Points2& uv, const Points2& before) {
  Eigen::Index kept = 0;
  for (Eigen::Index c = 0; c < uv.rows(); ++c) kept += uv.row(c) == before.row(c);
  return kept;
}

TEST(Repair, a_map_without_damage_comes_back_bit_for_bit) {
  const mesh::Surface surface = test::bumpy_grid(9, 7, 0.2, 2.0);
  const Points2 uv = test::flat(surface);
  const certify::Parametrization map = repaired(surface, uv);
  EXPECT_TRUE(map.certificate.ok);
  EXPECT_EQ(map.uv, uv);
  EXPECT_EQ(count(map, "corners_kept"), uv.rows());
}

TEST(Repair, only_a_vertex_that_was_thrown_far_moves) {
  const mesh::Surface surface = test::bumpy_grid(10, 10, 0.1, 2.0);
  Points2 uv = test::flat(surface);
  const VertexId thrown = 5 * 11 + 5;
  put(surface, thrown, Vector2(7, -3), uv);
  const certify::Parametrization map = repaired(surface, uv);
  EXPECT_EQ(count(map, "charts_unfolded"), 1);
  EXPECT_GT(count(map, "flips_before"), 0);
  EXPECT_EQ(map.certificate.flips32, 0);
  for (CornerId c = 0; c < static_cast<CornerId>(uv.rows()); ++c) {
    if (surface.faces.data()[c] != thrown) {
      ASSERT_EQ(map.uv.row(c), uv.row(c));
    }
  }
}

TEST(Repair, a_mirrored_chart_is_turned_over_and_the_others_stay) {
  const mesh::Surface surface = test::bumpy_grid(8, 8, 0.2, 2.0);
  Points2 uv = test::flat(surface);
  std::vector<char> right;
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    right.push_back(uv.middleRows<3>(3 * f).col(0).mean() > 0.5);
    if (right.back())
      uv.middleRows<3>(3 * f).col(0).array() = 3.0 - uv.middleRows<3>(3 * f).col(0).array();
  }
  const certify::Parametrization map = repaired(surface, uv);
  EXPECT_EQ(count(map, "charts_mirrored"), 1);
  EXPECT_EQ(count(map, "charts_anew"), 0);
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    if (right[static_cast<std::size_t>(f)] == 0) {
      ASSERT_EQ(map.uv.middleRows<3>(3 * f), uv.middleRows<3>(3 * f));
    }
  }
}

TEST(Repair, a_chart_that_collapsed_gets_the_size_of_the_others) {
  const mesh::Surface surface = test::bumpy_grid(8, 8, 0.2, 2.0);
  for (const bool to_a_line : {false, true}) {
    Points2 uv = test::flat(surface);
    for (FaceId f = 0; f < surface.faces.rows(); ++f) {
      auto own = uv.middleRows<3>(3 * f);
      if (own.col(0).mean() < 0.5) continue;
      own.col(0).setConstant(9.0);
      if (!to_a_line) own.col(1).setConstant(9.0);
    }
    const certify::Parametrization map = repaired(surface, uv);
    EXPECT_EQ(count(map, "charts_anew"), 1);
    EXPECT_EQ(count(map, "charts_moved"), 1);
    EXPECT_EQ(map.certificate.island_overlaps, 0);
    EXPECT_LT(map.certificate.energy, 1.2);
    EXPECT_EQ(2 * count(map, "corners_kept"), uv.rows());
  }
}

TEST(Repair, a_whole_map_at_one_point_is_unwrapped) {
  const mesh::Surface surface = test::sphere(12, 8);
  const certify::Parametrization map =
      repaired(surface, Points2::Constant(surface.faces.size(), 2, 0.5));
  EXPECT_EQ(map.certificate.flips32, 0);
  EXPECT_EQ(map.certificate.overlaps, 0);
  EXPECT_LE(map.uv.maxCoeff(), 1.0);
  EXPECT_GE(map.uv.minCoeff(), 0.0);
}

TEST(Repair, corners_without_a_place_get_one) {
  const mesh::Surface surface = test::bumpy_grid(10, 10, 0.1, 2.0);
  const Points2 flat = test::flat(surface);
  Points2 uv = flat;
  put(surface, 5 * 11 + 5, Vector2(std::nan(""), 0.5), uv);
  put(surface, 3 * 11 + 2, Vector2(1e39, 0.5), uv);
  uv.row(0).setConstant(std::numeric_limits<double>::infinity());
  const certify::Parametrization map = repaired(surface, uv);
  EXPECT_EQ(count(map, "corners_without_place"), 6 + 6 + 1);
  EXPECT_TRUE(map.certificate.ok);
  EXPECT_EQ(map.uv.row(0), flat.row(0));
  EXPECT_GE(corners_kept(map.uv, flat), uv.rows() - 12);
}

TEST(Repair, a_face_torn_off_joins_its_neighbours_again) {
  const mesh::Surface surface = test::bumpy_grid(10, 10, 0.1, 2.0);
  const Points2 flat = test::flat(surface);
  Points2 uv = flat;
  for (const FaceId f : {44, 90}) uv.middleRows<3>(3 * f).col(0) *= -1.0;
  uv.row(3 * 150) << 0.0, 0.0;
  const certify::Parametrization map = repaired(surface, uv);
  EXPECT_EQ(map.uv, flat);
  EXPECT_EQ(count(map, "corners_rejoined"), 7);
  EXPECT_EQ(count(map, "charts"), 1);
}

TEST(Repair, a_face_is_not_joined_across_a_seam) {
  const mesh::Surface surface = test::bumpy_grid(10, 10, 0.1, 2.0);
  Points2 uv = test::flat(surface);
  uv.middleRows<3>(3 * 90).col(0) *= -1.0;
  RepairOptions options;
  options.cuts.resize(3, 2);
  for (Index k = 0; k < 3; ++k)
    options.cuts.row(k) << surface.faces(90, k), surface.faces(90, (k + 1) % 3);
  const certify::Parametrization map = repaired(surface, uv, options);
  EXPECT_EQ(count(map, "corners_rejoined"), 0);
  EXPECT_EQ(count(map, "charts"), 2);
  EXPECT_EQ(count(map, "charts_mirrored"), 1);
}

// The unit square, wound one and a half times around the origin.
struct Spiral {
  mesh::Surface surface = test::grid(30, 4);
  Points2 uv;
  Spiral() {
    uv = test::flat(surface);
    for (Eigen::Index c = 0; c < uv.rows(); ++c) {
      const double angle = 3.0 * 3.14159265358979 * uv(c, 0);
      const double radius = 2.0 - uv(c, 1);
      uv.row(c) << radius * std::cos(angle), radius * std::sin(angle);
    }
    for (VertexId v = 0; v < surface.vertices.rows(); ++v) surface.vertices(v, 0) *= 12.0;
  }
};

TEST(Repair, a_chart_on_itself_is_cut_opened_or_kept) {
  const Spiral spiral;
  ASSERT_TRUE(certify::flipped_faces(spiral.uv).empty());
  RepairOptions options;
  options.overlaps = SelfOverlaps::kCut;
  const certify::Parametrization cut = repaired(spiral.surface, spiral.uv, options);
  EXPECT_GT(count(cut, "overlaps_before"), 0);
  EXPECT_EQ(cut.certificate.overlaps, 0);
  EXPECT_GT(count(cut, "charts"), 1);
  EXPECT_EQ(count(cut, "charts_cut"), 1);
  EXPECT_GE(2 * count(cut, "corners_kept"), spiral.uv.rows());
  EXPECT_EQ(cut.certificate.island_overlaps, 0);
  options.overlaps = SelfOverlaps::kOpen;
  const certify::Parametrization open = repaired(spiral.surface, spiral.uv, options);
  EXPECT_EQ(open.certificate.overlaps, 0);
  EXPECT_EQ(count(open, "charts"), 1);
  options.overlaps = SelfOverlaps::kKeep;
  const certify::Parametrization kept = repaired(spiral.surface, spiral.uv, options);
  EXPECT_EQ(kept.uv, spiral.uv);
  EXPECT_GT(kept.certificate.overlaps, 0);
}

TEST(Repair, charts_on_others_are_moved_where_that_is_asked_for) {
  const mesh::Surface surface = test::bumpy_grid(8, 8, 0.2, 2.0);
  Points2 uv = test::flat(surface);
  std::int64_t left = 0;
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    if (uv.middleRows<3>(3 * f).col(0).mean() > 0.3) {
      uv.middleRows<3>(3 * f).col(0).array() -= 0.3;
    } else {
      left += 3;
    }
  }
  EXPECT_EQ(repaired(surface, uv).uv, uv);
  RepairOptions options;
  options.disjoint = true;
  const certify::Parametrization map = repaired(surface, uv, options);
  EXPECT_EQ(map.certificate.island_overlaps, 0);
  EXPECT_EQ(count(map, "charts_moved"), 1);
  EXPECT_EQ(count(map, "corners_kept"), uv.rows() - left);
}

TEST(Repair, pins_hold_bit_for_bit) {
  const mesh::Surface surface = test::bumpy_grid(10, 10, 0.1, 2.0);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> anywhere(-0.2, 1.2);
  Points2 uv = test::flat(surface);
  for (int i = 0; i < 12; ++i)
    put(surface, static_cast<VertexId>(random() % 121), Vector2(anywhere(random), anywhere(random)),
        uv);
  RepairOptions options;
  for (CornerId c = 0; c < static_cast<CornerId>(uv.rows()); ++c) {
    const VertexId v = surface.faces.data()[c];
    if (v == 0) options.pins.push_back({c, Vector2(0.0, 0.0)});
    if (v == 60) options.pins.push_back({c, Vector2(0.5625, 0.46875)});
  }
  const certify::Parametrization map = repaired(surface, uv, options);
  EXPECT_EQ(map.certificate.pin_failures, 0);
  for (const certify::CornerPin& pin : options.pins)
    EXPECT_EQ(Vector2(map.uv.row(pin.corner)), pin.uv);
}

TEST(Repair, two_pins_for_one_place_are_refused) {
  const mesh::Surface surface = test::grid(3, 3);
  RepairOptions options;
  for (CornerId c = 0; c < static_cast<CornerId>(surface.faces.size()); ++c) {
    if (surface.faces.data()[c] == 0)
      options.pins.push_back({c, Vector2(0.0, 0.1 * static_cast<double>(c))});
  }
  ASSERT_EQ(options.pins.size(), 2U);
  try {
    repaired(surface, test::flat(surface), options);
    FAIL();
  } catch (const InvalidInput& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kBadPins);
  }
}

TEST(Repair, the_same_bits_for_any_number_of_threads) {
  const mesh::Surface surface = test::bumpy_grid(30, 30, 0.2, 2.0);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> anywhere(0, 1);
  Points2 uv = test::flat(surface);
  for (FaceId f = 0; f < surface.faces.rows(); ++f)
    uv.middleRows<3>(3 * f).col(1).array() +=
        2.0 * std::floor(4.0 * uv.middleRows<3>(3 * f).col(0).mean());
  for (int i = 0; i < 100; ++i)
    put(surface, static_cast<VertexId>(random() % 961), Vector2(anywhere(random), anywhere(random)),
        uv);
  Points2 first;
  for (const int threads : {1, 2, 3, 8}) {
    ExecutionContext context;
    context.threads = threads;
    const certify::Parametrization map = repair(surface, uv, {}, context);
    if (threads == 1) first = map.uv;
    EXPECT_EQ(map.uv, first);
  }
}

TEST(Repair, ends_when_time_is_over_and_when_cancelled) {
  const mesh::Surface surface = test::bumpy_grid(60, 60, 0.2, 2.0);
  const Points2 uv = Points2::Zero(surface.faces.size(), 2);
  RepairOptions options;
  options.max_seconds = 1e-6;
  try {
    repaired(surface, uv, options);
    FAIL();
  } catch (const NotConverged& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kTimeLimit);
  }
  ExecutionContext context;
  context.cancel();
  EXPECT_THROW(repair(surface, uv, {}, context), Cancelled);
}

// Whatever is done to a map, what comes back is certified.
TEST(Repair, random_damage_is_mended) {
  for (unsigned seed = 0; seed < 60; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> anywhere(0, 1);
    const mesh::Surface surface = test::bumpy_grid(9, 9, anywhere(random), 2.0);
    Points2 uv = test::flat(surface);
    const auto moves = static_cast<int>(random() % 40);
    for (int i = 0; i < moves; ++i)
      put(surface, static_cast<VertexId>(random() % 100),
          Vector2(anywhere(random), anywhere(random)), uv);
    for (unsigned i = 0; i < random() % 5; ++i)
      uv.row(static_cast<Eigen::Index>(random()) % uv.rows()) << anywhere(random), anywhere(random);
    const certify::Parametrization map = repaired(surface, uv);
    EXPECT_TRUE(map.certificate.ok) << seed;
    EXPECT_EQ(map.certificate.overlaps, 0) << seed;
  }
}

}  // namespace
}  // namespace flipfree::unwrap::repair_test
