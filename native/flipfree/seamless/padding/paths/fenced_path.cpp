#include "flipfree/seamless/padding/paths/fenced_path.h"

#include <algorithm>
#include <cstddef>
#include <set>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/seamless/padding/paths/free_path.h"

namespace flipfree::seamless {
namespace {

[[noreturn]] void no_way(VertexId v) {
  throw_not_converged(ErrorCode::kIterationLimit,
                      "The cut found no way between the cones from vertex " + std::to_string(v) +
                          " on. Refine the mesh, or take other cones.",
                      ElementKind::kVertex, {v});
}

class Fencer {
 public:
  Fencer(Canvas& canvas, const DiskBoundary& boundary, const ExecutionContext& context)
      : canvas_(canvas), context_(context) {
    for (const HalfedgeId h : boundary.halfedges)
      places_.emplace_back(canvas.mesh().source(h), canvas.mesh().target(h));
  }

  // Refinement renumbers half-edges: places are known by their edge's ends.
  HalfedgeId sector(Index place) const {
    return canvas_.mesh().find(places_[at(place)].first, places_[at(place)].second);
  }

  // A tree from places of the boundary to all these cones. Returns the vertex and the second one of
  // the first fence.
  std::pair<VertexId, VertexId> fence(const std::vector<Index>& places, std::set<VertexId> cones) {
    std::pair<VertexId, VertexId> first = {kInvalid, kInvalid};
    std::vector<VertexId> tree;
    while (!cones.empty()) {
      WayStart from;
      for (const Index place : places) from.sectors.push_back(sector(place));
      from.vertices = tree;
      const std::vector<HalfedgeId> path = free_path(
          canvas_, from, {nullptr, [&](VertexId v) { return cones.contains(v); }}, context_);
      if (path.empty()) no_way(*cones.begin());
      if (tree.empty())
        first = {canvas_.mesh().source(path.front()), canvas_.mesh().target(path.front())};
      for (const HalfedgeId h : path) tree.push_back(canvas_.mesh().target(h));
      cones.erase(tree.back());
      canvas_.draw(path, Curve::kFence);
    }
    return first;
  }

  std::vector<HalfedgeId> pass(HalfedgeId from, HalfedgeId to) {
    std::vector<HalfedgeId> path = free_path(
        canvas_, {{from}, {}}, {[&](HalfedgeId s) { return s == to; }, nullptr}, context_);
    if (path.empty()) no_way(canvas_.mesh().source(from));
    canvas_.remove_fences();
    return path;
  }

 private:
  Canvas& canvas_;
  const ExecutionContext& context_;
  std::vector<std::pair<VertexId, VertexId>> places_;
};

std::set<VertexId> other_cones(const Canvas& canvas, const std::vector<VertexId>& cones) {
  std::set<VertexId> others;
  for (VertexId v = 0; v < canvas.vertex_count(); ++v) {
    if (canvas.excess(v) != 0) others.insert(v);
  }
  for (const VertexId v : cones) others.erase(v);
  return others;
}

}  // namespace

std::vector<HalfedgeId> fenced_path(Canvas& canvas, const DiskBoundary& boundary,
                                    const PathEnds& ends, const std::vector<VertexId>& inside,
                                    const ExecutionContext& context) {
  Fencer fencer(canvas, boundary, context);
  fencer.fence(boundary.places_between(ends.to, ends.from), {inside.begin(), inside.end()});
  fencer.fence(boundary.places_between(ends.from, ends.to), other_cones(canvas, inside));
  return fencer.pass(fencer.sector(ends.from), fencer.sector(ends.to));
}

std::vector<HalfedgeId> fenced_loop(Canvas& canvas, const DiskBoundary& boundary, Index place,
                                    VertexId inside, const ExecutionContext& context) {
  Fencer fencer(canvas, boundary, context);
  // The fence to the cone divides the place's sector in two: the loop's ends.
  const auto [root, second] = fencer.fence({place}, {inside});
  fencer.fence(boundary.places_between(place, place), other_cones(canvas, {inside}));
  return fencer.pass(canvas.mesh().find(root, second), fencer.sector(place));
}

}  // namespace flipfree::seamless
