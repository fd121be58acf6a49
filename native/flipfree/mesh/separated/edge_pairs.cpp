#include "flipfree/mesh/separated/edge_pairs.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
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
  Pairer(const PairingInput& input, const std::vector<char>& turned, std::vector<HalfedgeId>& mate)
      : input_(input), turned_(turned), mate_(mate) {}

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
      HalfedgeId &one = mate_[at(crowd_[i])], &other = mate_[at(crowd_[k])];
      if (one != kInvalid || other != kInvalid) continue;
      one = crowd_[k];
      other = crowd_[i];
    }
  }

 private:
  VertexId apex(HalfedgeId h) const { return source(input_.faces, previous_corner(h)); }
  // Where h starts once its face is turned over, if it is.
  VertexId start(HalfedgeId h) const {
    const bool turned = !turned_.empty() && turned_[at(h / 3)] != 0;
    return turned ? target(input_.faces, h) : source(input_.faces, h);
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
    if (apex(a) == apex(b)) return 0.0;  // duplicates
    if (input_.has_map() && !continues_in_map(input_.faces, input_.corner_uv, a, b)) return 0.0;
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
  std::vector<HalfedgeId>& mate_;
  std::vector<HalfedgeId> crowd_;
  std::vector<Vector3> across_;
};

}  // namespace

bool continues_in_map(const Triangles& faces, const Points2& corner_uv, HalfedgeId a,
                      HalfedgeId b) {
  const bool same = source(faces, a) == source(faces, b);
  const CornerId first = same ? b : next_corner(b);
  const CornerId second = same ? next_corner(b) : b;
  return corner_uv.row(a) == corner_uv.row(first) &&
         corner_uv.row(next_corner(a)) == corner_uv.row(second);
}

EdgePairs pair_edges(const Points3& positions, const Triangles& faces,
                     const ExecutionContext& context) {
  EdgePairs result;
  result.mate.assign(at(faces.size()), kInvalid);
  for_each_edge(static_cast<Index>(positions.rows()), faces, context,
                [&](std::span<const HalfedgeId> edge) {
                  if (edge.size() < 2) return;
                  const std::size_t before = result.duplicate.size();
                  append_duplicates(faces, edge, result.duplicate);
                  if (edge.size() == 2 && result.duplicate.size() == before) {
                    result.mate[at(edge[0])] = edge[1];
                    result.mate[at(edge[1])] = edge[0];
                  } else {
                    result.several.emplace_back(edge.begin(), edge.end());
                  }
                });
  sort_unique(result.duplicate);
  return result;
}

void pair_crowds(const PairingInput& input, const std::vector<char>& turned, EdgePairs& pairs,
                 const ExecutionContext& context) {
  constexpr std::size_t kCheckEvery = 1 << 10;
  Pairer pairer(input, turned, pairs.mate);
  for (std::size_t i = 0; i < pairs.several.size(); ++i) {
    if (i % kCheckEvery == 0) context.check();
    const EdgeUse& edge = pairs.several[i];
    if (edge.size() > 2 && input.at_seam[at(edge.front())] == 0) pairer.pair_crowd(edge);
  }
}

namespace {

// Calls visit(h, o) where just two half-edges between the same vertices are of one group.
template <typename Group, typename Visit>
void for_each_two(const Triangles& faces, const Group& group, const Visit& visit) {
  const Index vertices = faces.size() == 0 ? 0 : faces.maxCoeff() + 1;
  std::vector<HalfedgeId> sorted;
  for_each_edge(vertices, faces, ExecutionContext(), [&](std::span<const HalfedgeId> edge) {
    sorted.assign(edge.begin(), edge.end());
    std::ranges::stable_sort(sorted, {}, group);
    for (std::size_t i = 0, next = 0; i < sorted.size(); i = next) {
      while (next < sorted.size() && group(sorted[next]) == group(sorted[i])) ++next;
      if (next - i == 2) visit(sorted[i], sorted[i + 1]);
    }
  });
}

}  // namespace

std::vector<Index> polygons_of(const Triangles& faces, Index vertex_count,
                               const IndexPairs& diagonals) {
  const std::vector<char> flags = flag_pairs(faces, vertex_count, &diagonals);
  DisjointSets joined(static_cast<Index>(faces.rows()));
  for_each_two(
      faces, [&](HalfedgeId h) { return flags[at(h)] != 0 ? kInvalid : h; },
      [&](HalfedgeId h, HalfedgeId o) { joined.join(h / 3, o / 3); });
  return joined.firsts();
}

