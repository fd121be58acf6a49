#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <limits>

#include "flipfree/base/error.h"
#include "flipfree/mesh/files/file_polygons.h"
#include "flipfree/mesh/files/mesh_file.h"
#include "flipfree/mesh/files/text.h"
#include "flipfree/mesh/polygon_triangles.h"

namespace flipfree::mesh {
namespace {

FilePolygons polygons_of(std::string_view bytes, Format format) {
  switch (format) {
    case Format::kObj:
      return read_obj(bytes);
    case Format::kPly:
      return read_ply(bytes);
    case Format::kOff:
      return read_off(bytes);
    case Format::kStl:
      return read_stl(bytes);
  }
  throw InternalError("A format without a reader.");
}

}  // namespace

Format format_of(std::string_view path) {
  struct Named {
    std::string_view ending;
    Format format;
  };
  static constexpr std::array<Named, 4> kFormats{{{".obj", Format::kObj},
                                                  {".ply", Format::kPly},
                                                  {".off", Format::kOff},
                                                  {".stl", Format::kStl}}};
  std::string ending(path.substr(std::min(path.rfind('.'), path.size())));
  std::transform(ending.begin(), ending.end(), ending.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  for (const Named& named : kFormats)
    if (ending == named.ending) return named.format;
  refuse("Ending of the path", "it is none of .obj, .ply, .off and .stl", "Use one of them");
}

bool holds_corner_uv(Format format) { return format == Format::kObj || format == Format::kPly; }

namespace {

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

}  // namespace

MeshFile read_mesh(std::string_view bytes, Format format) {
  FilePolygons polygons = polygons_of(bytes, format);
  drop_partial_uv(polygons);
  if (std::all_of(polygons.uv.begin(), polygons.uv.end(), [](float t) { return std::isnan(t); }))
    polygons.uv.clear();
  MeshFile mesh;
  mesh.vertices = std::move(polygons.positions);

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

}  // namespace flipfree::mesh
