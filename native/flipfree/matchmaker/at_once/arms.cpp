#include "flipfree/matchmaker/at_once/arms.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <utility>
#include <vector>

#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/distortion/energy/own_map.h"
#include "flipfree/distortion/minimize/minimize.h"
#include "flipfree/embedding/embed.h"
#include "flipfree/matchmaker/at_once/star_map.h"
#include "flipfree/matchmaker/coarsening/relax.h"
#include "flipfree/matchmaker/coarsening/remove_vertex.h"
#include "flipfree/matchmaker/start/first_try.h"

namespace flipfree::matchmaker {
namespace {

constexpr std::size_t kFewestPins = 3;
// Newton steps of a star without the surface.
constexpr int kStepsOfStar = 30;
// So many stars are brought to rest, of these so many with the surface on them, and of these so
// many for a round; then half of them after each round.
constexpr std::size_t kShort = 24;
constexpr std::size_t kLifted = 8;
constexpr std::size_t kTried = 4;
// Newton steps of each round in which they are compared.
constexpr int kStepsOfTry = 10;

double part_of(std::size_t i, std::size_t count) {
  return static_cast<double>(i) / static_cast<double>(count);
}

// A star, by itself and with the surface on it.
struct Candidate {
  StarView view;
  PlaneMap plane;
  mesh::RefinedMap map;                                   // empty until the surface is on it
  double cost = std::numeric_limits<double>::infinity();  // the less, the better
};

// The best few by cost, the best first.
void keep_best(std::vector<Candidate>& all, std::size_t count) {
  std::erase_if(all, [](const Candidate& c) { return !std::isfinite(c.cost); });
  std::stable_sort(all.begin(), all.end(),
                   [](const Candidate& a, const Candidate& b) { return a.cost < b.cost; });
  if (all.size() > count) all.resize(count);
}

// Lines in the disk, all told: what is added grows with it.
double length_of(const PlaneMap& plane) {
  double length = 0;
  for (Eigen::Index f = 0; f < plane.faces.rows(); ++f) {
    for (Eigen::Index k = 0; k < 3; ++k)
      length +=
          (plane.before.row(plane.faces(f, k)) - plane.before.row(plane.faces(f, (k + 1) % 3)))
              .norm();
  }
  return length;
}

// Brings the star to rest with the pins where they are; its energy is its cost.
void relax_star(Candidate& candidate, const std::vector<char>& pinned, ExecutionContext& context) {
  PlaneMap& plane = candidate.plane;
  mesh::Surface flat;
  flat.faces = plane.faces;
  flat.vertices = Points3::Zero(plane.before.rows(), 3);
  flat.vertices.leftCols(2) = plane.before;
  distortion::MinimizeOptions options;
  options.max_iterations = kStepsOfStar;
  options.lengthen = true;
  for (std::size_t v = 0; v < plane.vertex.size(); ++v) {
    const VertexId w = plane.vertex[v];
    if (w != kInvalid && w < static_cast<VertexId>(pinned.size()) && pinned[at(w)] != 0)
      options.fixed.push_back(static_cast<VertexId>(v));
  }
  // Too squeezed for the Newton system: others will be better.
  Outcome<distortion::TargetsResult> rest = attempt([&] {
    return distortion::with_own_map(
        [&] { return distortion::minimize_with_targets(flat, plane.after, {}, options, context); });
  });
  candidate.cost = rest ? rest->energy : std::numeric_limits<double>::infinity();
  if (rest) plane.after = std::move(rest->uv);
}

// Stars that promise most.
std::vector<Candidate> best_stars(const mesh::RefinedMap& disk, const Constraints& constraints,
                                  ExecutionContext& context) {
  std::vector<Vector2> pins;
  std::vector<char> pinned(disk.surface.position.size(), 0);
  for (const PinnedVertex& p : constraints.pins) {
    pins.emplace_back(disk.uv.row(p.vertex).transpose());
    pinned[at(p.vertex)] = 1;
  }
  std::vector<Candidate> all;
  for (StarView& view : star_views(pins)) {
    context.check();
    mesh::RefinedMap split = disk;
    std::optional<PlaneMap> plane = make_star(split, constraints, view, context);
    if (!plane) continue;
    const double length = length_of(*plane);
    all.push_back({std::move(view), std::move(*plane), {}, length});
    if (all.size() > 2 * kShort) keep_best(all, kShort);
  }
  keep_best(all, kShort);
  parallel_for(context, all.size(), 1, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      ExecutionContext part(&context, 1);
      relax_star(all[i], pinned, part);
    }
  });
  keep_best(all, kLifted);
  return all;
}

