#include "flipfree/matchmaker/walk/walk_pins.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include "flipfree/base/failure/outcome.h"
#include "flipfree/distortion/energy/own_map.h"
#include "flipfree/distortion/minimize/targets.h"
#include "flipfree/matchmaker/at_once/arms.h"
#include "flipfree/matchmaker/at_once/planned_walk.h"
#include "flipfree/matchmaker/finish/unfold_wholes.h"
#include "flipfree/matchmaker/request/time_share.h"
#include "flipfree/matchmaker/smooth/neighbourhood.h"
#include "flipfree/matchmaker/smooth/relax.h"
#include "flipfree/matchmaker/start/first_try.h"
#include "flipfree/matchmaker/take_back/take_back.h"
#include "flipfree/matchmaker/take_back/untangle_removal.h"
#include "flipfree/matchmaker/walk/corridor.h"
#include "flipfree/matchmaker/walk/push_point.h"

namespace flipfree::matchmaker {
namespace {

// Rounds of continuation, and Newton steps afterwards: for all pins together, and for one.
constexpr int kPullsTogether = 60;
constexpr int kStepsTogether = 200;
constexpr int kPullsPerPin = 12;
constexpr int kStepsPerPin = 30;
// Newton steps after a push to the target, after one on the way, and after refinement was taken
// back.
constexpr int kStepsAtTarget = 20;
constexpr int kStepsOnTheWay = 5;
// These steps move vertices within so many rings around what has changed.
constexpr int kRelaxRings = 6;
// ... unless there is more than an added vertex to so many of the input's.
constexpr Index kFar = 4;
// Rounds of taking refinement back after a push; they end early when one frees less than this share
// (in per cent).
constexpr int kMostRounds = 4;
constexpr Index kWorthwhile = 10;
// Rounds in which whole faces are unfolded then, with a free boundary.
constexpr int kRoundsOfUnfolding = 2;
// After one that was not worthwhile, when there are so many per cent of what it left.
constexpr Index kMoreToUnfold = 115;
// Vertices are made to make room for others to go when there are so many per cent, and so many,
// more than the last time.
constexpr Index kMuch = 130;
constexpr Index kMuchAtLeast = 200;
// A push may add so many vertices per vertex of the input, and a few more.
constexpr Index kMostAddedShare = 2;
constexpr Index kMostAddedLeast = 10000;
// A walk is given up when the vertices that its pushes left, summed over the pushes, exceed so many
// times the input's: many pins that permute far draw out more with every push, without end.
constexpr std::int64_t kMostDragged = 10;
// Where arms leave more than one added vertex to so many of the input's, a few pins may do better
// one by one; many never do.
constexpr Index kMuchOfArms = 2;
constexpr std::size_t kFewPins = 16;
// Corridors that are tried one after another: how far they reach beyond the leg, in units of its
// length, and how near they come to obstacles.
constexpr std::array<std::pair<double, double>, 3> kCorridors = {
    {{1.0, 0.8}, {0.3, 0.5}, {0.1, 0.2}}};
// What crossing an edge of the mesh costs a way, in units of the mean distance between edges and of
// the edge's stretch against that of most edges, up to a bound.
constexpr double kEdgeCost = 1.0;
constexpr double kMostStretch = 5.0;

class Walker {
 public:
  Walker(mesh::RefinedMap& map, const Constraints& constraints, ExecutionContext& context)
      : map_(map),
        constraints_(constraints),
        keep_(map.surface.mesh.vertex_count()),
        context_(context),
        chart_(to_surface(map.surface)) {
    if (!constraints.free_boundary()) held_ = map.surface.boundary;
    obstacles_.outline = constraints.outline;
  }

