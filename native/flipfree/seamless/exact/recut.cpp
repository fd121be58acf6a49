#include "flipfree/seamless/exact/recut.h"

#include <cmath>
#include <cstddef>
#include <numbers>

#include "flipfree/base/plane.h"
#include "flipfree/mesh/cut_graph/map_cut.h"
#include "flipfree/seamless/seams.h"

namespace flipfree::seamless {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

// p -> p turned by quarters + shift.
struct Motion {
  Index turns = 0;
  Vector2 shift = Vector2::Zero();

  Vector2 operator()(const Vector2& p) const { return quarter_turned(p, turns) + shift; }
  Motion after(const Motion& first) const {
    return {(turns + first.turns) % 4, (*this)(first.shift)};
  }
  Motion inverse() const {
    const Index back = (4 - turns) % 4;
    return {back, -quarter_turned(shift, back)};
  }
};

// From the chart on the other side of half-edge h to the chart on its own.
Motion across(const Points2& uv, HalfedgeId h, HalfedgeId o) {
  const Vector2 source = uv.row(h), target = uv.row(next_corner(h));
  const Vector2 other_source = uv.row(next_corner(o)), other_target = uv.row(o);
  const double angle = turn(other_target - other_source, target - source);
  Motion motion;
  motion.turns = static_cast<Index>(std::lround(angle / (0.5 * std::numbers::pi)) & 3);
  motion.shift =
      0.5 * (source + target) - quarter_turned(0.5 * (other_source + other_target), motion.turns);
  return motion;
}

// What the refined faces of one parent are moved by to lie in the frame of the first of them.
std::vector<Motion> to_parents(const mesh::Adjacency& adjacency,
                               const std::vector<FaceId>& parent_face, const Points2& uv) {
  std::vector<Motion> motion(parent_face.size());
  std::vector<char> known(parent_face.size(), 0);
  std::vector<FaceId> queue;
  for (FaceId first = 0; at(first) < known.size(); ++first) {
    if (known[at(first)] != 0) continue;
    known[at(first)] = 1;
    queue.assign(1, first);
    for (std::size_t i = 0; i < queue.size(); ++i) {
      for (HalfedgeId h = 3 * queue[i]; h < 3 * queue[i] + 3; ++h) {
        const HalfedgeId o = adjacency.opposite[at(h)];
        if (known[at(o / 3)] != 0 || parent_face[at(o / 3)] != parent_face[at(first)]) continue;
        known[at(o / 3)] = 1;
        motion[at(o / 3)] = motion[at(h / 3)].after(across(uv, h, o));
        queue.push_back(o / 3);
      }
    }
  }
  return motion;
}

// What the input's faces are moved by to be laid out together, cut along `cuts`. `link`: per
// half-edge, from the frame on the other side to the one on its own.
std::vector<Motion> laid_out(const mesh::Adjacency& adjacency, const mesh::EdgeFlags& cuts,
                             const std::vector<Motion>& link) {
  std::vector<Motion> motion(link.size() / 3);
  std::vector<char> known(motion.size(), 0);
  std::vector<FaceId> queue;
  for (FaceId first = 0; at(first) < known.size(); ++first) {
    if (known[at(first)] != 0) continue;
    known[at(first)] = 1;
    queue.assign(1, first);
    for (std::size_t i = 0; i < queue.size(); ++i) {
      for (HalfedgeId h = 3 * queue[i]; h < 3 * queue[i] + 3; ++h) {
        const HalfedgeId o = adjacency.opposite[at(h)];
        if (cuts[at(h)] != 0 || known[at(o / 3)] != 0) continue;
        known[at(o / 3)] = 1;
        motion[at(o / 3)] = motion[at(h / 3)].after(link[at(h)]);
        queue.push_back(o / 3);
      }
    }
  }
  return motion;
}

}  // namespace

certify::Parametrization on_own_triangles(const mesh::Surface& input,
                                          const mesh::Adjacency& adjacency,
                                          const std::vector<VertexId>& cones,
                                          const mesh::EdgeFlags& avoided,
                                          const certify::Parametrization& map,
                                          const ExecutionContext& context) {
  const mesh::Adjacency refined =
      mesh::build_adjacency(static_cast<Index>(map.surface.vertices.rows()), map.surface.faces);
  const std::vector<Motion> to_parent = to_parents(refined, map.parent_face, map.uv);
  certify::Parametrization own;
  own.surface = input;
  own.uv.resize(3 * input.faces.rows(), 2);
  std::vector<Motion> link(static_cast<std::size_t>(3 * input.faces.rows()));
  for (CornerId c = 0; c < static_cast<CornerId>(map.uv.rows()); ++c) {
    const VertexId v = map.surface.faces(c / 3, c % 3);
    if (v >= static_cast<VertexId>(input.vertices.rows())) continue;
    const FaceId parent = map.parent_face[at(c / 3)];
    int k = 0;
    while (input.faces(parent, k) != v) ++k;
    own.uv.row(3 * parent + k) = to_parent[at(c / 3)](map.uv.row(c).transpose()).transpose();
    // Of the half-edges from v with the parent on their left, the one with another on its right
    // runs along the parent's own.
    const HalfedgeId o = refined.opposite[at(c)];
    if (map.parent_face[at(o / 3)] == parent) continue;
    link[at(3 * parent + k)] =
        to_parent[at(c / 3)].after(across(map.uv, c, o)).after(to_parent[at(o / 3)].inverse());
  }
  const mesh::EdgeFlags none(adjacency.opposite.size(), 0);
  const mesh::EdgeFlags cuts = mesh::cut_to_disks(input, adjacency, none, cones, avoided, context);
  const std::vector<Motion> motion = laid_out(adjacency, cuts, link);
  for (CornerId c = 0; c < static_cast<CornerId>(own.uv.rows()); ++c)
    own.uv.row(c) = motion[at(c / 3)](own.uv.row(c).transpose()).transpose();
  own.cut_edges = mesh::flagged_edges(input.faces, adjacency, cuts);
  certify::set_identity_provenance(own);
  return own;
}

}  // namespace flipfree::seamless
