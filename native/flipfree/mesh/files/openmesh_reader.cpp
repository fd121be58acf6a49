#include "flipfree/mesh/files/openmesh_reader.h"

#include <OpenMesh/Core/IO/IOManager.hh>
#include <OpenMesh/Core/IO/importer/BaseImporter.hh>
#include <OpenMesh/Core/Mesh/PolyMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/System/omstream.hh>
#include <limits>
#include <mutex>
#include <sstream>

#include "flipfree/base/error.h"
#include "flipfree/mesh/files/text.h"

namespace flipfree::mesh {
namespace {

using namespace OpenMesh;  // the importer's interface names it in every line

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();
const char* const kCornerUv = "texcoord";

// Takes what a reader finds as it comes: OpenMesh's own importer drops faces that its half-edges
// cannot hold (edges with three faces, vertices twice, orientations against each other).
class Collector final : public IO::BaseImporter {
 public:
  VertexHandle add_vertex(const Vec3f& point) override {
    positions.insert(positions.end(), {point[0], point[1], point[2]});
    return add_vertex();
  }
  VertexHandle add_vertex() override { return VertexHandle(static_cast<int>(vertices_++)); }
  FaceHandle add_face(const VHandles& corners) override {
    for (const VertexHandle v : corners) polygons.corners.push_back(v.idx());
    polygons.begin.push_back(static_cast<Index>(polygons.corners.size()));
    return properties_.new_face();  // a slot for its properties, without neighbours
  }
  void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<Vec2f>& uv) override {
    polygons.uv.resize(2 * static_cast<std::size_t>(polygons.begin.end()[-2]), kNone);
    for (const Vec2f& t : uv) polygons.uv.insert(polygons.uv.end(), {t[0], t[1]});
  }
  void set_texcoord(VertexHandle v, const Vec2f& uv) override {
    vertex_uv.resize(std::max(vertex_uv.size(), 2 * static_cast<std::size_t>(v.idx()) + 2), kNone);
    vertex_uv[2 * static_cast<std::size_t>(v.idx())] = uv[0];
    vertex_uv[2 * static_cast<std::size_t>(v.idx()) + 1] = uv[1];
  }
  BaseKernel* kernel() override { return &properties_; }
  std::size_t n_vertices() const override { return vertices_; }
  std::size_t n_faces() const override { return polygons.begin.size() - 1; }
  std::size_t n_edges() const override { return 0; }

  // What PLY files say in the list texcoord, which OpenMesh keeps as a property of faces.
  void collect_corner_uv() {
    FPropHandleT<std::vector<float>> property;
    if (!properties_.get_property_handle(property, kCornerUv)) return;
    for (std::size_t f = 0; f < n_faces(); ++f) {
      const auto& uv = properties_.property(property, FaceHandle(static_cast<int>(f)));
      polygons.uv.insert(polygons.uv.end(), uv.begin(), uv.end());
      polygons.uv.resize(2 * static_cast<std::size_t>(polygons.begin[f + 1]), kNone);
    }
  }

  Polygons polygons;
  std::vector<double> positions;
  std::vector<float> vertex_uv;

