#include "flipfree/unwrap/chart/separate.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <boost/graph/boykov_kolmogorov_max_flow.hpp>
#include <boost/graph/compressed_sparse_row_graph.hpp>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
#include <queue>

#include "flipfree/base/plane.h"
#include "flipfree/mesh/topology.h"
#include "flipfree/unwrap/chart/join_pieces.h"

namespace flipfree::unwrap {
namespace {

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
    for (FaceId f = 0; f < chart.faces.rows(); ++f) {
      const Vector2 p = uv.row(chart.faces(f, 0)).transpose();
      area_.push_back(0.5 * cross(Vector2(uv.row(chart.faces(f, 1)).transpose() - p),
                                  Vector2(uv.row(chart.faces(f, 2)).transpose() - p)));
    }
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
      struct Piece {
        std::vector<FacePair> pairs;
        std::vector<FaceId> faces;
        double area = 0;
        double overlap = 0;
      };
      std::vector<Piece> found(at(pieces.count));
      for (const FacePair& pair : pairs) {
        Piece& piece = found[at(pieces.of_face[at(pair.first)])];
        piece.pairs.push_back(pair);
        piece.overlap += pair.area;
      }
      for (std::size_t f = 0; f < pieces.of_face.size(); ++f) {
        Piece& piece = found[at(pieces.of_face[f])];
        if (piece.pairs.empty()) continue;
        piece.faces.push_back(static_cast<FaceId>(f));
        piece.area += area_[f];
      }
      std::erase_if(pairs, [&](const FacePair& pair) {
        const Piece& piece = found[at(pieces.of_face[at(pair.first)])];
        return piece.overlap <= tolerated_ * piece.area;
      });
      for (const Piece& piece : found) {
        if (!piece.pairs.empty() && piece.overlap > tolerated_ * piece.area)
          divide(piece.faces, piece.pairs);
      }
    }
    join_pieces({area_, cost_, tolerated_}, adjacency_, components(), overlapping, cut_);
    return std::move(cut_);
  }

 private:
  void weigh_edges(const mesh::EdgeFlags& uncuttable) {
    Points3 normals(chart_.faces.rows(), 3);
    centre_.resize(chart_.faces.rows(), 3);
    for (FaceId f = 0; f < chart_.faces.rows(); ++f) {
      const Vector3 a = chart_.vertices.row(chart_.faces(f, 0)).transpose();
      const Vector3 b = chart_.vertices.row(chart_.faces(f, 1)).transpose();
      const Vector3 c = chart_.vertices.row(chart_.faces(f, 2)).transpose();
      normals.row(f) = (b - a).cross(c - a).normalized().transpose();
      centre_.row(f) = ((a + b + c) / 3.0).transpose();
    }
    cost_.assign(cut_.size(), 0.0);
    double longest = 0.0;
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost_.size()); ++h) {
      const HalfedgeId o = adjacency_.opposite[at(h)];
      if (o == kInvalid) continue;
      const double length = (chart_.vertices.row(mesh::target(chart_.faces, h)) -
                             chart_.vertices.row(mesh::source(chart_.faces, h)))
                                .norm();
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
    const auto separated = [&](const FacePair& pair) {
      return side[at(pair.first)] != Side::kNone && side[at(pair.second)] != Side::kNone &&
             side[at(pair.first)] != side[at(pair.second)];
    };
    if (std::none_of(pairs.begin(), pairs.end(), separated)) side = sides_by_distance(pairs);
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

  // Connected regions of faces that lie on or under others get one side each, such that regions on
  // top of each other differ as far as that is possible; largest conflict first.
  std::vector<Side> sides_by_regions(const std::vector<FacePair>& pairs) const {
    std::vector<Side> side(at(static_cast<Index>(chart_.faces.rows())), Side::kNone);
    std::vector<Index> region(side.size(), kInvalid);
    std::vector<FaceId> involved;
    for (const FacePair& pair : pairs) involved.insert(involved.end(), {pair.first, pair.second});
    std::sort(involved.begin(), involved.end());
    involved.erase(std::unique(involved.begin(), involved.end()), involved.end());
    std::vector<char> is_involved(side.size(), 0);
    for (const FaceId f : involved) is_involved[at(f)] = 1;
    Index count = 0;
    std::vector<FaceId> stack;
    for (const FaceId seed : involved) {
      if (region[at(seed)] != kInvalid) continue;
      region[at(seed)] = count;
      stack.push_back(seed);
      while (!stack.empty()) {
        const FaceId f = stack.back();
        stack.pop_back();
        for (Index k = 0; k < 3; ++k) {
          const HalfedgeId o = across(3 * f + k);
          if (o == kInvalid || !is_involved[at(o / 3)] || region[at(o / 3)] != kInvalid) continue;
          region[at(o / 3)] = count;
          stack.push_back(o / 3);
        }
      }
      ++count;
    }
    std::vector<std::array<Index, 2>> conflicts;
    for (const FacePair& pair : pairs) {
      const Index a = region[at(pair.first)];
      const Index b = region[at(pair.second)];
      if (a != b) conflicts.push_back({std::min(a, b), std::max(a, b)});
    }
    std::sort(conflicts.begin(), conflicts.end());
    conflicts.erase(std::unique(conflicts.begin(), conflicts.end()), conflicts.end());
    std::vector<std::vector<Index>> against(at(count));
    for (const auto& [a, b] : conflicts) {
      against[at(a)].push_back(b);
      against[at(b)].push_back(a);
    }
    std::vector<Side> of_region(at(count), Side::kNone);
    for (Index seed = 0; seed < count; ++seed) {
      if (of_region[at(seed)] != Side::kNone || against[at(seed)].empty()) continue;
      of_region[at(seed)] = Side::kFirst;
      std::vector<Index> queue{seed};
      for (std::size_t head = 0; head < queue.size(); ++head) {
        for (const Index b : against[at(queue[head])]) {
          if (of_region[at(b)] != Side::kNone) continue;
          of_region[at(b)] =
              of_region[at(queue[head])] == Side::kFirst ? Side::kSecond : Side::kFirst;
          queue.push_back(b);
        }
      }
    }
    // Only faces of pairs that this separates are held to their side.
    for (const FacePair& pair : pairs) {
      const Side a = of_region[at(region[at(pair.first)])];
      const Side b = of_region[at(region[at(pair.second)])];
      if (a == Side::kNone || b == Side::kNone || a == b) continue;
      side[at(pair.first)] = a;
      side[at(pair.second)] = b;
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
    struct Arc {
      Index from, to;
      double capacity;
    };
    double total = 1.0;
    for (const FaceId f : faces) {
      for (Index k = 0; k < 3; ++k) total += cost_[at(3 * f + k)];
    }
    std::vector<Arc> arcs;
    arcs.reserve(3 * faces.size());
    for (const FaceId f : faces) {
      for (Index k = 0; k < 3; ++k) {
        const HalfedgeId o = across(3 * f + k);
        if (o != kInvalid) arcs.push_back({node[at(f)], node[at(o / 3)], cost_[at(3 * f + k)]});
      }
      if (side[at(f)] == Side::kFirst) {
        arcs.push_back({source_node, node[at(f)], total});
        arcs.push_back({node[at(f)], source_node, 0.0});
      } else if (side[at(f)] == Side::kSecond) {
        arcs.push_back({node[at(f)], sink_node, total});
        arcs.push_back({sink_node, node[at(f)], 0.0});
      }
    }
    std::sort(arcs.begin(), arcs.end(), [](const Arc& a, const Arc& b) {
      return a.from != b.from ? a.from < b.from : a.to < b.to;
    });
    std::vector<std::pair<Index, Index>> ends;
    std::vector<double> capacity;
    for (const Arc& arc : arcs) {
      ends.emplace_back(arc.from, arc.to);
      capacity.push_back(arc.capacity);
    }
    const Graph graph(boost::edges_are_sorted, ends.begin(), ends.end(), sink_node + 1);
    // Two faces that share two edges have two arcs each way: they are matched in order.
    std::vector<boost::graph_traits<Graph>::edge_descriptor> edge_of(arcs.size());
    for (auto [e, end] = boost::edges(graph); e != end; ++e)
      edge_of[static_cast<std::size_t>(boost::get(boost::edge_index, graph, *e))] = *e;
    std::vector<boost::graph_traits<Graph>::edge_descriptor> reverse(arcs.size());
    for (std::size_t i = 0; i < arcs.size();) {
      std::size_t same = i;
      while (same < arcs.size() && arcs[same].from == arcs[i].from && arcs[same].to == arcs[i].to)
        ++same;
      auto back = static_cast<std::size_t>(
          std::lower_bound(arcs.begin(), arcs.end(), Arc{arcs[i].to, arcs[i].from, 0.0},
                           [](const Arc& a, const Arc& b) {
                             return a.from != b.from ? a.from < b.from : a.to < b.to;
                           }) -
          arcs.begin());
      for (; i < same; ++i, ++back) reverse[i] = edge_of[back];
    }
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

}  // namespace flipfree::unwrap
