#include "flipfree/unwrap/repair/repair.h"

#include <gtest/gtest.h>

#include "flipfree/base/error.h"
#include "support/corner_maps.h"
#include "support/shapes.h"

namespace flipfree::unwrap::improve_any_test {
namespace {

TEST(ImproveAny, maps_with_flips_are_repaired_first) {
  const mesh::Surface surface = test::bumpy_grid(10, 10, 0.3, 2.0);
  Points2 uv = test::flat(surface);
  uv.row(300) << 4, 4;
  ExecutionContext context;
  EXPECT_THROW(distortion::improve(surface, uv, {}, context), InvalidInput);
  const certify::Parametrization map = improve_any(surface, uv, {}, context);
  EXPECT_TRUE(map.certificate.ok);
  EXPECT_GT(std::get<std::int64_t>(map.stats.at("flips_before")), 0);
}

TEST(ImproveAny, sound_maps_are_only_improved) {
  const mesh::Surface surface = test::bumpy_grid(10, 10, 0.3, 2.0);
  ExecutionContext context;
  const certify::Parametrization map = improve_any(surface, test::flat(surface), {}, context);
  EXPECT_FALSE(map.stats.contains("flips_before"));
}

}  // namespace
}  // namespace flipfree::unwrap::improve_any_test
