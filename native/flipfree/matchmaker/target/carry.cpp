#include "flipfree/matchmaker/target/carry.h"

#include <cstddef>
#include <deque>

#include "flipfree/base/plane.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

using Mesh = mesh::EditableTriangulation;

class Locator {
 public:
  Locator(const Mesh& mesh, const std::vector<Vector2>& place) : mesh_(mesh), place_(place) {}

  // The triangle that holds b, walking along the segment a -> b from triangle f, which holds a; or
  // from domain vertex `corner`, which lies at a. kInvalid if the walk leaves the domain.
  FaceId walk(FaceId f, Index corner, const Vector2& a, const Vector2& b) const {
    HalfedgeId entered = kInvalid;
    if (corner != kInvalid) {
      f = wedge(corner, a, b);
      if (f == kInvalid || contains(f, b)) return f;
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
        if (mesh_.apex(h) == corner) entered = mesh_.opposite(h);
      }
      if (entered == kInvalid) return kInvalid;
      f = entered / 3;
    }
    // The dual of the domain is a tree and the walk never turns back: no triangle comes twice.
    while (!contains(f, b)) {
      HalfedgeId exit = kInvalid;
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
        if (h == entered || mesh_.is_boundary(h)) continue;
        const Vector2& p = at(mesh_.source(h));
        const Vector2& q = at(mesh_.target(h));
        if (numeric::orientation(p, q, b) < 0 && numeric::orientation(a, b, p) <= 0 &&
            numeric::orientation(a, b, q) >= 0)
          exit = h;
      }
      if (exit == kInvalid) return kInvalid;
      entered = mesh_.opposite(exit);
      f = entered / 3;
    }
    return f;
  }

 private:
  const Vector2& at(Index v) const { return place_[static_cast<std::size_t>(v)]; }
  bool contains(FaceId f, const Vector2& p) const {
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      if (numeric::orientation(at(mesh_.source(h)), at(mesh_.target(h)), p) < 0) return false;
    }
    return true;
  }
  FaceId wedge(Index corner, const Vector2& a, const Vector2& b) const {
    FaceId found = kInvalid;
    mesh_.for_each_outgoing(corner, [&](HalfedgeId h) {
      if (found == kInvalid && numeric::orientation(a, at(mesh_.target(h)), b) >= 0 &&
          numeric::orientation(a, at(mesh_.apex(h)), b) <= 0)
        found = h / 3;
    });
    return found;
  }

  const Mesh& mesh_;
  const std::vector<Vector2>& place_;
};

}  // namespace

FaceId find_along(const TargetDomain& domain, const std::vector<Vector2>& place, FaceId f,
                  Index corner, const Vector2& a, const Vector2& b) {
  return Locator(domain.triangulation, place).walk(f, corner, a, b);
}

Carrier::Carrier(const mesh::RefinedSurface& surface, const Points2& uv, const TargetDomain& domain,
                 const std::vector<Vector2>& here, const ExecutionContext& context)
    : uv_(uv),
      domain_(domain),
      here_(here),
      face_(static_cast<std::size_t>(uv.rows()), kInvalid),
      corner_(face_.size(), kInvalid) {
  std::deque<VertexId> queue;
  for (const Index d : domain.outline) {
    const VertexId v = domain.mesh_vertex[static_cast<std::size_t>(d)];
    corner_[static_cast<std::size_t>(v)] = d;
    face_[static_cast<std::size_t>(v)] = domain.triangulation.outgoing(d) / 3;
    queue.push_back(v);
  }
  for (std::size_t steps = 0; !queue.empty(); ++steps) {
    if (steps % 4096 == 0) context.check();
    const VertexId v = queue.front();
    queue.pop_front();
    const Vector2 a = uv.row(v).transpose();
    surface.mesh.for_each_outgoing(v, [&](HalfedgeId h) {
      const VertexId w = surface.mesh.target(h);
      FaceId& f = face_[static_cast<std::size_t>(w)];
      if (f != kInvalid) return;
      f = find_along(domain, here, face_[static_cast<std::size_t>(v)],
                     corner_[static_cast<std::size_t>(v)], a, uv.row(w).transpose());
      if (f != kInvalid) queue.push_back(w);  // else another neighbour may find it
    });
  }
}

Vector2 Carrier::ride(FaceId f, const Vector2& p, const std::vector<Vector2>& there) const {
  if (f == kInvalid) return p;
  const Mesh::Triangle t = domain_.triangulation.corners(f);
  const auto at = [&](const std::vector<Vector2>& shape, std::size_t k) -> const Vector2& {
    return shape[static_cast<std::size_t>(t[k])];
  };
  const Vector2 e1 = at(here_, 1) - at(here_, 0);
  const Vector2 e2 = at(here_, 2) - at(here_, 0);
  const Vector2 d = p - at(here_, 0);
  const double area = cross(e1, e2);
  if (!(area > 0)) return p;
  return at(there, 0) + cross(d, e2) / area * (at(there, 1) - at(there, 0)) +
         cross(e1, d) / area * (at(there, 2) - at(there, 0));
}

Points2 Carrier::vertices(const std::vector<Vector2>& there) const {
  Points2 result(uv_.rows(), 2);
  for (Eigen::Index v = 0; v < uv_.rows(); ++v) {
    const auto i = static_cast<std::size_t>(v);
    const Vector2 p = corner_[i] != kInvalid ? there[static_cast<std::size_t>(corner_[i])]
                                             : ride(face_[i], uv_.row(v).transpose(), there);
    result.row(v) = p.transpose();
  }
  return result;
}

Vector2 Carrier::on_edge(VertexId a, VertexId b, double s,
                         const std::vector<Vector2>& there) const {
  const Vector2 start = uv_.row(a).transpose();
  const Vector2 p = start + s * (uv_.row(b).transpose() - start);
  const auto i = static_cast<std::size_t>(a);
  return ride(find_along(domain_, here_, face_[i], corner_[i], start, p), p, there);
}

}  // namespace flipfree::matchmaker
