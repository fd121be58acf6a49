#include "flipfree/unwrap/chart/separate.h"

#include <CGAL/box_intersection_d.h>
#include <boost/graph/boykov_kolmogorov_max_flow.hpp>
#include <boost/graph/compressed_sparse_row_graph.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <numeric>
#include <queue>
#include <set>
#include <tuple>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/plane.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/numeric/dense_factors.h"
#include "flipfree/numeric/predicates.h"
#include "flipfree/unwrap/islands/islands.h"

namespace flipfree::unwrap {
namespace {

// Is all of g on the right of a side of f, or on it?
bool beside(const Triangles& faces, const Points2& uv, FaceId f, FaceId g) {
  for (Index k = 0; k < 3; ++k) {
    const Vector2 a = uv.row(faces(f, k)).transpose();
    const Vector2 b = uv.row(faces(f, (k + 1) % 3)).transpose();
    bool right = true;
    for (Index m = 0; m < 3 && right; ++m) {
      const VertexId v = faces(g, m);
      if (v == faces(f, k) || v == faces(f, (k + 1) % 3)) continue;
      right = numeric::orientation(a, b, uv.row(v).transpose()) <= 0;
    }
    if (right) return true;
  }
  return false;
}

// Area of the intersection, by clipping f at the sides of g (Sutherland, Hodgman 1974).
double common_area(const Triangles& faces, const Points2& uv, FaceId f, FaceId g) {
  const auto corner = [&](FaceId face, Index k) -> Vector2 {
    return uv.row(faces(face, k)).transpose();
  };
  std::vector<Vector2> polygon{corner(f, 0), corner(f, 1), corner(f, 2)};
  std::vector<Vector2> clipped;
  for (Index k = 0; k < 3; ++k) {
    const Vector2 a = corner(g, k);
    const Vector2 side = corner(g, (k + 1) % 3) - a;
    clipped.clear();
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vector2& p = polygon[i];
      const Vector2& q = polygon[(i + 1) % polygon.size()];
      const double from = cross(side, Vector2(p - a));
      const double to = cross(side, Vector2(q - a));
      if (from >= 0) clipped.push_back(p);
      if ((from > 0 && to < 0) || (from < 0 && to > 0))
        clipped.emplace_back(p + (q - p) * (from / (from - to)));
    }
    polygon.swap(clipped);
  }
  double area = 0;
  for (std::size_t i = 2; i < polygon.size(); ++i)
    area += 0.5 * cross(Vector2(polygon[i - 1] - polygon[0]), Vector2(polygon[i] - polygon[0]));
  return std::max(area, std::numeric_limits<double>::min());  // it is positive, however rounded
}

}  // namespace

std::vector<FacePair> overlapping_faces(const Triangles& faces, const Points2& uv,
                                        const ExecutionContext& context) {
  using Box = CGAL::Box_intersection_d::Box_with_handle_d<double, 2, const Index*>;
  std::vector<Box> boxes;
  boxes.reserve(static_cast<std::size_t>(faces.rows()));
  for (FaceId f = 0; f < faces.rows(); ++f) {
    Vector2 low = uv.row(faces(f, 0)).transpose();
    Vector2 high = low;
    for (Index k = 1; k < 3; ++k) {
      low = low.cwiseMin(uv.row(faces(f, k)).transpose());
      high = high.cwiseMax(uv.row(faces(f, k)).transpose());
    }
    boxes.emplace_back(low.data(), high.data(), &faces(f, 0));
  }
  std::vector<FacePair> pairs;
  std::size_t looked_at = 0;
  CGAL::box_self_intersection_d(
      boxes.begin(), boxes.end(), [&](const Box& first, const Box& second) {
        if (++looked_at % 4096 == 0) context.check();
        const auto f = static_cast<FaceId>((first.handle() - faces.data()) / 3);
        const auto g = static_cast<FaceId>((second.handle() - faces.data()) / 3);
        if (beside(faces, uv, f, g) || beside(faces, uv, g, f)) return;
        pairs.push_back({std::min(f, g), std::max(f, g), common_area(faces, uv, f, g)});
      });
  std::sort(pairs.begin(), pairs.end(), [](const FacePair& p, const FacePair& q) {
    return p.first != q.first ? p.first < q.first : p.second < q.second;
  });
  return pairs;
}

