#include "flipfree/matchmaker/start/compose.h"

#include <array>
#include <cstddef>
#include <deque>

#include "flipfree/base/error.h"
#include "flipfree/base/plane.h"
#include "flipfree/embedding/embed.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

using Mesh = mesh::EditableTriangulation;

// Finds the triangle that contains a point, walking from one found before.
class Locator {
 public:
  Locator(const Mesh& mesh, const std::vector<Vector2>& place) : mesh_(mesh), place_(place) {}

  FaceId find(const Vector2& p, FaceId start) const {
    FaceId f = start;
    FaceId from = kInvalid;
    for (Index steps = 0; steps < mesh_.face_slots(); ++steps) {
      FaceId next = kInvalid;
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
        if (mesh_.is_boundary(h) || mesh_.opposite(h) / 3 == from) continue;
        if (side(h, p) < 0) next = mesh_.opposite(h) / 3;
      }
      if (next == kInvalid) break;
      from = f;
      f = next;
    }
    if (contains(f, p)) return f;
    // The point lies outside by rounding, or the walk went astray: take the face that misses it
    // least.
    for (FaceId g = 0; g < mesh_.face_slots(); ++g) {
      if (mesh_.alive(g) && contains(g, p)) return g;
    }
    return f;
  }

 private:
  int side(HalfedgeId h, const Vector2& p) const {
    return numeric::orientation(place_[static_cast<std::size_t>(mesh_.source(h))],
                                place_[static_cast<std::size_t>(mesh_.target(h))], p);
  }
  bool contains(FaceId f, const Vector2& p) const {
    return side(3 * f, p) >= 0 && side(3 * f + 1, p) >= 0 && side(3 * f + 2, p) >= 0;
  }
  const Mesh& mesh_;
  const std::vector<Vector2>& place_;
};

}  // namespace

Points2 compose_through_disk(const mesh::RefinedSurface& surface, const TargetDomain& domain,
                             ExecutionContext& context, Stats& stats) {
  const std::size_t n = domain.outline.size();
  std::vector<VertexId> loop;
  std::vector<double> lengths;
  for (std::size_t i = 0; i < n; ++i) {
    loop.push_back(domain.mesh_vertex[static_cast<std::size_t>(domain.outline[i])]);
    lengths.push_back((domain.point[static_cast<std::size_t>(domain.outline[(i + 1) % n])] -
                       domain.point[static_cast<std::size_t>(domain.outline[i])])
                          .norm());
  }
  const Points2 circle =
      embedding::place_boundary(embedding::BoundaryShape::kCircle, lengths).positions;
  std::vector<Vector2> place(domain.point.size());
  for (std::size_t i = 0; i < n; ++i) {
    place[static_cast<std::size_t>(domain.outline[i])] =
        circle.row(static_cast<Eigen::Index>(i)).transpose();
  }
  embedding::EmbedOptions options;
  options.float32 = false;
  const Points2 disk = embedding::embed_disk(surface.mesh.faces(), surface.mesh.vertex_count(),
                                             loop, circle, options, context, stats);

  Points2 uv = Points2::Zero(disk.rows(), 2);
  const Locator locator(domain.triangulation, place);
  std::vector<FaceId> found(static_cast<std::size_t>(disk.rows()), kInvalid);
  std::deque<VertexId> queue;
  for (std::size_t i = 0; i < n; ++i) {
    uv.row(loop[i]) = domain.point[static_cast<std::size_t>(domain.outline[i])].transpose();
    found[static_cast<std::size_t>(loop[i])] = domain.triangulation.outgoing(domain.outline[i]) / 3;
    queue.push_back(loop[i]);
  }
  // The affine piece of the target's map in domain face f, at place p of the disk.
  const auto piece = [&](FaceId f, const Vector2& p) -> Vector2 {
    const Mesh::Triangle t = domain.triangulation.corners(f);
    std::array<Vector2, 3> from;
    std::array<Vector2, 3> to;
    for (std::size_t k = 0; k < 3; ++k) {
      from[k] = place[static_cast<std::size_t>(t[k])];
      to[k] = domain.point[static_cast<std::size_t>(t[k])];
    }
    const double area = cross(from[1] - from[0], from[2] - from[0]);
    const double b1 = cross(p - from[0], from[2] - from[0]) / area;
    const double b2 = cross(from[1] - from[0], p - from[0]) / area;
    return to[0] + b1 * (to[1] - to[0]) + b2 * (to[2] - to[0]);
  };
  // Breadth first from the boundary: every vertex starts its walk where a neighbour ended.
  while (!queue.empty()) {
    const VertexId v = queue.front();
    queue.pop_front();
    surface.mesh.for_each_outgoing(v, [&](HalfedgeId h) {
      const VertexId w = surface.mesh.target(h);
      if (found[static_cast<std::size_t>(w)] != kInvalid) return;
      const Vector2 p = disk.row(w).transpose();
      const FaceId f = locator.find(p, found[static_cast<std::size_t>(v)]);
      found[static_cast<std::size_t>(w)] = f;
      queue.push_back(w);
      uv.row(w) = piece(f, p).transpose();
    });
  }
  return uv;
}

}  // namespace flipfree::matchmaker
