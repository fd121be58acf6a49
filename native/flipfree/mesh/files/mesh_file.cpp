#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <bit>
#include <cctype>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <map>
#include <numeric>
#include <tuple>
#include <utility>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/base/types.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/mesh/files/mesh_file.h"
#include "flipfree/mesh/files/text.h"
#include "flipfree/mesh/refined/editable_triangulation.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::mesh {

namespace {

// Polygons of a file as triangles that lie where the polygon lies, concave ones too.

using PolygonTriangle = std::array<Index, 3>;  // numbers of corners, in the polygon's winding

// n - 2 triangles of a polygon of n >= 3 corners in space, every side in one of them and every
// diagonal in two. Seen along the polygon's normal (by the sum of its sides' cross products, up to
// rounding where that is no axis) none is turned over, so that none leaves the polygon, wherever
// such triangles exist: for all outlines that do not cross themselves, holes by bridges and corners
// at one place included. Of several:
//   - the fan around corner 0, unless it is turned over or has a triangle without a shape
//     (kThinnest); quads as Blender splits them, by corners 0 and 2 unless that folds the quad;
//   - of up to kFewAtBest corners the triangles of least area in space, then the best shaped
//     (Klincsek 1980);
//   - larger ones lose ears until so few are left, or, where the outline touches or crosses itself
//     so that it has none, up to kMostAtBest; then diagonals are flipped until all are Delaunay.
// Corners at the place of the one before them get a triangle without area. Precondition: finite
// coordinates. Deterministic, the same for every power-of-two scale. Cost: O(n^2) as a rule; beyond
// kMostByEars the fan stays.
inline constexpr std::size_t kFewAtBest = 24;
inline constexpr std::size_t kMostAtBest = 256;
inline constexpr std::size_t kMostByEars = 20000;

using CornerNumbers = std::vector<Index>;
using OutlineTriangles = std::vector<PolygonTriangle>;

// A polygon without corners at the place of the one before, in its own unit, seen along its normal.
class Outline {
 public:
  explicit Outline(const std::vector<Vector3>& corners) {
    double extent = 0.0;
    for (const Vector3& p : corners) extent = std::max(extent, p.cwiseAbs().maxCoeff());
    // A power of two, so that what lies on one line stays there.
    const int exponent = extent > 0.0 ? std::ilogb(extent) : 0;
    for (const Vector3& p : corners)
      space_.push_back(p.unaryExpr([&](double x) { return std::ldexp(x, -exponent); }));
    Vector3 sum = Vector3::Zero();
    for (std::size_t i = 1; i + 1 < space_.size(); ++i)
      sum += (space_[i] - space_[0]).cross(space_[i + 1] - space_[0]);
    area_ = sum.stableNorm();
    if (area_ > 0.0) normal_ = sum / area_;
    // An axis that is no part of the normal makes the other one; axes stay axes, without rounding.
    Eigen::Index least = 0;
    normal_.cwiseAbs().minCoeff(&least);
    Vector3 u = Vector3::Unit(least) - normal_[least] * normal_;
    u.normalize();
    const Vector3 v = normal_.cross(u);
    for (const Vector3& p : space_) plane_.emplace_back(p.dot(u), p.dot(v));
  }

