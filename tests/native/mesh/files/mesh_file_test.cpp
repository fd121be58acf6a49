#include "flipfree/mesh/files/mesh_file.h"

#include <gtest/gtest.h>

#include <limits>

#include "mesh/files/file_meshes.h"

namespace flipfree::mesh::mesh_file_test {
namespace {

using namespace test;

TEST(MeshFile, WrittenObjAndPlyFilesComeBackBitForBit) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    MeshFile mesh = random_mesh(seed);
    mesh.uv(0, 0) = -0.0F;
    mesh.uv(1, 0) = std::numeric_limits<float>::denorm_min();
    mesh.uv(2, 1) = std::numeric_limits<float>::max();
    for (const Format format : {Format::kObj, Format::kPly}) {
      const MeshFile back = read_mesh(write_mesh(mesh, format), format);
      EXPECT_TRUE(same_bits(back.vertices, mesh.vertices));
      EXPECT_TRUE(same_bits(back.faces, mesh.faces));
      EXPECT_TRUE(same_bits(back.uv, mesh.uv));
    }
  }
}

TEST(MeshFile, OffKeepsPositionsBitForBitAndStlTheirNearest32BitOnes) {
  MeshFile mesh = random_mesh(1);
  mesh.uv.resize(0, 2);
  const MeshFile off = read_mesh(write_mesh(mesh, Format::kOff), Format::kOff);
  EXPECT_TRUE(same_bits(off.vertices, mesh.vertices));
  EXPECT_TRUE(same_bits(off.faces, mesh.faces));
  const MeshFile stl = read_mesh(write_mesh(mesh, Format::kStl), Format::kStl);
  ASSERT_EQ(stl.faces.rows(), mesh.faces.rows());
  EXPECT_EQ(stl.vertices.rows(), mesh.vertices.rows());  // welded again
  for (FaceId f = 0; f < mesh.faces.rows(); ++f)
    for (Index k = 0; k < 3; ++k)
      for (Index i = 0; i < 3; ++i)
        EXPECT_EQ(stl.vertices(stl.faces(f, k), i),
                  static_cast<double>(static_cast<float>(mesh.vertices(mesh.faces(f, k), i))));
}

TEST(MeshFile, FacesWithoutTextureCoordinatesAmongOthersHaveNaN) {
  const std::string text =
      std::string(kSquare) + "vt 0 0\nvt 1 0\nvt 1 1\nf 1 3 4\nf 1/1 2/2 3/3\n";
  const MeshFile mesh = read_mesh(text, Format::kObj);
  ASSERT_EQ(mesh.uv.rows(), 6);
  EXPECT_TRUE(mesh.uv.topRows(3).array().isNaN().all());
  EXPECT_TRUE(mesh.uv.bottomRows(3).allFinite());
  for (const Format format : {Format::kObj, Format::kPly}) {
    const MeshFile back = read_mesh(write_mesh(mesh, format), format);
    EXPECT_TRUE(back.uv.topRows(3).array().isNaN().all());
    EXPECT_EQ(back.uv.bottomRows(3), mesh.uv.bottomRows(3));
  }
}

TEST(MeshFile, ManyFacesWithoutTextureCoordinatesComeBack) {
  MeshFile mesh = random_mesh(4);
  mesh.uv.resize(0, 2);
  for (const Format format : kFormats) {
    const MeshFile back = read_mesh(write_mesh(mesh, format), format);
    EXPECT_EQ(back.faces.rows(), mesh.faces.rows());
    EXPECT_EQ(back.uv.rows(), 0);
  }
}

}  // namespace
}  // namespace flipfree::mesh::mesh_file_test