IndexPairs sides_of_torn_polygons(const Triangles& faces, const std::vector<Index>& polygon,
                                  const Points2f& corner_uv) {
  const auto polygon_of = [&](HalfedgeId h) { return polygon[at(h / 3)]; };
  const Points2 uv = corner_uv.cast<double>();
  std::vector<char> diagonal(at(faces.size()), 0);
  std::vector<Index> torn;
  for_each_two(faces, polygon_of, [&](HalfedgeId h, HalfedgeId o) {
    diagonal[at(h)] = diagonal[at(o)] = 1;
    if (!continues_in_map(faces, uv, h, o)) torn.push_back(polygon_of(h));
  });
  std::sort(torn.begin(), torn.end());
  std::vector<VertexPair> sides;
  for (HalfedgeId h = 0; at(h) < diagonal.size(); ++h) {
    if (diagonal[at(h)] == 0 && std::binary_search(torn.begin(), torn.end(), polygon_of(h)))
      sides.push_back(ends(faces, h));
  }
  sort_unique(sides);
  return rows_of(sides);
}

CutMesh split_fans(const Triangles& given, const IndexPairs& cuts) {
  std::vector<VertexId> ids;
  const Triangles faces = compact(given, ids);
  const std::vector<VertexPair> cut = sorted_pairs(cuts);
  DisjointSets corners(static_cast<Index>(faces.size()));
  for_each_edge(
      static_cast<Index>(ids.size()), faces, ExecutionContext(),
      [&](std::span<const HalfedgeId> edge) {
        const auto [low, high] = ends(faces, edge[0]);
        if (std::binary_search(cut.begin(), cut.end(), VertexPair(ids[at(low)], ids[at(high)])))
          return;
        for (const HalfedgeId h : edge.subspan(1)) {
          const bool same = source(faces, h) == source(faces, edge[0]);
          corners.join(edge[0], same ? h : next_corner(h));
          corners.join(next_corner(edge[0]), same ? next_corner(h) : h);
        }
      });
  CutMesh fans = fans_of(given, corners);
  sort_by_origin(fans);
  return fans;
}

namespace {

class SheetMaker {
 public:
  SheetMaker(const Triangles& faces, Adjacency& adjacency,
             std::vector<std::vector<HalfedgeId>> doubtful, const std::vector<Index>& polygon)
      : faces_(faces),
        adjacency_(adjacency),
        opposite_(adjacency.opposite),
        doubtful_(std::move(doubtful)),
        polygon_(polygon) {}

  Sheets run() {
    do {
      result_.mesh = cut_along(faces_, adjacency_, {});
    } while (part_edges());
    sort_by_origin(result_.mesh);
    std::sort(result_.parted.begin(), result_.parted.end());
    return std::move(result_);
  }

 private:
  // Outgoing half-edges of the fan around h's source, counter-clockwise; true if it is closed.
  bool collect_fan(HalfedgeId h, std::vector<HalfedgeId>& fan) const {
    HalfedgeId first = h;
    HalfedgeId g = rotate_cw(adjacency_, h);
    for (; g != kInvalid && g != h; g = rotate_cw(adjacency_, g)) first = g;
    const bool closed = g == h;
    if (closed) first = h;
    fan.assign(1, first);
    while ((g = rotate_ccw(adjacency_, fan.back())) != kInvalid && g != first) fan.push_back(g);
    return closed;
  }

  VertexPair ends(HalfedgeId h) const { return mesh::ends(result_.mesh.faces, h); }

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
        source(result_.mesh.faces, edge.front()) == low ? edge.front() : next_corner(edge.front());
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

  const Triangles& faces_;
  const Adjacency& adjacency_;
  std::vector<HalfedgeId>& opposite_;  // of adjacency_
  std::vector<std::vector<HalfedgeId>> doubtful_;
  const std::vector<Index>& polygon_;
  Sheets result_;
};

}  // namespace

Sheets make_sheets(const Triangles& faces, Adjacency& adjacency,
                   std::vector<std::vector<HalfedgeId>> doubtful,
                   const std::vector<Index>& polygon) {
  return SheetMaker(faces, adjacency, std::move(doubtful), polygon).run();
}

}  // namespace flipfree::mesh
