#include "flipfree/unwrap/packing/nest/nest.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/unwrap/packing/nest/fill.h"

namespace flipfree::unwrap {
namespace {

// Cells to a side per square root of shapes: some 48 across each shape. Few shapes are nested
// twice, as which layouts there are to find depends on the cells.
constexpr double kCellsAcross = 48.0;
constexpr std::array<double, 2> kLeastCellsToSide = {128.0, 192.0};
constexpr double kMostCellsToSide = 4096.0;
constexpr double kFirstFill = 0.62;   // of the tile, where the search begins
constexpr double kFineShare = 0.004;  // the search for a scale ends at this share of it
constexpr double kSearched = 0.02;    // scales below this share of the bound are not looked for
constexpr std::size_t kManyShapes = 2000;  // shapes, of which fewer directions are tried
constexpr std::size_t kFewShapes = 150;    // shapes, for which more rules are tried
constexpr double kMuch = 0.2;  // of all area: such shapes are tried as square as they go too
constexpr double kEffortForRules = 0.5;
constexpr double kLongerForFew = 2.0;  // with that effort, as it is half a second still
constexpr double kMendWords = 6e7;     // per unit of effort, for some hundred shapes
constexpr double kInflateWork = 3e6;
// Times that at most: beyond 500 shapes the gain is below 0.005 of the tile for seconds of work.
constexpr double kMostInflated = 5.0;
// Tries in a row to mend a filling that gain nothing, until it is given up.
constexpr std::size_t kLeastTries = 16;
constexpr std::size_t kTriesPerShape = 2;  // more
constexpr double kGain = 1.001;            // in scale; what is less is none
constexpr std::array<Rule, 2> kRules = {{{0.5, 1.0}, {1.0, 2.0}}};
constexpr std::array<Rule, 8> kOtherRules = {{{0.0, 1.0},
                                              {1.0, 0.0},
                                              {0.5, 3.0},
                                              {0.2, 0.5},
                                              {1.0, 1.0},
                                              {0.5, 2.0},
                                              {0.0, 3.0},
                                              {0.7, 0.5}}};
constexpr double kBetter = 1.006;  // where other rules begin, of the best scale so far

struct Problem {
  const std::vector<Shape>& shapes;
  std::vector<std::vector<Vector2>> turns;
  std::vector<char> may_turn;  // by any angle
  std::vector<std::size_t> order;
  std::vector<Loop> fixed;
  int cells = 0;
  Tile empty;
  double radius = 0.0;  // half of the margin
  double bound = 0.0;   // no larger scale is of use
};

// A complete filling and what it was found with.
struct Found {
  Filling filling;
  double scale = 0.0;
  std::vector<Pose> poses;
};

std::vector<Loop> loops_of(const Points2* triangles) {
  std::vector<Loop> loops;
  if (triangles == nullptr) return loops;
  for (Eigen::Index i = 0; i + 2 < triangles->rows(); i += 3) {
    Loop loop;
    for (Eigen::Index k = 0; k < 3; ++k) loop.push_back(triangles->row(i + k).transpose());
    if (std::all_of(
            loop.begin(), loop.end(),
            [](const Vector2& p) { return (p.array() < -1.0).any() || (p.array() > 2.0).any(); }) &&
        (loop[0].cwiseMin(loop[1]).cwiseMin(loop[2]).maxCoeff() > 2.0 ||
         loop[0].cwiseMax(loop[1]).cwiseMax(loop[2]).minCoeff() < -1.0))
      continue;
    if (twice_area(loop[0], loop[1], loop[2]) < 0.0) std::swap(loop[1], loop[2]);
    loops.push_back(std::move(loop));
  }
  return loops;
}

Tile tile_of(const std::vector<Loop>& fixed, int cells, double radius) {
  if (fixed.empty()) return Tile(cells);
  const int words = (cells + 63) / 64;
  std::vector<Word> taken(static_cast<std::size_t>(cells) * static_cast<std::size_t>(words), 0);
  for (const Loop& loop : fixed) draw_loop(loop, cells, radius * cells, words, taken);
  return {cells, taken};
}

std::vector<std::size_t> largest_first(const std::vector<Shape>& shapes) {
  std::vector<double> size;
  for (const Shape& s : shapes) size.push_back(2.0 * s.radius + std::sqrt(std::max(0.0, s.area)));
  std::vector<std::size_t> order(size.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return size[a] > size[b]; });
  return order;
}

Problem problem_of(const std::vector<Shape>& shapes, const NestOptions& options,
                   double least_cells) {
  const auto n = static_cast<double>(shapes.size());
  const int cells =
      64 * static_cast<int>(std::clamp(kCellsAcross * std::sqrt(n), least_cells, kMostCellsToSide) /
                            64.0);
  std::vector<Loop> fixed = loops_of(options.fixed);
  Tile empty = tile_of(fixed, cells, 0.5 * options.margin);
  Problem problem{shapes, {}, {}, largest_first(shapes), std::move(fixed), cells, std::move(empty)};
  std::vector<Vector2> turns = {Vector2(1.0, 0.0)};
  if (options.rotation == Rotation::kQuarters) turns = even_turns(4);
  if (options.rotation == Rotation::kFree) turns = even_turns(shapes.size() > kManyShapes ? 4 : 8);
  if (options.rotation == Rotation::kStraight)
    turns = even_turns(shapes.size() > kManyShapes ? 4 : 8);
  problem.turns.assign(shapes.size(), turns);
  const bool any = options.rotation == Rotation::kFree || options.rotation == Rotation::kStraight;
  problem.may_turn.assign(shapes.size(), any ? 1 : 0);
  for (std::size_t i = 0; options.rotation == Rotation::kStraight && i < shapes.size(); ++i) {
    if (!is_straight(shapes[i])) continue;
    problem.turns[i] = even_turns(4);
    problem.may_turn[i] = 0;
  }
  problem.radius = 0.5 * options.margin;
  double area = 0.0;
  double radius = 0.0;
  for (const Shape& s : shapes) {
    area += s.area;
    radius = std::max(radius, s.radius);
  }
  if (any && shapes.size() <= kFewShapes) {
    const std::vector<Vector2> quarters = even_turns(4);
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      if (shapes[i].area < kMuch * area || problem.may_turn[i] == 0) continue;
      const Vector2 t = squarest_turn(shapes[i]);
      for (const Vector2& q : quarters)
        problem.turns[i].emplace_back(t.x() * q.x() - t.y() * q.y(), t.x() * q.y() + t.y() * q.x());
    }
  }
  // No shape is wider than the tile's diagonal.
  problem.bound = radius > 0.0 ? std::sqrt(2.0) / radius : 1.0;
  if (area > 0.0) problem.bound = std::min(problem.bound, 1.0 / std::sqrt(area));
  if (options.scale > 0.0) problem.bound = std::min(problem.bound, options.scale);
  return problem;
}

