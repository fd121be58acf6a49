#include "flipfree/matchmaker/continuation/decimate.h"

#include <gtest/gtest.h>

#include "flipfree/numeric/predicates.h"
#include "support/shapes.h"

namespace flipfree::matchmaker::decimate_test {
namespace {

constexpr Index kSide = 40;

TEST(Decimate, KeepsWhatItMustAndPutsEveryVertexIntoACoarseFace) {
  const mesh::Surface surface = test::bumpy_grid(kSide, kSide, 0.1, 3);
  const mesh::RefinedMap fine{mesh::make_refined_surface(surface), surface.vertices.leftCols(2)};
  const VertexId pin = 41 * 17 + 23;
  std::vector<char> keep(fine.surface.position.size(), 0);
  for (const VertexId b : fine.surface.boundary) keep[static_cast<std::size_t>(b)] = 1;
  keep[static_cast<std::size_t>(pin)] = 1;
  ExecutionContext context;
  const CoarseDisk disk = decimate(fine, keep, 400, context);
  EXPECT_EQ(disk.fine.size(), 400U);
  EXPECT_NE(disk.coarse[static_cast<std::size_t>(pin)], kInvalid);
  for (const VertexId b : fine.surface.boundary)
    EXPECT_NE(disk.coarse[static_cast<std::size_t>(b)], kInvalid);
  const auto uv = [&](Index face, Index k) -> Vector2 {
    const VertexId c = disk.surface.faces(face, k % 3);
    return fine.uv.row(disk.fine[static_cast<std::size_t>(c)]).transpose();
  };
  for (FaceId f = 0; f < disk.surface.faces.rows(); ++f)
    EXPECT_GT(numeric::orientation(uv(f, 0), uv(f, 1), uv(f, 2)), 0) << f;
  for (std::size_t v = 0; v < disk.face.size(); ++v) {
    ASSERT_NE(disk.face[v] == kInvalid, disk.coarse[v] == kInvalid) << v;
    if (disk.face[v] == kInvalid) continue;
    for (Index k = 0; k < 3; ++k) {
      const Vector2 p = fine.uv.row(static_cast<Eigen::Index>(v)).transpose();
      EXPECT_GE(numeric::orientation(uv(disk.face[v], k), uv(disk.face[v], k + 1), p), 0) << v;
    }
  }
  EXPECT_EQ(disk.surface.faces.rows(), 2 * 400 - 2 - 4 * kSide);
}

}  // namespace
}  // namespace flipfree::matchmaker::decimate_test
