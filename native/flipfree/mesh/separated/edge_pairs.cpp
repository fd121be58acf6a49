#include "flipfree/mesh/separated/edge_pairs.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <tuple>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/error.h"
#include "flipfree/base/lists.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/islands.h"

namespace flipfree::mesh {

namespace {

// What a pair is worth: any is better than a border, but for a twisted and folded one.
constexpr double kAnyPair = 1.0;
constexpr double kSameWinding = 1.5;  // more than flatness can be worth: -1 to 1
constexpr double kSameMaterial = 0.5;
constexpr double kSamePolygon = 100.0;  // more than anything else
constexpr double kConvex = 0.1;         // two solids that touch at an edge stay two
constexpr double kFlat = 1e-6;
constexpr double kLeastWorth = 0.05;

// Edges of more faces than this are left open.
constexpr std::size_t kMostCompared = 256;

class Pairer {
 public:
  Pairer(const PairingInput& input, const std::vector<char>& turned, EdgePairs& result)
      : input_(input), turned_(turned), result_(result) {}

  // All half-edges between two vertices.
  void pair(std::span<const HalfedgeId> edge) {
    if (edge.size() == 2) {
      if (duplicates(edge[0], edge[1])) {
        result_.loose.emplace_back(edge.begin(), edge.end());
      } else {
        join(edge[0], edge[1]);
      }
    } else if (edge.size() > 2) {
      result_.crowded.emplace_back(edge.begin(), edge.end());
    }
    if (edge.size() > 1) append_duplicates(input_.faces, edge, result_.duplicate);
  }

  void pair_crowd(const std::vector<HalfedgeId>& halfedges) {
    if (halfedges.size() > kMostCompared) return;
    crowd_ = halfedges;
    across_.clear();
    for (const HalfedgeId h : crowd_) across_.push_back(across(h));
    std::vector<std::tuple<double, std::size_t, std::size_t>> pairs;
    for (std::size_t i = 0; i < crowd_.size(); ++i) {
      for (std::size_t k = i + 1; k < crowd_.size(); ++k) {
        const double w = worth(i, k);
        if (w > 0.0) pairs.emplace_back(-w, i, k);
      }
    }
    std::sort(pairs.begin(), pairs.end());
    for (const auto& [w, i, k] : pairs) {
      if (result_.mate[at(crowd_[i])] == kInvalid && result_.mate[at(crowd_[k])] == kInvalid)
        join(crowd_[i], crowd_[k]);
    }
  }

 private:
  VertexId apex(HalfedgeId h) const { return source(input_.faces, previous_corner(h)); }
  bool duplicates(HalfedgeId a, HalfedgeId b) const { return apex(a) == apex(b); }
  // Where h starts once its face is turned over, if it is.
  VertexId start(HalfedgeId h) const {
    const bool turned = !turned_.empty() && turned_[at(h / 3)] != 0;
    return turned ? target(input_.faces, h) : source(input_.faces, h);
  }
  void join(HalfedgeId a, HalfedgeId b) {
    result_.mate[at(a)] = b;
    result_.mate[at(b)] = a;
  }

  // Does the edge's k-th face lie behind the i-th one?
  bool behind(std::size_t i, std::size_t k) const {
    const HalfedgeId h = crowd_[i];
    const VertexId from = start(h);
    const VertexId to = source(input_.faces, h) + target(input_.faces, h) - from;
    Vector3 along = 0.5 * input_.positions.row(to) - 0.5 * input_.positions.row(from);
    along.stableNormalize();
    return along.cross(across_[i]).dot(across_[k]) < -kFlat;
  }

  // Unit vector in h's face across its edge, or zero where there is none.
  Vector3 across(HalfedgeId h) const {
    const VertexId low = std::min(source(input_.faces, h), target(input_.faces, h));
    const VertexId high = std::max(source(input_.faces, h), target(input_.faces, h));
    // Halved first, and in a unit of their own, so that no square overflows or vanishes.
    Vector3 along = 0.5 * input_.positions.row(high) - 0.5 * input_.positions.row(low);
    Vector3 aside = 0.5 * input_.positions.row(apex(h)) - 0.5 * input_.positions.row(low);
    along.stableNormalize();
    aside.stableNormalize();
    Vector3 result = aside - aside.dot(along) * along;
    result.stableNormalize();
    return result;
  }

