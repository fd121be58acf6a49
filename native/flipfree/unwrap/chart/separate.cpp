#include "flipfree/unwrap/chart/separate.h"

#include <CGAL/box_intersection_d.h>
#include <boost/graph/adjacency_list.hpp>
#include <boost/graph/boykov_kolmogorov_max_flow.hpp>
#include <boost/graph/dijkstra_shortest_paths.hpp>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>
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
  const std::vector<Index>& piece = pieces.of_face;
  const auto across = [&](std::size_t h) { return at(adjacency.opposite[h] / 3); };
  struct Border {
    double cost = 0.0;    // of the cut between the two; 0: they are no neighbours
    double shared = 0.0;  // area by which they lie on each other
  };
  using Borders = std::map<std::pair<Index, Index>, Border>;  // the lower piece first
  Borders borders;
  std::vector<double> area(at(pieces.count), 0.0);
  std::vector<double> own(area.size(), 0.0);  // area that overlaps within
  for (std::size_t f = 0; f < face_area.size(); ++f) area[at(piece[f])] += face_area[f];
  for (std::size_t h = 0; h < cut.size(); ++h) {
    if (cut[h] != 0 && piece[h / 3] < piece[across(h)])
      borders[{piece[h / 3], piece[across(h)]}].cost += edge_cost[h];
  }
  for (const FacePair& pair : overlapping) {
    const auto two = std::minmax(piece[at(pair.first)], piece[at(pair.second)]);
    (two.first == two.second ? own[at(two.first)] : borders[two].shared) += pair.area;
  }
  DisjointSets joined(pieces.count);
  while (true) {
    auto best = borders.end();
    for (auto i = borders.begin(); i != borders.end(); ++i) {
      const auto& [a, b] = i->first;
      const auto& [cost, shared] = i->second;
      if (cost > (best == borders.end() ? 0.0 : best->second.cost) &&
          own[at(a)] + own[at(b)] + shared <= tolerated * (area[at(a)] + area[at(b)]))
        best = i;
    }
    if (best == borders.end()) break;
    const auto [a, b] = best->first;
    joined.join(b, a);
    area[at(a)] += area[at(b)];
    own[at(a)] += own[at(b)] + best->second.shared;
    Borders next;
    for (const auto& [two, border] : borders) {
      const Index c = two.first == b ? a : two.first;
      const Index d = two.second == b ? a : two.second;
      if (c == d) continue;
      Border& sum = next[std::minmax(c, d)];
      sum.cost += border.cost;
      sum.shared += border.shared;
    }
    borders = std::move(next);
  }
  for (std::size_t h = 0; h < cut.size(); ++h) {
    if (cut[h] != 0 && joined.find(piece[h / 3]) == joined.find(piece[across(h)])) cut[h] = 0;
  }
}

// A cut along a crease of a right angle or more costs a quarter of one through a flat place.
constexpr double kCreaseShare = 0.25;
// A cut through a polygon, where the user sees no edge, costs so many times its length.
constexpr double kUncuttableCost = 1e3;

enum class Side : char { kNone, kFirst, kSecond };

// The faces of a piece as nodes, joined across edges: what cutting these costs is their capacity,
// between the faces' centres is their weight. Two nodes more are where a flow begins and ends.
using Link =
    boost::adjacency_list_traits<boost::vecS, boost::vecS, boost::directedS>::edge_descriptor;
using Graph = boost::adjacency_list<
    boost::vecS, boost::vecS, boost::directedS,
    boost::property<boost::vertex_color_t, boost::default_color_type,
                    boost::property<boost::vertex_distance_t, Index,
                                    boost::property<boost::vertex_predecessor_t, Link>>>,
    boost::property<
        boost::edge_capacity_t, double,
        boost::property<boost::edge_residual_capacity_t, double,
                        boost::property<boost::edge_reverse_t, Link,
                                        boost::property<boost::edge_weight_t, double>>>>>;

void connect(std::size_t from, std::size_t to, double there, double back, double weight,
             Graph& graph) {
  const Link link = boost::add_edge(from, to, graph).first;
  const Link reverse = boost::add_edge(to, from, graph).first;
  boost::put(boost::edge_capacity, graph, link, there);
  boost::put(boost::edge_capacity, graph, reverse, back);
  boost::put(boost::edge_reverse, graph, link, reverse);
  boost::put(boost::edge_reverse, graph, reverse, link);
  boost::put(boost::edge_weight, graph, link, weight);
  boost::put(boost::edge_weight, graph, reverse, weight);
}

std::vector<double> distances(std::size_t from, const Graph& graph) {
  std::vector<double> distance(boost::num_vertices(graph));
  boost::dijkstra_shortest_paths(graph, from,
                                 boost::distance_map(boost::make_iterator_property_map(
                                     distance.begin(), boost::get(boost::vertex_index, graph))));
  return distance;
}

