// Meshes and texts for the tests of files.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <random>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/mesh/files/mesh_file.h"
#include "support/shapes.h"

namespace flipfree::test {

inline constexpr std::array<mesh::Format, 4> kFormats{mesh::Format::kObj, mesh::Format::kPly,
                                                      mesh::Format::kOff, mesh::Format::kStl};
inline const char* const kSquare = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

// What is said against a file; "accepted" if nothing is.
template <typename Read>
std::string refusal_of(const Read& read) {
  try {
    (void)read();
  } catch (const InvalidInput& e) {
    EXPECT_EQ(e.error().code, ErrorCode::kBadShape);
    return e.what();
  }
  return "accepted";
}
inline std::string refusal(const std::string& text, mesh::Format format) {
  return refusal_of([&] { return mesh::read_mesh(text, format); });
}
inline const std::string kAgain = " Write the file again, or with other software.";

template <typename Matrix>
bool same_bits(const Matrix& a, const Matrix& b) {
  return a.rows() == b.rows() &&
         std::memcmp(a.data(), b.data(), static_cast<std::size_t>(a.size()) * sizeof(*a.data())) ==
             0;
}

// A grid with positions and texture coordinates that use all their digits, large and small.
inline mesh::MeshFile random_mesh(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const mesh::Surface surface = grid(5, 4);
  mesh::MeshFile mesh;
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

}  // namespace flipfree::test