  // Moves these pins by continuation; true if all arrive, otherwise the map is as before.
  bool pull(const std::vector<PinnedVertex>& pins, int steps, int pulls) {
    distortion::MinimizeOptions options;
    options.max_iterations = steps;
    options.max_pulls = pulls;
    options.memory = &order_;
    options.fixed = held_;
    std::vector<std::pair<VertexId, Vector2>> targets;
    for (const PinnedVertex& p : pins) targets.emplace_back(p.vertex, p.uv);
    Stats unused;
    // Too squeezed for the Newton system: blocked, like any other.
    Outcome<distortion::TargetsResult> result = attempt([&] {
      return distortion::with_own_map([&] {
        return distortion::minimize_with_targets(chart_, map_.uv, targets, options, context_,
                                                 unused);
      });
    });
    if (!result || !result->missed.empty()) return false;
    map_.uv = std::move(result->uv);
    for (const PinnedVertex& p : pins) hold(p);
    return true;
  }

  // Pushes a pin to its target; false if rounding or the limit on refinement is in the way.
  bool push(const PinnedVertex& pin) {
    look_around();
    const std::vector<Vector2> way =
        find_way(map_.uv.row(pin.vertex).transpose(), pin.uv, obstacles_, context_);
    if (way.empty()) return map_.uv.row(pin.vertex).transpose() == pin.uv;
    for (std::size_t i = 0; i < way.size(); ++i) {
      if (!push_leg(pin.vertex, way[i])) return false;
      const bool last = i + 1 == way.size();
      if (last) hold(pin);
      relax(last ? kStepsAtTarget : kStepsOnTheWay, pin.vertex, {});
      take_back(pin.vertex);
      if (added() > kMuch * eased_ / 100 + kMuchAtLeast) ease(pin.vertex);
    }
    dragged_ += added();
    return true;
  }

  bool exhausted() const { return dragged_ > kMostDragged * std::int64_t{keep_}; }

 private:
  Index added() const { return map_.surface.mesh.vertex_count() - keep_; }

  void hold(const PinnedVertex& pin) {
    held_.push_back(pin.vertex);
    obstacles_.points.push_back(pin.uv);
  }

  // The mesh as the planner of ways sees it. What is drawn out into a tongue, from a pin back to
  // where it came from, is expensive to cross and cheap to go along: a tongue that is pushed aside
  // gets longer, and the next one longer still.
  void look_around() {
    obstacles_.edges.clear();
    const mesh::EditableTriangulation& mesh = map_.surface.mesh;
    std::vector<double> stretch;
    for (HalfedgeId h = 0; h < mesh.halfedge_slots(); ++h) {
      if (!mesh.alive(h / 3) || mesh.edge(h) != h) continue;
      const VertexId a = mesh.source(h);
      const VertexId b = mesh.target(h);
      const double length = (map_.surface.position[static_cast<std::size_t>(a)] -
                             map_.surface.position[static_cast<std::size_t>(b)])
                                .norm();
      const Vector2 p = map_.uv.row(a).transpose();
      const Vector2 q = map_.uv.row(b).transpose();
      stretch.push_back(length > 0 ? (q - p).norm() / length : 0.0);
      obstacles_.edges.push_back({p, q, stretch.back()});
    }
    const auto middle = stretch.begin() + static_cast<std::ptrdiff_t>(stretch.size() / 2);
    std::nth_element(stretch.begin(), middle, stretch.end());
    const Vector2 size = (map_.uv.colwise().maxCoeff() - map_.uv.colwise().minCoeff()).transpose();
    const double mean = kEdgeCost * size.norm() / std::sqrt(static_cast<double>(stretch.size()));
    for (Obstacles::Edge& e : obstacles_.edges) {
      e.cost = mean * std::clamp(*middle > 0 ? e.cost / *middle : 1.0, 1.0, kMostStretch);
    }
  }

  bool push_leg(VertexId v, const Vector2& goal) {
    const Vector2 from = map_.uv.row(v).transpose();
    if (from == goal) return true;
    const Points2 before = map_.uv;
    std::vector<char> held(map_.surface.position.size(), 0);
    for (const VertexId h : held_) held[static_cast<std::size_t>(h)] = 1;
    const Index limit = kMostAddedLeast + kMostAddedShare * map_.surface.input_vertices();
    for (const auto& [reach, keep] : kCorridors) {
      const Polygon corridor = corridor_around(from, goal, obstacles_, reach, keep);
      if (!push_point(map_, v, goal, corridor, held, limit, context_)) continue;
      chart_ = to_surface(map_.surface);
      pushed_.clear();
      for (VertexId w = 0; w < static_cast<VertexId>(before.rows()); ++w) {
        if (map_.uv.row(w) != before.row(w)) pushed_.push_back(w);
      }
      return true;
    }
    return false;
  }