namespace {

// Neighbouring pieces (the faces' components under `cut`) that do not lie on top of each other
// become one, those with the most expensive cut between them first: `cut` loses what lay between.
void join_pieces(const std::vector<double>& face_area, const std::vector<double>& edge_cost,
                 double tolerated, const mesh::Adjacency& adjacency, const mesh::Components& pieces,
                 const std::vector<FacePair>& overlapping, mesh::EdgeFlags& cut) {
  DisjointSets joined(pieces.count);
  const auto root = [&](Index piece) { return joined.find(piece); };
  std::vector<std::map<Index, double>> on_top(at(pieces.count));  // area shared with each other
  std::vector<double> own(on_top.size(), 0.0);                    // area that overlaps within
  std::vector<double> area(on_top.size(), 0.0);
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
  std::vector<std::map<Index, double>> beside(on_top.size());  // cost of the cut to each neighbour
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cut.size()); ++h) {
    if (!cut[at(h)]) continue;
    const Index a = pieces.of_face[at(h / 3)];
    const Index b = pieces.of_face[at(adjacency.opposite[at(h)] / 3)];
    beside[at(a)][b] += edge_cost[at(h)];
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
    joined.join(b, a);
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

// A cut along a crease of a right angle or more costs a quarter of one through a flat place.
constexpr double kCreaseShare = 0.25;
// A cut through a polygon, where the user sees no edge, costs so many times its length.
constexpr double kUncuttableCost = 1e3;

enum class Side : char { kNone, kFirst, kSecond };

class Separator {
 public:
  Separator(const mesh::Surface& chart, const mesh::Adjacency& adjacency, const Points2& uv,
            double tolerated, const mesh::EdgeFlags& uncuttable, ExecutionContext& context)
      : chart_(chart), adjacency_(adjacency), tolerated_(tolerated), context_(context) {
    for (FaceId f = 0; f < chart.faces.rows(); ++f) area_.push_back(uv_area(chart.faces, uv, f));
    cut_.assign(adjacency.opposite.size(), 0);
    weigh_edges(uncuttable);
  }

  mesh::EdgeFlags run(const std::vector<FacePair>& overlapping) {
    std::vector<FacePair> pairs = overlapping;
    while (!pairs.empty()) {
      context_.check();
      const mesh::Components pieces = components();
      std::erase_if(pairs, [&](const FacePair& pair) {
        return pieces.of_face[at(pair.first)] != pieces.of_face[at(pair.second)];
      });
      std::vector<std::vector<FacePair>> own(at(pieces.count));
      std::vector<std::vector<FaceId>> faces(own.size());
      std::vector<double> spare(own.size(), 0.0);  // what may overlap, less what does
      for (const FacePair& pair : pairs) {
        own[at(pieces.of_face[at(pair.first)])].push_back(pair);
        spare[at(pieces.of_face[at(pair.first)])] -= pair.area;
      }
      for (std::size_t f = 0; f < pieces.of_face.size(); ++f) {
        faces[at(pieces.of_face[f])].push_back(static_cast<FaceId>(f));
        spare[at(pieces.of_face[f])] += tolerated_ * area_[f];
      }
      std::erase_if(pairs, [&](const FacePair& pair) {
        return spare[at(pieces.of_face[at(pair.first)])] >= 0.0;
      });
      for (std::size_t p = 0; p < own.size(); ++p) {
        if (spare[p] < 0.0) divide(faces[p], own[p]);
      }
    }
    join_pieces(area_, cost_, tolerated_, adjacency_, components(), overlapping, cut_);
    return std::move(cut_);
  }

 private:
  void weigh_edges(const mesh::EdgeFlags& uncuttable) {
    Points3 normals(chart_.faces.rows(), 3);
    centre_.resize(chart_.faces.rows(), 3);
    for (FaceId f = 0; f < chart_.faces.rows(); ++f) {
      normals.row(f) = face_normal(chart_, f).normalized().transpose();
      const auto corner = [&](Index k) { return chart_.vertices.row(chart_.faces(f, k)); };
      centre_.row(f) = (corner(0) + corner(1) + corner(2)) / 3.0;
    }
    cost_.assign(cut_.size(), 0.0);
    double longest = 0.0;
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost_.size()); ++h) {
      const HalfedgeId o = adjacency_.opposite[at(h)];
      if (o == kInvalid) continue;
      const double length = edge_length(chart_, h);
      const double cosine = std::clamp(normals.row(h / 3).dot(normals.row(o / 3)), 0.0, 1.0);
      const double share = kCreaseShare + (1.0 - kCreaseShare) * cosine;
      cost_[at(h)] = length * (std::isfinite(share) ? share : 1.0) *
                     (uncuttable.empty() || !uncuttable[at(h)] ? 1.0 : kUncuttableCost);
      longest = std::max(longest, length);
    }
    // No edge is free: of two cuts of the same length the one with fewer edges is the smoother.
    for (double& cost : cost_) cost += 1e-3 * longest;
  }

  mesh::Components components() const { return mesh::components_between(adjacency_, cut_); }

  HalfedgeId across(HalfedgeId h) const {
    return cut_[at(h)] ? kInvalid : adjacency_.opposite[at(h)];
  }

  // Cuts one piece between triangles that lie on top of each other; at least one pair is separated.
  void divide(const std::vector<FaceId>& faces, const std::vector<FacePair>& pairs) {
    std::vector<Side> side = sides_by_regions(pairs);
    if (std::find(side.begin(), side.end(), Side::kFirst) == side.end())
      side = sides_by_distance(pairs);
    const std::vector<char> first = minimum_cut(faces, side);
    for (const FaceId f : faces) {
      for (Index k = 0; k < 3; ++k) {
        const HalfedgeId h = 3 * f + k;
        const HalfedgeId o = across(h);
        if (o == kInvalid || first[at(f)] == first[at(o / 3)]) continue;
        cut_[at(h)] = cut_[at(o)] = 1;
      }
    }
  }

  // Connected regions of faces that lie on others get a side each such that regions on top of each
  // other differ, as far as one breadth-first walk over them can tell. Only faces of pairs that
  // this separates have one.
  std::vector<Side> sides_by_regions(const std::vector<FacePair>& pairs) const {
    std::vector<char> on_others(area_.size(), 0);
    for (const FacePair& pair : pairs) on_others[at(pair.first)] = on_others[at(pair.second)] = 1;
    mesh::EdgeFlags between = cut_;
    for (std::size_t h = 0; h < between.size(); ++h) {
      const HalfedgeId o = adjacency_.opposite[h];
      if (o != kInvalid && (on_others[h / 3] == 0 || on_others[at(o / 3)] == 0)) between[h] = 1;
    }
    const std::vector<Index> region = mesh::components_between(adjacency_, between).of_face;
    std::map<Index, std::set<Index>> against;
    for (const FacePair& pair : pairs) {
      const Index a = region[at(pair.first)];
      const Index b = region[at(pair.second)];
      if (a == b) continue;
      against[a].insert(b);
      against[b].insert(a);
    }
    std::map<Index, Side> of_region;
    for (const auto& [seed, others] : against) {
      if (!of_region.emplace(seed, Side::kFirst).second) continue;
      std::vector<Index> queue{seed};
      for (std::size_t i = 0; i < queue.size(); ++i) {
        const Side other = of_region[queue[i]] == Side::kFirst ? Side::kSecond : Side::kFirst;
        for (const Index b : against[queue[i]])
          if (of_region.emplace(b, other).second) queue.push_back(b);
      }
    }
    std::vector<Side> side(area_.size(), Side::kNone);
    for (const FacePair& pair : pairs) {
      const auto a = of_region.find(region[at(pair.first)]);
      const auto b = of_region.find(region[at(pair.second)]);
      if (a == of_region.end() || b == of_region.end() || a->second == b->second) continue;
      side[at(pair.first)] = a->second;
      side[at(pair.second)] = b->second;
    }
    return side;
  }

  // Where a region lies on top of itself: by the nearer of the two faces of the pair that is
  // farthest apart.
  std::vector<Side> sides_by_distance(const std::vector<FacePair>& pairs) const {
    const std::vector<double> from_first = distances(pairs.front().first);
    FacePair ends = pairs.front();
    for (const FacePair& pair : pairs) {
      const auto apart = [&](const FacePair& p) {
        return std::abs(from_first[at(p.first)] - from_first[at(p.second)]);
      };
      if (apart(pair) > apart(ends)) ends = pair;
    }
    const std::vector<double> a = distances(ends.first);
    const std::vector<double> b = distances(ends.second);
    std::vector<Side> side(a.size(), Side::kNone);
    for (const FacePair& pair : pairs) {
      const bool first = a[at(pair.first)] < b[at(pair.first)];
      const bool second = a[at(pair.second)] < b[at(pair.second)];
      if (first == second) continue;
      side[at(pair.first)] = first ? Side::kFirst : Side::kSecond;
      side[at(pair.second)] = second ? Side::kFirst : Side::kSecond;
    }
    // The two ends differ in any case, even where all distances are the same.
    side[at(ends.first)] = Side::kFirst;
    side[at(ends.second)] = Side::kSecond;
    return side;
  }

  // Over the faces' centres.
  std::vector<double> distances(FaceId from) const {
    std::vector<double> distance(at(static_cast<Index>(chart_.faces.rows())),
                                 std::numeric_limits<double>::infinity());
    using Entry = std::pair<double, FaceId>;
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    distance[at(from)] = 0.0;
    queue.emplace(0.0, from);
    while (!queue.empty()) {
      const auto [d, f] = queue.top();
      queue.pop();
      if (d > distance[at(f)]) continue;
      for (Index k = 0; k < 3; ++k) {
        const HalfedgeId o = across(3 * f + k);
        if (o == kInvalid) continue;
        const double next = d + (centre_.row(f) - centre_.row(o / 3)).norm();
        if (!(next < distance[at(o / 3)])) continue;
        distance[at(o / 3)] = next;
        queue.emplace(next, o / 3);
      }
    }
    return distance;
  }

  // Per face of the chart: is it on the first side of the least cut? Only `faces` are looked at.
  std::vector<char> minimum_cut(const std::vector<FaceId>& faces,
                                const std::vector<Side>& side) const {
    using Graph = boost::compressed_sparse_row_graph<boost::directedS, boost::no_property,
                                                     boost::no_property, Index, Index>;
    std::vector<Index> node(side.size(), kInvalid);
    for (std::size_t i = 0; i < faces.size(); ++i) node[at(faces[i])] = static_cast<Index>(i);
    const auto source_node = static_cast<Index>(faces.size());
    const Index sink_node = source_node + 1;
    double total = 1.0;
    for (const FaceId f : faces) {
      for (Index k = 0; k < 3; ++k) total += cost_[at(3 * f + k)];
    }
    // By the nodes that they leave, each with the arc back.
    std::vector<std::pair<Index, Index>> arcs;
    std::vector<double> capacity;
    std::vector<std::size_t> back;
    const auto add = [&](Index from, Index to, double most) {
      arcs.emplace_back(from, to);
      capacity.push_back(most);
      back.push_back(0);
      return arcs.size() - 1;
    };
    std::vector<std::size_t> arc_across(3 * side.size()), arc_to_end(side.size());
    for (const FaceId f : faces) {
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
        const HalfedgeId o = across(h);
        if (o != kInvalid) arc_across[at(h)] = add(node[at(f)], node[at(o / 3)], cost_[at(h)]);
      }
      if (side[at(f)] == Side::kFirst) arc_to_end[at(f)] = add(node[at(f)], source_node, 0.0);
      if (side[at(f)] == Side::kSecond) arc_to_end[at(f)] = add(node[at(f)], sink_node, total);
    }
    for (const auto& [end, own, most] : {std::tuple(source_node, Side::kFirst, total),
                                         std::tuple(sink_node, Side::kSecond, 0.0)}) {
      for (const FaceId f : faces) {
        if (side[at(f)] != own) continue;
        const std::size_t arc = add(end, node[at(f)], most);
        back[arc] = arc_to_end[at(f)];
        back[arc_to_end[at(f)]] = arc;
      }
    }
    for (const FaceId f : faces) {
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
        if (across(h) != kInvalid) back[arc_across[at(h)]] = arc_across[at(across(h))];
      }
    }
    const Graph graph(boost::edges_are_sorted, arcs.begin(), arcs.end(), sink_node + 1);
    const std::vector<boost::graph_traits<Graph>::edge_descriptor> edge_of(
        boost::edges(graph).first, boost::edges(graph).second);
    std::vector<boost::graph_traits<Graph>::edge_descriptor> reverse;
    for (const std::size_t arc : back) reverse.push_back(edge_of[arc]);
    std::vector<double> residual(arcs.size());
    std::vector<boost::graph_traits<Graph>::edge_descriptor> predecessor(at(sink_node + 1));
    std::vector<boost::default_color_type> color(at(sink_node + 1));
    std::vector<Index> distance(at(sink_node + 1));
    const auto by_edge = boost::get(boost::edge_index, graph);
    const auto by_node = boost::get(boost::vertex_index, graph);
    boost::boykov_kolmogorov_max_flow(
        graph, boost::make_iterator_property_map(capacity.begin(), by_edge),
        boost::make_iterator_property_map(residual.begin(), by_edge),
        boost::make_iterator_property_map(reverse.begin(), by_edge),
        boost::make_iterator_property_map(predecessor.begin(), by_node),
        boost::make_iterator_property_map(color.begin(), by_node),
        boost::make_iterator_property_map(distance.begin(), by_node), by_node, source_node,
        sink_node);
    const auto source_color = color[at(source_node)];
    std::vector<char> first(side.size(), 0);
    for (const FaceId f : faces) {
      const bool reached = color[at(node[at(f)])] == source_color;
      first[at(f)] = side[at(f)] == Side::kFirst || (reached && side[at(f)] != Side::kSecond);
    }
    return first;
  }

  const mesh::Surface& chart_;
  const mesh::Adjacency& adjacency_;
  double tolerated_;
  ExecutionContext& context_;
  std::vector<double> area_;  // per face, in the map
  mesh::EdgeFlags cut_;
  std::vector<double> cost_;  // per half-edge
  Points3 centre_;            // per face
};

}  // namespace

