#include <sstream>
#include <string>
#include <vector>

#include "finding.h"
#include "flipfree/base/error.h"
#include "flipfree/mesh/files/mesh_file.h"
#include "targets.h"

namespace flipfree::fuzz {
namespace {

// Bytes as they come reach little behind a header: words of the formats, and numbers, do.
constexpr const char* kWords =
    "v |vt |f |\n|1 |2 |3 |0 |-1 |0.5 |1/1 |2/2 |3/3 |/|1e39 |nan |OFF\n|STOFF\n|3 1 0\n|ply\n|"
    "solid |vertex |list |format ascii 1.0\n|element |face |property |float |uchar |int |x\n|y\n|"
    "z\n|texcoord\n|vertex_indices\n|end_header\n|outer loop\n|endloop\n|endsolid\n|"
    "format binary_little_endian 1.0\n|\\\n|#";

std::string text_of(Bytes& bytes) {
  std::vector<std::string> words;
  std::istringstream all(kWords);
  for (std::string word; std::getline(all, word, '|');) words.push_back(word);
  std::string text;
  while (!bytes.empty()) {
    const auto choice = bytes.byte();
    if (choice < words.size()) {
      text += words[choice];
    } else {
      text += static_cast<char>(choice == 255 ? bytes.byte() : choice);
    }
  }
  return text;
}

void check(const mesh::MeshFile& mesh, std::size_t size) {
  require(mesh.vertices.allFinite(), "a position is not finite");
  require(mesh.faces.size() == 0 ||
              (mesh.faces.minCoeff() >= 0 && mesh.faces.maxCoeff() < mesh.vertices.rows()),
          "a face has a vertex that does not exist");
  require(mesh.uv.rows() == 0 || mesh.uv.rows() == 3 * mesh.faces.rows(), "uv of the wrong shape");
  require(mesh.polygons.size() == static_cast<std::size_t>(mesh.faces.rows()),
          "polygons of the wrong shape");
  require(static_cast<std::size_t>(mesh.faces.rows() + mesh.vertices.rows()) <= 8 * size,
          "more mesh than bytes");
}

}  // namespace

void fuzz_files(Bytes bytes) {
  const auto format = static_cast<mesh::Format>(bytes.below(4));
  const std::string text = text_of(bytes);
  mesh::MeshFile mesh;
  if (!allowed([&] { mesh = mesh::read_mesh(text, format); })) return;
  check(mesh, text.size());
  if (!mesh::holds_corner_uv(format)) mesh.uv.resize(0, 2);
  const mesh::MeshFile back = mesh::read_mesh(mesh::write_mesh(mesh, format), format);
  require(format == mesh::Format::kStl || back.vertices == mesh.vertices, "positions changed");
  require(format == mesh::Format::kStl || back.faces == mesh.faces, "faces changed");
  require(back.uv.rows() == mesh.uv.rows() && (back.uv.array() == mesh.uv.array() ||
                                               (back.uv.array().isNaN() && mesh.uv.array().isNaN()))
                                                  .all(),
          "texture coordinates changed");
}

}  // namespace flipfree::fuzz