  // Lowers the distortion with all held pins and one more vertex where they are: near `seeds`, and
  // near what is added. As squeezed as it may be, the map is valid.
  void relax(int steps, VertexId also, std::vector<VertexId> seeds) {
    std::vector<VertexId> fixed = held_;
    if (std::find(held_.begin(), held_.end(), also) == held_.end()) fixed.push_back(also);
    RelaxOptions options;
    options.steps = steps;
    options.lengthen = true;
    options.memory = &order_;
    // What is drawn out far has to give way everywhere.
    const bool far = !constraints_.free_boundary() || kFar * added() > keep_;
    if (seeds.empty() || far) {
      matchmaker::relax(map_, fixed, options, context_);
      return;
    }
    for (VertexId v = keep_; v < map_.surface.mesh.vertex_count(); ++v) seeds.push_back(v);
    relax_near(map_, seeds, kRelaxRings, fixed, options, context_);
  }

  // The vertices that stay where refinement is taken back, and those around.
  std::vector<VertexId> around_refinement() const {
    std::vector<VertexId> around = around_added(map_.surface.mesh, keep_);
    std::erase_if(around, [&](VertexId v) { return v >= keep_; });
    return around;
  }

  // Removes what refinement it can, so that it does not pile up.
  void take_back(VertexId moving) {
    std::vector<VertexId> around = around_refinement();
    matchmaker::take_back(map_, held_, keep_, {kMostRounds, true, kWorthwhile, 1}, context_, [&] {
      chart_ = to_surface(map_.surface);
      relax(kStepsOnTheWay, moving, std::exchange(around, around_refinement()));
      return true;
    });
    if (added() == 0) return;
    // Inside a prescribed boundary there is little room to make: it takes long and frees little,
    // and is worth it only before the refinement gets out of hand.
    if (!constraints_.free_boundary() && added() <= keep_) return;
    if (!constraints_.use(Device::kUnfold)) return;
    std::vector<VertexId> held = held_;
    held.push_back(moving);
    const Index there = added();
    if (100 * there < kMoreToUnfold * stuck_) return;
    const Index freed = unfold_wholes(map_, held, keep_, kRoundsOfUnfolding, context_, &order_);
    if (freed > 0) chart_ = to_surface(map_.surface);
    stuck_ = 100 * freed < kWorthwhile * there ? added() : 0;
  }

  // As take_back(), where the vertices around have to move for it.
  void ease(VertexId moving) {
    std::vector<VertexId> held = held_;
    held.push_back(moving);
    const std::vector<VertexId> around = around_refinement();
    if (remove_by_untangling(map_, held, keep_, context_) > 0) {
      map_ = mesh::compacted_map(map_);
      chart_ = to_surface(map_.surface);
      relax(kStepsOnTheWay, moving, around);
    }
    eased_ = added();
  }

