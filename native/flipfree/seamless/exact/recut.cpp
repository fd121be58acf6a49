#include "flipfree/seamless/exact/recut.h"

#include <cmath>
#include <cstddef>
#include <numbers>

#include "flipfree/base/plane.h"
#include "flipfree/mesh/cut_graph/map_cut.h"
#include "flipfree/seamless/seams.h"

namespace flipfree::seamless {
namespace {

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

// What each face is moved by to lie in the frame of the first of those that it is joined with, over
// the half-edges h where joined(h, its opposite); link(h, its opposite): from the frame on the
// other side to the one on its own.
template <class Joined, class Link>
std::vector<Motion> laid_out(const mesh::Adjacency& adjacency, Joined joined, Link link) {
  std::vector<Motion> motion(adjacency.opposite.size() / 3);
  std::vector<char> known(motion.size(), 0);
  std::vector<FaceId> queue;
  for (FaceId first = 0; at(first) < known.size(); ++first) {
    if (known[at(first)] != 0) continue;
    known[at(first)] = 1;
    queue.assign(1, first);
    for (std::size_t i = 0; i < queue.size(); ++i) {
      for (HalfedgeId h = 3 * queue[i]; h < 3 * queue[i] + 3; ++h) {
        const HalfedgeId o = adjacency.opposite[at(h)];
        if (!joined(h, o) || known[at(o / 3)] != 0) continue;
        known[at(o / 3)] = 1;
        motion[at(o / 3)] = motion[at(h / 3)].after(link(h, o));
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
  const auto one_parent = [&](HalfedgeId h, HalfedgeId o) {
    return map.parent_face[at(h / 3)] == map.parent_face[at(o / 3)];
  };
  const std::vector<Motion> to_parent = laid_out(
      refined, one_parent, [&](HalfedgeId h, HalfedgeId o) { return across(map.uv, h, o); });
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
  const auto uncut = [&](HalfedgeId h, HalfedgeId) { return cuts[at(h)] == 0; };
  const std::vector<Motion> motion =
      laid_out(adjacency, uncut, [&](HalfedgeId h, HalfedgeId) { return link[at(h)]; });
  for (CornerId c = 0; c < static_cast<CornerId>(own.uv.rows()); ++c)
    own.uv.row(c) = motion[at(c / 3)](own.uv.row(c).transpose()).transpose();
  own.cut_edges = mesh::flagged_edges(input.faces, adjacency, cuts);
  certify::set_identity_provenance(own);
  return own;
}

}  // namespace flipfree::seamless