  double worth(std::size_t i, std::size_t k) const {
    const HalfedgeId a = crowd_[i];
    const HalfedgeId b = crowd_[k];
    if (duplicates(a, b)) return 0.0;
    if (input_.corner_uv != nullptr && !continues_in_map(input_.faces, *input_.corner_uv, a, b)) {
      return 0.0;
    }
    double sum = kAnyPair - across_[i].dot(across_[k]);
    if (same_number(input_.polygon, a / 3, b / 3)) sum += kSamePolygon;
    if (start(a) != start(b)) {
      sum += kSameWinding;
      if (behind(i, k)) sum += kConvex;
    }
    if (same_number(input_.material, a / 3, b / 3)) sum += kSameMaterial;
    return sum > kLeastWorth ? sum : 0.0;
  }

  const PairingInput& input_;
  const std::vector<char>& turned_;
  EdgePairs& result_;
  std::vector<HalfedgeId> crowd_;
  std::vector<Vector3> across_;
};

}  // namespace

std::vector<char> flag_pairs(const Triangles& faces, Index vertex_count, const IndexPairs* pairs) {
  std::vector<char> flags(at(faces.size()), 0);
  if (pairs == nullptr || pairs->rows() == 0) return flags;
  const std::vector<VertexPair> sorted = sorted_pairs(*pairs);
  std::vector<char> low_end(at(vertex_count), 0);
  for (const VertexPair& pair : sorted) {
    if (pair.first >= 0 && pair.first < vertex_count) low_end[at(pair.first)] = 1;
  }
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(flags.size()); ++h) {
    const VertexPair own = ends(faces, h);
    if (low_end[at(own.first)] == 0) continue;
    flags[at(h)] = std::binary_search(sorted.begin(), sorted.end(), own) ? 1 : 0;
  }
  return flags;
}

bool continues_in_map(const Triangles& faces, const Points2& corner_uv, HalfedgeId a,
                      HalfedgeId b) {
  const bool same = source(faces, a) == source(faces, b);
  const CornerId first = same ? b : next_corner(b);
  const CornerId second = same ? next_corner(b) : b;
  return corner_uv.row(a) == corner_uv.row(first) &&
         corner_uv.row(next_corner(a)) == corner_uv.row(second);
}

EdgePairs pair_edges(const PairingInput& input, const ExecutionContext& context) {
  EdgePairs result;
  result.mate.assign(at(input.faces.size()), kInvalid);
  const std::vector<char> none;
  Pairer pairer(input, none, result);
  for_each_edge(static_cast<Index>(input.positions.rows()), input.faces, context,
                [&](std::span<const HalfedgeId> edge) { pairer.pair(edge); });
  sort_unique(result.duplicate);
  return result;
}

void pair_crowds(const PairingInput& input, const std::vector<char>& turned, EdgePairs& pairs,
                 const ExecutionContext& context) {
  constexpr std::size_t kCheckEvery = 1 << 10;
  Pairer pairer(input, turned, pairs);
  for (std::size_t i = 0; i < pairs.crowded.size(); ++i) {
    if (i % kCheckEvery == 0) context.check();
    const EdgeUse& edge = pairs.crowded[i];
    if (input.at_seam[at(edge.front())] == 0) pairer.pair_crowd(edge);
  }
}

namespace {

// Half-edges of one group and between the same vertices, where there are just two of them.
template <typename Group>
std::vector<std::pair<HalfedgeId, HalfedgeId>> twos(const Triangles& faces,
                                                    std::vector<HalfedgeId> halfedges,
                                                    Group group) {
  const auto key = [&](HalfedgeId h) { return std::pair(group(h), ends(faces, h)); };
  std::sort(halfedges.begin(), halfedges.end(), [&](HalfedgeId g, HalfedgeId h) {
    return std::pair(key(g), g) < std::pair(key(h), h);
  });
  std::vector<std::pair<HalfedgeId, HalfedgeId>> found;
  for (std::size_t i = 0, next = 0; i < halfedges.size(); i = next) {
    while (next < halfedges.size() && key(halfedges[next]) == key(halfedges[i])) ++next;
    if (next - i == 2) found.emplace_back(halfedges[i], halfedges[i + 1]);
  }
  return found;
}

}  // namespace