  mesh::RefinedMap& map_;
  const Constraints& constraints_;
  Index keep_;
  ExecutionContext& context_;
  mesh::Surface chart_;
  std::vector<VertexId> held_;
  Obstacles obstacles_;
  numeric::EliminationMemory order_{keep_};
  std::int64_t dragged_ = 0;      // added vertices after each push, summed
  Index stuck_ = 0;               // added vertices that the last vain unfolding left
  std::vector<VertexId> pushed_;  // vertices that the last push moved
  Index eased_ = 0;               // added vertices that were left when they last made room
};

// Pulls the pins home one after another, the nearest first, and pushes those that do not come.
Walk walk_one_by_one(Walker& walker, const mesh::RefinedMap& map, const Constraints& constraints,
                     bool refine, ExecutionContext& context, Stats& stats) {
  // A push would bend lines, and cannot tell the sheets of a target that overlaps itself apart.
  const bool may_push = refine && constraints.edges.empty() && constraints.use(Device::kPush) &&
                        (constraints.free_boundary() || constraints.simple_outline);
  std::vector<PinnedVertex> waiting = constraints.pins;
  std::stable_sort(waiting.begin(), waiting.end(),
                   [&](const PinnedVertex& a, const PinnedVertex& b) {
                     return (map.uv.row(a.vertex).transpose() - a.uv).squaredNorm() <
                            (map.uv.row(b.vertex).transpose() - b.uv).squaredNorm();
                   });
  Walk walk;
  walk.mode = WalkMode::kOneByOne;
  std::int64_t pushes = 0;
  for (std::size_t i = 0; i < waiting.size(); ++i) {
    const auto share = [&](std::size_t k) {
      return static_cast<double>(k) / static_cast<double>(waiting.size());
    };
    const ProgressRange range(context, share(i), share(i + 1));
    if (constraints.use(Device::kPull) && walker.pull({waiting[i]}, kStepsPerPin, kPullsPerPin))
      continue;
    stats["walk.pushes"] = ++pushes;
    const bool pushed = may_push && walker.push(waiting[i]);
    walk.exhausted = pushed && walker.exhausted() && i + 1 < waiting.size();
    if (pushed && !walk.exhausted) continue;
    stats["walk.blocked"] = static_cast<std::int64_t>(waiting.size() - i);
    return walk;
  }
  walk.arrived = true;
  return walk;
}

Walk walked(mesh::RefinedMap& map, const Constraints& constraints, bool refine,
            ExecutionContext& context, Stats& stats) {
  if (constraints.pins.empty()) return {true};
  const Index keep = map.surface.mesh.vertex_count();
  Walker walker(map, constraints, context);
  {
    const ProgressRange range(context, 0.0, 0.2);
    if (walker.pull(constraints.pins, kStepsTogether, kPullsTogether))
      return {true, WalkMode::kTogether};
  }
  std::optional<mesh::RefinedMap> armed;
  if (refine) {
    const ProgressRange range(context, 0.2, 0.5);
    if (constraints.use(Device::kPlanned)) {
      const PlannedWalk planned = walk_as_planned(map, constraints, context, stats);
      if (planned.arrived) return {true, WalkMode::kPlanned, false, planned.settled};
    }
    armed = map;
    if (!constraints.use(Device::kArms) || !walk_with_arms(*armed, constraints, context, stats))
      armed.reset();
  }
  const auto added = [&](const mesh::RefinedMap& m) {
    return m.surface.mesh.vertex_count() - keep;
  };
  if (!armed || (kMuchOfArms * added(*armed) > keep && constraints.pins.size() <= kFewPins)) {
    const ProgressRange range(context, 0.5, 1.0);
    Walk walk;
    const auto one_by_one = [&] {
      walk = walk_one_by_one(walker, map, constraints, refine, context, stats);
    };
    if (armed) {
      ended_in_time(one_by_one);
    } else {
      one_by_one();
    }
    if (!armed || (walk.arrived && added(map) <= added(*armed))) return walk;
  }
  map = std::move(*armed);
  return {true, WalkMode::kArms};
}

const char* name_of(WalkMode mode) {
  switch (mode) {
    case WalkMode::kNone:
      break;
    case WalkMode::kTogether:
      return "together";
    case WalkMode::kPlanned:
      return "planned";
    case WalkMode::kArms:
      return "arms";
    case WalkMode::kOneByOne:
      return "one by one";
  }
  return "none";
}

}  // namespace

Walk walk_pins(mesh::RefinedMap& map, const Constraints& constraints, bool refine,
               ExecutionContext& context, Stats& stats) {
  const Walk walk = walked(map, constraints, refine, context, stats);
  if (walk.mode != WalkMode::kNone) stats["walk.mode"] = std::string(name_of(walk.mode));
  return walk;
}

}  // namespace flipfree::matchmaker
