#include "flipfree/mesh/files/mesh_file.h"

#include <gtest/gtest.h>

#include "mesh/files/file_meshes.h"

namespace flipfree::mesh::read_mesh_test {
namespace {

using namespace test;

TEST(ReadMesh, FacesThatNoSurfaceHasAreKept) {
  // Three faces at one edge, one turned over, one twice, a vertex without faces.
  const std::string text =
      "OFF\n6 5 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n0 -1 0\n5 5 5\n"
      "3 0 1 2\n3 0 1 3\n3 0 1 4\n3 0 1 4\n3 2 1 1\n";
  const MeshFile mesh = read_mesh(text, Format::kOff);
  Triangles expected(5, 3);
  expected << 0, 1, 2, 0, 1, 3, 0, 1, 4, 0, 1, 4, 2, 1, 1;
  EXPECT_EQ(mesh.faces, expected);
  EXPECT_EQ(mesh.vertices.rows(), 6);
  const MeshFile ply = read_mesh(write_mesh(mesh, Format::kPly), Format::kPly);
  EXPECT_EQ(ply.faces, expected);
}

TEST(ReadMesh, EndingsDecideTheFormat) {
  EXPECT_EQ(format_of("a.b/c.OBJ"), Format::kObj);
  EXPECT_EQ(format_of(".stl"), Format::kStl);
  for (const char* path : {"a", "a.obj.bak", "", "."}) EXPECT_THROW(format_of(path), InvalidInput);
}

}  // namespace
}  // namespace flipfree::mesh::read_mesh_test
