#include "flipfree/mesh/files/plain_form.h"

#include <gtest/gtest.h>

#include <cmath>

#include "mesh/files/file_meshes.h"

namespace flipfree::mesh::plain_obj_test {
namespace {

using namespace test;

TEST(PlainObj, ReadsWhatOtherProgramsWrite) {
  const std::string text =
      "\xEF\xBB\xBF# comment\r\nmtllib /dev/zero\r\no a\r\nv +0.5 0 0 1 0 0\r\nv 1e0 0 0\r\nv 1 1 "
      "0\r\n"
      "vt 0.25\r\nvt 0.1 0.2 0\r\nvt .5 .75\r\nvn 0 0 1\r\nusemtl b\r\ns 1\r\n"
      "f -3/-3/1 -2/-2/1 \\\r\n -1/-1/1\r\nl 1 2\r\nf 1//1 2//1 3//1 # end\r\n";
  const MeshFile mesh = read_mesh(text, Format::kObj);
  ASSERT_EQ(mesh.faces.rows(), 2);
  EXPECT_EQ(mesh.vertices(0, 0), 0.5);
  EXPECT_EQ(mesh.uv(0, 0), 0.25F);
  EXPECT_EQ(mesh.uv(0, 1), 0.0F);
  EXPECT_EQ(mesh.uv(2, 1), 0.75F);
  EXPECT_TRUE(std::isnan(mesh.uv(3, 0)));
}

TEST(PlainObj, FacesMayComeBeforeTheirVertices) {
  EXPECT_EQ(read_mesh("f 1 2 3\n" + std::string(kSquare), Format::kObj).faces.rows(), 1);
}

// Indices count from 1 again, lines are joined, positions have left, all that OpenMesh need not see
// is gone.
TEST(PlainObj, IsTheSameFileWithNothingButFaces) {
  const PlainForm plain = plain_obj(
      "mtllib a.mtl\nv 0.1 2 3 # here\nv 1 0 0\nv 0 1 0\nvt .5 1\nvt 1\nvt 0 1\nvn 0 0 1\n"
      "f -3/-1 \\\n2/2 3/1\nf 1 2 3\n");
  EXPECT_EQ(plain.text,
            "v 0 0 0\nv 0 0 0\nv 0 0 0\nvt 0.5 1\nvt 1 0\nvt 0 1\nf 1/3 2/2 3/1\nf 1 2 3\n");
  EXPECT_STREQ(plain.extension, ".obj");
  EXPECT_FALSE(plain.binary);
  EXPECT_EQ(plain.polygons, 2);
  EXPECT_TRUE(plain.corner_uv);
  EXPECT_FALSE(plain.vertex_uv);
  ASSERT_EQ(plain.positions.rows(), 3);
  EXPECT_EQ(Vector3(plain.positions.row(0).transpose()), Vector3(0.1, 2, 3));
}

TEST(PlainObj, RefusalsNameTheLineAndTheCure) {
  const std::string square = kSquare;
  const auto obj = [&](const std::string& text) {
    return refusal_of([&] { return plain_obj(square + text); });
  };
  EXPECT_EQ(obj("f 1 2 9\n"), "Line 5: a face uses vertex 9, the file has 4." + kAgain);
  EXPECT_EQ(obj("f 1 2 0\n"), "Line 5: a face has the index 0, which names nothing." + kAgain);
  EXPECT_EQ(obj("f 1 2 -5\n"), "Line 5: a face has the index -5, which names nothing." + kAgain);
  EXPECT_EQ(obj("f /1 2 3\n"),
            "Line 5: an index of a face should be a whole number, not nothing." + kAgain);
  EXPECT_EQ(obj("f 1 2\n"), "Line 5: a face has fewer than three corners." + kAgain);
  EXPECT_EQ(obj("vt 0 0\nf 1/1 2 3\n"),
            "Line 6: some corners of a face have texture coordinates and some have not." + kAgain);
  EXPECT_EQ(obj("vt 0 0\nf 1/2 2/1 3/1\n"),
            "Line 6: a face uses texture coordinate 2, the file has 1." + kAgain);
  EXPECT_EQ(
      obj("f 1 2 -4\n"),
      "Line 5: a face uses one vertex twice. Delete such faces (Merge by Distance), and write the "
      "file again.");
  EXPECT_EQ(obj("v 1 2\n"),
            "Line 5: a coordinate should be a finite number, not nothing." + kAgain);
  EXPECT_EQ(obj("v 1 2 nan\n"),
            "Line 5: a coordinate should be a finite number, not 'nan'." + kAgain);
  EXPECT_EQ(obj("v 1 2 1,5\n"),
            "Line 5: a coordinate should be a finite number, not '1,5'." + kAgain);
  EXPECT_EQ(obj("v 1 2 1e400\n"),
            "Line 5: a coordinate should be a finite number, not '1e400'." + kAgain);
  EXPECT_EQ(obj("vt 1e39 0\n"),
            "Line 5: a texture coordinate is beyond 32-bit numbers. Scale it down.");
}

}  // namespace
}  // namespace flipfree::mesh::plain_obj_test
