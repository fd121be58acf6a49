#include "flipfree/seamless/padding/extra_path.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <set>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/seamless/padding/paths.h"
#include "flipfree/seamless/signature.h"

namespace flipfree::seamless {

namespace {

// The excess of the parts that paths between the T-nodes can make, one of each two.
std::vector<Index> part_excesses(Index genus) {
  return genus == 1 ? std::vector<Index>{-2} : std::vector<Index>{-2, -1, 1, 2, 3};
}

// A cone that alone is right for the part on one side of an extra path.
bool fits_alone(Index k, Index genus) { return k % 4 != 0 && k >= 2 && k <= 8 * genus - 2; }

std::vector<Index> places_on_holes(const Canvas& canvas, const DiskBoundary& boundary) {
  std::vector<Index> places;
  for (Index i = 0; i < boundary.size(); ++i) {
    if (boundary.corner[at(i)] == 0 && canvas.curve(boundary.halfedges[at(i)]) == Curve::kLoop)
      places.push_back(i);
  }
  return places;
}

// Where T-nodes can be: not at nodes, nor on both sides of one branch at different vertices.
bool can_be_t_nodes(const Canvas& canvas, const DiskBoundary& boundary, const PathEnds& ends) {
  if (boundary.corner[at(ends.from)] != 0 || boundary.corner[at(ends.to)] != 0) return false;
  const HalfedgeId from = boundary.halfedges[at(ends.from)];
  const HalfedgeId to = boundary.halfedges[at(ends.to)];
  if (boundary.branch[at(ends.from)] != boundary.branch[at(ends.to)]) return true;
  if (canvas.mesh().source(from) == canvas.mesh().source(to)) return true;
  // The same side if no corner is between them, one way or the other.
  return boundary.corners_between(ends.from, ends.to) == 0 ||
         boundary.corners_between(ends.to, ends.from) == 0;
}

// Fences need somewhere to begin.
bool has_room_for_fences(const DiskBoundary& boundary, const PathEnds& ends) {
  return (ends.from + 1) % boundary.size() != ends.to &&
         (ends.to + 1) % boundary.size() != ends.from;
}

}  // namespace

Pattern pattern_for(const std::vector<Index>& cones, Index genus) {
  if (genus == 0) return Pattern::kNone;
  if (std::all_of(cones.begin(), cones.end(), [](Index k) { return k % 4 == 0; }))
    return Pattern::kChain;
  if (genus < 3) {
    const std::vector<Index> excesses = part_excesses(genus);
    if (std::any_of(excesses.begin(), excesses.end(),
                    [&](Index e) { return cones_with_excess(cones, e).has_value(); }))
      return Pattern::kTwoTNodes;
  } else if (std::any_of(cones.begin(), cones.end(),
                         [&](Index k) { return fits_alone(k, genus); })) {
    return Pattern::kExtraPath;
  }
  if (std::find(cones.begin(), cones.end(), 1) != cones.end()) return Pattern::kLoop;
  throw_infeasible(
      ErrorCode::kBadAngles,
      "No torus has cones of 3 and 5 quarter turns alone. Move one of the cones' angles "
      "to a third one.",
      {"empty stratum", {{"genus", {1.0}}, {"cones", {3.0, 5.0}}}});
}

bool can_be_twisted(const std::vector<Index>& cones, Index genus) {
  // 4 genus - 2 corners of 8 genus; the other cones fit the others.
  return genus > 0 &&
         std::none_of(cones.begin(), cones.end(), [](Index k) { return k % 2 != 0; }) &&
         cones_with_excess(cones, 4 * genus - 6);
}

std::vector<JoinedSectors> joinable_sectors(const Canvas& canvas,
                                            const std::array<VertexId, 2>& t_nodes,
                                            const std::vector<Index>& cones) {
  const DiskBoundary boundary = disk_boundary(canvas);
  std::vector<JoinedSectors> joinable;
  for (const HalfedgeId from : canvas.drawn_around(t_nodes[0])) {
    for (const HalfedgeId to : canvas.drawn_around(t_nodes[1])) {
      const Index corners =
          left_corners(boundary, {boundary.place[at(from)], boundary.place[at(to)]});
      if (corners % 4 != 0 && cones_with_excess(cones, corners - kFlat))
        joinable.push_back({from, to});
    }
  }
  if (joinable.empty()) throw InternalError("no pattern of the cut fits the cones");
  return joinable;
}

bool draw_shortest_joining_path(Canvas& canvas, const std::vector<JoinedSectors>& sectors,
                                const ExecutionContext& context) {
  const DiskBoundary boundary = disk_boundary(canvas);
  std::set<Index> from, to;
  std::set<std::pair<Index, Index>> pairs;
  for (const auto& [f, t] : sectors) {
    from.insert(boundary.place[at(f)]);
    to.insert(boundary.place[at(t)]);
    pairs.emplace(boundary.place[at(f)], boundary.place[at(t)]);
  }
  const auto path = shortest_separating_path(
      canvas, boundary, {from.begin(), from.end()}, {to.begin(), to.end()},
      [&](const PathEnds& ends) {
        return pairs.contains({ends.from, ends.to});
      },
      context);
  if (path) canvas.draw(path->halfedges, Curve::kExtra);
  return path.has_value();
}

void draw_fenced_joining_path(Canvas& canvas, const std::vector<JoinedSectors>& sectors,
                              const std::vector<Index>& cones, const ExecutionContext& context) {
  const DiskBoundary boundary = disk_boundary(canvas);
  const PathEnds ends{boundary.place[at(sectors.front()[0])],
                      boundary.place[at(sectors.front()[1])]};
  const auto inside = cones_with_excess(cones, left_corners(boundary, ends) - kFlat);
  if (!inside) throw InternalError("cones that do not fit between the sectors");
  canvas.draw(fenced_path(canvas, boundary, ends, *inside, context), Curve::kExtra);
}

bool draw_shortest_extra_path(Canvas& canvas, const ExecutionContext& context) {
  const DiskBoundary boundary = disk_boundary(canvas);
  const auto allowed = [&](const PathEnds& ends) { return can_be_t_nodes(canvas, boundary, ends); };
  std::vector<Index> anywhere;
  for (Index i = 0; i < boundary.size(); ++i) {
    if (boundary.corner[at(i)] == 0) anywhere.push_back(i);
  }
  const auto path = shortest_separating_path(canvas, boundary, places_on_holes(canvas, boundary),
                                             anywhere, allowed, context);
  if (path) canvas.draw(path->halfedges, Curve::kExtra);
  return path.has_value();
}

void draw_fenced_extra_path(Canvas& canvas, const std::vector<Index>& cones, Index genus,
                            const ExecutionContext& context) {
  const DiskBoundary boundary = disk_boundary(canvas);
  // The cone with the fewest corners around it.
  VertexId cone = kInvalid;
  for (VertexId v = 0; v < static_cast<VertexId>(cones.size()); ++v) {
    if (fits_alone(cones[at(v)], genus) && (cone == kInvalid || cones[at(v)] < cones[at(cone)]))
      cone = v;
  }
  for (const Index f : places_on_holes(canvas, boundary)) {
    for (Index t = 0; t < boundary.size(); ++t) {
      const PathEnds ends{f, t};
      if (f == t || !can_be_t_nodes(canvas, boundary, ends) ||
          left_corners(boundary, ends) != cones[at(cone)] || !has_room_for_fences(boundary, ends))
        continue;
      canvas.draw(fenced_path(canvas, boundary, ends, {cone}, context), Curve::kExtra);
      return;
    }
  }
  throw InternalError("no place on the cut is right for the extra path");
}

std::vector<HalfedgeId> sectors_on_holes(const Canvas& canvas) {
  const DiskBoundary boundary = disk_boundary(canvas);
  std::vector<HalfedgeId> sectors;
  for (const Index place : places_on_holes(canvas, boundary))
    sectors.push_back(boundary.halfedges[at(place)]);
  return sectors;
}

void draw_loop_around_cone(Canvas& canvas, const std::vector<HalfedgeId>& sectors,
                           const std::vector<Index>& cones, const ExecutionContext& context) {
  const DiskBoundary boundary = disk_boundary(canvas);
  const auto is_end = [&](VertexId v) { return at(v) < cones.size() && cones[at(v)] == 1; };
  const std::vector<HalfedgeId> path = free_path(canvas, {sectors, {}}, {nullptr, is_end}, context);
  if (path.empty()) throw InternalError("no way from the cut to a cone");
  const Index place = boundary.place[at(canvas.sector_of(path.front()))];
  const VertexId cone = canvas.mesh().target(path.back());
  canvas.draw(fenced_loop(canvas, boundary, place, cone, context), Curve::kExtra);
}

namespace {

// How a sum was reached first.
struct Step {
  VertexId last = kInvalid;
  Index before = 0;  // the sum without it
};

}  // namespace

std::optional<std::vector<VertexId>> cones_with_excess(const std::vector<Index>& cones,
                                                       Index excess) {
  Index lowest = 0;
  Index highest = 0;
  for (const Index k : cones) (k < kFlat ? lowest : highest) += k - kFlat;
  if (excess < lowest || excess > highest) return std::nullopt;
  std::vector<Step> steps(static_cast<std::size_t>(highest - lowest + 1));
  const auto step = [&](Index sum) -> Step& { return steps[at(sum - lowest)]; };
  std::vector<Index> sums = {0};
  for (VertexId v = 0; v < static_cast<VertexId>(cones.size()); ++v) {
    const Index more = cones[at(v)] - kFlat;
    if (more == 0) continue;
    // Sums that are new now have v last, so that no cone is taken twice.
    const std::size_t known = sums.size();
    for (std::size_t i = 0; i < known; ++i) {
      const Index sum = sums[i] + more;
      if (sum == 0 || step(sum).last != kInvalid) continue;
      step(sum) = {v, sums[i]};
      sums.push_back(sum);
    }
    if (step(excess).last != kInvalid) break;
  }
  if (step(excess).last == kInvalid) return std::nullopt;
  std::vector<VertexId> found;
  for (Index sum = excess; sum != 0; sum = step(sum).before) found.push_back(step(sum).last);
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace flipfree::seamless