// The star that bears the surface best.
std::optional<mesh::RefinedMap> best_map(const mesh::RefinedMap& disk, std::vector<Candidate> stars,
                                         const Constraints& constraints, ExecutionContext& context,
                                         Stats& stats) {
  const Index keep = disk.surface.mesh.vertex_count();
  for (Candidate& c : stars) {
    c.cost = std::numeric_limits<double>::infinity();
    c.map = disk;
    // The star has come to rest since; what it splits is the same again.
    if (!make_star(c.map, constraints, c.view, context) || !follow_by(c.map, c.plane, context))
      continue;
    c.map = mesh::compacted_map(c.map);  // with the boundary as it is now
    c.cost = c.map.surface.mesh.vertex_count() - keep;
  }
  keep_best(stars, kTried);
  if (stars.empty()) return std::nullopt;
  stats["arms.lifted"] = static_cast<std::int64_t>(stars.front().cost);
  const std::vector<VertexId> held = held_vertices(disk.surface, constraints);
  for (double done = 0; stars.size() > 1;) {
    // Half of the work that is left is in this round.
    const double share = 0.5 * (1 - done);
    for (std::size_t i = 0; i < stars.size(); ++i) {
      const ProgressRange range(context, done + share * part_of(i, stars.size()),
                                done + share * part_of(i + 1, stars.size()));
      thin_out(stars[i].map, held, keep, context);
      relax(stars[i].map, held, {kStepsOfTry, true, nullptr}, context);
      stars[i].cost = energy_of(stars[i].map, context);
    }
    keep_best(stars, (stars.size() + 1) / 2);
    done += share;
  }
  if (stars.empty()) return std::nullopt;
  return std::move(stars.front().map);
}

}  // namespace

mesh::RefinedMap in_circle(const mesh::RefinedSurface& surface, ExecutionContext& context) {
  const auto count = static_cast<double>(surface.boundary.size());
  Points2 circle(static_cast<Eigen::Index>(surface.boundary.size()), 2);
  for (Eigen::Index i = 0; i < circle.rows(); ++i) {
    const double angle = 2 * std::numbers::pi * static_cast<double>(i) / count;
    circle.row(i) << std::cos(angle), std::sin(angle);
  }
  embedding::EmbedOptions options;
  options.float32 = false;
  options.low_distortion = true;
  Stats unused;
  const Points2 uv = embedding::embed_disk(surface.mesh.faces(), surface.mesh.vertex_count(),
                                           surface.boundary, circle, options, context, unused);
  const mesh::Surface room = equal_area_metric(surface, uv, context);
  return {surface, room.vertices.leftCols(2)};
}

bool move_with_arms(mesh::RefinedMap& map, const Constraints& constraints,
                    ExecutionContext& context, Stats& stats) {
  if (!constraints.free_boundary() || constraints.one_to_one || !constraints.edges.empty() ||
      constraints.pins.size() < kFewestPins)
    return false;
  mesh::RefinedMap disk;
  std::vector<Candidate> stars;
  {
    const ProgressRange range(context, 0.0, 0.2);
    Outcome<mesh::RefinedMap> circle = attempt(
        [&] { return distortion::with_own_map([&] { return in_circle(map.surface, context); }); });
    if (!circle) return false;
    disk = std::move(*circle);
    stars = best_stars(disk, constraints, context);
  }
  const ProgressRange range(context, 0.2, 1.0);
  std::optional<mesh::RefinedMap> best =
      best_map(disk, std::move(stars), constraints, context, stats);
  if (!best) return false;
  map = std::move(*best);
  return true;
}

}  // namespace flipfree::matchmaker
