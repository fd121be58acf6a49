#include "flipfree/mesh/separated/orientation.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <tuple>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/plane.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/islands.h"
#include "flipfree/mesh/separated/edge_pairs.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::mesh {

namespace {

class Orienter {
 public:
  Orienter(const PairingInput& input, EdgePairs& pairs)
      : positions_(input.positions),
        faces_(input.faces),
        closed_(input.at_seam),
        corner_uv_(input.corner_uv),
        polygon_(input.polygon),
        pairs_(pairs),
        mate_(pairs.mate) {
    // Areas are compared only: in a unit in which they neither overflow nor vanish.
    const double extent = positions_.size() == 0 ? 0.0 : positions_.cwiseAbs().maxCoeff();
    unit_ = extent > 0.0 ? 1.0 / extent : 1.0;
    if (!std::isfinite(unit_)) unit_ = 1.0;
    side_.assign(static_cast<std::size_t>(faces_.rows()), kUnknown);
    if (corner_uv_ != nullptr) find_contradictions();
  }

  Orientation run(const ExecutionContext& context) {
    if (corner_uv_ == nullptr) close_where_regions_contradict_themselves();
    orient_parts(context);
    Orientation result;
    result.turned = side_;
    const std::vector<HalfedgeId> opposed = opposed_mates();
    if (!opposed.empty()) list(opposed, result);
    for (const HalfedgeId h : opposed) {
      mate_[at(mate_[at(h)])] = kInvalid;
      mate_[at(h)] = kInvalid;
    }
    return result;
  }

 private:
  static constexpr char kUnknown = 2;

  bool same_direction(HalfedgeId h, HalfedgeId o) const {
    return source(faces_, h) == source(faces_, o);
  }
  bool agree(HalfedgeId h, HalfedgeId o) const {
    return same_direction(h, o) == (side_[at(h / 3)] != side_[at(o / 3)]);
  }
  double area(FaceId f) const {
    const Vector3 a = unit_ * positions_.row(faces_(f, 0));
    const Vector3 b = unit_ * positions_.row(faces_(f, 1));
    const Vector3 c = unit_ * positions_.row(faces_(f, 2));
    return (b - a).cross(c - a).norm();
  }

  void close(HalfedgeId h) { closed_[at(h)] = closed_[at(mate_[at(h)])] = 1; }
  bool are_of_polygon(FaceId f, FaceId g) const {
    return polygon_ != nullptr && (*polygon_)[at(f)] == (*polygon_)[at(g)];
  }

  // Faces that all agree and still contradict each other somewhere are a surface with one side
  // (around a vertex, or a handle, contradictions are even in number): no turning helps there.
  void close_where_regions_contradict_themselves() {
    DisjointSets region(static_cast<Index>(faces_.rows()));
    std::vector<HalfedgeId> opposed;
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(mate_.size()); ++h) {
      const HalfedgeId o = mate_[at(h)];
      if (o < h || closed_[at(h)] != 0) continue;
      if (!same_direction(h, o)) {
        region.join(h / 3, o / 3);
      } else if (!are_of_polygon(h / 3, o / 3)) {
        opposed.push_back(h);
      }
    }
    for (const HalfedgeId h : opposed) {
      if (region.find(h / 3) == region.find(mate_[at(h)] / 3)) close(h);
    }
  }

  void orient_parts(const ExecutionContext& context) {
    constexpr Index kCheckEvery = 1 << 14;
    std::fill(side_.begin(), side_.end(), kUnknown);
    for (FaceId f = 0; f < faces_.rows(); ++f) {
      if (f % kCheckEvery == 0) context.check();
      if (side_[at(f)] == kUnknown) orient_part(f);
    }
  }