// Of two nodes that are on different sides, those with the nearer one of the two that are farthest
// apart.
std::vector<Side> sides_by_distance(const std::vector<std::array<std::size_t, 2>>& pairs,
                                    const Graph& graph) {
  const std::vector<double> from_first = distances(pairs.front()[0], graph);
  const auto apart = [&](const auto& p) { return std::abs(from_first[p[0]] - from_first[p[1]]); };
  auto ends = pairs.front();
  for (const auto& pair : pairs)
    if (apart(pair) > apart(ends)) ends = pair;
  const std::vector<double> a = distances(ends[0], graph);
  const std::vector<double> b = distances(ends[1], graph);
  std::vector<Side> side(a.size(), Side::kNone);
  for (const auto& [p, q] : pairs) {
    if ((a[p] < b[p]) == (a[q] < b[q])) continue;
    side[p] = a[p] < b[p] ? Side::kFirst : Side::kSecond;
    side[q] = a[q] < b[q] ? Side::kFirst : Side::kSecond;
  }
  // The two ends differ in any case, even where all distances are the same.
  side[ends[0]] = Side::kFirst;
  side[ends[1]] = Side::kSecond;
  return side;
}

class Separator {
 public:
  Separator(const mesh::Surface& chart, const Points2& uv, double tolerated,
            const mesh::EdgeFlags& uncuttable, ExecutionContext& context)
      : adjacency_(chart.adjacency()),
        tolerated_(tolerated),
        context_(context),
        cut_(adjacency_.opposite.size(), 0),
        node_(cut_.size() / 3) {
    for (FaceId f = 0; f < chart.faces.rows(); ++f) area_.push_back(uv_area(chart.faces, uv, f));
    weigh_edges(chart, uncuttable);
  }

  mesh::EdgeFlags run(const std::vector<FacePair>& overlapping) {
    std::vector<FacePair> pairs = overlapping;
    while (!pairs.empty()) {
      context_.check();
      const std::vector<Index> piece = components().of_face;
      std::erase_if(pairs, [&](const FacePair& pair) {
        return piece[at(pair.first)] != piece[at(pair.second)];
      });
      struct Piece {
        std::vector<FacePair> pairs;
        std::vector<FaceId> faces;
        double spare = 0.0;  // what may overlap, less what does
      };
      std::map<Index, Piece> pieces;
      for (const FacePair& pair : pairs) {
        Piece& own = pieces[piece[at(pair.first)]];
        own.pairs.push_back(pair);
        own.spare -= pair.area;
      }
      for (FaceId f = 0; at(f) < piece.size(); ++f) {
        const auto own = pieces.find(piece[at(f)]);
        if (own == pieces.end()) continue;
        own->second.faces.push_back(f);
        own->second.spare += tolerated_ * area_[at(f)];
      }
      std::erase_if(pairs, [&](const FacePair& pair) {
        return pieces.at(piece[at(pair.first)]).spare >= 0.0;
      });
      for (const auto& [i, own] : pieces)
        if (own.spare < 0.0) divide(own.faces, own.pairs);
    }
    join_pieces(area_, cost_, tolerated_, adjacency_, components(), overlapping, cut_);
    return std::move(cut_);
  }

