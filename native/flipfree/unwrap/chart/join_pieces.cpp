#include "flipfree/unwrap/chart/join_pieces.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <queue>

namespace flipfree::unwrap {
void join_pieces(const JoinCosts& costs, const mesh::Adjacency& adjacency,
                 const mesh::Components& pieces, const std::vector<FacePair>& overlapping,
                 mesh::EdgeFlags& cut) {
  const std::vector<double>& face_area = costs.face_area;
  const double tolerated = costs.tolerated;
  std::vector<Index> parent(at(pieces.count));
  std::iota(parent.begin(), parent.end(), Index{0});
  const auto root = [&](Index piece) {
    while (parent[at(piece)] != piece) piece = parent[at(piece)] = parent[at(parent[at(piece)])];
    return piece;
  };
  std::vector<std::map<Index, double>> on_top(parent.size());  // area shared with each other piece
  std::vector<double> own(parent.size(), 0.0);                 // area that overlaps within
  std::vector<double> area(parent.size(), 0.0);
  for (std::size_t f = 0; f < face_area.size(); ++f) area[at(pieces.of_face[f])] += face_area[f];
  for (const FacePair& pair : overlapping) {
    const Index a = pieces.of_face[at(pair.first)];
    const Index b = pieces.of_face[at(pair.second)];
    if (a == b) {
      own[at(a)] += pair.area;
      continue;
    }
    on_top[at(a)][b] += pair.area;
    on_top[at(b)][a] += pair.area;
  }
  const auto may_join = [&](Index a, Index b) {
    const auto found = on_top[at(a)].find(b);
    if (found == on_top[at(a)].end() && own[at(a)] + own[at(b)] == 0) return true;
    const double shared = found == on_top[at(a)].end() ? 0.0 : found->second;
    return own[at(a)] + own[at(b)] + shared <= tolerated * (area[at(a)] + area[at(b)]) &&
           (tolerated > 0 || shared == 0);
  };
  std::vector<std::map<Index, double>> beside(parent.size());  // cost of the cut to each neighbour
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut.size()); ++h) {
    if (!cut[at(h)]) continue;
    const Index a = pieces.of_face[at(h / 3)];
    const Index b = pieces.of_face[at(adjacency.opposite[at(h)] / 3)];
    beside[at(a)][b] += costs.edge[at(h)];
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
    if (may_join(a, b)) queue.push({beside[at(a)].at(b), std::min(a, b), std::max(a, b)});
  };
  for (Index a = 0; a < pieces.count; ++a) {
    for (const auto& [b, cost] : beside[at(a)]) {
      if (a < b) offer(a, b);
    }
  }
  while (!queue.empty()) {
    const Join next = queue.top();
    queue.pop();
    // Entries of pieces that have been joined, or whose common cut has grown, are out of date.
    if (root(next.a) != next.a || root(next.b) != next.b || !may_join(next.a, next.b) ||
        beside[at(next.a)].at(next.b) != next.cost)
      continue;
    const Index a = next.a;
    const Index b = next.b;
    parent[at(b)] = a;
    own[at(a)] += own[at(b)];
    area[at(a)] += area[at(b)];
    for (const auto& [c, shared] : on_top[at(b)]) {
      if (c == a) {
        own[at(a)] += shared;
        continue;
      }
      on_top[at(c)].erase(b);
      on_top[at(c)][a] = on_top[at(a)][c] += shared;
    }
    on_top[at(a)].erase(b);
    beside[at(a)].erase(b);
    for (const auto& [c, cost] : beside[at(b)]) {
      if (c == a) continue;
      beside[at(c)].erase(b);
      beside[at(c)][a] = beside[at(a)][c] += cost;
    }
    for (const auto& [c, cost] : beside[at(a)]) offer(a, c);
  }
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut.size()); ++h) {
    if (!cut[at(h)]) continue;
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (root(pieces.of_face[at(h / 3)]) == root(pieces.of_face[at(o / 3)]))
      cut[at(h)] = cut[at(o)] = 0;
  }
}

}  // namespace flipfree::unwrap
