#include "flipfree/seamless/padding/reroute/loop_turns.h"

#include <algorithm>
#include <cstddef>

#include "flipfree/base/error.h"

namespace flipfree::seamless {

Index turn_to_come(const BranchGraph& graph, const BranchLoop& loop, const Ending& ending) {
  const auto corners = [&](Index sector) {
    const auto& divided = ending.divided;
    return std::find(divided.begin(), divided.end(), sector) == divided.end() ? 1 : 2;
  };
  Index turn = 0;
  for (std::size_t i = 0; i < loop.size(); ++i) {
    if (loop[i] == ending.bent) --turn;
    if ((loop[i] ^ 1) == ending.bent) ++turn;
    const Index arrival = loop[i] ^ 1;
    turn += 2;
    for (Index end = loop[(i + 1) % loop.size()]; end != arrival; end = graph.next_end[at(end)])
      turn -= corners(end);
  }
  return turn;
}

intrinsic::DualLoop strip_on_input(const Canvas& canvas, const mesh::Adjacency& input_adjacency,
                                   const std::vector<VertexId>& cycle) {
  intrinsic::DualLoop strip;
  const auto cross = [&](HalfedgeId h) {
    const HalfedgeId side = canvas.input_side(h);
    if (side == kInvalid) return;
    if (!strip.empty() && strip.back() == input_adjacency.opposite[at(side)]) {
      strip.pop_back();
    } else {
      strip.push_back(side);
    }
  };
  const std::size_t n = cycle.size();
  for (std::size_t i = 0; i < n; ++i) {
    const VertexId v = cycle[i];
    const HalfedgeId out = canvas.mesh().find(v, cycle[(i + 1) % n]);
    HalfedgeId h = next_corner(canvas.mesh().find(cycle[(i + n - 1) % n], v));
    for (; h != out; h = next_corner(canvas.mesh().opposite(h))) cross(h);
  }
  std::size_t first = 0;
  while (first + 1 < strip.size() && strip[first] == input_adjacency.opposite[at(strip.back())]) {
    strip.pop_back();
    ++first;
  }
  strip.erase(strip.begin(), strip.begin() + static_cast<std::ptrdiff_t>(first));
  if (strip.empty()) throw InternalError("a loop of the cut that shrinks to a point");
  return strip;
}

intrinsic::DualLoop strip_on_input(const Canvas& canvas, const mesh::Adjacency& input_adjacency,
                                   const BranchGraph& graph, const BranchLoop& loop) {
  std::vector<VertexId> vertices;
  for (const Index end : loop) {
    const std::vector<VertexId> branch = graph.walked_from(end);
    vertices.insert(vertices.end(), branch.begin(), branch.end() - 1);
  }
  return strip_on_input(canvas, input_adjacency, vertices);
}

}  // namespace flipfree::seamless
