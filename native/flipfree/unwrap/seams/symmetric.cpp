#include "flipfree/unwrap/seams/symmetric.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "flipfree/base/disjoint_sets.h"
#include "flipfree/base/failure.h"
#include "flipfree/mesh/face_area.h"
#include "flipfree/unwrap/chart/chart.h"
#include "flipfree/unwrap/islands/islands.h"
#include "flipfree/unwrap/packing/layout.h"
#include "flipfree/unwrap/seams/made_parts.h"
#include "flipfree/unwrap/seams/search.h"
#include "flipfree/unwrap/seams/sheet.h"

namespace flipfree::unwrap {
namespace {

// What symmetric seams may cost, over what was found.
constexpr double kMostForSymmetry = 1.28;
// What a further island costs, as a share of all seams.
constexpr double kPriceOfIsland = 0.03;
// More islands than were found only for nets, which are not stretched.
constexpr Stretch kNets = {1.002, 1.2};

// Per half-edge, on which side of the plane its edge lies: 1, -1, or 0 in the middle.
std::vector<int> sides_of(const mesh::Surface& surface, const Mirror& mirror) {
  const auto way = [&](VertexId v) -> Vector3 {
    return (surface.vertices.row(v) - surface.vertices.row(mirror.image[at(v)])).transpose();
  };
  Vector3 normal = Vector3::Zero();
  for (const VertexId v : surface.faces.triangles().reshaped()) {
    if (way(v).squaredNorm() > normal.squaredNorm()) normal = way(v);
  }
  const double least = 1e-4 * normal.squaredNorm();
  std::vector<int> sides(at(static_cast<Index>(surface.faces.size())));
  for (HalfedgeId h = 0; h < static_cast<HalfedgeId>(sides.size()); ++h) {
    const double x =
        normal.dot(way(mesh::source(surface.faces, h)) + way(mesh::target(surface.faces, h)));
    sides[at(h)] = x > least ? 1 : x < -least ? -1 : 0;
  }
  return sides;
}

// Seams as they are on this side of the plane, and their images; 0: those of both sides.
mesh::EdgeFlags mirrored_cut(const mesh::EdgeFlags& cut, const Mirror& mirror,
                             const std::vector<int>& sides, int side) {
  mesh::EdgeFlags result = cut;
  for (std::size_t h = 0; h < cut.size(); ++h) {
    const HalfedgeId image = mirror.edge[h];
    if (image == kInvalid || sides[h] * side > 0) continue;
    result[h] = cut[at(image)];
    if (sides[h] * side == 0) result[h] |= cut[h];
  }
  return result;
}

// Islands that a plane maps onto each other, and what is made of them.
class Symmetrizer {
 public:
  Symmetrizer(const Islands& found, const std::vector<Points2>& uv, const mesh::Surface& surface,
              const mesh::Adjacency& adjacency, const std::vector<double>& cost,
              const Mirror& mirror, const UnwrapOptions& options)
      : found_(found),
        surface_(surface),
        adjacency_(adjacency),
        cost_(cost),
        options_(options),
        area_(mesh::area_of(surface)),
        cut_(found.cut),
        before_(surface.faces.size(), 2) {
    std::vector<Index> island(at(static_cast<Index>(surface.faces.rows())));
    for (std::size_t c = 0; c < uv.size(); ++c) {
      const mesh::Chart& chart = found.charts[c];
      for (const FaceId f : chart.faces) island[at(f)] = static_cast<Index>(c);
      put_corners(chart, uv[c], before_);
    }
    corner_uv_ = before_;
    DisjointSets sets(static_cast<Index>(uv.size()));
    for (std::size_t h = 0; h < cut_.size(); ++h) {
      const HalfedgeId image = mirror.edge[h];
      if (image == kInvalid || adjacency.opposite[h] == kInvalid || cut_[h] != 0) continue;
      for (const HalfedgeId other : {image, adjacency.opposite[at(image)]})
        sets.join(island[h / 3], island[at(other / 3)]);
    }
    for (const Index i : island) group_.push_back(sets.find(i));
    count_ = counts(found);
    most_ = prices(cut_, count_);
    for (double& most : most_) most *= kMostForSymmetry;
  }

  // Takes seams of a side for the groups in which they are usable, and cost less than what is
  // there.
  void use(const mesh::EdgeFlags& cut, const mesh::EdgeFlags& uncuttable,
           ExecutionContext& context) {
    const Islands islands = make_islands(surface_, adjacency_, cut, uncuttable, false, context);
    const std::vector<std::size_t> count = counts(islands);
    const std::vector<double> price = prices(cut, count);
    std::vector<char> is_better(most_.size(), 0);
    for (std::size_t g = 0; g < most_.size(); ++g) is_better[g] = price[g] <= most_[g] ? 1 : 0;
    for (std::size_t h = 0; h < cut.size(); ++h)
      if (islands.added[h] != 0) is_better[at(group_[h / 3])] = 0;
    Points2 corner_uv = before_;
    for (const mesh::Chart& chart : islands.charts) {
      const std::size_t group = group_of(chart);
      if (is_better[group] == 0 || part_of(chart, cut) == part_of(chart, found_.cut)) continue;
      const bool has_more = count[group] > count_[group];
      const Stretch bound = has_more ? kNets : stretch_bound(options_.seams.stretch);
      if ((has_more && mesh::area_of(chart.surface) < kSliver * area_) ||
          !lay_flat(chart, part_of(chart, cut), bound, corner_uv, context))
        is_better[group] = 0;
    }
    for (std::size_t h = 0; h < cut.size(); ++h) {
      if (is_better[at(group_[h / 3])] == 0) continue;
      cut_[h] = cut[h];
      const auto row = static_cast<Eigen::Index>(h);
      corner_uv_.row(row) = corner_uv.row(row);
      most_[at(group_[h / 3])] = price[at(group_[h / 3])];
    }
  }

