#include "flipfree/embedding/embed.h"

#include <gtest/gtest.h>

#include "embedding/disks.h"
#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/distortion/energy/energy.h"

namespace flipfree::embedding::embed_test {
namespace {

Embedding embed(const test::Disk& disk, const EmbedOptions& options) {
  ExecutionContext context;
  return embed_disk_refined({disk.surface.faces, disk.vertex_count(), disk.loop, disk.boundary},
                            options, context);
}

void expect_flip_free(const Embedding& e) {
  ExecutionContext context;
  EXPECT_TRUE(distortion::is_flip_free(e.faces, e.uv, context));
  EXPECT_TRUE(distortion::is_flip_free(e.faces, as_stored(e.uv), context));
}

TEST(Embed, EveryOuterFaceOfASphereWorks) {
  const mesh::Surface sphere = test::sphere(14, 9);
  for (FaceId f = 0; f < sphere.faces.rows(); ++f) {
    mesh::Surface open = sphere;
    Triangles faces = sphere.faces;
    faces.row(f).swap(faces.row(faces.rows() - 1));
    open.faces = std::move(faces);
    expect_flip_free(embed(test::opened(open), {}));
  }
}

// Thesis 3.5, Figure 3.13: the polygon's rows hold no number.
TEST(Embed, APolygonWithoutRoomIsInfeasibleByExactDecision) {
  Triangles fan(3, 3);
  fan << 0, 1, 3, 1, 2, 3, 2, 0, 3;
  const auto run = [&](const Points2& p, bool float32) {
    ExecutionContext context;
    EmbedOptions options;
    options.float32 = float32;
    const Points2 uv = embed_disk({fan, 4, {0, 1, 2}, p}, options, context).uv;
    EXPECT_TRUE(distortion::is_flip_free(fan, uv, context));
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
    test::Disk scaled = disk;
    scaled.boundary *= scale;
    expect_flip_free(embed(scaled, {}));
  }
  // Far away, 32-bit floats hold too few points: said so, and 64 bits still work.
  test::Disk far = disk;
  far.boundary.col(0).array() += 1e9;
  EXPECT_THROW(embed(far, {}), Infeasible);
  EmbedOptions options;
  options.float32 = false;
  const Embedding e = embed(far, options);
  EXPECT_TRUE(distortion::is_flip_free(e.faces, e.uv, context));
}

}  // namespace
}  // namespace flipfree::embedding::embed_test