  // What plain forms do not have.
  HalfedgeHandle add_edge(VertexHandle, VertexHandle) override { return HalfedgeHandle(); }
  FaceHandle add_face(HalfedgeHandle) override { return FaceHandle(); }
  void add_face_texcoords(FaceHandle, VertexHandle, const std::vector<Vec3f>&) override {}
  void set_face_texindex(FaceHandle, int) override {}
  void set_point(VertexHandle, const Vec3f&) override {}
  void set_halfedge(VertexHandle, HalfedgeHandle) override {}
  void set_next(HalfedgeHandle, HalfedgeHandle) override {}
  void set_face(HalfedgeHandle, FaceHandle) override {}
  void request_face_texcoords2D() override {}
  void set_texcoord(HalfedgeHandle, const Vec2f&) override {}
  void set_texcoord(VertexHandle, const Vec3f&) override {}
  void set_texcoord(HalfedgeHandle, const Vec3f&) override {}
  void set_normal(VertexHandle, const Vec3f&) override {}
  void set_normal(VertexHandle, const Vec3d&) override {}
  void set_normal(FaceHandle, const Vec3f&) override {}
  void set_normal(FaceHandle, const Vec3d&) override {}
  void set_color(VertexHandle, const Vec3uc&) override {}
  void set_color(VertexHandle, const Vec4uc&) override {}
  void set_color(VertexHandle, const Vec3f&) override {}
  void set_color(VertexHandle, const Vec4f&) override {}
  void set_color(EdgeHandle, const Vec3uc&) override {}
  void set_color(EdgeHandle, const Vec4uc&) override {}
  void set_color(EdgeHandle, const Vec3f&) override {}
  void set_color(EdgeHandle, const Vec4f&) override {}
  void set_color(FaceHandle, const Vec3uc&) override {}
  void set_color(FaceHandle, const Vec4uc&) override {}
  void set_color(FaceHandle, const Vec3f&) override {}
  void set_color(FaceHandle, const Vec4f&) override {}
  void set_status(VertexHandle, const Attributes::StatusInfo&) override {}
  void set_status(HalfedgeHandle, const Attributes::StatusInfo&) override {}
  void set_status(EdgeHandle, const Attributes::StatusInfo&) override {}
  void set_status(FaceHandle, const Attributes::StatusInfo&) override {}
  void add_texture_information(int, std::string) override {}

 private:
  std::size_t vertices_ = 0;
  PolyMesh_ArrayKernelT<> properties_;
};

bool run_reader(const PlainForm& plain, Collector& collector) {
  // The readers are single objects with state, and so are the streams that they complain to.
  static std::mutex one_at_a_time;
  const std::scoped_lock lock(one_at_a_time);
  omlog().disable();
  omout().disable();
  omerr().disable();
  IO::Options options;
  if (plain.binary) options += IO::Options::Binary;
  if (plain.vertex_uv) options += IO::Options::VertexTexCoord;
  if (plain.corner_uv) options += IO::Options::FaceTexCoord;
  if (plain.corner_uv && plain.binary) options += IO::Options::Custom;
  std::istringstream stream(plain.text, std::ios::in | std::ios::binary);
  return IO::IOManager().read(stream, plain.extension, collector, options);
}

}  // namespace

Polygons read_with_openmesh(const PlainForm& plain) {
  Collector collector;
  const bool done = run_reader(plain, collector);
  if (plain.corner_uv && plain.binary) collector.collect_corner_uv();
  Polygons polygons = std::move(collector.polygons);
  const std::size_t found = polygons.begin.size() - 1, corners = polygons.corners.size();
  const bool is_stl = plain.positions.rows() == 0 && plain.binary;
  if (is_stl) polygons.positions = to_points(collector.positions);

  if (plain.corner_uv) {
    polygons.uv.resize(std::max(2 * corners, polygons.uv.size()), kNone);
  } else {
    polygons.uv.clear();  // OBJ: every face has been handed on as one without any
    for (std::size_t c = 0; c < corners && plain.vertex_uv; ++c)
      for (std::size_t i = 0; i < 2; ++i)
        polygons.uv.push_back(
            collector.vertex_uv.at(2 * static_cast<std::size_t>(polygons.corners[c]) + i));
  }

  const bool whole =
      is_stl ? found <= static_cast<std::size_t>(plain.polygons)
             : found == static_cast<std::size_t>(plain.polygons) &&
                   collector.n_vertices() ==
                       static_cast<std::size_t>(plain.positions.rows()) + plain.again.size();
  if (!done || !whole || (!polygons.uv.empty() && polygons.uv.size() != 2 * corners))
    throw InternalError("OpenMesh read another mesh than the file has.");
  const auto own = static_cast<Index>(plain.positions.rows());
  for (Index& v : polygons.corners)
    if (!plain.again.empty() && v >= own) v = plain.again.at(static_cast<std::size_t>(v - own));
  return polygons;
}

}  // namespace flipfree::mesh