mesh::EdgeFlags separating_cut(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                               const Points2& uv, const std::vector<FacePair>& overlapping,
                               double tolerated, const mesh::EdgeFlags& uncuttable,
                               ExecutionContext& context) {
  return Separator(chart, adjacency, uv, tolerated, uncuttable, context).run(overlapping);
}

namespace {

// Height over length of faces that could not be stored as islands of their own.
constexpr double kThinnestStored = 1e-5;

bool is_thin(const mesh::Surface& chart, FaceId f) {
  double longest = 0.0;
  for (Index k = 0; k < 3; ++k) longest = std::max(longest, edge_length(chart, 3 * f + k));
  return !(face_normal(chart, f).norm() > kThinnestStored * longest * longest);
}

// Per face the first one of those that stay together: polygons, and every thin face with a
// neighbour that is none, or with what leads to one, across the longest edges.
std::vector<FaceId> blocks_of(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                              const mesh::EdgeFlags& uncuttable, bool thin_alone) {
  const auto count = static_cast<FaceId>(chart.faces.rows());
  DisjointSets sets(count);
  std::vector<char> stands;  // of a first face: can its block be an island?
  for (FaceId f = 0; f < count; ++f) stands.push_back(is_thin(chart, f) ? 0 : 1);
  const auto join = [&](FaceId f, FaceId g) {
    const auto [first, other] = std::minmax({sets.find(f), sets.find(g)});
    sets.join(other, first);
    stands[at(first)] |= stands[at(other)];
  };
  std::vector<std::pair<double, HalfedgeId>> thin;
  for (HalfedgeId h = 0; h < 3 * count; ++h) {
    const HalfedgeId o = adjacency.opposite[at(h)];
    if (o < h) continue;
    if (!uncuttable.empty() && uncuttable[at(h)] != 0) join(h / 3, o / 3);
    if (!thin_alone && (is_thin(chart, h / 3) || is_thin(chart, o / 3)))
      thin.emplace_back(-edge_length(chart, h), h);
  }
  std::sort(thin.begin(), thin.end());
  for (const auto& [length, h] : thin) {
    const FaceId a = sets.find(h / 3);
    const FaceId b = sets.find(adjacency.opposite[at(h)] / 3);
    if (stands[at(a)] == 0 || stands[at(b)] == 0) join(a, b);
  }
  std::vector<FaceId> first;
  for (FaceId f = 0; f < count; ++f) first.push_back(sets.find(f));
  return first;
}

// The faces along the direction in which the map (#V x 2) is longest.
std::vector<FaceId> along_axis(const Triangles& faces, const Points2& uv) {
  Points2 centre(faces.rows(), 2);
  for (FaceId f = 0; f < faces.rows(); ++f)
    centre.row(f) = uv.row(faces(f, 0)) + uv.row(faces(f, 1)) + uv.row(faces(f, 2));
  centre.rowwise() -= centre.colwise().mean().eval();
  const Eigen::Matrix2d spread = centre.transpose() * centre;
  const Eigen::VectorXd height = centre * numeric::symmetric_eigen(spread).vectors.col(1);
  std::vector<FaceId> order(at(static_cast<Index>(faces.rows())));
  std::iota(order.begin(), order.end(), FaceId{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](FaceId a, FaceId b) { return height[a] < height[b]; });
  return order;
}

// The blocks from that of `seed` on, ring by ring, up to about half of all faces, and the others.
std::vector<Index> grown_half(const mesh::Adjacency& adjacency, const std::vector<FaceId>& block,
                              FaceId seed) {
  const std::size_t count = block.size();
  std::vector<std::vector<FaceId>> faces(count);  // by the block's first
  for (std::size_t f = 0; f < count; ++f) faces[at(block[f])].push_back(static_cast<FaceId>(f));
  std::vector<Index> side(count, 0);
  std::vector<FaceId> queue;
  const auto take = [&](FaceId first) {
    for (const FaceId f : faces[at(first)]) {
      side[at(f)] = 1;
      queue.push_back(f);
    }
  };
  take(block[at(seed)]);
  for (std::size_t i = 0; i < queue.size() && 2 * queue.size() < count; ++i) {
    for (Index k = 0; k < 3; ++k) {
      const HalfedgeId o = adjacency.opposite[at(3 * queue[i] + k)];
      if (o == kInvalid || side[at(o / 3)] != 0) continue;
      const FaceId first = block[at(o / 3)];
      if (queue.size() + faces[at(first)].size() < count) take(first);
    }
  }
  return side;
}

}  // namespace

