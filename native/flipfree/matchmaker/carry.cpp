#include "flipfree/matchmaker/carry.h"

#include <cstddef>
#include <deque>

#include "flipfree/numeric/predicates.h"

namespace flipfree {
namespace {

using Mesh = EditableTriangulation;

double cross(const Vector2& a, const Vector2& b) { return a.x() * b.y() - a.y() * b.x(); }

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
        if (orientation(p, q, b) < 0 && orientation(a, b, p) <= 0 && orientation(a, b, q) >= 0)
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
      if (orientation(at(mesh_.source(h)), at(mesh_.target(h)), p) < 0) return false;
    }
    return true;
  }
  FaceId wedge(Index corner, const Vector2& a, const Vector2& b) const {
    FaceId found = kInvalid;
    mesh_.for_each_outgoing(corner, [&](HalfedgeId h) {
      if (found == kInvalid && orientation(a, at(mesh_.target(h)), b) >= 0 &&
          orientation(a, at(mesh_.apex(h)), b) <= 0)
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

Points2 carry(const RefinedSurface& surface, const Points2& uv, const TargetDomain& domain,
              const std::vector<Vector2>& from, const std::vector<Vector2>& to,
              const ExecutionContext& context) {
  const Mesh& target = domain.triangulation;
  const Locator locator(target, from);
  const auto count = static_cast<std::size_t>(uv.rows());
  std::vector<FaceId> found(count, kInvalid);
  std::vector<Index> corner(count, kInvalid);
  std::deque<VertexId> queue;
  Points2 result = uv;
  for (const Index d : domain.outline) {
    const VertexId v = domain.mesh_vertex[static_cast<std::size_t>(d)];
    corner[static_cast<std::size_t>(v)] = d;
    found[static_cast<std::size_t>(v)] = target.outgoing(d) / 3;
    result.row(v) = to[static_cast<std::size_t>(d)].transpose();
    queue.push_back(v);
  }
  for (std::size_t steps = 0; !queue.empty(); ++steps) {
    if (steps % 4096 == 0) context.check();
    const VertexId v = queue.front();
    queue.pop_front();
    const Vector2 a = uv.row(v).transpose();
    surface.mesh.for_each_outgoing(v, [&](HalfedgeId h) {
      const VertexId w = surface.mesh.target(h);
      FaceId& f = found[static_cast<std::size_t>(w)];
      if (f != kInvalid) return;
      const Vector2 b = uv.row(w).transpose();
      f = locator.walk(found[static_cast<std::size_t>(v)], corner[static_cast<std::size_t>(v)], a,
                       b);
      if (f == kInvalid) return;  // another neighbour may find it; else it stays where it is
      queue.push_back(w);
      const Mesh::Triangle t = target.corners(f);
      const auto place = [&](const std::vector<Vector2>& shape, std::size_t k) -> const Vector2& {
        return shape[static_cast<std::size_t>(t[k])];
      };
      const Vector2 e1 = place(from, 1) - place(from, 0);
      const Vector2 e2 = place(from, 2) - place(from, 0);
      const Vector2 d = b - place(from, 0);
      const double area = cross(e1, e2);
      if (!(area > 0)) return;
      const double w1 = cross(d, e2) / area;
      const double w2 = cross(e1, d) / area;
      result.row(w) =
          (place(to, 0) + w1 * (place(to, 1) - place(to, 0)) + w2 * (place(to, 2) - place(to, 0)))
              .transpose();
    });
  }
  return result;
}

}  // namespace flipfree
