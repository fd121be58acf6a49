#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_map>

#include "flipfree/base/error.h"
#include "flipfree/mesh/files/mesh_file.h"
#include "flipfree/mesh/files/text.h"

namespace flipfree::mesh {
namespace {

using Corners = std::vector<CornerId>;

VertexId vertex_of(const MeshFile& mesh, CornerId c) { return mesh.faces(c / 3, c % 3); }

bool same_bits(const MeshFile& mesh, CornerId a, CornerId b) {
  for (Index i = 0; i < 2 && mesh.uv.rows() > 0; ++i)
    if (std::bit_cast<std::uint32_t>(mesh.uv(a, i)) != std::bit_cast<std::uint32_t>(mesh.uv(b, i)))
      return false;
  return true;
}

// Of the corners of a polygon's triangles one for each number, in their order; false, and nothing
// done, if the map is cut through the polygon.
bool join_corners(const MeshFile& mesh, Corners& polygon) {
  const auto number = [&](CornerId c) { return mesh.corners(c / 3, c % 3); };
  Corners joined = polygon;
  std::sort(joined.begin(), joined.end(), [&](CornerId a, CornerId b) {
    return std::pair(number(a), a) < std::pair(number(b), b);
  });
  std::size_t kept = 0;
  for (const CornerId c : joined) {
    if (kept > 0 && number(joined[kept - 1]) == number(c)) {
      if (vertex_of(mesh, joined[kept - 1]) != vertex_of(mesh, c) ||
          !same_bits(mesh, joined[kept - 1], c))
        return false;
    } else {
      joined[kept++] = c;
    }
  }
  joined.resize(kept);
  polygon = std::move(joined);
  return true;
}

// The corners of every face that is written.
std::vector<Corners> polygon_corners(const MeshFile& mesh) {
  const bool joined = mesh.corners.rows() > 0 && !mesh.polygons.empty();
  std::vector<Corners> faces;
  for (FaceId f = 0; f < mesh.faces.rows();) {
    const FaceId first = f;
    Corners polygon;
    do {
      for (CornerId c = 3 * f; c < 3 * f + 3; ++c) polygon.push_back(c);
      ++f;
    } while (joined && f < mesh.faces.rows() && mesh.polygons[at(f)] == mesh.polygons[at(first)]);
    if (!joined || join_corners(mesh, polygon)) {
      faces.push_back(std::move(polygon));
      continue;
    }
    for (CornerId c = 3 * first; c < 3 * f; c += 3) faces.push_back({c, c + 1, c + 2});
  }
  return faces;
}

bool has_uv(const MeshFile& mesh, const Corners& polygon) {
  return mesh.uv.rows() > 0 && !std::isnan(mesh.uv(polygon[0], 0));
}

void check(const MeshFile& mesh, Format format) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  if (format == Format::kStl && mesh.vertices.size() > 0 &&
      mesh.vertices.cwiseAbs().maxCoeff() > kLargest)
    throw_invalid(kBadFile,
                  "A position is beyond the 32-bit numbers of this format. Scale the mesh down, or "
                  "write another format.");
  if (mesh.uv.rows() == 0) return;
  if (!holds_corner_uv(format))
    throw_invalid(kBadFile,
                  "Files of this type hold no texture coordinates for corners. Write .obj or .ply, "
                  "or leave uv out.");
  for (FaceId f = 0; f < mesh.faces.rows(); ++f) {
    const auto block = mesh.uv.middleRows<3>(3 * f);
    if (!block.allFinite() && !block.array().isNaN().all())
      throw_invalid(kBadFile,
                    "Face " + std::to_string(f) +
                        " has a texture coordinate that is not finite, or "
                        "beyond 32-bit numbers. Unwrap it again, or leave uv out.",
                    ElementKind::kFace, {f});
  }
}

void append_row(std::string& text, const char* keyword, const double* row) {
  text += keyword;
  for (int i = 0; i < 3; ++i) {
    if (i > 0) text += ' ';
    append_number(text, row[i]);
  }
  text += '\n';
}

// Numbers texture coordinates, from 1: those of one vertex with the same bits are one.
class TextureNumbers {
 public:
  explicit TextureNumbers(const MeshFile& mesh) : mesh_(mesh) {}
  long long of(CornerId c, std::string& text) {
    auto& known = numbers_[vertex_of(mesh_, c)];
    for (const auto& [corner, number] : known)
      if (same_bits(mesh_, corner, c)) return number;
    known.emplace_back(c, ++last_);
    text += "vt ";
    append_number(text, mesh_.uv(c, 0));
    text += ' ';
    append_number(text, mesh_.uv(c, 1));
    text += '\n';
    return last_;
  }

