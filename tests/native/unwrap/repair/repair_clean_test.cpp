#include "flipfree/unwrap/repair/repair_clean.h"

#include <gtest/gtest.h>

#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap {
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
}  // namespace flipfree::unwrap
