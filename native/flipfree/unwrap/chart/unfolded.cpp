#include "flipfree/unwrap/chart/unfolded.h"

#include <Eigen/Geometry>
#include <vector>

#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/topology.h"

namespace flipfree::unwrap {

Points2 unfolded(const mesh::Surface& chart, const ExecutionContext& context) {
  const auto count = static_cast<Index>(chart.vertices.rows());
  const mesh::Adjacency adjacency = mesh::build_adjacency(count, chart.faces);
  Points2 uv = Points2::Zero(count, 2);
  std::vector<char> placed(at(count), 0);
  Index left = count;
  const auto place = [&](VertexId v, const Vector2& p) {
    if (placed[at(v)] != 0) return;
    uv.row(v) = p.transpose();
    placed[at(v)] = 1;
    --left;
  };
  const auto place_of = [&](VertexId v) -> Vector3 { return chart.vertices.row(v).transpose(); };
  if (chart.faces.rows() == 0) return Points2(0, 2);
  place(chart.faces(0, 0), Vector2::Zero());
  place(chart.faces(0, 1),
        Vector2((place_of(chart.faces(0, 1)) - place_of(chart.faces(0, 0))).norm(), 0.0));
  std::vector<char> seen(at(static_cast<Index>(chart.faces.rows())), 0);
  std::vector<HalfedgeId> queue{0};  // of faces that are next, the side whose ends have places
  seen[0] = 1;
  for (std::size_t i = 0; i < queue.size(); ++i) {
    if (i % 65536 == 0) context.check();
    const HalfedgeId h = queue[i];
    const VertexId a = mesh::source(chart.faces, h);
    const VertexId b = mesh::target(chart.faces, h);
    const CornerId apex = previous_corner(h);
    const VertexId c = chart.faces(apex / 3, apex % 3);
    const Vector3 side = place_of(b) - place_of(a);
    const Vector3 other = place_of(c) - place_of(a);
    // On the unfolded side, however long that is by now: the direction counts.
    const Vector2 along = (uv.row(b) - uv.row(a)).transpose().normalized();
    const double length = side.norm();
    place(c, uv.row(a).transpose() + along * (side.dot(other) / length) +
                 Vector2(-along.y(), along.x()) * (side.cross(other).norm() / length));
    for (Index k = 0; k < 3; ++k) {
      const HalfedgeId o = adjacency.opposite[at(3 * (h / 3) + k)];
      if (o == kInvalid || seen[at(o / 3)] != 0) continue;
      seen[at(o / 3)] = 1;
      queue.push_back(o);
    }
  }
  return left == 0 ? uv : Points2(0, 2);
}

}  // namespace flipfree::unwrap