  std::size_t size() const { return space_.size(); }
  bool has_normal() const { return area_ > 0.0; }
  const Vector2& plane(Index i) const { return plane_[at(i)]; }
  bool positive(Index i, Index k, Index j) const {
    return numeric::orientation(plane(i), plane(k), plane(j)) > 0;
  }
  Vector3 area_vector(Index i, Index k, Index j) const {
    return (space_[at(k)] - space_[at(i)]).cross(space_[at(j)] - space_[at(i)]);
  }
  // Squared.
  std::array<double, 3> sides(Index i, Index k, Index j) const {
    return {(space_[at(k)] - space_[at(i)]).squaredNorm(),
            (space_[at(j)] - space_[at(k)]).squaredNorm(),
            (space_[at(i)] - space_[at(j)]).squaredNorm()};
  }
  bool has_shape(Index i, Index k, Index j) const {
    const auto [a, b, c] = sides(i, k, j);
    return area_vector(i, k, j).norm() > kThinnest * std::max({a, b, c});
  }
  // Area that the normal does not see, as a share of the polygon's; in steps, so that triangles in
  // one plane are equal. Sums of the triangles' areas differ by nothing else.
  double excess(Index i, Index k, Index j) const {
    constexpr double kStep = 1e-9;
    const Vector3 area = area_vector(i, k, j);
    const double unit = kStep * (has_normal() ? area_ : 1.0);
    return std::round((area.norm() - area.dot(normal_)) / unit);
  }
  // Squared sides over area: the sum of the angles' cotangents, large for needles.
  double slenderness(Index i, Index k, Index j) const {
    const auto [a, b, c] = sides(i, k, j);
    return (a + b + c) / std::max(area_vector(i, k, j).norm(), kThinnest * (a + b + c));
  }

