#include "flipfree/mesh/files/openmesh_reader.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "mesh/files/file_meshes.h"

namespace flipfree::mesh::openmesh_reader_test {
namespace {

using namespace test;

TEST(OpenMeshReader, HandsPolygonsOnAsTheyStand) {
  const Polygons polygons = read_with_openmesh(
      plain_off("OFF\n4 3 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n3 0 1 2\n3 0 1 2\n"));
  EXPECT_EQ(polygons.corners, (std::vector<Index>{0, 1, 2, 3, 0, 1, 2, 0, 1, 2}));
  EXPECT_EQ(polygons.begin, (std::vector<Index>{0, 4, 7, 10}));
  EXPECT_TRUE(polygons.uv.empty());
  EXPECT_EQ(polygons.positions.rows(), 0) << "they come from the plain form";
}

TEST(OpenMeshReader, KeepsTextureCoordinatesWithTheirCorners) {
  const Polygons polygons = read_with_openmesh(plain_obj(
      "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 1 2\nvt 3 4\nvt 5 6\nf 1 2 3\nf 2/1 3/2 4/3\n"));
  ASSERT_EQ(polygons.uv.size(), 12U);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_TRUE(std::isnan(polygons.uv[i]));
    EXPECT_EQ(polygons.uv[6 + i], static_cast<float>(i + 1));
  }
}

TEST(OpenMeshReader, APlainFormThatIsNotWhatItSaysIsABugOfOurs) {
  PlainForm plain = plain_off("OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n");
  plain.polygons = 2;
  EXPECT_THROW(read_with_openmesh(plain), InternalError);
}

}  // namespace
}  // namespace flipfree::mesh::openmesh_reader_test
