#include "flipfree/matchmaker/continuation/decimate.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "flipfree/mesh/refined/fill_polygon.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

using Mesh = mesh::EditableTriangulation;

// Stars with more corners are left alone, and so are those that only triangles below this shape
// fill (1: equilateral, 0: flat).
constexpr std::size_t kMostDecimatedCorners = 14;
constexpr double kLeastShape = 0.02;
// A round that removes a smaller share (in per cent) of the vertices is the last one.
constexpr Index kWorthwhileDecimation = 1;

class Decimator {
 public:
  Decimator(const mesh::RefinedMap& map, const std::vector<char>& keep)
      : map_(map),
        mesh_(map.surface.mesh),
        keep_(keep),
        first_(static_cast<std::size_t>(mesh_.face_slots()), kInvalid),
        next_(static_cast<std::size_t>(mesh_.vertex_count()), kInvalid) {
    for (VertexId v = 0; v < mesh_.vertex_count(); ++v) {
      if (mesh_.outgoing(v) != kInvalid) ++left_;
    }
  }

  void run(Index target, const ExecutionContext& context) {
    while (left_ > target) {
      const Index before = left_;
      std::vector<std::pair<double, VertexId>> order;
      for (VertexId v = 0; v < mesh_.vertex_count(); ++v) {
        if (keep_[index(v)] == 0 && mesh_.outgoing(v) != kInvalid && !mesh_.is_boundary_vertex(v))
          order.emplace_back(star_area(v), v);
      }
      std::sort(order.begin(), order.end());
      std::vector<char> blocked(next_.size(), 0);
      for (std::size_t i = 0; i < order.size() && left_ > target; ++i) {
        if (i % 256 == 0) context.check();
        const VertexId v = order[i].second;
        if (blocked[index(v)] != 0 || !remove(v)) continue;
        for (const VertexId w : corners_) blocked[index(w)] = 1;
        --left_;
      }
      if (100 * (before - left_) < kWorthwhileDecimation * before) break;
    }
  }

  CoarseDisk result() const {
    CoarseDisk disk;
    disk.coarse.assign(next_.size(), kInvalid);
    disk.face.assign(next_.size(), kInvalid);
    for (VertexId v = 0; v < mesh_.vertex_count(); ++v) {
      if (mesh_.outgoing(v) == kInvalid) continue;
      disk.coarse[index(v)] = static_cast<VertexId>(disk.fine.size());
      disk.fine.push_back(v);
    }
    disk.surface.vertices.resize(static_cast<Eigen::Index>(disk.fine.size()), 3);
    for (std::size_t i = 0; i < disk.fine.size(); ++i)
      disk.surface.vertices.row(static_cast<Eigen::Index>(i)) = place(disk.fine[i]).transpose();
    std::vector<FaceId> slots;
    disk.surface.faces = mesh_.faces(&slots);
    for (std::size_t i = 0; i < slots.size(); ++i) {
      for (VertexId v = first_[index(slots[i])]; v != kInvalid; v = next_[index(v)])
        disk.face[index(v)] = static_cast<FaceId>(i);
    }
    for (Eigen::Index i = 0; i < disk.surface.faces.size(); ++i) {
      VertexId& v = disk.surface.faces.data()[i];
      v = disk.coarse[index(v)];
    }
    return disk;
  }

 private:
  static std::size_t index(Index i) { return static_cast<std::size_t>(i); }
  Vector2 uv(VertexId v) const { return map_.uv.row(v).transpose(); }
  const Vector3& place(VertexId v) const { return map_.surface.position[index(v)]; }

  double star_area(VertexId v) const {
    double area = 0;
    mesh_.for_each_outgoing(v, [&](HalfedgeId h) {
      area += (place(mesh_.target(h)) - place(v)).cross(place(mesh_.apex(h)) - place(v)).norm();
    });
    return area;
  }

  // 1 for an equilateral triangle, 0 for a flat one.
  double shape(VertexId a, VertexId b, VertexId c) const {
    const Vector3 e = place(b) - place(a);
    const Vector3 f = place(c) - place(a);
    const double squares = e.squaredNorm() + f.squaredNorm() + (f - e).squaredNorm();
    return squares > 0 ? 2.0 * std::sqrt(3.0) * e.cross(f).norm() / squares : 0.0;
  }

  bool remove(VertexId v) {
    const std::vector<FaceId> star = mesh_.star(v);
    if (star.size() > kMostDecimatedCorners) return false;
    corners_.clear();
    mesh_.for_each_outgoing(v, [&](HalfedgeId h) { corners_.push_back(mesh_.target(h)); });
    if (!triangulate()) return false;
    std::vector<VertexId> points = {v};
    for (const FaceId f : star) {
      for (VertexId p = first_[index(f)]; p != kInvalid; p = next_[index(p)]) points.push_back(p);
      first_[index(f)] = kInvalid;
    }
    const std::vector<FaceId> parents(triangles_.size(), mesh_.parent(star.front()));
    mesh_.replace(star, triangles_, parents);
    for (const VertexId p : points) {
      const FaceId f = holder(uv(p));
      next_[index(p)] = first_[index(f)];
      first_[index(f)] = p;
    }
    return true;
  }

  // The new triangle that holds a point of the star. All tests are exact, so there is one.
  FaceId holder(const Vector2& p) const {
    FaceId found = kInvalid;
    for (const Mesh::Triangle& t : triangles_) {
      found = mesh_.find(t[0], t[1]) / 3;
      bool inside = true;
      for (std::size_t k = 0; k < 3; ++k)
        inside = inside && numeric::orientation(uv(t[k]), uv(t[(k + 1) % 3]), p) >= 0;
      if (inside) break;
    }
    return found;
  }

  // Fills corners_ by the triangulation whose worst shape is best; all triangles positive in the
  // map.
  bool triangulate() {
    const auto chord = [&](std::size_t i, std::size_t j) {
      // An edge beyond the star may join the same two corners already.
      return mesh_.find(corners_[i], corners_[j]) == kInvalid;
    };
    const auto cost = [&](std::size_t i, std::size_t k, std::size_t j, double limit) {
      const double value = shape(corners_[i], corners_[k], corners_[j]);
      const bool good = value >= kLeastShape && -value < limit &&
                        numeric::orientation(uv(corners_[i]), uv(corners_[k]), uv(corners_[j])) > 0;
      return good ? -value : mesh::PolygonFiller::kForbidden;
    };
    if (!filler_.fill(corners_.size(), chord, cost)) return false;
    triangles_.clear();
    filler_.for_each_triangle([&](std::size_t i, std::size_t k, std::size_t j) {
      triangles_.push_back({corners_[i], corners_[k], corners_[j]});
    });
    return true;
  }

  const mesh::RefinedMap& map_;
  Mesh mesh_;
  const std::vector<char>& keep_;
  // Removed vertices of each face, as lists.
  std::vector<VertexId> first_;
  std::vector<VertexId> next_;
  Index left_ = 0;
  std::vector<VertexId> corners_;
  std::vector<Mesh::Triangle> triangles_;
  mesh::PolygonFiller filler_;
};

}  // namespace

CoarseDisk decimate(const mesh::RefinedMap& map, const std::vector<char>& keep, Index target,
                    const ExecutionContext& context) {
  Decimator decimator(map, keep);
  decimator.run(target, context);
  return decimator.result();
}

}  // namespace flipfree::matchmaker
