#include "flipfree/embedding/embed.h"

#include <gtest/gtest.h>

#include "embedding/disks.h"
#include "flipfree/base/error.h"
#include "flipfree/base/stored.h"
#include "flipfree/embedding/tutte/tutte.h"

namespace flipfree::embedding::embed_test {
namespace {

Embedding embed(const test::Disk& disk, const EmbedOptions& options, Stats& stats) {
  ExecutionContext context;
  return embed_disk_refined(disk.surface.faces, disk.vertex_count(), disk.loop, disk.boundary,
                            options, context, stats);
}

void expect_flip_free(const Embedding& e) {
  ExecutionContext context;
  EXPECT_EQ(count_flips(e.faces, e.uv, context), 0U);
  EXPECT_EQ(count_flips(e.faces, as_stored(e.uv), context), 0U);
}

std::string rung(const Stats& stats) { return std::get<std::string>(stats.at("rung")); }

TEST(Embed, AnOrdinaryDiskNeedsOnlyTutte) {
  Stats stats;
  const auto disk = test::make_disk(test::bumpy_grid(20, 20, 0.2, 3), BoundaryShape::kCircle);
  const Embedding e = embed(disk, {}, stats);
  expect_flip_free(e);
  EXPECT_EQ(rung(stats), "tutte");
  EXPECT_TRUE(e.added.empty());
}

TEST(Embed, TheLadderIsClimbedWhereTutteFoldsAndSaysSo) {
  for (const auto shape : {BoundaryShape::kCircle, BoundaryShape::kSquare}) {
    for (const Index rings : {160, 400}) {
      Stats stats;
      expect_flip_free(embed(test::make_disk(test::tube(8, rings), shape), {}, stats));
      EXPECT_NE(rung(stats), "tutte");
      EXPECT_GT(std::get<std::int64_t>(stats.at("tutte_flips")), 0);
    }
  }
}

TEST(Embed, EveryOuterFaceOfASphereWorks) {
  const mesh::Surface sphere = test::sphere(14, 9);
  for (FaceId f = 0; f < sphere.faces.rows(); ++f) {
    mesh::Surface open = sphere;
    open.faces.row(f).swap(open.faces.row(open.faces.rows() - 1));
    Stats stats;
    expect_flip_free(embed(test::opened(open), {}, stats));
  }
}

TEST(Embed, LowDistortionStartsFromNothingWhereTutteFolds) {
  Stats stats;
  EmbedOptions options;
  options.low_distortion = true;
  expect_flip_free(
      embed(test::make_disk(test::tube(8, 200), BoundaryShape::kCircle), options, stats));
  EXPECT_EQ(rung(stats), "progressive");
}

TEST(Embed, SameBitsForOneAndTwoThreads) {
  const auto disk = test::make_disk(test::tube(12, 300), BoundaryShape::kCircle);
  for (const auto method : {EmbedMethod::kLadder, EmbedMethod::kProgressive}) {
    EmbedOptions options;
    options.method = method;
    options.low_distortion = true;
    Points2 first;
    for (const int threads : {1, 2, 2}) {
      ExecutionContext context;
      context.threads = threads;
      Stats stats;
      const Points2 uv = embed_disk(disk.surface.faces, disk.vertex_count(), disk.loop,
                                    disk.boundary, options, context, stats);
      if (threads == 1) {
        first = uv;
      } else {
        EXPECT_EQ(first, uv);
      }
    }
  }
}

// Thesis 3.5, Figure 3.13: the polygon's rows hold no number.
TEST(Embed, APolygonWithoutRoomIsInfeasibleByExactDecision) {
  Triangles fan(3, 3);
  fan << 0, 1, 3, 1, 2, 3, 2, 0, 3;
  const auto run = [&](const Points2& p, bool float32) {
    ExecutionContext context;
    Stats stats;
    EmbedOptions options;
    options.float32 = float32;
    const Points2 uv = embed_disk(fan, 4, {0, 1, 2}, p, options, context, stats);
    EXPECT_EQ(count_flips(fan, uv, context), 0U);
  };
  Points2 flat(3, 2);
  flat << -0.5, 1, 0.5, 1, 0, 1 + 0x1p-52;
  EXPECT_THROW(run(flat, false), Infeasible);
  flat(2, 1) = 1 + 0x1p-51;  // one row inside
  EXPECT_NO_THROW(run(flat, false));
  EXPECT_THROW(run(flat, true), Infeasible);
  flat(2, 1) = 1 + 0x1p-23;
  EXPECT_THROW(run(flat, true), Infeasible);
  EXPECT_NO_THROW(run(flat, false));
  flat(2, 1) = 1 + 0x1p-22;
  EXPECT_NO_THROW(run(flat, true));
  try {
    flat(2, 1) = 1 + 0x1p-23;
    run(flat, true);
  } catch (const Infeasible& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kNoRoomInPolygon);
  }
}

TEST(Embed, ScaleAndPlaceOfThePolygonDecideNothingButRoom) {
  const auto disk = test::make_disk(test::tube(8, 100), BoundaryShape::kCircle);
  ExecutionContext context;
  for (const double scale : {1e-30, 1e-4, 1.0, 1e5, 1e30}) {
    Stats stats;
    test::Disk scaled = disk;
    scaled.boundary *= scale;
    expect_flip_free(embed(scaled, {}, stats));
  }
  // Far away, 32-bit floats hold too few points: said so, and 64 bits still work.
  test::Disk far = disk;
  far.boundary.col(0).array() += 1e9;
  Stats stats;
  EXPECT_THROW(embed(far, {}, stats), Infeasible);
  EmbedOptions options;
  options.float32 = false;
  const Embedding e = embed(far, options, stats);
  EXPECT_EQ(count_flips(e.faces, e.uv, context), 0U);
}

}  // namespace
}  // namespace flipfree::embedding::embed_test