// Fills the tile with this rule at this scale; true, and better, if it holds everything.
bool attempt_filling(const Problem& problem, const Rule& rule, double scale, Found& best,
                     double& missing, const ExecutionContext& context) {
  const Masks masks =
      draw_shapes(problem.shapes, problem.turns, scale, problem.cells, problem.radius, context);
  Filling filling = fill(problem.shapes, masks, problem.empty, problem.order, rule, 0.3, context);
  missing = filling.missing;
  if (!filling.complete()) return false;
  best = {filling, scale, poses_of(filling, masks, problem.turns)};
  return true;
}

// From a scale that is known to work: as much larger as this rule can.
Found surpass(const Problem& problem, const Rule& rule, double known,
              const ExecutionContext& context) {
  Found best;
  double missing = 0.0;
  double scale = known;
  while (scale < problem.bound) {
    scale = std::min(problem.bound, kBetter * scale);
    if (!attempt_filling(problem, rule, scale, best, missing, context)) break;
  }
  return best;
}

// The largest scale at which one rule fills the tile, by guesses from what found no place.
Found search(const Problem& problem, const Rule& rule, double guess, double least, bool wanted,
             const ExecutionContext& context) {
  Found best;
  double missing = 0.0;
  if (wanted && attempt_filling(problem, rule, problem.bound, best, missing, context)) return best;
  double high = problem.bound;
  const double low = std::max(least, kSearched * problem.bound);
  double scale = std::min(std::max(guess, 0.5 * (low + high)), 0.99 * high);
  while (scale > low) {
    if (attempt_filling(problem, rule, scale, best, missing, context)) {
      if (high - scale < kFineShare * high) break;
      scale = std::min(0.5 * (scale + high), 1.04 * scale);
      continue;
    }
    high = scale;
    const double guessed = scale * std::sqrt(std::max(0.3, 1.0 - missing)) * 0.995;
    if (best.scale > 0.0) {
      if (high - best.scale < kFineShare * high) break;
      scale = std::max(std::min(guessed, 0.997 * high), 0.5 * (best.scale + high));
    } else {
      // One shape that is most of all says little by what it misses.
      if (high - low < kFineShare * high) break;
      scale = std::min(std::max(guessed, 0.5 * (low + high)), 0.99 * high);
    }
  }
  return best;
}

