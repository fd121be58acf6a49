#include "flipfree/unwrap/repair/repair.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "flipfree/base/plane.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::repair_clean_test {
namespace {

std::int64_t count(const certify::Parametrization& map, const char* key) {
  return std::get<std::int64_t>(map.stats.at(key));
}

certify::Parametrization repaired(const mesh::Surface& surface, const Points2& uv,
                                  const RepairOptions& options) {
  ExecutionContext context;
  return repair_clean(surface, uv, options, context);
}

// Two islands, left and right of the middle; the right one is drawn out upwards.
struct Halves {
  mesh::Surface surface = test::bumpy_grid(8, 8, 0.1, 2.0);
  Points2 uv = test::flat(surface);
  std::vector<char> right;

  Halves() {
    for (FaceId f = 0; f < surface.faces.rows(); ++f) {
      auto own = uv.middleRows<3>(3 * f);
      right.push_back(own.col(0).mean() > 0.5);
      if (right.back() == 0) continue;
      own.col(0).array() += 1.0;
      own.col(1) *= 2.5;
    }
  }
  bool same(const Points2& other, bool of_right) const {
    for (FaceId f = 0; f < surface.faces.rows(); ++f) {
      if ((right[static_cast<std::size_t>(f)] != 0) != of_right) continue;
      if (other.middleRows<3>(3 * f) != uv.middleRows<3>(3 * f)) return false;
    }
    return true;
  }
};

TEST(RepairClean, stretched_islands_stay_and_are_counted_unless_asked_for) {
  const Halves halves;
  RepairOptions options;
  const certify::Parametrization kept = repaired(halves.surface, halves.uv, options);
  EXPECT_EQ(kept.uv, halves.uv);
  EXPECT_EQ(count(kept, "stretched_charts"), 1);
  options.stretched = StretchedIslands::kImprove;
  const certify::Parametrization better = repaired(halves.surface, halves.uv, options);
  EXPECT_TRUE(better.certificate.ok);
  EXPECT_TRUE(halves.same(better.uv, false));
  EXPECT_FALSE(halves.same(better.uv, true));
  EXPECT_EQ(count(better, "charts_improved"), 1);
  EXPECT_EQ(count(better, "stretched_charts"), 0);
  EXPECT_EQ(count(better, "charts_moved"), 0);
}

TEST(RepairClean, islands_stacked_on_purpose_stay_so_when_they_are_made_better) {
  Halves halves;
  for (FaceId f = 0; f < halves.surface.faces.rows(); ++f) {
    if (halves.right[static_cast<std::size_t>(f)] != 0)
      halves.uv.middleRows<3>(3 * f).col(0).array() -= 1.5;
  }
  RepairOptions options;
  options.stretched = StretchedIslands::kImprove;
  const certify::Parametrization map = repaired(halves.surface, halves.uv, options);
  EXPECT_EQ(count(map, "charts_improved"), 1);
  EXPECT_EQ(count(map, "charts_moved"), 0);
  EXPECT_GT(map.certificate.island_overlaps, 0);
  options.disjoint = true;
  EXPECT_EQ(repaired(halves.surface, halves.uv, options).certificate.island_overlaps, 0);
}

// Beside a stretched island one that is folded at its middle: unfolded it reaches over a third one.
TEST(RepairClean, what_is_made_anew_makes_way_whatever_was_made_better_elsewhere) {
  const mesh::Surface surface = test::bumpy_grid(12, 8, 0.05, 2.0);
  Points2 uv = test::flat(surface);
  for (FaceId f = 0; f < surface.faces.rows(); ++f) {
    auto own = uv.middleRows<3>(3 * f);
    const double x = own.col(0).mean();
    if (x > 2.0 / 3.0) {
      own.col(0).array() += 1.0;
      own.col(1) *= 2.5;
    } else if (x > 1.0 / 3.0) {
      own.col(0) = 1.0 / 3.0 + (own.col(0).array() - 0.5).abs();
    }
  }
  RepairOptions options;
  std::vector<std::pair<VertexId, VertexId>> seam;  // what is folded is not joined to the first one
  for (CornerId c = 0; c < static_cast<CornerId>(surface.faces.size()); ++c) {
    const VertexId v = surface.faces.data()[c], w = surface.faces.data()[next_corner(c)];
    const auto on_it = [&](VertexId i) {
      return std::abs(surface.vertices(i, 0) - 1.0 / 3.0) < 1e-9;
    };
    if (on_it(v) && on_it(w)) seam.emplace_back(v, w);
  }
  options.cuts.resize(static_cast<Eigen::Index>(seam.size()), 2);
  for (std::size_t i = 0; i < seam.size(); ++i)
    options.cuts.row(static_cast<Eigen::Index>(i)) << seam[i].first, seam[i].second;
  for (const StretchedIslands what : {StretchedIslands::kCount, StretchedIslands::kImprove}) {
    options.stretched = what;
    const certify::Parametrization map = repaired(surface, uv, options);
    EXPECT_EQ(count(map, "charts_anew"), 1);
    EXPECT_EQ(count(map, "charts_improved"), what == StretchedIslands::kImprove ? 1 : 0);
    EXPECT_EQ(count(map, "charts_moved"), 1);
    EXPECT_EQ(map.certificate.island_overlaps, 0);
  }
}

double density(const Halves& halves, const Points2& uv, bool of_right) {
  double plane = 0.0;
  double area = 0.0;
  for (FaceId f = 0; f < halves.surface.faces.rows(); ++f) {
    if ((halves.right[static_cast<std::size_t>(f)] != 0) != of_right) continue;
    const auto own = [&](Index k) -> Vector2 { return uv.row(3 * f + k).transpose(); };
    const auto at = [&](Index k) -> Vector3 {
      return halves.surface.vertices.row(halves.surface.faces(f, k)).transpose();
    };
    plane += twice_area(own(0), own(1), own(2));
    area += (at(1) - at(0)).cross(at(2) - at(0)).norm();
  }
  return std::sqrt(plane / area);
}

TEST(RepairClean, what_is_made_better_gets_the_scale_of_what_stands_unless_pins_hold_it) {
  const Halves halves;
  RepairOptions options;
  options.stretched = StretchedIslands::kImprove;
  for (const double aspect : {1.0, 2.0}) {
    options.aspect = aspect;
    Points2 uv = halves.uv;
    uv.col(0) /= aspect;
    const Points2 better = repaired(halves.surface, uv, options).uv;
    EXPECT_NEAR(density(halves, better, true) / density(halves, uv, false), 1.0, 0.03) << aspect;
  }
  options.aspect = 1.0;
  const auto last = static_cast<FaceId>(halves.surface.faces.rows()) - 1;
  for (const CornerId c : {3 * last, 3 * last + 1})
    options.pins.push_back({c, halves.uv.row(c).transpose()});
  const Points2 pinned = repaired(halves.surface, halves.uv, options).uv;
  EXPECT_TRUE(halves.same(pinned, false));
  for (const certify::CornerPin& pin : options.pins)
    EXPECT_EQ(Vector2(pinned.row(pin.corner)), pin.uv);
}

TEST(RepairClean, the_same_bits_for_any_number_of_threads_when_islands_are_made_better) {
  const Halves halves;
  RepairOptions options;
  options.stretched = StretchedIslands::kImprove;
  Points2 first;
  for (const int threads : {1, 3}) {
    ExecutionContext context;
    context.threads = threads;
    const certify::Parametrization map = repair_clean(halves.surface, halves.uv, options, context);
    if (first.rows() == 0) first = map.uv;
    EXPECT_EQ(map.uv, first);
  }
}

}  // namespace
}  // namespace flipfree::unwrap::repair_clean_test