 private:
  void weigh_edges(const mesh::Surface& chart, const mesh::EdgeFlags& uncuttable) {
    Points3 normals(chart.faces.rows(), 3);
    Points3 centres(chart.faces.rows(), 3);
    for (FaceId f = 0; f < chart.faces.rows(); ++f) {
      normals.row(f) = chart.area_vector(f).normalized().transpose();
      const auto [a, b, c] = chart.corners(f);
      centres.row(f) = ((a + b + c) / 3.0).transpose();
    }
    cost_.assign(cut_.size(), 0.0);
    length_ = cost_;
    double longest = 0.0;
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(cost_.size()); ++h) {
      const HalfedgeId o = adjacency_.opposite[at(h)];
      if (o == kInvalid) continue;
      const double length = edge_length(chart, h);
      const double cosine = std::clamp(normals.row(h / 3).dot(normals.row(o / 3)), 0.0, 1.0);
      const double share = kCreaseShare + (1.0 - kCreaseShare) * cosine;
      cost_[at(h)] = length * (std::isfinite(share) ? share : 1.0) *
                     (uncuttable.empty() || !uncuttable[at(h)] ? 1.0 : kUncuttableCost);
      length_[at(h)] = (centres.row(h / 3) - centres.row(o / 3)).norm();
      longest = std::max(longest, length);
    }
    // No edge is free: of two cuts of the same length the one with fewer edges is the smoother.
    for (double& cost : cost_) cost += 1e-3 * longest;
  }

  mesh::Components components() const { return mesh::components_between(adjacency_, cut_); }

  // Cuts one piece between triangles that lie on top of each other, where that costs least (Boykov,
  // Kolmogorov 2004); at least one pair is separated.
  void divide(const std::vector<FaceId>& faces, const std::vector<FacePair>& pairs) {
    const std::size_t source = faces.size(), sink = source + 1;
    for (std::size_t i = 0; i < faces.size(); ++i) node_[at(faces[i])] = i;
    const auto for_edges = [&](auto visit) {
      for (const FaceId f : faces) {
        for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
          const HalfedgeId o = adjacency_.opposite[at(h)];
          if (o > h && cut_[at(h)] == 0) visit(h, o, node_[at(f)], node_[at(o / 3)]);
        }
      }
    };
    Graph graph(sink + 1);
    double infinite = 1.0;
    for_edges([&](HalfedgeId h, HalfedgeId, std::size_t a, std::size_t b) {
      infinite += cost_[at(h)];
      connect(a, b, cost_[at(h)], cost_[at(h)], length_[at(h)], graph);
    });
    std::vector<std::array<std::size_t, 2>> apart;
    for (const FacePair& pair : pairs)
      apart.push_back({node_[at(pair.first)], node_[at(pair.second)]});
    const std::vector<Side> side = sides_by_distance(apart, graph);
    for (std::size_t n = 0; n < source; ++n) {
      if (side[n] == Side::kFirst) connect(source, n, infinite, 0.0, 0.0, graph);
      if (side[n] == Side::kSecond) connect(n, sink, infinite, 0.0, 0.0, graph);
    }
    boost::boykov_kolmogorov_max_flow(graph, source, sink);
    const auto color_of = [&](std::size_t n) { return boost::get(boost::vertex_color, graph, n); };
    const auto is_first = [&](std::size_t n) {
      return side[n] == Side::kFirst ||
             (side[n] != Side::kSecond && color_of(n) == color_of(source));
    };
    for_edges([&](HalfedgeId h, HalfedgeId o, std::size_t a, std::size_t b) {
      if (is_first(a) != is_first(b)) cut_[at(h)] = cut_[at(o)] = 1;
    });
  }

  const mesh::Adjacency& adjacency_;
  double tolerated_;
  ExecutionContext& context_;
  std::vector<double> area_;  // per face, in the map
  mesh::EdgeFlags cut_;
  std::vector<std::size_t> node_;  // per face: its number in the piece that is divided
  std::vector<double> cost_;       // per half-edge
  std::vector<double> length_;     // per half-edge: from its face's centre to the one beyond
};

}  // namespace

mesh::EdgeFlags separating_cut(const mesh::Surface& chart, const Points2& uv,
                               const std::vector<FacePair>& overlapping, double tolerated,
                               const mesh::EdgeFlags& uncuttable, ExecutionContext& context) {
  return Separator(chart, uv, tolerated, uncuttable, context).run(overlapping);
}

namespace {

// Height over length of faces that could not be stored as islands of their own.
constexpr double kThinnestStored = 1e-5;

bool is_thin(const mesh::Surface& chart, FaceId f) {
  double longest = 0.0;
  for (Index k = 0; k < 3; ++k) longest = std::max(longest, edge_length(chart, 3 * f + k));
  return !(chart.area_vector(f).norm() > kThinnestStored * longest * longest);
}

// Per face the first one of those that stay together: polygons, and every thin face with a
// neighbour that is none, or with what leads to one, across the longest edges.
std::vector<FaceId> blocks_of(const mesh::Surface& chart, const mesh::EdgeFlags& uncuttable,
                              bool thin_alone) {
  const std::vector<HalfedgeId>& opposite = chart.adjacency().opposite;
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
    const HalfedgeId o = opposite[at(h)];
    if (o < h) continue;
    if (!uncuttable.empty() && uncuttable[at(h)] != 0) join(h / 3, o / 3);
    if (!thin_alone && (is_thin(chart, h / 3) || is_thin(chart, o / 3)))
      thin.emplace_back(-edge_length(chart, h), h);
  }
  std::sort(thin.begin(), thin.end());
  for (const auto& [length, h] : thin) {
    const FaceId a = sets.find(h / 3);
    const FaceId b = sets.find(opposite[at(h)] / 3);
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

}  // namespace

mesh::EdgeFlags halving_cut(const mesh::Surface& chart, const Points2& uv,
                            const mesh::EdgeFlags& uncuttable, bool thin_alone,
                            ExecutionContext& context) {
  const mesh::Adjacency& adjacency = chart.adjacency();
  const auto count = at(chart.faces.rows());
  mesh::EdgeFlags cut(adjacency.opposite.size(), 0);
  if (count < 2) return cut;
  const std::vector<FaceId> block = blocks_of(chart, uncuttable, thin_alone);
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
  const mesh::EdgeFlags least = separating_cut(chart, uv, ends, 0.0, spared, context);
  // Every block goes where its first face is.
  const std::vector<Index> piece = mesh::components_between(adjacency, least).of_face;
  std::vector<Index> side(count);
  for (std::size_t f = 0; f < count; ++f) side[f] = piece[at(block[f])];
  for (std::size_t h = 0; h < cut.size(); ++h) cut[h] = differ(side, h) ? 1 : 0;
  return cut;
}

}  // namespace flipfree::unwrap
