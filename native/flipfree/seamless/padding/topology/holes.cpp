#include "flipfree/seamless/padding/topology/holes.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <map>
#include <queue>
#include <utility>

#include "flipfree/seamless/padding/paths/free_distances.h"

namespace flipfree::seamless {
namespace {

// The hole to go on to: the nearest one that is not in the chain yet and not kept for its end.
Index nearest(Index from, const std::vector<std::vector<std::pair<Index, double>>>& near,
              const std::vector<char>& used) {
  using Entry = std::pair<double, Index>;
  std::vector<double> distance(near.size(), std::numeric_limits<double>::infinity());
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
  distance[at(from)] = 0.0;
  queue.push({0.0, from});
  while (!queue.empty()) {
    const auto [so_far, hole] = queue.top();
    queue.pop();
    if (so_far > distance[at(hole)]) continue;
    if (used[at(hole)] == 0) return hole;
    for (const auto& [other, step] : near[at(hole)]) {
      if (so_far + step >= distance[at(other)]) continue;
      distance[at(other)] = so_far + step;
      queue.push({so_far + step, other});
    }
  }
  // Not joined to the others by any pair: any.
  return static_cast<Index>(std::find(used.begin(), used.end(), 0) - used.begin());
}

}  // namespace

Holes::Holes(const Canvas& canvas, std::vector<std::vector<VertexId>> loops)
    : canvas_(canvas),
      loops_(std::move(loops)),
      where_(at(canvas.vertex_count()), {kInvalid, kInvalid}) {
  for (std::size_t l = 0; l < loops_.size(); ++l) {
    for (std::size_t i = 0; i < loops_[l].size(); ++i)
      where_[at(loops_[l][i])] = {static_cast<Index>(l), static_cast<Index>(i)};
  }
}

Index Holes::loop_of(VertexId v) const {
  return at(v) < where_.size() ? where_[at(v)][0] : kInvalid;
}

VertexId Holes::neighbour(VertexId v, Index step) const {
  const std::vector<VertexId>& loop = loops_[at(where_[at(v)][0])];
  const auto n = static_cast<Index>(loop.size());
  return loop[at((where_[at(v)][1] + step + n) % n)];
}

std::vector<HalfedgeId> Holes::sectors_at(Index hole, VertexId v) const {
  const Index ahead = hole % 2 == 0 ? 1 : -1;
  const HalfedgeId first = canvas_.mesh().find(v, neighbour(v, ahead));
  const HalfedgeId last = canvas_.mesh().find(v, neighbour(v, -ahead));
  std::vector<HalfedgeId> sectors;
  for (HalfedgeId h = first; h != last; h = canvas_.mesh().rotate_ccw(h)) {
    if (canvas_.is_drawn(h)) sectors.push_back(h);
  }
  return sectors;
}

std::vector<HalfedgeId> Holes::open_sectors(Index hole) const {
  std::vector<HalfedgeId> sectors;
  for (const VertexId v : loops_[at(hole / 2)]) {
    if (is_open(v)) sectors.push_back(sectors_at(hole, v).front());
  }
  return sectors;
}

bool Holes::has(Index hole, HalfedgeId sector) const {
  const VertexId v = canvas_.mesh().source(sector);
  if (loop_of(v) != hole / 2) return false;
  const std::vector<HalfedgeId> sectors = sectors_at(hole, v);
  return std::find(sectors.begin(), sectors.end(), sector) != sectors.end();
}

Index Holes::hole_of(HalfedgeId sector) const {
  const Index left = 2 * loop_of(canvas_.mesh().source(sector));
  return has(left, sector) ? left : partner_of(left);
}

std::vector<HolePair> hole_neighbours(const Canvas& canvas, const Holes& holes,
                                      const ExecutionContext& context) {
  const mesh::EditableTriangulation& mesh = canvas.mesh();
  std::vector<HalfedgeId> first;
  for (Index hole = 0; hole < holes.count(); ++hole) {
    for (const HalfedgeId sector : holes.open_sectors(hole))
      canvas.for_each_inside(sector, [&](HalfedgeId h) { first.push_back(h); });
  }
  const auto [distance, arrival, order] = free_distances(canvas, first, kInvalid, context);
  std::vector<Index> nearest_hole(distance.size(), kInvalid);
  for (const VertexId v : order) {
    const VertexId before = mesh.source(arrival[at(v)]);
    nearest_hole[at(v)] = canvas.is_free(before) ? nearest_hole[at(before)]
                                                 : holes.hole_of(canvas.sector_of(arrival[at(v)]));
  }
  std::map<std::pair<Index, Index>, double> shortest;
  for (HalfedgeId h = 0; h < mesh.halfedge_slots(); ++h) {
    const VertexId v = mesh.source(h);
    const VertexId w = mesh.target(h);
    const Index a = nearest_hole[at(v)];
    const Index b = nearest_hole[at(w)];
    if (a == kInvalid || b == kInvalid || a >= b) continue;
    const double length = distance[at(v)] + canvas.length(h) + distance[at(w)];
    const auto [entry, is_new] = shortest.try_emplace({a, b}, length);
    entry->second = std::min(entry->second, length);
  }
  std::vector<HolePair> pairs;
  for (const auto& [ends, length] : shortest) pairs.push_back({ends.first, ends.second, length});
  return pairs;
}

std::vector<Index> hole_order(Index count, const std::vector<HolePair>& neighbours,
                              bool odd_couple) {
  std::vector<std::vector<std::pair<Index, double>>> near(at(count));
  for (const HolePair& pair : neighbours) {
    near[at(pair.a)].emplace_back(pair.b, pair.distance);
    near[at(pair.b)].emplace_back(pair.a, pair.distance);
  }
  std::vector<Index> order = {0};
  std::vector<char> used(at(count), 0);
  used[0] = used[at(partner_of(0))] = 1;
  while (order.size() + 1 < at(count)) {
    order.push_back(nearest(order.back(), near, used));
    used[at(order.back())] = 1;
  }
  order.push_back(partner_of(0));
  if (odd_couple && !has_odd_couple(order)) {
    // All partners have places of different parity: two neighbours that are no partners change
    // theirs.
    const std::size_t i = order[1] == partner_of(order[2]) ? 2 : 1;
    std::swap(order[i], order[i + 1]);
  }
  return order;
}

}  // namespace flipfree::seamless