  // With maps in `uv`.
  Islands result(const mesh::EdgeFlags& uncuttable, std::vector<Points2>& uv,
                 ExecutionContext& context) const {
    Islands islands = make_islands(surface_, adjacency_, cut_, uncuttable, false, context);
    uv.clear();
    for (const mesh::Chart& chart : islands.charts) uv.push_back(by_vertex(chart, corner_uv_));
    for (std::size_t h = 0; h < cut_.size(); ++h) {
      const bool was_given = found_.cut[h] != 0 && found_.added[h] == 0;
      islands.added[h] = islands.cut[h] != 0 && !was_given ? 1 : 0;
    }
    return islands;
  }

 private:
  std::size_t group_of(const mesh::Chart& chart) const { return at(group_[at(chart.faces[0])]); }

  // Per group, as what follows.
  std::vector<std::size_t> counts(const Islands& islands) const {
    std::vector<std::size_t> count(found_.charts.size(), 0);
    for (const mesh::Chart& chart : islands.charts) ++count[group_of(chart)];
    return count;
  }
  std::vector<double> prices(const mesh::EdgeFlags& cut,
                             const std::vector<std::size_t>& islands) const {
    std::vector<double> price(islands.size(), 0.0);
    for (std::size_t h = 0; h < cut.size(); ++h)
      if (cut[h] != 0) price[at(group_[h / 3])] += std::min(cost_[h], kForbidden);
    for (std::size_t g = 0; g < price.size(); ++g)
      price[g] *= 1.0 + kPriceOfIsland * static_cast<double>(islands[g]);
    return price;
  }

  // False if the island is no map within the bound. A part of what was keeps its map, unless it
  // has one without stretch.
  bool lay_flat(const mesh::Chart& chart, const mesh::EdgeFlags& cut, const Stretch& bound,
                Points2& corner_uv, ExecutionContext& context) const {
    const mesh::EdgeFlags before = part_of(chart, found_.cut);
    bool is_part = true;
    for (std::size_t h = 0; h < cut.size(); ++h) is_part = is_part && cut[h] >= before[h];
    const auto stretch = [&](const Points2& uv) {
      return stretch_of(chart.surface, by_corner(chart.surface.faces, uv));
    };
    const bool keeps = is_part && stretch(by_vertex(chart, corner_uv)).within(bound);
    FlattenOptions flatten;
    flatten.max_iterations = options_.max_iterations;
    flatten.tolerance = options_.tolerance;
    flatten.acceptable = options_.acceptable;
    for (const bool bijective : {false, true}) {
      Stats ignored;
      flatten.bijective = bijective;
      const mesh::InOwnUnit own(chart.surface);
      Outcome<FlatChart> flat =
          attempt([&] { return flatten_chart(own.surface(), flatten, context, ignored); });
      if (!flat) return keeps;
      flat->uv *= own.unit();
      const bool is_net = stretch(flat->uv).within(kNets);
      if (!is_net && (keeps || !stretch(flat->uv).within(bound))) return keeps;
      if (bijective || !options_.bijective) {
        put_corners(chart, flat->uv, corner_uv);
        return true;
      }
      // What is not stretched gives no way.
      if (is_net && overlaps_itself(chart.surface.faces, flat->uv, context)) return keeps;
    }
    return keeps;
  }

  const Islands& found_;
  const mesh::Surface& surface_;
  const mesh::Adjacency& adjacency_;
  const std::vector<double>& cost_;
  const UnwrapOptions& options_;
  const double area_;
  mesh::EdgeFlags cut_;
  Points2 before_;
  Points2 corner_uv_;
  std::vector<Index> group_;        // per face
  std::vector<std::size_t> count_;  // per group: islands that were found
  std::vector<double> most_;        // per group: what its seams may cost
};

}  // namespace

void make_symmetric(Islands& islands, std::vector<Points2>& uv, const mesh::Surface& surface,
                    const Points3& placed, const mesh::Adjacency& adjacency, const Mirror& mirror,
                    const std::vector<double>& cost, const mesh::EdgeFlags& given,
                    const mesh::EdgeFlags& uncuttable, const UnwrapOptions& options,
                    ExecutionContext& context) {
  if (uv.empty() || mirror.empty()) return;
  const mesh::Surface as_placed{placed, surface.faces};
  const std::vector<int> sides = sides_of(mesh::InOwnUnit(as_placed).surface(), mirror);
  const mesh::EdgeFlags& cut = islands.cut;
  if (mirrored_cut(cut, mirror, sides, 0) == cut || mirrored_cut(given, mirror, sides, 0) != given)
    return;
  Symmetrizer symmetrizer(islands, uv, surface, adjacency, cost, mirror, options);
  ended_in_time([&] {
    for (const int side : {1, -1, 0})
      symmetrizer.use(mirrored_cut(cut, mirror, sides, side), uncuttable, context);
  });
  islands = symmetrizer.result(uncuttable, uv, context);
}

}  // namespace flipfree::unwrap
