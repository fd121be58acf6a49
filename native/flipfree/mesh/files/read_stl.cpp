// STL, binary or text. Told apart by size: a binary file has 84 bytes and 50 for each triangle.
#include <OpenMesh/Core/IO/importer/ImporterT.hh>
#include <OpenMesh/Core/IO/reader/STLReader.hh>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/System/omstream.hh>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <sstream>
#include <vector>

#include "flipfree/base/error.h"
#include "flipfree/mesh/files/mesh_file.h"
#include "flipfree/mesh/files/text.h"

namespace flipfree::mesh {
namespace {

using namespace OpenMesh;  // the importer's interface names it in every line

static_assert(std::endian::native == std::endian::little);

constexpr std::size_t kHeader = 80, kStart = 84, kTriangle = 50;

std::uint32_t promised(std::string_view bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + kHeader, sizeof count);
  return count;
}

std::string to_binary(const std::vector<float>& corners) {
  const auto count = static_cast<std::uint32_t>(corners.size() / 9);
  std::string text(kStart + kTriangle * count, '\0');
  std::memcpy(text.data() + kHeader, &count, sizeof count);
  for (std::size_t t = 0; t < count; ++t)
    std::memcpy(text.data() + kStart + kTriangle * t + 12, corners.data() + 9 * t, 36);
  return text;
}

std::vector<float> from_binary(std::string_view bytes) {
  const std::size_t count = promised(bytes);
  std::vector<float> corners(9 * count);
  for (std::size_t t = 0; t < count; ++t) {
    std::memcpy(corners.data() + 9 * t, bytes.data() + kStart + kTriangle * t + 12, 36);
    for (std::size_t i = 9 * t; i < 9 * t + 9; ++i)
      if (!std::isfinite(corners[i]))
        refuse("Triangle " + std::to_string(t), "a coordinate is NaN or infinite",
               "Delete or move that vertex, and write the file again");
  }
  return corners;
}

std::vector<float> from_text(std::string_view bytes) {
  std::vector<float> corners;
  std::size_t loop = 0;
  bool ended = false;
  Lines lines(bytes);
  while (lines.next()) {
    std::string_view rest = lines.line();
    const std::string_view keyword = next_word(rest);
    if (keyword == "outer") loop = corners.size();
    ended = keyword == "endsolid" || (ended && keyword.empty());
    if (keyword == "vertex") {
      for (int i = 0; i < 3; ++i)
        corners.push_back(to_float(next_word(rest), lines.place(), "a coordinate"));
    } else if (keyword == "endloop" && corners.size() != loop + 9) {
      refuse(lines.place(), "a facet does not have three corners");
    }
  }
  if (!ended) refuse("End of the file", "the file ends before 'endsolid'");
  if (corners.size() % 9 != 0) refuse("End of the file", "corners outside of facets");
  return corners;
}

// Takes triangles as they come: OpenMesh's own importer drops those that its half-edges cannot hold
// (edges with three faces, orientations against each other).
class Collector final : public IO::ImporterT<TriMesh_ArrayKernelT<>> {
 public:
  Collector(TriMesh_ArrayKernelT<>& unused, FilePolygons& polygons)
      : ImporterT(unused), polygons_(polygons) {}

  VertexHandle add_vertex(const Vec3f& point) override {
    coordinates.insert(coordinates.end(), {point[0], point[1], point[2]});
    return VertexHandle(static_cast<int>(coordinates.size() / 3) - 1);
  }
  FaceHandle add_face(const VHandles& corners) override {
    for (const VertexHandle v : corners) polygons_.corners.push_back(v.idx());
    polygons_.begin.push_back(static_cast<Index>(polygons_.corners.size()));
    return FaceHandle(static_cast<int>(n_faces()) - 1);
  }
  std::size_t n_vertices() const override { return coordinates.size() / 3; }
  std::size_t n_faces() const override { return polygons_.begin.size() - 1; }
  std::size_t n_edges() const override { return 0; }

  std::vector<double> coordinates;

 private:
  FilePolygons& polygons_;
};

// `text`: a binary file. Equal corners become one vertex.
FilePolygons read_binary(const std::string& text) {
  // The readers are single objects with state, and so are the streams that they complain to.
  static std::mutex one_at_a_time;
  const std::scoped_lock lock(one_at_a_time);
  omlog().disable();
  omout().disable();
  omerr().disable();
  FilePolygons polygons;
  TriMesh_ArrayKernelT<> unused;
  Collector collector(unused, polygons);
  IO::Options options = IO::Options::Binary;
  std::istringstream stream(text, std::ios::in | std::ios::binary);
  // Not through the manager of all readers, which knows of none where OpenMesh is linked
  // statically.
  if (!IO::STLReader().read(stream, collector, options) ||
      polygons.corners.size() != 3 * collector.n_faces())
    throw InternalError("OpenMesh did not read an STL file that holds together.");
  polygons.positions = to_points(collector.coordinates);
  return polygons;
}

}  // namespace

FilePolygons read_stl(std::string_view bytes) {
  const bool binary =
      bytes.size() >= kStart && kStart + kTriangle * std::size_t{promised(bytes)} == bytes.size();
  std::string_view rest = bytes.substr(0, kHeader);
  rest.remove_prefix(std::min(rest.find_first_not_of(" \t\r\n"), rest.size()));
  if (!binary && !rest.starts_with("solid"))
    refuse("Start of the file",
           "neither text, which begins with 'solid', nor as many bytes as a "
           "binary file with that number of triangles has");
  const std::vector<float> corners = binary ? from_binary(bytes) : from_text(bytes);
  count_of(corners.size() / 9, "End of the file");
  return read_binary(to_binary(corners));
}

}  // namespace flipfree::mesh
