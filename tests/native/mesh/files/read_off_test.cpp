#include "flipfree/mesh/files/file_polygons.h"

#include <gtest/gtest.h>

#include "mesh/files/file_meshes.h"

namespace flipfree::mesh::read_off_test {
namespace {

using namespace test;

TEST(ReadOff, StepsOverCommentsColoursAndTextureCoordinates) {
  const MeshFile mesh = read_mesh(
      "STCOFF # a\n3 1 0\n\n0 0 0 9 9 9 1 0.5 0.25\n1 0 0 9 9 9 1 1 0 # b\n0 1 0 9 9 9 1 0 1\n"
      "3 0 1 2 255 0 0\n",
      Format::kOff);
  EXPECT_EQ(mesh.faces.rows(), 1);
  EXPECT_EQ(mesh.uv.rows(), 0);
  EXPECT_EQ(read_mesh("3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", Format::kOff).faces.rows(), 1);
  EXPECT_EQ(read_mesh("OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", Format::kOff).faces.rows(), 1);
}

TEST(ReadOff, RefusalsNameThePlaceAndTheCure) {
  const auto off = [](const std::string& text) {
    return refusal_of([&] { return read_off(text); });
  };
  EXPECT_EQ(off("OFF\n3 1 0\n0 0 0\n"), "End of the file: vertex 1 of 3 is missing." + kAgain);
  EXPECT_EQ(off(""), "End of the file: line 0 of 2 is missing." + kAgain);
  EXPECT_EQ(off("OFF\n-3 1 0\n"), "Line 2: a count is negative." + kAgain);
  EXPECT_EQ(off("OFF BINARY\n3 1 0\n"),
            "Line 1: binary OFF files are not read. Write it as text, or as .ply.");
  EXPECT_EQ(
      off("4OFF\n3 1 0\n"),
      "Line 1: this kind of OFF file has no three coordinates a vertex. Write it as plain OFF.");
  EXPECT_EQ(off("OFF\n1 1 0\n0 0 0\n3 0 0 1\n"),
            "Line 4: a face uses vertex 1, the last is 0." + kAgain);
}

TEST(ReadOff, FacesOfTwoCornersAreCountedAndPassedOver) {
  const MeshFile mesh =
      read_mesh("OFF\n3 3 0\n0 0 0\n1 0 0\n0 1 0\n2 0 1\n3 0 1 2\n1 2\n", Format::kOff);
  ASSERT_EQ(mesh.faces.rows(), 1);
  EXPECT_EQ(mesh.polygons, (std::vector<Index>{1}));
}

}  // namespace
}  // namespace flipfree::mesh::read_off_test