 private:
  std::vector<Vector3> space_;
  std::vector<Vector2> plane_;
  Vector3 normal_ = Vector3::UnitZ();
  double area_ = 0.0;  // twice
};

OutlineTriangles fan_of(std::size_t n) {
  OutlineTriangles fan;
  for (Index k = 2; k < static_cast<Index>(n); ++k) fan.push_back({0, k - 1, k});
  return fan;
}

bool fan_stays(const Outline& outline) {
  const auto n = static_cast<Index>(outline.size());
  for (Index k = 2; k < n; ++k) {
    if (!outline.has_shape(0, k - 1, k)) return false;
    if (n != 4 && !outline.positive(0, k - 1, k)) return false;
  }
  // is_quad_flip_v3_first_third_fast() of Blender.
  return n != 4 || outline.area_vector(0, 1, 2).dot(outline.area_vector(0, 2, 3)) > 0.0;
}

// What a triangulation costs: triangles turned over, area, shape; in this order.
struct OutlineCost {
  double turned = 0.0;
  double excess = 0.0;
  double slenderness = 0.0;
  bool operator<(const OutlineCost& o) const {
    return std::tie(turned, excess, slenderness) < std::tie(o.turned, o.excess, o.slenderness);
  }
  OutlineCost operator+(const OutlineCost& o) const {
    return {turned + o.turned, excess + o.excess, slenderness + o.slenderness};
  }
};

OutlineCost cost_of(const Outline& outline, Index i, Index k, Index j) {
  // Without area: not turned, but as slender as can be.
  const double turned = outline.has_normal() && outline.positive(j, k, i) ? 1.0 : 0.0;
  return {turned, outline.excess(i, k, j), outline.slenderness(i, k, j)};
}

// The cheapest triangles of some corners of the outline, which are in order.
void cheapest_triangles(const Outline& outline, const CornerNumbers& corners,
                        OutlineTriangles& triangles) {
  const std::size_t n = corners.size();
  std::vector<OutlineCost> best(n * n);
  std::vector<std::size_t> apex(n * n, 0);
  for (std::size_t length = 2; length < n; ++length) {
    for (std::size_t i = 0; i + length < n; ++i) {
      const std::size_t j = i + length;
      OutlineCost& least = best[i * n + j];
      least.turned = std::numeric_limits<double>::infinity();
      for (std::size_t k = i + 1; k < j; ++k) {
        const OutlineCost parts = best[i * n + k] + best[k * n + j];
        if (!(parts < least)) continue;
        const OutlineCost sum = parts + cost_of(outline, corners[i], corners[k], corners[j]);
        if (!(sum < least)) continue;
        least = sum;
        apex[i * n + j] = k;
      }
    }
  }
  std::vector<std::pair<std::size_t, std::size_t>> open{{0, n - 1}};
  while (!open.empty()) {
    const auto [i, j] = open.back();
    open.pop_back();
    if (j == i + 1) continue;
    const std::size_t k = apex[i * n + j];
    triangles.push_back({corners[i], corners[k], corners[j]});
    open.emplace_back(i, k);
    open.emplace_back(k, j);
  }
}

// Cuts corners off whose triangle lies inside, with no other corner in it, until kFewAtBest are
// left. Where there are none, the cheapest are cut off until kMostAtBest are left.
CornerNumbers cut_ears(const Outline& outline, OutlineTriangles& triangles) {
  CornerNumbers left(outline.size());
  std::iota(left.begin(), left.end(), 0);
  const auto ear_at = [&](std::size_t i) {
    const std::size_t n = left.size();
    return PolygonTriangle{left[(i + n - 1) % n], left[i], left[(i + 1) % n]};
  };
  const auto is_ear = [&](const PolygonTriangle& ear) {
    if (!outline.positive(ear[0], ear[1], ear[2])) return false;
    const Vector2 &p = outline.plane(ear[0]), &q = outline.plane(ear[1]),
                  &r = outline.plane(ear[2]);
    return std::none_of(left.begin(), left.end(), [&](Index other) {
      const Vector2& x = outline.plane(other);
      return x != p && x != q && x != r && numeric::orientation(p, q, x) >= 0 &&
             numeric::orientation(q, r, x) >= 0 && numeric::orientation(r, p, x) >= 0;
    });
  };
  const auto cheapest = [&] {
    std::vector<OutlineCost> cost;
    for (std::size_t i = 0; i < left.size(); ++i) {
      const PolygonTriangle ear = ear_at(i);
      cost.push_back(cost_of(outline, ear[0], ear[1], ear[2]));
    }
    return at(std::min_element(cost.begin(), cost.end()) - cost.begin());
  };
  std::size_t i = 0, failed = 0;
  while (left.size() > (failed < left.size() ? kFewAtBest : kMostAtBest)) {
    const bool may_be = failed < left.size();
    i = may_be ? i % left.size() : cheapest();
    PolygonTriangle ear = ear_at(i);
    if (may_be && !is_ear(ear)) {
      ++failed;
      ++i;
      continue;
    }
    std::rotate(ear.begin(), std::min_element(ear.begin(), ear.end()), ear.end());
    triangles.push_back(ear);
    left.erase(left.begin() + static_cast<std::ptrdiff_t>(i));
    if (failed <= left.size()) failed = 0;
    ++i;  // no long fans
  }
  return left;
}

// Flips diagonals, seen along the normal, until the triangles are Delaunay, none of them turned
// over by that (Lawson 1977).
void flip_to_delaunay(const Outline& outline, OutlineTriangles& triangles) {
  Triangles faces(static_cast<Eigen::Index>(triangles.size()), 3);
  std::vector<std::array<VertexId, 2>> edges;
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    const auto [i, k, j] = triangles[f];
    faces.row(static_cast<Eigen::Index>(f)) << i, k, j;
    edges.insert(edges.end(), {{i, k}, {k, j}, {j, i}});
  }
  EditableTriangulation mesh(static_cast<Index>(outline.size()), faces);
  // Roundings aside every flip lowers the lifted surface.
  for (std::size_t left = 100 * edges.size(); !edges.empty() && left > 0;) {
    const HalfedgeId h = mesh.find(edges.back()[0], edges.back()[1]);
    edges.pop_back();
    if (h == kInvalid || mesh.is_boundary(h)) continue;
    const VertexId a = mesh.source(h), b = mesh.target(h), c = mesh.apex(h);
    const VertexId d = mesh.apex(mesh.opposite(h));
    if (numeric::in_circle(outline.plane(a), outline.plane(b), outline.plane(c),
                           outline.plane(d)) <= 0 ||
        !outline.positive(a, d, c) || !outline.positive(d, b, c))
      continue;
    mesh.flip_edge(h);  // h parts the outline between c and d, so that they have no edge yet
    --left;
    edges.insert(edges.end(), {{a, d}, {d, b}, {b, c}, {c, a}});
  }
  for (std::size_t f = 0; f < triangles.size(); ++f) {
    PolygonTriangle& t = triangles[f] = mesh.corners(static_cast<FaceId>(f));
    std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  }
}