std::vector<Index> polygons_of(const Triangles& faces, Index vertex_count,
                               const IndexPairs& diagonals) {
  const std::vector<char> flags = flag_pairs(faces, vertex_count, &diagonals);
  std::vector<HalfedgeId> flagged;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(flags.size()); ++h) {
    if (flags[at(h)] != 0) flagged.push_back(h);
  }
  DisjointSets joined(static_cast<Index>(faces.rows()));
  for (const auto& [h, o] : twos(faces, std::move(flagged), [](HalfedgeId) { return 0; }))
    joined.join(h / 3, o / 3);
  std::vector<Index> polygon;
  for (FaceId f = 0; f < faces.rows(); ++f) polygon.push_back(joined.find(f));
  return polygon;
}

IndexPairs sides_of_torn_polygons(const Triangles& faces, const std::vector<Index>& polygon,
                                  const Points2f& corner_uv) {
  const auto polygon_of = [&](HalfedgeId h) { return polygon[at(h / 3)]; };
  std::vector<Index> several = polygon;
  std::sort(several.begin(), several.end());
  std::vector<Index> once;
  for (std::size_t i = 0, next = 0; i < several.size(); i = next) {
    while (next < several.size() && several[next] == several[i]) ++next;
    if (next - i == 1) once.push_back(several[i]);
  }
  std::vector<HalfedgeId> halfedges;
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(faces.size()); ++h) {
    if (!std::binary_search(once.begin(), once.end(), polygon_of(h))) halfedges.push_back(h);
  }
  const auto inside = twos(faces, halfedges, polygon_of);
  const Points2 uv = corner_uv.cast<double>();
  std::vector<Index> torn;
  for (const auto& [h, o] : inside) {
    if (!continues_in_map(faces, uv, h, o)) torn.push_back(polygon_of(h));
  }
  if (torn.empty()) return IndexPairs(0, 2);
  std::sort(torn.begin(), torn.end());
  std::vector<char> diagonal(at(faces.size()), 0);
  for (const auto& [h, o] : inside) diagonal[at(h)] = diagonal[at(o)] = 1;
  std::vector<VertexPair> sides;
  for (const HalfedgeId h : halfedges) {
    if (diagonal[at(h)] == 0 && std::binary_search(torn.begin(), torn.end(), polygon_of(h)))
      sides.push_back(ends(faces, h));
  }
  sort_unique(sides);
  return rows_of(sides);
}

Fans split_fans(const Triangles& faces, const IndexPairs& cuts) {
  Fans result;
  result.faces.resize(faces.rows(), 3);
  if (faces.size() == 0) return result;
  if (faces.minCoeff() < 0)
    throw_invalid(ErrorCode::kIndexOutOfRange, "A triangle has a negative vertex. Correct it.");
  if (faces.maxCoeff() >= 2 * faces.size()) {
    std::vector<VertexId> ids;
    const Triangles ranked = compact(faces, ids);
    const IndexPairs pairs = cuts.unaryExpr([&](VertexId v) {
      const auto found = std::lower_bound(ids.begin(), ids.end(), v);
      const bool used = found != ids.end() && *found == v;
      return used ? static_cast<VertexId>(found - ids.begin()) : kInvalid;
    });
    result = split_fans(ranked, pairs);
    for (VertexId& v : result.origin) v = ids[at(v)];
    return result;
  }
  const std::vector<VertexPair> cut = sorted_pairs(cuts);
  DisjointSets fans(static_cast<Index>(faces.size()));  // of corners; the first stands for all
  const auto join = [&](CornerId a, CornerId b) {
    const auto [first, other] = std::minmax({fans.find(a), fans.find(b)});
    fans.join(other, first);
  };
  const Index vertices = faces.maxCoeff() + 1;
  for_each_edge(vertices, faces, ExecutionContext(), [&](std::span<const HalfedgeId> edge) {
    if (std::binary_search(cut.begin(), cut.end(), ends(faces, edge[0]))) return;
    for (const HalfedgeId h : edge.subspan(1)) {
      const bool same = source(faces, h) == source(faces, edge[0]);
      join(edge[0], same ? h : next_corner(h));
      join(next_corner(edge[0]), same ? next_corner(h) : h);
    }
  });
  const auto corners = corners_by_vertex(at(vertices), faces);
  VertexId* const number = result.faces.data();
  for (VertexId v = 0; v < vertices; ++v) {
    for (const CornerId c : corners[v]) {
      const CornerId first = fans.find(c);
      number[c] = first == c ? static_cast<VertexId>(result.origin.size()) : number[first];
      if (first == c) result.origin.push_back(v);
    }
  }
  return result;
}