 private:
  const MeshFile& mesh_;
  std::unordered_map<VertexId, std::vector<std::pair<CornerId, long long>>> numbers_;
  long long last_ = 0;
};

std::string write_obj(const MeshFile& mesh) {
  std::string text = "# Flipfree UV\n", faces;
  for (Index v = 0; v < mesh.vertices.rows(); ++v)
    append_row(text, "v ", mesh.vertices.row(v).data());
  TextureNumbers numbers(mesh);
  for (const Corners& polygon : polygon_corners(mesh)) {
    const bool textured = has_uv(mesh, polygon);
    faces += 'f';
    for (const CornerId c : polygon) {
      faces += ' ';
      append_number(faces, static_cast<long long>(vertex_of(mesh, c)) + 1);
      if (!textured) continue;
      faces += '/';
      append_number(faces, numbers.of(c, text));
    }
    faces += '\n';
  }
  return text + faces;
}

std::string write_off(const MeshFile& mesh) {
  const std::vector<Corners> polygons = polygon_corners(mesh);
  std::string text = "OFF\n" + std::to_string(mesh.vertices.rows()) + " " +
                     std::to_string(polygons.size()) + " 0\n";
  for (Index v = 0; v < mesh.vertices.rows(); ++v)
    append_row(text, "", mesh.vertices.row(v).data());
  for (const Corners& polygon : polygons) {
    append_number(text, static_cast<long long>(polygon.size()));
    for (const CornerId c : polygon) {
      text += ' ';
      append_number(text, static_cast<long long>(vertex_of(mesh, c)));
    }
    text += '\n';
  }
  return text;
}

std::string write_ply(const MeshFile& mesh) {
  const std::vector<Corners> polygons = polygon_corners(mesh);
  const bool textured = mesh.uv.rows() > 0;
  // Every program knows lengths of one byte; longer lists need more.
  const bool small = std::all_of(polygons.begin(), polygons.end(),
                                 [](const Corners& polygon) { return polygon.size() < 128; });
  const std::string length = small ? "uchar" : "int";
  std::string text = "ply\nformat binary_little_endian 1.0\ncomment Flipfree UV\nelement vertex " +
                     std::to_string(mesh.vertices.rows()) +
                     "\nproperty double x\nproperty double y\nproperty double z\nelement face " +
                     std::to_string(polygons.size()) + "\nproperty list " + length +
                     " int vertex_indices\n";
  if (textured) text += "property list " + length + " float texcoord\n";
  text += "end_header\n";
  const auto append_length = [&](std::size_t n) {
    if (small) {
      append_bytes(text, static_cast<std::uint8_t>(n));
    } else {
      append_bytes(text, static_cast<std::int32_t>(n));
    }
  };
  for (Index v = 0; v < mesh.vertices.rows(); ++v)
    for (Index i = 0; i < 3; ++i) append_bytes(text, mesh.vertices(v, i));
  for (const Corners& polygon : polygons) {
    append_length(polygon.size());
    for (const CornerId c : polygon) append_bytes(text, vertex_of(mesh, c));
    if (!textured) continue;
    const bool here = has_uv(mesh, polygon);
    append_length(here ? 2 * polygon.size() : 0);
    for (const CornerId c : polygon)
      for (Index i = 0; i < 2 && here; ++i) append_bytes(text, mesh.uv(c, i));
  }
  return text;
}

std::string write_stl(const MeshFile& mesh) {
  std::string text = "binary, by Flipfree UV";
  text.resize(80, ' ');
  append_bytes(text, static_cast<std::uint32_t>(mesh.faces.rows()));
  for (FaceId f = 0; f < mesh.faces.rows(); ++f) {
    const Vector3 a = mesh.vertices.row(mesh.faces(f, 0)), b = mesh.vertices.row(mesh.faces(f, 1)),
                  c = mesh.vertices.row(mesh.faces(f, 2));
    const Vector3 normal = (b - a).cross(c - a).stableNormalized();
    for (const Vector3& row : {normal, a, b, c})
      for (const double x : row) append_bytes(text, static_cast<float>(x));
    text.append(2, '\0');
  }
  return text;
}

}  // namespace

std::string write_mesh(const MeshFile& mesh, Format format) {
  check(mesh, format);
  switch (format) {
    case Format::kObj:
      return write_obj(mesh);
    case Format::kPly:
      return write_ply(mesh);
    case Format::kOff:
      return write_off(mesh);
    case Format::kStl:
      return write_stl(mesh);
  }
  throw InternalError("A format without a writer.");
}

}  // namespace flipfree::mesh