// Of three corners or more, none at the place of the one before it.
OutlineTriangles triangles_of_outline(const std::vector<Vector3>& corners) {
  const std::size_t n = corners.size();
  if (n == 3) return fan_of(n);
  const Outline outline(corners);
  if (fan_stays(outline)) return fan_of(n);
  OutlineTriangles triangles;
  if (n > kMostByEars) return fan_of(n);
  const CornerNumbers left = cut_ears(outline, triangles);
  cheapest_triangles(outline, left, triangles);
  if (n > kFewAtBest) flip_to_delaunay(outline, triangles);
  std::sort(triangles.begin(), triangles.end());
  return triangles;
}

std::vector<PolygonTriangle> triangles_of_polygon(const std::vector<Vector3>& corners) {
  const std::size_t n = corners.size();
  CornerNumbers kept;
  for (std::size_t i = 0; i < n; ++i) {
    if (corners[i] != corners[(i + n - 1) % n]) kept.push_back(static_cast<Index>(i));
  }
  if (kept.size() < 3) return fan_of(n);
  if (kept.size() == n) return triangles_of_outline(corners);
  std::vector<Vector3> places;
  for (const Index i : kept) places.push_back(corners[at(i)]);
  OutlineTriangles triangles;
  const auto size = static_cast<Index>(n);
  for (const PolygonTriangle& t : triangles_of_outline(places))
    triangles.push_back({kept[at(t[0])], kept[at(t[1])], kept[at(t[2])]});
  // CornerNumbers that were left out lie between a side's ends, at its first one.
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const Index end = kept[(i + 1) % kept.size()];
    for (Index k = (kept[i] + 1) % size; k != end; k = (k + 1) % size)
      triangles.push_back({k == 0 ? size - 1 : k - 1, k, end});
  }
  return triangles;
}

// A polygon has texture coordinates at all of its corners, or none: NaN.
void drop_partial_uv(FilePolygons& polygons) {
  if (polygons.uv.empty()) return;
  for (std::size_t p = 0; p + 1 < polygons.begin.size(); ++p) {
    const auto first = polygons.uv.begin() + 2 * polygons.begin[p];
    const auto last = polygons.uv.begin() + 2 * polygons.begin[p + 1];
    if (std::any_of(first, last, [](float t) { return std::isnan(t); }))
      std::fill(first, last, std::numeric_limits<float>::quiet_NaN());
  }
}

// Files of a mesh.

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
  std::map<Index, CornerId> joined;
  for (const CornerId c : polygon) {
    const CornerId first = joined.try_emplace(mesh.corners(c / 3, c % 3), c).first->second;
    if (vertex_of(mesh, first) != vertex_of(mesh, c) || !same_bits(mesh, first, c)) return false;
  }
  polygon.clear();
  for (const auto& [number, c] : joined) polygon.push_back(c);
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

// Appends the shortest decimals that give the same bits, or as `format` says.
template <typename Number, typename... Format>
void append_number(std::string& text, Number value, Format... format) {
  std::array<char, 64> buffer;
  const auto end =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), value, format...).ptr;
  text.append(buffer.data(), end);
}

// Appends a number as binary files have it, the low byte first.
template <typename T>
void append_bytes(std::string& text, T value) {
  static_assert(std::endian::native == std::endian::little);
  std::array<char, sizeof(T)> bytes;
  std::memcpy(bytes.data(), &value, sizeof(T));
  text.append(bytes.data(), bytes.size());
}

void append_row(std::string& text, const char* keyword, const double* row) {
  text += keyword;
  for (int i = 0; i < 3; ++i) {
    if (i > 0) text += ' ';
    append_number(text, row[i]);
  }
  text += '\n';
}