namespace {

class SheetMaker {
 public:
  SheetMaker(const Triangles& faces, std::vector<HalfedgeId>& opposite,
             std::vector<std::vector<HalfedgeId>> doubtful, const std::vector<Index>* polygon)
      : faces_(faces), opposite_(opposite), doubtful_(std::move(doubtful)), polygon_(polygon) {}

  Sheets run() {
    do {
      number_fans();
    } while (part_edges());
    sort_by_origin();
    std::sort(result_.parted.begin(), result_.parted.end());
    return std::move(result_);
  }

 private:
  HalfedgeId rotate_ccw(HalfedgeId h) const { return opposite_[at(previous_corner(h))]; }
  HalfedgeId rotate_cw(HalfedgeId h) const {
    const HalfedgeId o = opposite_[at(h)];
    return o == kInvalid ? kInvalid : next_corner(o);
  }

  // Outgoing half-edges of the fan around h's source, counter-clockwise; true if it is closed.
  bool collect_fan(HalfedgeId h, std::vector<HalfedgeId>& fan) const {
    HalfedgeId first = h;
    HalfedgeId g = rotate_cw(h);
    for (; g != kInvalid && g != h; g = rotate_cw(g)) first = g;
    const bool closed = g == h;
    if (closed) first = h;
    fan.assign(1, first);
    for (g = rotate_ccw(first); g != kInvalid && g != first; g = rotate_ccw(g)) fan.push_back(g);
    return closed;
  }

  void number_fans() {
    result_.vertex.assign(opposite_.size(), kInvalid);
    result_.origin.clear();
    std::vector<HalfedgeId> fan;
    for (CornerId c = 0; c < static_cast<CornerId>(opposite_.size()); ++c) {
      if (result_.vertex[at(c)] != kInvalid) continue;
      collect_fan(c, fan);
      for (const HalfedgeId h : fan)
        result_.vertex[at(h)] = static_cast<VertexId>(result_.origin.size());
      result_.origin.push_back(faces_(c / 3, c % 3));
    }
  }

  std::pair<VertexId, VertexId> ends(HalfedgeId h) const {
    return std::minmax({result_.vertex[at(h)], result_.vertex[at(next_corner(h))]});
  }

  // Cuts fans where several edges have the same two ends; false if there are none.
  bool part_edges() {
    std::vector<HalfedgeId> to_cut;
    std::vector<HalfedgeId> edge;
    for (std::vector<HalfedgeId>& halfedges : doubtful_) {
      std::sort(halfedges.begin(), halfedges.end(), [&](HalfedgeId g, HalfedgeId h) {
        return std::pair(ends(g), g) < std::pair(ends(h), h);
      });
      for (std::size_t i = 0; i < halfedges.size();) {
        const auto shared = ends(halfedges[i]);
        edge.clear();
        for (; i < halfedges.size() && ends(halfedges[i]) == shared; ++i)
          edge.push_back(halfedges[i]);
        if (unit_count(edge) > 1) cut_between(edge, to_cut);
      }
    }
    bool any = false;
    for (const HalfedgeId h : to_cut) {
      const HalfedgeId o = opposite_[at(h)];
      if (o == kInvalid) continue;  // found from two edges
      opposite_[at(h)] = opposite_[at(o)] = kInvalid;
      result_.parted.push_back(std::min(h, o));
      doubtful_.push_back({h, o});
      any = true;
    }
    return any;
  }

