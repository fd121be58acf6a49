#include "flipfree/matchmaker/patches/embed_patches.h"

#include <gtest/gtest.h>

#include "flipfree/base/plane.h"
#include "flipfree/distortion/untangle.h"
#include "flipfree/matchmaker/target/outline_target.h"
#include "matchmaker/permuted_pins.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::embed_patches_test {
namespace {

TEST(EmbedPatches, EveryPathIsStraightEveryFacePositiveAndPinsAreMet) {
  const mesh::Surface surface = test::grid(9, 9);
  for (unsigned seed = 0; seed < 4; ++seed) {
    mesh::RefinedSurface work = mesh::make_refined_surface(surface);
    const Constraints constraints = test::permuted_pins(surface, work, 8, seed);
    ExecutionContext context;
    Stats stats;
    const Target target = full_target(work, constraints, context);
    const ConvexPartition partition = merge_convex(target.domain);
    const Paths paths =
        trace_paths(work, target.domain, partition, Paths(partition.edges.size()), context);
    const Points2 uv = embed_patches(work, target.domain, partition, paths, context, stats);
    ASSERT_EQ(uv.rows(), work.mesh.vertex_count());
    work.mesh.check_invariants();
    EXPECT_TRUE(distortion::find_flips(work.mesh.faces(), uv, context).empty());
    for (const PinnedVertex& pin : constraints.pins)
      EXPECT_EQ(Vector2(uv.row(pin.vertex).transpose()), pin.uv);
    for (std::size_t i = 0; i < constraints.outline.size(); ++i)
      EXPECT_EQ(Vector2(uv.row(work.boundary[i]).transpose()), constraints.outline[i]);
    for (std::size_t e = 0; e < paths.size(); ++e) {
      const Vector2 a = target.domain.point[at(partition.edges[e].a)];
      const Vector2 d = target.domain.point[at(partition.edges[e].b)] - a;
      double last = -1;
      for (const VertexId v : paths[e]) {
        const Vector2 p = Vector2(uv.row(v).transpose()) - a;
        EXPECT_NEAR(cross(d, p), 0.0, 1e-15);
        EXPECT_GT(d.dot(p), last);
        last = d.dot(p);
      }
    }
  }
}

}  // namespace
}  // namespace flipfree::matchmaker::embed_patches_test