std::string write_obj(const MeshFile& mesh) {
  std::string text = "# Flipfree UV\n", faces;
  for (Index v = 0; v < mesh.vertices.rows(); ++v)
    append_row(text, "v ", mesh.vertices.row(v).data());
  // Of texture coordinates: those of one vertex with the same bits are one.
  std::map<std::array<std::uint32_t, 3>, std::size_t> numbers;
  const auto texture_of = [&](CornerId c) {
    const auto bits = [&](Index i) { return std::bit_cast<std::uint32_t>(mesh.uv(c, i)); };
    const std::array key{static_cast<std::uint32_t>(vertex_of(mesh, c)), bits(0), bits(1)};
    const auto [known, is_new] = numbers.try_emplace(key, numbers.size() + 1);
    if (is_new) {
      text += "vt ";
      append_number(text, mesh.uv(c, 0), std::chars_format::general, 9);
      text += ' ';
      append_number(text, mesh.uv(c, 1), std::chars_format::general, 9);
      text += '\n';
    }
    return known->second;
  };
  for (const Corners& polygon : polygon_corners(mesh)) {
    const bool textured = has_uv(mesh, polygon);
    faces += 'f';
    for (const CornerId c : polygon) {
      faces += ' ';
      append_number(faces, std::int64_t{vertex_of(mesh, c)} + 1);
      if (!textured) continue;
      faces += '/';
      append_number(faces, texture_of(c));
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
    append_number(text, polygon.size());
    for (const CornerId c : polygon) {
      text += ' ';
      append_number(text, vertex_of(mesh, c));
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

struct FileType {
  std::string_view ending;
  Format format;
  FilePolygons (*read)(std::string_view bytes);
  std::string (*write)(const MeshFile& mesh);
};
constexpr std::array<FileType, 4> kFileTypes{{{".obj", Format::kObj, read_obj, write_obj},
                                              {".ply", Format::kPly, read_ply, write_ply},
                                              {".off", Format::kOff, read_off, write_off},
                                              {".stl", Format::kStl, read_stl, write_stl}}};

const FileType& file_type(Format format) {
  return *std::find_if(kFileTypes.begin(), kFileTypes.end(),
                       [&](const FileType& t) { return t.format == format; });
}

}  // namespace

Format format_of(std::string_view path) {
  std::string ending(path.substr(std::min(path.rfind('.'), path.size())));
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const FileType& type : kFileTypes)
    if (ending == type.ending) return type.format;
  refuse("Ending of the path", "it is none of .obj, .ply, .off and .stl", "Use one of them");
}

bool holds_corner_uv(Format format) { return format == Format::kObj || format == Format::kPly; }

MeshFile read_mesh(std::string_view bytes, Format format) {
  FilePolygons polygons = file_type(format).read(bytes);
  drop_partial_uv(polygons);
  if (std::all_of(polygons.uv.begin(), polygons.uv.end(), [](float t) { return std::isnan(t); }))
    polygons.uv.clear();
  MeshFile mesh;
  mesh.vertices = Points3::Map(polygons.coordinates.data(),
                               static_cast<Eigen::Index>(polygons.coordinates.size() / 3), 3);

  const std::size_t count = polygons.begin.size() - 1;
  const Index triangles = count_of(polygons.corners.size() - 2 * count, "End of the file");
  mesh.faces.resize(triangles, 3);
  mesh.corners.resize(triangles, 3);
  mesh.uv.resize(polygons.uv.empty() ? 0 : 3 * triangles, 2);
  Index f = 0;
  std::vector<Vector3> places;
  for (std::size_t p = 0; p < count; ++p) {
    const Index first = polygons.begin[p];
    places.clear();
    for (Index c = first; c < polygons.begin[p + 1]; ++c)
      places.emplace_back(mesh.vertices.row(polygons.corners[at(c)]));
    for (const PolygonTriangle& triangle : triangles_of_polygon(places)) {
      for (Index i = 0; i < 3; ++i) {
        const Index corner = first + triangle[at(i)];
        const auto c = at(corner);
        mesh.corners(f, i) = corner;
        mesh.faces(f, i) = polygons.corners[c];
        if (mesh.uv.rows() > 0)
          mesh.uv.row(3 * f + i) << polygons.uv[2 * c], polygons.uv[2 * c + 1];
      }
      mesh.polygons.push_back(polygons.numbers.empty() ? static_cast<Index>(p)
                                                       : polygons.numbers[p]);
      ++f;
    }
  }
  return mesh;
}

std::string write_mesh(const MeshFile& mesh, Format format) {
  check(mesh, format);
  return file_type(format).write(mesh);
}

}  // namespace flipfree::mesh
