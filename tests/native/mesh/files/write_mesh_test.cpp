#include "flipfree/mesh/files/mesh_file.h"

#include <gtest/gtest.h>

#include <OpenMesh/Core/IO/IOManager.hh>
#include <OpenMesh/Core/IO/importer/ImporterT.hh>
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <limits>
#include <sstream>

#include "mesh/files/file_meshes.h"

namespace flipfree::mesh::write_mesh_test {
namespace {

using namespace test;

// Other programs read what is written: OpenMesh with its own importer does.
TEST(WriteMesh, OpenMeshReadsWhatIsWritten) {
  struct Traits : OpenMesh::DefaultTraits {
    HalfedgeAttributes(OpenMesh::Attributes::TexCoord2D);
  };
  MeshFile mesh = random_mesh(2);
  for (const Format format : kFormats) {
    if (!holds_corner_uv(format)) mesh.uv.resize(0, 2);
    OpenMesh::PolyMesh_ArrayKernelT<Traits> other;
    OpenMesh::IO::ImporterT<decltype(other)> importer(other);
    OpenMesh::IO::Options options;
    if (format == Format::kObj) options += OpenMesh::IO::Options::FaceTexCoord;
    if (format == Format::kPly) options += OpenMesh::IO::Options::Custom;
    if (format == Format::kPly || format == Format::kStl) options += OpenMesh::IO::Options::Binary;
    std::istringstream stream(write_mesh(mesh, format));
    const std::array<const char*, 4> endings{".obj", ".ply", ".off", ".stl"};
    ASSERT_TRUE(OpenMesh::IO::IOManager().read(stream, endings[static_cast<std::size_t>(format)],
                                               importer, options));
    ASSERT_EQ(other.n_vertices(), static_cast<std::size_t>(mesh.vertices.rows()));
    ASSERT_EQ(other.n_faces(), static_cast<std::size_t>(mesh.faces.rows()));
    if (format != Format::kObj) continue;
    for (FaceId f = 0; f < mesh.faces.rows(); ++f) {
      for (const auto h : other.fh_range(OpenMesh::FaceHandle(f))) {
        const VertexId v = other.to_vertex_handle(h).idx();
        Index k = 0;
        while (mesh.faces(f, k) != v) ++k;
        EXPECT_EQ(other.texcoord2D(h)[0], mesh.uv(3 * f + k, 0));
        EXPECT_EQ(other.texcoord2D(h)[1], mesh.uv(3 * f + k, 1));
      }
    }
  }
}

TEST(WriteMesh, TrianglesOfPolygonsAreJoinedAgain) {
  const std::string text =
      std::string(kSquare) +
      "v 2 2 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3 4/4\nf 3/1 5/2 4/3\n";
  const MeshFile mesh = read_mesh(text, Format::kObj);
  Triangles expected(3, 3);
  expected << 0, 1, 2, 0, 2, 3, 2, 4, 3;
  EXPECT_EQ(mesh.faces, expected);
  EXPECT_EQ(mesh.polygons, (std::vector<Index>{0, 0, 1}));
  for (const Format format : {Format::kObj, Format::kPly}) {
    const MeshFile back = read_mesh(write_mesh(mesh, format), format);
    EXPECT_EQ(back.polygons, mesh.polygons);
    EXPECT_EQ(back.faces, expected);
    EXPECT_TRUE(same_bits(back.uv, mesh.uv));
  }
  MeshFile torn = mesh;  // the two triangles differ at a corner that they share: two faces
  torn.uv(3, 0) = 0.5F;
  EXPECT_EQ(read_mesh(write_mesh(torn, Format::kObj), Format::kObj).polygons.back(), 2);
}

TEST(WriteMesh, RefusesWhatAFormatCannotHold) {
  MeshFile mesh = random_mesh(3);
  EXPECT_THROW(write_mesh(mesh, Format::kOff), InvalidInput);
  EXPECT_THROW(write_mesh(mesh, Format::kStl), InvalidInput);
  mesh.uv(4, 0) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(write_mesh(mesh, Format::kObj), InvalidInput);
  mesh.uv.resize(0, 2);
  mesh.vertices(0, 0) = 1e300;
  EXPECT_THROW(write_mesh(mesh, Format::kStl), InvalidInput);
}

}  // namespace
}  // namespace flipfree::mesh::write_mesh_test
