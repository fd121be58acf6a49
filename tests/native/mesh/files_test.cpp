#include "flipfree/mesh/files/mesh_file.h"

#include <gtest/gtest.h>

#include <OpenMesh/Core/IO/IOInstances.hh>  // linked statically, it knows those readers alone that are named
#include <OpenMesh/Core/IO/IOManager.hh>
#include <OpenMesh/Core/IO/importer/ImporterT.hh>
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <array>
#include <cmath>
#include <random>
#include <sstream>

#include "support/shapes.h"

namespace flipfree::mesh::files_test {
namespace {

constexpr std::array<Format, 4> kFormats{Format::kObj, Format::kPly, Format::kOff, Format::kStl};

// A grid with positions and texture coordinates that use all their digits, large and small.
MeshFile random_mesh(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const Surface surface = test::grid(5, 4);
  MeshFile mesh;
  mesh.vertices = surface.vertices;
  mesh.faces = surface.faces;
  for (Index v = 0; v < mesh.vertices.rows(); ++v)
    for (Index i = 0; i < 3; ++i)
      mesh.vertices(v, i) = unit(random) * std::pow(10.0, 30.0 * unit(random));
  mesh.uv.resize(3 * mesh.faces.rows(), 2);
  for (Index c = 0; c < mesh.uv.rows(); ++c)
    for (Index i = 0; i < 2; ++i)
      mesh.uv(c, i) = static_cast<float>(unit(random) * std::pow(10.0, 42.0 * unit(random) - 4.0));
  return mesh;
}

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

}  // namespace
}  // namespace flipfree::mesh::files_test
