#include "flipfree/field/prescribed/simplify.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <unordered_map>
#include <utility>
#include <vector>

#include "flipfree/field/prescribed/prescribed.h"
#include "flipfree/field/topology/weights.h"

namespace flipfree::field {
namespace {

// Share of the square root of the area at which a vertex takes a part of a sharp cone, and how many
// times farther one is looked for that has too many quarter turns.
constexpr double kSpread = 0.05;
constexpr double kFarther = 4.0;

class Mover {
 public:
  Mover(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
        const std::vector<char>& held, const ExecutionContext& context)
      : surface_(surface), adjacency_(adjacency), held_(held), context_(context) {
    on_boundary_.assign(adjacency.vertex_halfedge.size(), 0);
    for (HalfedgeId h = 0; at(h) < adjacency.opposite.size(); ++h) {
      if (adjacency.opposite[at(h)] == kInvalid)
        on_boundary_[at(mesh::source(surface.faces, h))] =
            on_boundary_[at(mesh::target(surface.faces, h))] = 1;
    }
  }

  bool is_inside(VertexId v) const {
    return on_boundary_[at(v)] == 0 && adjacency_.vertex_halfedge[at(v)] != kInvalid;
  }

  struct Found {
    double distance = 0.0;
    std::vector<HalfedgeId> path;  // from the start to it; empty: nothing was found
  };
  // The nearest vertex that is wanted, up to `most` away.
  Found nearest(VertexId from, double most,
                const std::function<bool(VertexId, double)>& wanted) const {
    std::unordered_map<VertexId, std::pair<double, HalfedgeId>> reached;
    using Entry = std::pair<double, VertexId>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    reached[from] = {0.0, kInvalid};
    queue.push({0.0, from});
    std::size_t done = 0;
    while (!queue.empty()) {
      const auto [distance, v] = queue.top();
      queue.pop();
      if (distance > reached[v].first) continue;
      if (++done % 1024 == 0) context_.check();
      if (v != from && wanted(v, distance)) return {distance, path_to(reached, v)};
      const HalfedgeId first = adjacency_.vertex_halfedge[at(v)];
      HalfedgeId h = first;
      do {
        const VertexId w = mesh::target(surface_.faces, h);
        const double further =
            distance + (surface_.vertices.row(w) - surface_.vertices.row(v)).norm();
        const auto known = reached.find(w);
        if (further <= most && is_open(h) && is_inside(w) &&
            (known == reached.end() || further < known->second.first)) {
          reached[w] = {further, h};
          queue.push({further, w});
        }
        h = mesh::rotate_ccw(adjacency_, h);
      } while (h != first);
    }
    return {};
  }

 private:
  bool is_open(HalfedgeId h) const {
    return held_[at(h / 3)] == 0 || held_[at(adjacency_.opposite[at(h)] / 3)] == 0;
  }
  std::vector<HalfedgeId> path_to(
      const std::unordered_map<VertexId, std::pair<double, HalfedgeId>>& reached,
      VertexId v) const {
    std::vector<HalfedgeId> path;
    for (HalfedgeId h = reached.at(v).second; h != kInvalid;
         h = reached.at(mesh::source(surface_.faces, h)).second)
      path.push_back(h);
    std::reverse(path.begin(), path.end());
    return path;
  }

  const mesh::Surface& surface_;
  const mesh::Adjacency& adjacency_;
  const std::vector<char>& held_;
  const ExecutionContext& context_;
  std::vector<char> on_boundary_;
};

}  // namespace

Simplified simplify(const mesh::Surface& surface, const mesh::Adjacency& adjacency,
                    const Frames& frames, const std::vector<char>& held,
                    const SimplifyOptions& options, CrossField& field, ExecutionContext& context) {
  std::vector<Index> cones = cone_turns(surface.faces, adjacency, frames, field);
  const Mover mover(surface, adjacency, held, context);
  const double extent = extent_of(surface);
  const double reach = options.reach * extent;
  const double spread = kSpread * extent;
  Simplified result;
  // From one that has too many quarter turns to one that has too few.
  const auto move = [&](VertexId from, VertexId to, const std::vector<HalfedgeId>& path) {
    add_along(adjacency, path, 1, field);
    --cones[at(from)];
    ++cones[at(to)];
  };
  const auto end_of = [&](const Mover::Found& found) {
    return mesh::target(surface.faces, found.path.back());
  };
  // Nearest pairs first. Each move brings two cones nearer to 4, so there is an end; what was found
  // before its partner was used up is looked for anew.
  const auto partner = [&](VertexId v) {
    return mover.nearest(v, reach, [&](VertexId w, double) { return cones[at(w)] < 4; });
  };
  struct Pair {
    double distance;
    VertexId from;
    std::vector<HalfedgeId> path;
    bool operator<(const Pair& other) const {
      return distance != other.distance ? distance > other.distance : from > other.from;
    }
  };
  std::priority_queue<Pair> pairs;
  const auto look = [&](VertexId v) {
    context.check();
    Mover::Found found = partner(v);
    if (!found.path.empty()) pairs.push({found.distance, v, std::move(found.path)});
  };
  for (VertexId v = 0; reach > 0.0 && at(v) < cones.size(); ++v) {
    if (cones[at(v)] > 4 && mover.is_inside(v)) look(v);
  }
  while (!pairs.empty()) {
    const Pair pair = pairs.top();
    pairs.pop();
    const VertexId to = mesh::target(surface.faces, pair.path.back());
    if (cones[at(to)] < 4) {
      move(pair.from, to, pair.path);
      ++result.cancelled;
    }
    if (cones[at(pair.from)] > 4) look(pair.from);
  }
  for (VertexId v = 0; at(v) < cones.size(); ++v) {
    while (cones[at(v)] < options.least_turns && mover.is_inside(v)) {
      context.check();
      // A cone that has too many, else a regular vertex at some distance; three are left there.
      Mover::Found found =
          mover.nearest(v, kFarther * spread, [&](VertexId w, double) { return cones[at(w)] > 4; });
      const bool regular = found.path.empty();
      for (double least = spread; found.path.empty() && least > 1e-3 * spread; least *= 0.5) {
        found = mover.nearest(v, kFarther * spread, [&](VertexId w, double distance) {
          return cones[at(w)] == 4 && distance >= least;
        });
      }
      // On coarse meshes there is none so near.
      if (found.path.empty()) {
        found = mover.nearest(v, std::numeric_limits<double>::infinity(),
                              [&](VertexId w, double) { return cones[at(w)] >= 4; });
      }
      if (found.path.empty()) break;
      std::vector<HalfedgeId> back(found.path.rbegin(), found.path.rend());
      for (HalfedgeId& h : back) h = adjacency.opposite[at(h)];
      move(end_of(found), v, back);
      ++(regular ? result.spread : result.cancelled);
    }
  }
  if (result.cancelled + result.spread > 0) {
    const AngleSystem system(surface, adjacency, held, std::vector<double>(held.size(), 0.0),
                             context);
    relax(adjacency, frames, system, field, context);
  }
  return result;
}

}  // namespace flipfree::field
