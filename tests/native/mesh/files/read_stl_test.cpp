#include "flipfree/mesh/files/file_polygons.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>

#include "mesh/files/file_meshes.h"

namespace flipfree::mesh::read_stl_test {
namespace {

using namespace test;

TEST(ReadStl, IsReadAsTextAndBinary) {
  const std::string text =
      " solid vertex 1\nfacet normal 0 0 1\n outer loop\n  vertex 0 0 0\n  vertex 1 0 0\n"
      "  vertex 0 1 0\n endloop\nendfacet\nfacet normal 0 0 1\n outer loop\n  vertex 1 0 0\n"
      "  vertex 1 1 0\n  vertex 0 1 0\n endloop\nendfacet\nfacet normal 0 0 0\n outer loop\n"
      "  vertex 1 0 0\n  vertex 1 0 0\n  vertex 0 1 0\n endloop\nendfacet\nendsolid\n\n";
  const MeshFile mesh = read_mesh(text, Format::kStl);
  EXPECT_EQ(mesh.vertices.rows(), 4);
  EXPECT_EQ(mesh.faces.rows(), 2);  // the third has two corners in one place
  const std::string binary = write_mesh(mesh, Format::kStl);
  EXPECT_EQ(binary.size(), 84U + 2 * 50);
  EXPECT_EQ(read_mesh(binary, Format::kStl).faces, mesh.faces);
  EXPECT_NE(refusal(binary.substr(0, 150), Format::kStl), "accepted");
  EXPECT_NE(refusal(text.substr(0, text.find("endsolid")), Format::kStl), "accepted");
}

TEST(ReadStl, HasAsManyTrianglesAsThereAreBytesFor) {
  std::string text(84, ' ');
  const std::uint32_t promised = 4000000000U;
  std::memcpy(text.data() + 80, &promised, sizeof promised);
  EXPECT_EQ(refusal_of([&] { return read_stl(text); }).substr(0, 18), "Start of the file:");
  const std::uint32_t none = 0;
  std::memcpy(text.data() + 80, &none, sizeof none);
  EXPECT_TRUE(read_stl(text).corners.empty());
}

}  // namespace
}  // namespace flipfree::mesh::read_stl_test
