#include "flipfree/mesh/files/mesh_file.h"

#include <gtest/gtest.h>

#include <OpenMesh/Core/IO/IOManager.hh>
#include <OpenMesh/Core/IO/importer/ImporterT.hh>
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <random>
#include <sstream>

#include "flipfree/base/error.h"
#include "support/shapes.h"

namespace flipfree::mesh {
namespace {

constexpr std::array<Format, 4> kFormats{Format::kObj, Format::kPly, Format::kOff, Format::kStl};
const char* const kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

std::string refusal(const std::string& text, Format format) {
  try {
    (void)read_mesh(text, format);
  } catch (const InvalidInput& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kBadShape);
    return e.what();
  }
  return "accepted";
}

template <typename Matrix>
bool same_bits(const Matrix& a, const Matrix& b) {
  return a.rows() == b.rows() &&
         std::memcmp(a.data(), b.data(), static_cast<std::size_t>(a.size()) * sizeof(*a.data())) ==
             0;
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

// Other programs read what is written: OpenMesh with its own importer does.
TEST(MeshFile, OpenMeshReadsWhatIsWritten) {
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

TEST(MeshFile, FacesThatNoSurfaceHasAreKept) {
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

TEST(MeshFile, PolygonsAreFansThatWritingJoinsAgain) {
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

TEST(MeshFile, ObjReadsWhatOtherProgramsWrite) {
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

TEST(MeshFile, FacesMayComeBeforeTheirVertices) {
  EXPECT_EQ(read_mesh("f 1 2 3\n" + std::string(kSquare), Format::kObj).faces.rows(), 1);
}

TEST(MeshFile, PlyReadsBothByteOrdersAndStepsOverTheRest) {
  const std::string header =
      "element extra 2\nproperty list uchar short a\nproperty double b\n"
      "element vertex 3\nproperty uchar red\nproperty double x\nproperty float y\nproperty short "
      "z\n"
      "property float s\nproperty float t\n"
      "element face 1\nproperty uchar flags\nproperty list ushort uint vertex_index\n"
      "property list uchar double more\nend_header\n";
  const std::string ascii = "ply\nformat ascii 1.0\ncomment c\n" + header +
                            "2 -7 8 0.5\n0 1\n255 0.1 0.25 -3 0.5 0.75\n1 1 0 0 0.5 0.75\n"
                            "2 0 1 0 0.5 0.125\n12 3 0 1 2 1 0.5\n";
  const MeshFile mesh = read_mesh(ascii, Format::kPly);
  EXPECT_EQ(mesh.vertices(0, 0), 0.1);
  EXPECT_EQ(mesh.vertices(0, 2), -3.0);
  EXPECT_EQ(mesh.uv(2, 1), 0.125F);
  ASSERT_EQ(mesh.faces.rows(), 1);

  for (const bool big : {false, true}) {
    std::string text = std::string("ply\r\nformat ") +
                       (big ? "binary_big_endian" : "binary_little_endian") + " 1.0\r\n" + header;
    const auto put = [&](auto value) {
      std::array<char, sizeof value> bytes;
      std::memcpy(bytes.data(), &value, sizeof value);
      if (big) std::reverse(bytes.begin(), bytes.end());
      text.append(bytes.data(), bytes.size());
    };
    put(std::uint8_t{2}), put(std::int16_t{-7}), put(std::int16_t{8}), put(0.5);
    put(std::uint8_t{0}), put(1.0);
    for (const double x : {0.1, 1.0, 0.0}) {
      put(std::uint8_t{255}), put(x), put(x == 0.0 ? 1.0F : 0.25F);
      put(static_cast<std::int16_t>(x == 0.1 ? -3 : 0)), put(0.5F), put(x == 0.0 ? 0.125F : 0.75F);
    }
    put(std::uint8_t{12}), put(std::uint16_t{3});
    for (const std::uint32_t v : {0U, 1U, 2U}) put(v);
    put(std::uint8_t{1}), put(0.5);
    const MeshFile binary = read_mesh(text, Format::kPly);
    EXPECT_EQ(binary.vertices(0, 0), 0.1);
    EXPECT_EQ(binary.vertices(0, 2), -3.0);
    EXPECT_EQ(binary.faces, mesh.faces);
    EXPECT_TRUE(same_bits(binary.uv, mesh.uv));
    for (std::size_t cut = 1; cut < 60; ++cut)
      EXPECT_NE(refusal(text.substr(0, text.size() - cut), Format::kPly), "accepted") << cut;
  }
}

TEST(MeshFile, StlIsReadAsTextAndBinary) {
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

TEST(MeshFile, OffStepsOverCommentsColoursAndTextureCoordinates) {
  const MeshFile mesh = read_mesh(
      "STCOFF # a\n3 1 0\n\n0 0 0 9 9 9 1 0.5 0.25\n1 0 0 9 9 9 1 1 0 # b\n0 1 0 9 9 9 1 0 1\n"
      "3 0 1 2 255 0 0\n",
      Format::kOff);
  EXPECT_EQ(mesh.faces.rows(), 1);
  EXPECT_EQ(mesh.uv.rows(), 0);
  EXPECT_EQ(read_mesh("3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", Format::kOff).faces.rows(), 1);
  EXPECT_EQ(read_mesh("OFF 3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", Format::kOff).faces.rows(), 1);
}

TEST(MeshFile, RefusalsNameThePlaceAndTheCure) {
  const std::string square = kSquare;
  const auto obj = [&](const std::string& text) { return refusal(square + text, Format::kObj); };
  const std::string again = " Write the file again, or with other software.";
  EXPECT_EQ(obj("f 1 2 9\n"), "Line 5: a face uses vertex 9, the file has 4." + again);
  EXPECT_EQ(obj("f 1 2 0\n"), "Line 5: a face has the index 0, which names nothing." + again);
  EXPECT_EQ(obj("f 1 2 -5\n"), "Line 5: a face has the index -5, which names nothing." + again);
  EXPECT_EQ(obj("f /1 2 3\n"),
            "Line 5: an index of a face should be a whole number, not nothing." + again);
  EXPECT_EQ(obj("f 1 2\n"), "Line 5: a face has fewer than three corners." + again);
  EXPECT_EQ(obj("vt 0 0\nf 1/1 2 3\n"),
            "Line 6: some corners of a face have texture coordinates and some have not." + again);
  EXPECT_EQ(obj("vt 0 0\nf 1/2 2/1 3/1\n"),
            "Line 6: a face uses texture coordinate 2, the file has 1." + again);
  EXPECT_EQ(
      obj("f 1 2 -4\n"),
      "Line 5: a face uses one vertex twice. Delete such faces (Merge by Distance), and write the "
      "file again.");
  EXPECT_EQ(obj("v 1 2\n"), "Line 5: a coordinate should be a finite number, not nothing." + again);
  EXPECT_EQ(obj("v 1 2 nan\n"),
            "Line 5: a coordinate should be a finite number, not 'nan'." + again);
  EXPECT_EQ(obj("v 1 2 1,5\n"),
            "Line 5: a coordinate should be a finite number, not '1,5'." + again);
  EXPECT_EQ(obj("v 1 2 1e400\n"),
            "Line 5: a coordinate should be a finite number, not '1e400'." + again);
  EXPECT_EQ(obj("vt 1e39 0\n"),
            "Line 5: a texture coordinate is beyond 32-bit numbers. Scale it down.");
  EXPECT_EQ(refusal("ply\nformat ascii 1.0\n", Format::kPly),
            "End of the file: the header has no end." + again);
  EXPECT_EQ(refusal("OFF\n3 1 0\n0 0 0\n", Format::kOff),
            "End of the file: vertex 1 of 3 is missing." + again);
  EXPECT_EQ(refusal("", Format::kOff), "End of the file: line 0 of 2 is missing." + again);
  const std::string endless =
      "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\n"
      "property float y\nproperty float z\nelement face 4000000000\n"
      "property list int int vertex_indices\nend_header\n1 2 3\n";
  EXPECT_EQ(refusal(endless, Format::kPly), "Vertex 1: the file ends here." + again);
}

TEST(MeshFile, NumbersNearerToZeroThanDoublesAreZero) {
  const MeshFile mesh =
      read_mesh("v 1e-400 -1e-999 0.000e-5\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", Format::kObj);
  EXPECT_EQ(mesh.vertices.row(0).norm(), 0.0);
}

TEST(MeshFile, EndingsDecideTheFormat) {
  EXPECT_EQ(format_of("a.b/c.OBJ"), Format::kObj);
  EXPECT_EQ(format_of(".stl"), Format::kStl);
  for (const char* path : {"a", "a.obj.bak", "", "."}) EXPECT_THROW(format_of(path), InvalidInput);
}

TEST(MeshFile, WritingRefusesWhatAFormatCannotHold) {
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
}  // namespace flipfree::mesh
