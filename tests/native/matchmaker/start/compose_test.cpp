#include "flipfree/matchmaker/start/compose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "flipfree/distortion/untangle.h"
#include "flipfree/matchmaker/target/outline_target.h"
#include "matchmaker/start/star_outline.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::compose_test {
namespace {

TEST(Compose, PutsTheBoundaryAtItsTargetsAndFoldsLittle) {
  const mesh::Surface surface = test::grid(8, 8);
  const mesh::RefinedSurface refined = mesh::make_refined_surface(surface);
  const Constraints constraints = test::star_outline(refined);
  ExecutionContext context;
  Stats stats;
  const Target target = outline_target(refined, constraints, context);
  const Points2 uv = compose_through_disk(refined, target.domain, context, stats);
  for (std::size_t i = 0; i < constraints.outline.size(); ++i)
    EXPECT_EQ(Vector2(uv.row(refined.boundary[i]).transpose()), constraints.outline[i]);
  // Most of it is right: that is all that is promised, and what makes it a start.
  const auto folded = distortion::find_flips(surface.faces, uv, context).size();
  EXPECT_LT(10 * folded, static_cast<std::size_t>(surface.faces.rows()));
}

// Corners on a circle are where the disk has them: nothing is left for the target to bend.
TEST(Compose, OntoACircleIsTheMapOntoTheDisk) {
  const mesh::Surface surface = test::grid(8, 8);
  const mesh::RefinedSurface refined = mesh::make_refined_surface(surface);
  Constraints constraints;
  const auto n = static_cast<double>(refined.boundary.size());
  for (std::size_t i = 0; i < refined.boundary.size(); ++i) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(i) / n;
    constraints.outline.emplace_back(3 * std::cos(angle), 3 * std::sin(angle));
  }
  ExecutionContext context;
  Stats stats;
  const Target target = outline_target(refined, constraints, context);
  const Points2 uv = compose_through_disk(refined, target.domain, context, stats);
  EXPECT_TRUE(distortion::find_flips(surface.faces, uv, context).empty());
}

}  // namespace
}  // namespace flipfree::matchmaker::compose_test
