#include "flipfree/mesh/files/file_polygons.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "mesh/files/file_meshes.h"

namespace flipfree::mesh::read_obj_test {
namespace {

using namespace test;

TEST(ReadObj, ReadsWhatOtherProgramsWrite) {
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

TEST(ReadObj, FacesMayComeBeforeTheirVertices) {
  EXPECT_EQ(read_mesh("f 1 2 3\n" + std::string(kSquare), Format::kObj).faces.rows(), 1);
}

TEST(ReadObj, FacesOfTwoCornersAreCountedAndPassedOver) {
  const MeshFile mesh =
      read_mesh(std::string(kSquare) + "f 1 2\nf 1 2 3\nf\nf 4\nf 1 3 4\n", Format::kObj);
  ASSERT_EQ(mesh.faces.rows(), 2);
  EXPECT_EQ(mesh.polygons, (std::vector<Index>{1, 4}));
  EXPECT_EQ(mesh.faces(1, 2), 3);
}

TEST(ReadObj, CornersThatAreThereTwiceStayWithTheirTextureCoordinates) {
  const MeshFile mesh = read_mesh(std::string(kSquare) +
                                      "vt 0 0\nvt 1 0\nvt 2 0\nvt 3 0\nvt 4 0\n"
                                      "f 1/1 2/2 2/3 3/4 1/5\nf 1/1 3/3 4/4\n",
                                  Format::kObj);
  ASSERT_EQ(mesh.faces.rows(), 4);
  EXPECT_EQ(mesh.vertices.rows(), 4);
  EXPECT_EQ(mesh.polygons, (std::vector<Index>{0, 0, 0, 1}));
  const std::array<Index, 5> vertices{0, 1, 1, 2, 0};
  std::set<Index> used;
  for (Index t = 0; t < 3; ++t)
    for (Index i = 0; i < 3; ++i) {
      const Index corner = mesh.corners(t, i);
      ASSERT_LT(corner, 5);
      used.insert(corner);
      EXPECT_EQ(mesh.faces(t, i), vertices[at(corner)]);
      EXPECT_EQ(mesh.uv(3 * t + i, 0), static_cast<float>(corner));
    }
  EXPECT_EQ(used.size(), 5U);
  EXPECT_EQ(mesh.faces(3, 2), 3);
}

TEST(ReadObj, PolygonsWithTextureCoordinatesThatAreNotThereHaveNone) {
  std::string begin(kSquare);
  begin += "vt 0 0\nvt 1 0\nvt 2 0\nvt nan 0\nvt 1e39 0\n";
  for (const std::string odd : {"f 1/1 2/2 3/9\n", "f 1/1 2/2 3/0\n", "f 1/-9 2/2 3/3\n",
                                "f 1/1 2 3/3\n", "f 1/1 2/2 3/4\n", "f 1/1 2/2 3/5\n"}) {
    const MeshFile mesh = read_mesh(begin + odd + "f 1/1 2/2 3/3\n", Format::kObj);
    ASSERT_EQ(mesh.uv.rows(), 6);
    for (Index c = 0; c < 3; ++c) {
      EXPECT_TRUE(std::isnan(mesh.uv(c, 0)) && std::isnan(mesh.uv(c, 1))) << odd;
      EXPECT_EQ(mesh.uv(3 + c, 0), static_cast<float>(c)) << odd;
    }
  }
}

TEST(ReadObj, RefusalsNameTheLineAndTheCure) {
  const std::string square = kSquare;
  const auto obj = [&](const std::string& text) {
    return refusal_of([&] { return read_obj(square + text); });
  };
  EXPECT_EQ(obj("f 1 2 9\n"), "Line 5: a face uses vertex 9, the file has 4." + kAgain);
  EXPECT_EQ(obj("f 1 2 0\n"), "Line 5: a face has the index 0, which names nothing." + kAgain);
  EXPECT_EQ(obj("f 1 2 -5\n"), "Line 5: a face has the index -5, which names nothing." + kAgain);
  EXPECT_EQ(obj("f /1 2 3\n"),
            "Line 5: an index of a face should be a whole number, not nothing." + kAgain);
  EXPECT_EQ(obj("v 1 2\n"),
            "Line 5: a coordinate should be a finite number, not nothing." + kAgain);
  EXPECT_EQ(obj("v 1 2 nan\n"),
            "Line 5: a coordinate should be a finite number, not 'nan'." + kAgain);
  EXPECT_EQ(obj("v 1 2 1,5\n"),
            "Line 5: a coordinate should be a finite number, not '1,5'." + kAgain);
  EXPECT_EQ(obj("v 1 2 1e400\n"),
            "Line 5: a coordinate should be a finite number, not '1e400'." + kAgain);
}

}  // namespace
}  // namespace flipfree::mesh::read_obj_test
