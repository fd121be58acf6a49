#include "flipfree/mesh/validate.h"

#include <gtest/gtest.h>

#include <limits>

#include "support/shapes.h"

namespace flipfree::mesh::validate_test {
namespace {

// The first defect of a mesh, which must have one.
Error first_defect(const Surface& surface, const ValidateOptions& options = {}) {
  const std::vector<Error> defects = find_defects(surface, options);
  EXPECT_FALSE(defects.empty());
  return defects.empty() ? Error{} : defects.front();
}

Surface with_faces(std::initializer_list<std::array<Index, 3>> faces, Index vertex_count = 8) {
  Surface surface;
  surface.vertices.resize(vertex_count, 3);
  // Points on a twisted cubic: no three are collinear.
  for (Index v = 0; v < vertex_count; ++v) surface.vertices.row(v) << v, v * v, v * v * v;
  surface.faces.resize(static_cast<Eigen::Index>(faces.size()), 3);
  Eigen::Index f = 0;
  for (const auto& face : faces) surface.faces.row(f++) << face[0], face[1], face[2];
  return surface;
}

TEST(Validate, accepts_open_and_closed_manifolds_and_loose_vertices) {
  for (const Surface& surface :
       {test::grid(3, 4), test::sphere(8, 5), test::torus(6, 5), test::cylinder(7, 2)}) {
    EXPECT_TRUE(find_defects(surface).empty());
  }
  EXPECT_TRUE(find_defects(with_faces({{0, 1, 2}})).empty());
}

TEST(Validate, names_what_is_wrong) {
  Surface infinite = test::grid(2, 2);
  infinite.vertices(4, 1) = std::numeric_limits<double>::quiet_NaN();
  infinite.vertices(7, 0) = std::numeric_limits<double>::infinity();
  const struct {
    Surface surface;
    ErrorCode code;
    std::vector<Index> named;
  } cases[] = {
      {Surface{}, ErrorCode::kEmptyMesh, {}},
      {with_faces({{0, 1, 2}, {0, 2, 99}}), ErrorCode::kIndexOutOfRange, {1}},
      {with_faces({{-1, 1, 2}}), ErrorCode::kIndexOutOfRange, {0}},
      {infinite, ErrorCode::kNotFinite, {4, 7}},
      {with_faces({{0, 1, 2}, {3, 4, 3}}), ErrorCode::kRepeatedCorner, {1}},
      {with_faces({{0, 1, 2}, {1, 2, 0}}), ErrorCode::kDuplicateFace, {1}},
      {with_faces({{0, 1, 2}, {2, 1, 0}}), ErrorCode::kDuplicateFace, {1}},
      {with_faces({{0, 1, 2}, {1, 0, 3}, {0, 1, 4}}), ErrorCode::kNonManifoldEdge, {0, 1}},
      {with_faces({{0, 1, 2}, {0, 1, 3}}), ErrorCode::kInconsistentOrientation, {0, 1}},
      {with_faces({{0, 1, 2}, {0, 3, 4}}), ErrorCode::kNonManifoldVertex, {0}},
  };
  for (const auto& c : cases) {
    const Error error = first_defect(c.surface);
    EXPECT_EQ(error.code, c.code) << error.message;
    EXPECT_EQ(error.elements, c.named) << error.message;
  }
}

TEST(Validate, names_zero_area_faces_and_zero_length_edges_exactly) {
  Surface surface = test::grid(2, 1);
  surface.vertices.row(1) << 0.25, 0.5, 0.0;  // on the segment from vertex 0 to vertex 4
  Surface line = with_faces({{0, 1, 2}}, 3);
  line.vertices << 0, 0, 0, 1e-30, 2e-30, 3e-30, 2e-30, 4e-30, 6e-30;
  EXPECT_EQ(first_defect(line).code, ErrorCode::kZeroAreaFace);
  line.vertices(2, 2) = std::nextafter(6e-30, 1.0);
  EXPECT_TRUE(find_defects(line).empty()) << "thin is not degenerate";
  line.vertices.row(2) = line.vertices.row(1);
  EXPECT_EQ(first_defect(line).code, ErrorCode::kZeroLengthEdge);
}

TEST(Validate, tells_disconnected_meshes_and_surfaces_that_are_no_disk) {
  ValidateOptions disk;
  disk.require_disk = true;
  EXPECT_TRUE(find_defects(test::grid(2, 2), disk).empty());
  EXPECT_EQ(first_defect(with_faces({{0, 1, 2}, {3, 4, 5}}), disk).code, ErrorCode::kDisconnected);
  EXPECT_EQ(first_defect(test::cylinder(5, 1), disk).code, ErrorCode::kNotADisk);
  EXPECT_EQ(first_defect(test::torus(5, 5), disk).code, ErrorCode::kNotADisk);
}

}  // namespace
}  // namespace flipfree::mesh::validate_test
