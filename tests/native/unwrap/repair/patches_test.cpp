#include "flipfree/unwrap/repair/patches.h"

#include <gtest/gtest.h>

#include "flipfree/distortion/energy/energy.h"
#include "unwrap/repair/charts.h"

namespace flipfree::unwrap::patches_test {
namespace {

using test_charts::Sheet;

Index moved(const Points2& a, const Points2& b) {
  Index count = 0;
  for (Eigen::Index v = 0; v < a.rows(); ++v) count += a.row(v) != b.row(v);
  return count;
}

TEST(Patches, vertices_in_one_place_are_the_ones_that_move) {
  Sheet sheet(10);
  const Points2 sound = sheet.uv;
  for (const VertexId v : {24, 50, 51, 62, 97}) sheet.uv.row(v).setZero();
  Points2 uv = sheet.uv;
  ExecutionContext context;
  EXPECT_TRUE(mend_in_place(sheet.chart, uv, context));
  EXPECT_TRUE(distortion::is_flip_free(sheet.surface.faces, uv, context));
  EXPECT_LE(moved(uv, sound), 6);
}

TEST(Patches, a_part_grows_until_it_unfolds) {
  Sheet sheet(12);
  // A block mirrored in place: its inner vertices alone have no room.
  for (VertexId v = 0; v < sheet.uv.rows(); ++v) {
    if ((sheet.uv.row(v).array() - 0.5).abs().maxCoeff() < 0.2)
      sheet.uv(v, 0) = 1.0 - sheet.uv(v, 0);
  }
  const Points2 before = sheet.uv;
  ExecutionContext context;
  EXPECT_TRUE(mend_in_place(sheet.chart, sheet.uv, context));
  EXPECT_TRUE(distortion::is_flip_free(sheet.surface.faces, sheet.uv, context));
  EXPECT_GT(moved(sheet.uv, before), 8);
  EXPECT_LT(moved(sheet.uv, before), 100);
}

TEST(Patches, pins_stay_and_what_is_only_pinned_is_left_over) {
  Sheet sheet(8);
  sheet.uv.row(40) << 0.6, 0.55;
  sheet.uv.row(41) << 0.4, 0.5;
  Points2 uv = sheet.uv;
  sheet.chart.pinned[40] = 1;
  ExecutionContext context;
  EXPECT_TRUE(mend_in_place(sheet.chart, uv, context));
  EXPECT_EQ(uv.row(40), sheet.uv.row(40));
  sheet.chart.pinned.assign(sheet.chart.pinned.size(), 1);
  uv = sheet.uv;
  EXPECT_FALSE(mend_in_place(sheet.chart, uv, context));
  EXPECT_EQ(uv, sheet.uv);
}

TEST(Patches, only_what_is_around_the_flagged_faces_is_relaxed) {
  Sheet sheet(10, 0.0);
  sheet.uv.row(60) << 0.55, 0.53;
  std::vector<char> over(sheet.chart.area.size(), 0);
  for (std::size_t f = 0; f < over.size(); ++f)
    over[f] = (sheet.surface.faces.row(static_cast<Eigen::Index>(f)).array() == 60).any();
  ExecutionContext context;
  const Points2 uv = relaxed_around(sheet.chart, over, 0, sheet.uv, context);
  EXPECT_LT((uv.row(60) - sheet.surface.vertices.row(60).leftCols<2>()).norm(), 0.02);
  EXPECT_LE(moved(uv, sheet.uv), 7);
}

}  // namespace
}  // namespace flipfree::unwrap::patches_test