  static bool contains(const std::vector<HalfedgeId>& edge, HalfedgeId h) {
    return std::find(edge.begin(), edge.end(), h) != edge.end();
  }
  // Pairs and borders among half-edges with the same ends.
  std::size_t unit_count(const std::vector<HalfedgeId>& edge) const {
    std::size_t count = 0;
    for (const HalfedgeId h : edge) {
      const HalfedgeId o = opposite_[at(h)];
      count += o == kInvalid || o > h || !contains(edge, o) ? 1 : 0;
    }
    return count;
  }
  // The pair or border of `edge` that a face of the fan has at the fan's vertex: its lower
  // half-edge; kInvalid if it has none.
  HalfedgeId unit_at(const std::vector<HalfedgeId>& edge, HalfedgeId outgoing) const {
    for (const HalfedgeId h : {outgoing, previous_corner(outgoing)}) {
      if (!contains(edge, h)) continue;
      const HalfedgeId o = opposite_[at(h)];
      return o == kInvalid ? h : std::min(h, o);
    }
    return kInvalid;
  }

  // One spoke in every gap between the pairs and borders around their common lower end.
  void cut_between(const std::vector<HalfedgeId>& edge, std::vector<HalfedgeId>& to_cut) const {
    const VertexId low = ends(edge.front()).first;
    const HalfedgeId any =
        result_.vertex[at(edge.front())] == low ? edge.front() : next_corner(edge.front());
    std::vector<HalfedgeId> fan;
    const bool closed = collect_fan(any, fan);
    std::vector<std::pair<std::size_t, HalfedgeId>> places;  // in the fan, and which unit
    for (std::size_t i = 0; i < fan.size(); ++i) {
      const HalfedgeId unit = unit_at(edge, fan[i]);
      if (unit != kInvalid) places.emplace_back(i, unit);
    }
    for (std::size_t p = 0; p < places.size(); ++p) {
      const bool last = p + 1 == places.size();
      if (last && !closed) break;
      const auto& [from, unit] = places[p];
      const auto& [to, next_unit] = places[last ? 0 : p + 1];
      if (unit == next_unit) continue;
      const std::size_t length = (to + fan.size() - from) % fan.size();
      to_cut.push_back(previous_corner(fan[(from + middle(fan, from, length)) % fan.size()]));
    }
  }
  bool inside_polygon(HalfedgeId h) const {
    const HalfedgeId o = opposite_[at(h)];
    return o != kInvalid && same_number(polygon_, h / 3, o / 3);
  }
  // Of the first `length` spokes behind fan[from], the one in the middle, or the nearest to it that
  // is no diagonal if there is one.
  std::size_t middle(const std::vector<HalfedgeId>& fan, std::size_t from,
                     std::size_t length) const {
    const std::size_t half = (length - 1) / 2;
    for (std::size_t away = 0; away <= half + 1; ++away) {
      for (const std::size_t i : {half - std::min(away, half), half + away}) {
        if (i >= length) continue;
        if (!inside_polygon(previous_corner(fan[(from + i) % fan.size()]))) return i;
      }
    }
    return half;
  }

  void sort_by_origin() {
    const std::size_t count = result_.origin.size();
    std::vector<VertexId> order(count);
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](VertexId a, VertexId b) {
      return result_.origin[at(a)] < result_.origin[at(b)];
    });
    std::vector<VertexId> rank(count);
    std::vector<VertexId> origin(count);
    for (std::size_t i = 0; i < count; ++i) {
      rank[at(order[i])] = static_cast<VertexId>(i);
      origin[i] = result_.origin[at(order[i])];
    }
    for (VertexId& v : result_.vertex) v = rank[at(v)];
    result_.origin = std::move(origin);
  }

  const Triangles& faces_;
  std::vector<HalfedgeId>& opposite_;
  std::vector<std::vector<HalfedgeId>> doubtful_;
  const std::vector<Index>* polygon_;
  Sheets result_;
};

}  // namespace

Sheets make_sheets(const Triangles& faces, std::vector<HalfedgeId>& opposite,
                   std::vector<std::vector<HalfedgeId>> doubtful,
                   const std::vector<Index>* polygon) {
  return SheetMaker(faces, opposite, std::move(doubtful), polygon).run();
}

}  // namespace flipfree::mesh