mesh::EdgeFlags halving_cut(const mesh::Surface& chart, const mesh::Adjacency& adjacency,
                            const Points2& uv, const mesh::EdgeFlags& uncuttable, bool thin_alone,
                            ExecutionContext& context) {
  const auto count = at(chart.faces.rows());
  mesh::EdgeFlags cut(adjacency.opposite.size(), 0);
  if (count < 2) return cut;
  const std::vector<FaceId> block = blocks_of(chart, adjacency, uncuttable, thin_alone);
  const std::vector<FaceId> order = along_axis(chart.faces, uv);
  std::vector<FacePair> ends;  // of the first and the last quarter, as if they lay on each other
  for (std::size_t i = 0; i < std::max<std::size_t>(count / 4, 1); ++i) {
    const auto [a, b] = std::minmax(order[i], order[count - 1 - i]);
    ends.push_back({a, b, 1.0});
  }
  mesh::EdgeFlags spared(cut.size(), 0);
  const auto differ = [&](const std::vector<Index>& side, std::size_t h) {
    const HalfedgeId o = adjacency.opposite[h];
    return o != kInvalid && side[h / 3] != side[at(o / 3)];
  };
  for (std::size_t h = 0; h < cut.size(); ++h) spared[h] = differ(block, h) ? 0 : 1;
  const mesh::EdgeFlags least = separating_cut(chart, adjacency, uv, ends, 0.0, spared, context);
  // Every block goes where its first face is.
  const std::vector<Index> piece = mesh::components_between(adjacency, least).of_face;
  std::vector<Index> side(count);
  for (std::size_t f = 0; f < count; ++f) side[f] = piece[at(block[f])];
  if (std::adjacent_find(side.begin(), side.end(), std::not_equal_to<>()) == side.end())
    side = grown_half(adjacency, block, order.front());
  for (std::size_t h = 0; h < cut.size(); ++h) cut[h] = differ(side, h) ? 1 : 0;
  return cut;
}

}  // namespace flipfree::unwrap
