#include "flipfree/unwrap/chart/join_pieces.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <queue>

namespace flipfree::unwrap {
namespace {

std::size_t size(Index i) { return static_cast<std::size_t>(i); }

}  // namespace

void join_pieces(const JoinCosts& costs, const mesh::Adjacency& adjacency,
                 const mesh::Components& pieces, const std::vector<FacePair>& overlapping,
                 mesh::EdgeFlags& cut) {
  const std::vector<double>& face_area = costs.face_area;
  const double tolerated = costs.tolerated;
  std::vector<Index> parent(size(pieces.count));
  std::iota(parent.begin(), parent.end(), Index{0});
  const auto root = [&](Index piece) {
    while (parent[size(piece)] != piece)
      piece = parent[size(piece)] = parent[size(parent[size(piece)])];
    return piece;
  };
  std::vector<std::map<Index, double>> on_top(parent.size());  // area shared with each other piece
  std::vector<double> own(parent.size(), 0.0);                 // area that overlaps within
  std::vector<double> area(parent.size(), 0.0);
  for (std::size_t f = 0; f < face_area.size(); ++f) area[size(pieces.of_face[f])] += face_area[f];
  for (const FacePair& pair : overlapping) {
    const Index a = pieces.of_face[size(pair.first)];
    const Index b = pieces.of_face[size(pair.second)];
    if (a == b) {
      own[size(a)] += pair.area;
      continue;
    }
    on_top[size(a)][b] += pair.area;
    on_top[size(b)][a] += pair.area;
  }
  const auto may_join = [&](Index a, Index b) {
    const auto found = on_top[size(a)].find(b);
    if (found == on_top[size(a)].end() && own[size(a)] + own[size(b)] == 0) return true;
    const double shared = found == on_top[size(a)].end() ? 0.0 : found->second;
    return own[size(a)] + own[size(b)] + shared <= tolerated * (area[size(a)] + area[size(b)]) &&
           (tolerated > 0 || shared == 0);
  };
  std::vector<std::map<Index, double>> beside(parent.size());  // cost of the cut to each neighbour
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut.size()); ++h) {
    if (!cut[size(h)]) continue;
    const Index a = pieces.of_face[size(h / 3)];
    const Index b = pieces.of_face[size(adjacency.opposite[size(h)] / 3)];
    beside[size(a)][b] += costs.edge[size(h)];
  }
  struct Join {
    double cost;
    Index a, b;
    bool operator<(const Join& other) const {
      return cost != other.cost ? cost < other.cost : a != other.a ? a > other.a : b > other.b;
    }
  };
  std::priority_queue<Join> queue;
  const auto offer = [&](Index a, Index b) {
    if (may_join(a, b)) queue.push({beside[size(a)].at(b), std::min(a, b), std::max(a, b)});
  };
  for (Index a = 0; a < pieces.count; ++a) {
    for (const auto& [b, cost] : beside[size(a)]) {
      if (a < b) offer(a, b);
    }
  }
  while (!queue.empty()) {
    const Join next = queue.top();
    queue.pop();
    // Entries of pieces that have been joined, or whose common cut has grown, are out of date.
    if (root(next.a) != next.a || root(next.b) != next.b || !may_join(next.a, next.b) ||
        beside[size(next.a)].at(next.b) != next.cost)
      continue;
    const Index a = next.a;
    const Index b = next.b;
    parent[size(b)] = a;
    own[size(a)] += own[size(b)];
    area[size(a)] += area[size(b)];
    for (const auto& [c, shared] : on_top[size(b)]) {
      if (c == a) {
        own[size(a)] += shared;
        continue;
      }
      on_top[size(c)].erase(b);
      on_top[size(c)][a] = on_top[size(a)][c] += shared;
    }
    on_top[size(a)].erase(b);
    beside[size(a)].erase(b);
    for (const auto& [c, cost] : beside[size(b)]) {
      if (c == a) continue;
      beside[size(c)].erase(b);
      beside[size(c)][a] = beside[size(a)][c] += cost;
    }
    for (const auto& [c, cost] : beside[size(a)]) offer(a, c);
  }
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut.size()); ++h) {
    if (!cut[size(h)]) continue;
    const HalfedgeId o = adjacency.opposite[size(h)];
    if (root(pieces.of_face[size(h / 3)]) == root(pieces.of_face[size(o / 3)]))
      cut[size(h)] = cut[size(o)] = 0;
  }
}

}  // namespace flipfree::unwrap
