#include "flipfree/matchmaker/walk_pins.h"

#include <algorithm>
#include <cstddef>
#include <deque>
#include <set>

#include "flipfree/base/error.h"
#include "flipfree/distortion/energy.h"
#include "flipfree/distortion/rest_shapes.h"
#include "flipfree/distortion/targets.h"
#include "flipfree/matchmaker/first_try.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree {
namespace {

// Newton steps allowed for one pin, and for all of them together.
constexpr int kStepsPerPin = 60;
constexpr int kStepsTogether = 200;
// Triangles split when a pin is blocked: the most distorted ones and those around the pin.
constexpr std::size_t kSplitFaces = 24;

class Walker {
 public:
  Walker(RefinedMap& map, const Constraints& constraints, ExecutionContext& context)
      : map_(map), constraints_(constraints), context_(context), chart_(to_surface(map.surface)) {
    if (!constraints.free_boundary()) held_ = map.surface.boundary;
  }

  // Moves these pins; true if all arrive. The map is replaced in any case where `keep_partial`,
  // else on success only.
  bool move(const std::vector<PinnedVertex>& pins, int steps, bool keep_partial) {
    MinimizeOptions options;
    options.max_iterations = steps;
    options.fixed = held_;
    std::vector<std::pair<VertexId, Vector2>> targets;
    for (const PinnedVertex& p : pins) targets.emplace_back(p.vertex, p.uv);
    Stats unused;
    TargetsResult result;
    try {
      result = minimize_with_targets(chart_, map_.uv, targets, options, context_, unused);
    } catch (const NotConverged&) {
      return false;  // too squeezed for the Newton system: blocked, like any other
    }
    const bool arrived = result.missed.empty();
    if (arrived || keep_partial) map_.uv = std::move(result.uv);
    if (arrived) {
      for (const PinnedVertex& p : pins) held_.push_back(p.vertex);
    }
    return arrived;
  }

  // Splits the edges of the triangles that resist most. Midpoints keep the map valid up to
  // rounding, which is checked.
  void refine_around(VertexId pin) {
    const std::vector<distortion::RestTriangle> rest =
        distortion::build_rest_shapes(chart_, context_).triangles;
    std::vector<std::pair<double, FaceId>> worst;
    for (FaceId f = 0; f < chart_.faces.rows(); ++f) {
      const auto at = [&](Index k) { return map_.uv.row(chart_.faces(f, k)).data(); };
      const distortion::Jacobian j =
          distortion::jacobian(rest[static_cast<std::size_t>(f)], at(0), at(1), at(2));
      worst.emplace_back(-distortion::symmetric_dirichlet(j), f);
    }
    const std::size_t count = std::min(kSplitFaces, worst.size());
    std::partial_sort(worst.begin(), worst.begin() + static_cast<std::ptrdiff_t>(count),
                      worst.end());
    std::set<std::pair<VertexId, VertexId>> edges;
    const auto add = [&](FaceId f) {
      for (Index k = 0; k < 3; ++k) {
        const VertexId a = chart_.faces(f, k);
        const VertexId b = chart_.faces(f, (k + 1) % 3);
        edges.emplace(std::min(a, b), std::max(a, b));
      }
    };
    for (std::size_t i = 0; i < count; ++i) add(worst[i].second);
    for (FaceId f = 0; f < chart_.faces.rows(); ++f) {
      if (chart_.faces(f, 0) == pin || chart_.faces(f, 1) == pin || chart_.faces(f, 2) == pin)
        add(f);
    }
    RefinedSurface& surface = map_.surface;
    for (const auto& [a, b] : edges) {
      const HalfedgeId h = surface.mesh.find(a, b);
      if (surface.mesh.is_boundary(h)) continue;
      const Vector2 middle = 0.5 * (map_.uv.row(a) + map_.uv.row(b)).transpose();
      if (!splits_well(h, middle) || !splits_well(surface.mesh.opposite(h), middle)) continue;
      surface.split_edge(h);
      map_.uv.conservativeResize(surface.mesh.vertex_count(), 2);
      map_.uv.row(map_.uv.rows() - 1) = middle.transpose();
    }
    chart_ = to_surface(surface);
  }

 private:
  bool splits_well(HalfedgeId h, const Vector2& middle) const {
    const EditableTriangulation& mesh = map_.surface.mesh;
    const Vector2 a = map_.uv.row(mesh.source(h)).transpose();
    const Vector2 b = map_.uv.row(mesh.target(h)).transpose();
    const Vector2 c = map_.uv.row(mesh.apex(h)).transpose();
    return orientation(a, middle, c) > 0 && orientation(middle, b, c) > 0;
  }

  RefinedMap& map_;
  const Constraints& constraints_;
  ExecutionContext& context_;
  Surface chart_;
  std::vector<VertexId> held_;
};

}  // namespace

bool walk_pins(RefinedMap& map, const Constraints& constraints, Index added_limit,
               ExecutionContext& context, Stats& stats) {
  if (constraints.pins.empty()) return true;
  const Index before = map.surface.mesh.vertex_count();
  Walker walker(map, constraints, context);
  const ProgressRange quiet(context, 0.0, 0.0);
  if (walker.move(constraints.pins, kStepsTogether, false)) {
    stats["walk.mode"] = std::string("together");
    return true;
  }
  stats["walk.mode"] = std::string("one by one");
  std::deque<PinnedVertex> waiting(constraints.pins.begin(), constraints.pins.end());
  std::stable_sort(waiting.begin(), waiting.end(),
                   [&](const PinnedVertex& a, const PinnedVertex& b) {
                     return (map.uv.row(a.vertex).transpose() - a.uv).squaredNorm() <
                            (map.uv.row(b.vertex).transpose() - b.uv).squaredNorm();
                   });
  std::int64_t splits = 0;
  std::size_t refused = 0;  // pins in a row that could not move
  while (!waiting.empty()) {
    const PinnedVertex pin = waiting.front();
    waiting.pop_front();
    const bool all_refused = refused >= waiting.size() + 1;
    if (walker.move({pin}, kStepsPerPin, all_refused)) {
      refused = 0;
      continue;
    }
    if (!all_refused) {
      ++refused;
      waiting.push_back(pin);
      continue;
    }
    // Nobody can move: make room here, and go on with the same pin from where it stopped.
    waiting.push_front(pin);
    const Index present = map.surface.mesh.vertex_count();
    if (present - before >= added_limit) break;
    walker.refine_around(pin.vertex);
    if (map.surface.mesh.vertex_count() == present) break;  // no inner edge can be split
    ++splits;
  }
  stats["walk.refinements"] = splits;
  stats["walk.blocked"] = static_cast<std::int64_t>(waiting.size());
  return waiting.empty();
}

}  // namespace flipfree
