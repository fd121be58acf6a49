#include "flipfree/mesh/files/file_polygons.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>

#include "mesh/files/file_meshes.h"

namespace flipfree::mesh::read_ply_test {
namespace {

using namespace test;

TEST(ReadPly, ReadsBothByteOrdersAndStepsOverTheRest) {
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

TEST(ReadPly, RefusalsNameThePlaceAndTheCure) {
  const auto ply = [](const std::string& text) {
    return refusal_of([&] { return read_ply(text); });
  };
  EXPECT_EQ(ply("ply\nformat ascii 1.0\n"), "End of the file: the header has no end." + kAgain);
  const std::string endless =
      "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\n"
      "property float y\nproperty float z\nelement face 4000000000\n"
      "property list int int vertex_indices\nend_header\n1 2 3\n";
  EXPECT_EQ(ply(endless), "Vertex 1: the file ends here." + kAgain);
  const std::string head = "ply\nformat ascii 1.0\n";
  EXPECT_EQ(ply("plx\n"), "Line 1: the file does not begin with 'ply'." + kAgain);
  EXPECT_EQ(ply(head + "property float x\n"), "Line 3: a property of no element." + kAgain);
  EXPECT_EQ(ply(head + "element vertex -1\n"), "Line 3: a count is negative." + kAgain);
  EXPECT_EQ(ply("ply\nend_header\n"), "Line 2: the header names no format." + kAgain);
  const std::string vertex =
      head + "element vertex 1\nproperty float x\nproperty float y\nproperty float z\n";
  const std::string face =
      vertex + "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  EXPECT_EQ(ply(vertex + "end_header\n0 0 0\n"),
            "Header: the file has no faces. Export faces, not strips or points only.");
  EXPECT_EQ(ply(face + "0 0 0\n3 0 0 1\n"), "Face 0: it uses vertex 1, the last is 0." + kAgain);
}

TEST(ReadPly, OddFacesAndTextureCoordinatesCostNoOtherFace) {
  const MeshFile mesh = read_mesh(
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement face 5\nproperty list uchar int vertex_indices\n"
      "property list uchar float texcoord\nend_header\n0 0 0\n1 0 0\n0 1 0\n"
      "2 0 1 4 1 2 3 4\n3 0 1 2 6 0 0 1 0 0 1\n0 0\n3 0 1 2 2 5 5\n3 0 1 2 6 0 0 nan 0 0 1\n",
      Format::kPly);
  EXPECT_EQ(mesh.polygons, (std::vector<Index>{1, 3, 4}));
  ASSERT_EQ(mesh.uv.rows(), 9);
  EXPECT_EQ(mesh.uv(1, 0), 1.0F);
  for (Index c = 3; c < 9; ++c) EXPECT_TRUE(std::isnan(mesh.uv(c, 0)) && std::isnan(mesh.uv(c, 1)));
}

}  // namespace
}  // namespace flipfree::mesh::read_ply_test