// Larger and larger, mending what finds no place, in smaller and smaller steps until none is left
// that works, or the work is spent, of which what is left comes back.
Found grow(const Problem& problem, Found best, std::uint64_t seed, double& work,
           const ExecutionContext& context) {
  const double whole_work = work;
  const std::size_t tries = kLeastTries + kTriesPerShape * problem.shapes.size();
  double step = 0.01;
  constexpr double kLeastStep = 0.0005;
  while (step >= kLeastStep && work > 0.0 && best.scale < problem.bound) {
    const double scale = std::min(problem.bound, best.scale * (1.0 + step));
    const Masks masks =
        draw_shapes(problem.shapes, problem.turns, scale, problem.cells, problem.radius, context);
    Filling filling = carry(problem.shapes, masks, problem.empty, best.filling);
    const MendLimits limits{tries, std::min(work, 0.25 * work + 2e6)};
    filling =
        mend(problem.shapes, masks, problem.empty, std::move(filling), ++seed, limits, context);
    // Drawing costs as well, at least this share of all.
    work -= filling.looked + 4e4 * static_cast<double>(problem.shapes.size()) + 0.01 * whole_work;
    if (filling.complete()) {
      best = {filling, scale, poses_of(filling, masks, problem.turns)};
    } else {
      step *= 0.6;
    }
  }
  return best;
}

// The largest of what the rules fill the tile with; scale 0 if none does.
Found begin(const Problem& problem, const NestOptions& options, bool thorough,
            ExecutionContext& context) {
  const bool wanted = options.scale > 0.0;
  const double guess = problem.bound * std::sqrt(kFirstFill);
  // One shape lies as low by any rule.
  const std::size_t rules = problem.shapes.size() > 1 ? kRules.size() : 1;
  std::array<Found, kRules.size()> found;
  parallel_for(context, rules, 1, [&](std::size_t i, std::size_t, std::size_t) {
    const ExecutionContext part(&context, 1);
    found[i] = search(problem, kRules[i], guess, options.least_scale, wanted, part);
  });
  Found best = std::move(found[0].scale >= found[1].scale ? found[0] : found[1]);
  if (!(best.scale > 0.0) || best.scale >= problem.bound || !thorough || rules == 1) return best;
  std::array<Found, kOtherRules.size()> others;
  parallel_for(context, others.size(), 1, [&](std::size_t i, std::size_t, std::size_t) {
    const ExecutionContext part(&context, 1);
    others[i] = surpass(problem, kOtherRules[i], best.scale, part);
  });
  for (Found& other : others)
    if (other.scale > best.scale) best = std::move(other);
  return best;
}

}  // namespace

Layout nest(const std::vector<Shape>& shapes, const NestOptions& options,
            ExecutionContext& context) {
  if (shapes.empty()) return {};
  const double n = static_cast<double>(shapes.size());
  const bool thorough = options.effort >= kEffortForRules && shapes.size() <= kFewShapes;
  const double effort = thorough ? kLongerForFew * options.effort : options.effort;
  context.report("packing", 0.1);
  const std::array<Problem, 2> problems = {problem_of(shapes, options, kLeastCellsToSide[0]),
                                           problem_of(shapes, options, kLeastCellsToSide[1])};
  const bool mends = options.effort > 0.0 && shapes.size() <= kManyShapes && shapes.size() > 1;
  std::array<Found, 2> found;
  found[0] = begin(problems[0], options, thorough, context);
  found[1] = mends && problems[1].cells != problems[0].cells
                 ? begin(problems[1], options, thorough, context)
                 : found[0];
  const Found& better = found[0].scale >= found[1].scale ? found[0] : found[1];
  if (!(better.scale > 0.0)) return {};
  context.report("packing", 0.4);
  InflateOptions inflating;
  inflating.margin = options.margin;
  inflating.may_turn = problems[0].may_turn;
  inflating.most_scale = options.scale > 0.0 ? problems[0].bound : 0.0;
  inflating.fixed = &problems[0].fixed;
  inflating.work = effort * kInflateWork * std::clamp(n / 100.0, 1.0, kMostInflated);
  if (!mends || better.scale >= problems[0].bound)
    return inflate(shapes, {better.poses, better.scale}, inflating, context);
  // Longer for some more shapes, as each step mends only what is near.
  std::array<double, 2> work;
  work.fill(effort * kMendWords * (n <= kFewShapes ? 1.6 : std::clamp(n / 500.0, 0.5, 2.0)));
  Layout best;
  // Once more from where it began, by other chances, as long as that gains.
  std::uint64_t seed = 100;
  for (bool gained = true; gained && std::max(work[0], work[1]) > 0.0; seed += 200) {
    std::array<Layout, 2> layouts;
    parallel_for(context, layouts.size(), 1, [&](std::size_t i, std::size_t, std::size_t) {
      if (!(found[i].scale > 0.0) || !(work[i] > 0.0)) return;
      const ExecutionContext part(&context, 1);
      const Found grown = grow(problems[i], found[i], seed + 100 * i, work[i], part);
      layouts[i] = inflate(shapes, {grown.poses, grown.scale}, inflating, part);
    });
    gained = false;
    for (Layout& layout : layouts) {
      gained = gained || layout.scale > kGain * best.scale;
      if (layout.scale > best.scale) best = std::move(layout);
    }
  }
  return best;
}

}  // namespace flipfree::unwrap