  // The lower half-edges, ascending.
  std::vector<HalfedgeId> opposed_mates() const {
    std::vector<HalfedgeId> result;
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(mate_.size()); ++h) {
      if (mate_[at(h)] > h && !agree(h, mate_[at(h)])) result.push_back(h);
    }
    return result;
  }

  // By what is to be seen with a map and without: all mates across seams too, but no crowd.
  void list(const std::vector<HalfedgeId>& opposed, Orientation& result) const {
    std::vector<char> crowded(mate_.size(), 0);
    for (const EdgeUse& use : pairs_.crowded) {
      for (const HalfedgeId h : use) crowded[at(h)] = 1;
    }
    // Every face twice, once a side: f and count + f.
    const auto count = static_cast<Index>(faces_.rows());
    DisjointSets sides(2 * count);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(mate_.size()); ++h) {
      const HalfedgeId o = mate_[at(h)];
      if (o < h || crowded[at(h)] != 0) continue;
      const Index across = same_direction(h, o) ? count : 0;
      sides.join(h / 3, o / 3 + across);
      sides.join(h / 3 + count, o / 3 + count - across);
    }
    for (const HalfedgeId h : opposed) {
      if (crowded[at(h)] != 0) continue;
      const bool one = sides.find(h / 3) == sides.find(h / 3 + count);
      (one ? result.one_sided : result.opposed).push_back(h);
    }
  }

  // Marks the faces that hang together with contradicting windings.
  void find_contradictions() {
    DisjointSets joined(static_cast<Index>(faces_.rows()));
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(mate_.size()); ++h) {
      if (mate_[at(h)] > h) joined.join(h / 3, mate_[at(h)] / 3);
    }
    for (const auto* uses : {&pairs_.crowded, &pairs_.loose}) {
      for (const EdgeUse& use : *uses) {
        for (const HalfedgeId h : use) joined.join(h / 3, use.front() / 3);
      }
    }
    std::vector<char> twisted(side_.size(), 0);
    for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(mate_.size()); ++h) {
      const HalfedgeId o = mate_[at(h)];
      if (o > h && same_direction(h, o)) twisted[at(joined.find(h / 3))] = 1;
    }
    for (const auto* uses : {&pairs_.crowded, &pairs_.loose}) {
      for (const EdgeUse& use : *uses) twisted[at(joined.find(use.front() / 3))] = 1;
    }
    contradicted_.assign(side_.size(), 0);
    for (FaceId f = 0; f < faces_.rows(); ++f) contradicted_[at(f)] = twisted[at(joined.find(f))];
  }
  // With the exact sign, so that a part of slivers that are all positive is.
  double map_area(FaceId f) const {
    const Vector2 a = corner_uv_->row(3 * f);
    const Vector2 b = corner_uv_->row(3 * f + 1);
    const Vector2 c = corner_uv_->row(3 * f + 2);
    return numeric::orientation(a, b, c) *
           std::max(std::abs(cross(b - a, c - a)), std::numeric_limits<double>::min());
  }

  // The side of o's face that goes with that of h's.
  char side_across(HalfedgeId h, HalfedgeId o) const {
    return same_direction(h, o) != (side_[at(h / 3)] != 0) ? 1 : 0;
  }
  // A face, and all that is joined to it inside its polygon: no front meets another in there.
  void take(FaceId first, char side) {
    side_[at(first)] = side;
    std::size_t i = part_.size();
    part_.push_back(first);
    if (polygon_ == nullptr) return;
    for (; i < part_.size(); ++i) {
      const FaceId f = part_[i];
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
        const HalfedgeId o = mate_[at(h)];
        if (o == kInvalid || closed_[at(h)] != 0 || side_[at(o / 3)] != kUnknown) continue;
        if (!are_of_polygon(f, o / 3)) continue;
        side_[at(o / 3)] = side_across(h, o);
        part_.push_back(o / 3);
      }
    }
  }

  // Breadth first, so that the fronts of a one-sided part meet along a short cut.
  void orient_part(FaceId first) {
    part_.clear();
    take(first, 0);
    double kept = 0.0;
    double turned = 0.0;
    for (std::size_t i = 0; i < part_.size(); ++i) {
      const FaceId f = part_[i];
      (side_[at(f)] == 0 ? kept : turned) += area(f);
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
        const HalfedgeId o = mate_[at(h)];
        if (o == kInvalid || closed_[at(h)] != 0 || side_[at(o / 3)] != kUnknown) continue;
        take(o / 3, side_across(h, o));
      }
    }
    if (corner_uv_ != nullptr && contradicted_[at(first)] != 0) {
      double positive = 0.0;
      for (const FaceId f : part_) positive += side_[at(f)] == 0 ? map_area(f) : -map_area(f);
      turned = positive < 0.0 ? 1.0 : 0.0;
      kept = 0.0;
    }
    if (turned > kept) {
      for (const FaceId f : part_) side_[at(f)] = side_[at(f)] == 0 ? 1 : 0;
    }
  }

  const Points3& positions_;
  const Triangles& faces_;
  std::vector<char> closed_;  // 3 #F: no part goes on there
  const Points2* corner_uv_;
  const std::vector<Index>* polygon_;
  const EdgePairs& pairs_;
  std::vector<HalfedgeId>& mate_;
  double unit_ = 1.0;
  std::vector<char> side_;
  std::vector<FaceId> part_;
  std::vector<char> contradicted_;  // per face, where there is a map
};

}  // namespace

Orientation orient(const PairingInput& input, EdgePairs& pairs, const ExecutionContext& context) {
  return Orienter(input, pairs).run(context);
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
  std::vector<char> diagonal(static_cast<std::size_t>(faces.size()), 0);
  for (const auto& [h, o] : inside) diagonal[at(h)] = diagonal[at(o)] = 1;
  std::vector<VertexPair> sides;
  for (const HalfedgeId h : halfedges) {
    if (diagonal[at(h)] == 0 && std::binary_search(torn.begin(), torn.end(), polygon_of(h)))
      sides.push_back(ends(faces, h));
  }
  sort_unique(sides);
  return rows_of(sides);
}

}  // namespace flipfree::mesh
