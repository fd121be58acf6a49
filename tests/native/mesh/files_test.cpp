#include "flipfree/mesh/files/mesh_file.h"

#include <gtest/gtest.h>

#include <OpenMesh/Core/IO/IOInstances.hh>  // linked statically, it knows those readers alone that are named
#include <OpenMesh/Core/IO/IOManager.hh>
#include <OpenMesh/Core/IO/importer/ImporterT.hh>
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>
#include <sstream>
#include <string>
#include <vector>

#include "flipfree/base/error.h"
#include "support/shapes.h"

namespace flipfree::mesh::files_test {
namespace {

constexpr std::array<Format, 4> kFormats{Format::kObj, Format::kPly, Format::kOff, Format::kStl};
const char* const kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

// What is said against a file; "accepted" if nothing is.
std::string refusal(const std::string& text, Format format) {
  try {
    (void)read_mesh(text, format);
  } catch (const InvalidInput& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kBadShape);
    return e.what();
  }
  return "accepted";
}

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

// Each names the place, and says more than that.
TEST(ReadMesh, RefusalsNameThePlace) {
  const std::string square = kSquare;
  const std::string head = "ply\nformat ascii 1.0\n";
  const std::string vertex =
      head + "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
  std::string promised(84, ' ');  // four thousand millions of triangles, of which none is there
  const std::uint32_t count = 4000000000U;
  std::memcpy(promised.data() + 80, &count, sizeof count);
  const struct {
    Format format;
    std::string text;
    std::string place;
  } cases[] = {
      {Format::kObj, square + "f 1 2 9\n", "Line 5: "},
      {Format::kObj, square + "f 1 2 0\n", "Line 5: "},
      {Format::kObj, square + "f 1 2 -5\n", "Line 5: "},
      {Format::kObj, square + "f /1 2 3\n", "Line 5: "},
      {Format::kObj, square + "v 1 2\n", "Line 5: "},
      {Format::kObj, square + "v 1 2 nan\n", "Line 5: "},
      {Format::kObj, square + "v 1 2 1,5\n", "Line 5: "},
      {Format::kObj, square + "v 1 2 1e400\n", "Line 5: "},
      {Format::kOff, "", "End of the file: "},
      {Format::kOff, "OFF\n3 1 0\n0 0 0\n", "End of the file: "},
      {Format::kOff, "OFF\n-3 1 0\n", "Line 2: "},
      {Format::kOff, "OFF BINARY\n3 1 0\n", "Line 1: "},
      {Format::kOff, "4OFF\n3 1 0\n", "Line 1: "},
      {Format::kOff, "OFF\n1 1 0\n0 0 0\n3 0 0 1\n", "Line 4: "},
      {Format::kPly, "plx\n", "Line 1: "},
      {Format::kPly, "ply\nend_header\n", "Line 2: "},
      {Format::kPly, "ply\nformat ascii 1.0\n", "End of the file: "},
      {Format::kPly, head + "property float x\n", "Line 3: "},
      {Format::kPly, head + "element vertex -1\n", "Line 3: "},
      {Format::kPly,
       head + "element vertex 4000000000\nproperty float x\nproperty float y\nproperty float z\n"
              "element face 4000000000\nproperty list int int vertex_indices\nend_header\n1 2 3\n",
       "Vertex 1: "},
      {Format::kPly, vertex + "end_header\n0 0 0\n", "Header: "},
      {Format::kPly,
       vertex + "element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n"
                "3 0 0 1\n",
       "Face 0: "},
      {Format::kStl, promised, "Start of the file: "},
  };
  for (const auto& c : cases) {
    const std::string said = refusal(c.text, c.format);
    EXPECT_EQ(said.substr(0, c.place.size()), c.place) << c.text;
    EXPECT_GT(said.size(), c.place.size() + 10) << c.text;
  }
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
