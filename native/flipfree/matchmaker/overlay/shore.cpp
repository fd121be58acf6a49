#include "flipfree/matchmaker/overlay/shore.h"

#include <algorithm>
#include <limits>

namespace flipfree::matchmaker {
namespace {

// A boundary vertex that is to mark the end of an arm's share lies within this part of the gap
// between two pins.
constexpr double kMiddle = 0.6;

}  // namespace

Shore::Shore(mesh::RefinedMap& map, const Vector2& centre) : map_(map), centre_(centre) {
  const VertexId first = map.surface.boundary.front();
  VertexId v = first;
  do {
    rim_.push_back({angle_at(v), v});
    v = next(v);
  } while (v != first);
  std::sort(rim_.begin(), rim_.end());
}

VertexId Shore::between(double from, double turn) {
  const double middle = std::remainder(from + 0.5 * turn, kTurn);
  const std::size_t after = first_after(middle);
  VertexId best = kInvalid;
  double nearest = 0.5 * kMiddle * turn;
  for (const std::size_t i : {after, after + rim_.size() - 1}) {
    const auto& [angle, v] = rim_[i % rim_.size()];
    const double off = std::abs(turn_from(from, angle) - 0.5 * turn);
    if (off >= nearest) continue;
    nearest = off;
    best = v;
  }
  return best != kInvalid ? best : split_at(middle);
}

std::vector<VertexId> Shore::inside(VertexId from, VertexId to, std::size_t count) {
  while (true) {
    std::vector<VertexId> chain = {from};
    while (chain.back() != to) chain.push_back(next(chain.back()));
    if (chain.size() >= count + 2) return {chain.begin() + 1, chain.end() - 1};
    std::size_t longest = 0;
    for (std::size_t i = 1; i + 1 < chain.size(); ++i) {
      if (length(chain[i]) > length(chain[longest])) longest = i;
    }
    if (split(chain[longest], 0.5) == kInvalid) return {};
  }
}

VertexId Shore::next(VertexId v) const {
  const mesh::EditableTriangulation& mesh = map_.surface.mesh;
  return mesh.target(mesh.outgoing(v));
}

std::size_t Shore::first_after(double angle) const {
  const auto after = std::upper_bound(rim_.begin(), rim_.end(),
                                      std::pair(angle, std::numeric_limits<VertexId>::max()));
  return static_cast<std::size_t>(after - rim_.begin());
}

// Where the ray in this direction meets the boundary.
VertexId Shore::split_at(double angle) {
  const VertexId v = rim_[(first_after(angle) + rim_.size() - 1) % rim_.size()].second;
  const Vector2 ray(std::cos(angle), std::sin(angle));
  const Vector2 a = place(v) - centre_;
  const Vector2 b = place(next(v)) - centre_;
  const double left = cross(ray, b);
  const double right = cross(a, ray);
  return split(v, right / (right + left));
}

// Splits the boundary edge that leaves v.
VertexId Shore::split(VertexId v, double share) {
  if (!(share > 0 && share < 1)) return kInvalid;
  mesh::RefinedSurface& surface = map_.surface;
  const HalfedgeId h = surface.mesh.outgoing(v);
  const VertexId w = surface.mesh.target(h);
  const mesh::Support where =
      mesh::rounded_between(surface.support[at(v)], surface.support[at(w)], share);
  const mesh::Support& apex = surface.support[at(surface.mesh.apex(h))];
  const FaceId parent = surface.mesh.parent(h / 3);
  if (surface.orientation_in_parent(parent, surface.support[at(v)], where, apex) <= 0 ||
      surface.orientation_in_parent(parent, where, surface.support[at(w)], apex) <= 0)
    return kInvalid;
  const Vector2 p = (1 - share) * place(v) + share * place(w);
  const VertexId fresh = surface.split_edge(h, where);
  map_.uv.conservativeResize(map_.uv.rows() + 1, 2);
  map_.uv.row(fresh) = p.transpose();
  const std::pair seen(angle_at(fresh), fresh);
  rim_.insert(std::upper_bound(rim_.begin(), rim_.end(), seen), seen);
  return fresh;
}

}  // namespace flipfree::matchmaker
