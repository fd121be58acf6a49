#include "flipfree/embedding/progressive/progressive.h"

#include <gtest/gtest.h>

#include <random>

#include "embedding/disks.h"
#include "flipfree/base/error.h"
#include "flipfree/base/stored.h"
#include "flipfree/embedding/tutte/tutte.h"

namespace flipfree::embedding::progressive_test {
namespace {

Points2 with_boundary(const test::Disk& disk, Points2 uv) {
  for (std::size_t i = 0; i < disk.loop.size(); ++i) {
    uv.row(disk.loop[i]) = disk.boundary.row(static_cast<Index>(i));
  }
  return uv;
}

Points2 random_start(const test::Disk& disk, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  Points2 uv(disk.vertex_count(), 2);
  for (Index v = 0; v < uv.rows(); ++v) uv.row(v) << unit(random), unit(random);
  return with_boundary(disk, uv);
}

void expect_flip_free(const test::Disk& disk, const Points2& uv, bool float32) {
  ExecutionContext context;
  EXPECT_EQ(count_flips(disk.surface.faces, uv, context), 0U);
  if (float32) {
    EXPECT_EQ(count_flips(disk.surface.faces, as_stored(uv), context), 0U);
  }
  for (std::size_t i = 0; i < disk.loop.size(); ++i) {
    EXPECT_EQ(uv.row(disk.loop[i]), disk.boundary.row(static_cast<Index>(i)));
  }
}

Points2 solve(const test::Disk& disk, const Points2& start, ProgressiveStart kind, bool float32) {
  ExecutionContext context;
  Stats stats;
  PlanarMap map = make_planar_map(disk.surface.faces, disk.loop, start, float32);
  const bool nothing = kind == ProgressiveStart::kNothing;
  progressive_embedding(map, nothing ? ProgressiveOptions{.start = kind} : thorough(kind), context,
                        stats);
  return map.uv;
}

std::vector<test::Disk> hard_disks() {
  std::vector<test::Disk> disks;
  disks.push_back(test::make_disk(test::tube(8, 160), BoundaryShape::kCircle));
  disks.push_back(test::make_disk(test::tube(3, 400), BoundaryShape::kTriangle));
  disks.push_back(
      test::make_disk(test::stacked(2000, test::Stacking::kMixed), BoundaryShape::kTriangle));
  disks.push_back(
      test::make_disk(test::stacked(2000, test::Stacking::kDeep), BoundaryShape::kTriangle));
  disks.push_back(test::make_disk(test::bumpy_grid(30, 20, 0.2, 3), BoundaryShape::kCircle));
  return disks;
}

TEST(Progressive, FromNothingAndFromRandomStartsEveryHardDiskIsEmbeddedAsStored) {
  for (const test::Disk& disk : hard_disks()) {
    const Points2 uv = solve(disk, with_boundary(disk, Points2::Zero(disk.vertex_count(), 2)),
                             ProgressiveStart::kNothing, true);
    expect_flip_free(disk, uv, true);
    EXPECT_EQ(uv, as_stored(uv));
    for (const unsigned seed : {1U, 2U, 3U}) {
      expect_flip_free(
          disk, solve(disk, random_start(disk, seed), ProgressiveStart::kInitial, true), true);
    }
  }
}

TEST(Progressive, FromTuttesFoldedMapEveryHardDiskIsEmbeddedInDouble) {
  ExecutionContext context;
  for (const test::Disk& disk : hard_disks()) {
    const Points2 start =
        tutte_uniform(disk.surface.faces, disk.vertex_count(), disk.loop, disk.boundary, context);
    expect_flip_free(disk, solve(disk, start, ProgressiveStart::kInitial, false), false);
  }
}

TEST(Progressive, CancelStopsIt) {
  const test::Disk disk = test::make_disk(test::tube(8, 400), BoundaryShape::kCircle);
  ExecutionContext context;
  context.cancel();
  Stats stats;
  PlanarMap map = make_planar_map(disk.surface.faces, disk.loop,
                                  with_boundary(disk, Points2::Zero(disk.vertex_count(), 2)), true);
  ProgressiveOptions options;
  options.start = ProgressiveStart::kNothing;
  EXPECT_THROW(progressive_embedding(map, options, context, stats), Cancelled);
}

}  // namespace
}  // namespace flipfree::embedding::progressive_test
