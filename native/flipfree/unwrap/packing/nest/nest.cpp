#include "flipfree/unwrap/packing/nest/nest.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/unwrap/packing/nest/shape.h"

namespace flipfree::unwrap {
namespace {

// All shapes in all their directions as cells, at one scale.
struct Masks {
  double scale = 0.0;
  int cells = 0;  // of the tile, to a side
  std::vector<std::vector<Mask>> of_shape;
};
struct Filling {
  std::vector<int> turn;  // per shape: the direction, -1 if it found no place
  std::vector<Cell> cell;
  double looked = 0.0;   // words of the tile
  double missing = 0.0;  // area of the shapes that found no place, as a share
  bool complete() const { return missing == 0.0; }
};

struct MendLimits {
  std::size_t tries = 0;
  double work = 0.0;  // words of the tile to look at
};

double total_area(const std::vector<Shape>& shapes) {
  double sum = 0.0;
  for (const Shape& s : shapes) sum += s.area;
  return sum;
}

// Once the masks are so much smaller than where a search last began at the bottom, it does again:
// what is smaller may fit where nothing did.
constexpr double kSmaller = 0.95;

struct Memory {
  int row = 0;
  double size = std::numeric_limits<double>::infinity();
};

// How the place of a shape is chosen among the lowest ones of all its directions.
struct Rule {
  double height = 1.0;   // weight of the mask's own height: 0 its foot, 1 its top is to be low
  double contact = 0.0;  // what touching on all sides is worth, in heights of the mask
};

struct Choice {
  int turn = -1;
  Cell cell;
  double cost = std::numeric_limits<double>::infinity();
};

void consider(const Tile& tile, const Mask& mask, std::size_t turn, const Cell& cell,
              const Rule& rule, Choice& best) {
  double cost = cell.y + rule.height * mask.height + 1e-4 * cell.x;
  if (rule.contact > 0.0) cost -= rule.contact * mask.height * tile.contact(mask, cell);
  if (cost < best.cost) best = {static_cast<int>(turn), cell, cost};
}

Choice best_place(const std::vector<Mask>& masks, const Tile& tile, const Rule& rule, int from,
                  int to) {
  Choice best;
  for (std::size_t t = 0; t < masks.size(); ++t) {
    if (const auto cell = tile.lowest(masks[t], from, to))
      consider(tile, masks[t], t, *cell, rule, best);
  }
  return best;
}

Choice best_place(const std::vector<Mask>& masks, const Tile& tile, const Rule& rule,
                  std::vector<Memory>& memory) {
  Choice best;
  for (std::size_t t = 0; t < masks.size(); ++t) {
    const Mask& mask = masks[t];
    const double size = static_cast<double>(mask.width) * mask.height;
    if (size < kSmaller * memory[t].size) memory[t] = {0, size};
    const auto cell = tile.lowest(mask, memory[t].row, tile.cells());
    memory[t].row = cell ? cell->y : tile.cells();
    if (cell) consider(tile, mask, t, *cell, rule, best);
  }
  return best;
}

double share(const Shape& shape, double whole) {
  return whole > 0.0 ? std::max(shape.area / whole, 1e-12) : 1.0;
}

constexpr std::array<std::array<int, 2>, 9> kAround = {
    {{0, 0}, {0, -1}, {-1, 0}, {0, 1}, {1, 0}, {-1, -1}, {1, 1}, {1, -1}, {-1, 1}}};
constexpr std::size_t kMostTaken = 16;
constexpr double kStep = 2e4;  // what a step costs beside looking, in words

// The same numbers on every system (splitmix64).
class Random {
 public:
  explicit Random(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15U);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
    return z ^ (z >> 31);
  }
  std::size_t below(std::size_t n) { return static_cast<std::size_t>(next() % n); }
  double unit() { return static_cast<double>(next() >> 11) * 0x1p-53; }

 private:
  std::uint64_t state_;
};

std::vector<Vector2> even_turns(int count) {
  std::vector<Vector2> turns;
  for (int i = 0; i < count; ++i) {
    if (4 * i % count == 0) {
      const int quarter = 4 * i / count;
      turns.emplace_back(quarter == 0   ? 1.0
                         : quarter == 2 ? -1.0
                                        : 0.0,
                         quarter == 1   ? 1.0
                         : quarter == 3 ? -1.0
                                        : 0.0);
      continue;
    }
    const double angle = 2.0 * std::numbers::pi * i / count;
    turns.emplace_back(std::cos(angle), std::sin(angle));
  }
  return turns;
}

Masks draw_shapes(const std::vector<Shape>& shapes, const std::vector<std::vector<Vector2>>& turns,
                  double scale, int cells, double radius, const ExecutionContext& context) {
  Masks masks;
  masks.scale = scale;
  masks.cells = cells;
  masks.of_shape.resize(shapes.size());
  parallel_for(context, shapes.size(), 16, [&](std::size_t begin, std::size_t end, std::size_t) {
    Pen pen;
    for (std::size_t i = begin; i < end; ++i) {
      masks.of_shape[i].reserve(turns[i].size());
      for (const Vector2& turn : turns[i]) {
        masks.of_shape[i].push_back(draw_shape(shapes[i], turn, scale * cells,
                                               (radius + shapes[i].slack * scale) * cells, pen));
      }
    }
  });
  return masks;
}

// Puts the shapes into the tile in this order, each where the rule likes it best; passes over those
// that fit nowhere, and ends once their share of the area is more than `most_missing`.
Filling fill(const std::vector<Shape>& shapes, const Masks& masks, Tile tile,
             const std::vector<std::size_t>& order, const Rule& rule, double most_missing,
             const ExecutionContext& context) {
  Filling filling;
  filling.turn.assign(shapes.size(), -1);
  filling.cell.resize(shapes.size());
  std::size_t most = 0;
  for (const auto& m : masks.of_shape) most = std::max(most, m.size());
  std::vector<Memory> memory(most);
  const double whole = total_area(shapes);
  std::size_t count = 0;
  for (const std::size_t i : order) {
    if (++count % 32 == 0) context.check();
    const Choice choice = best_place(masks.of_shape[i], tile, rule, memory);
    if (choice.turn < 0) {
      filling.missing += share(shapes[i], whole);
      if (filling.missing > most_missing) break;
      continue;
    }
    filling.turn[i] = choice.turn;
    filling.cell[i] = choice.cell;
    tile.put(masks.of_shape[i][at(choice.turn)], choice.cell);
  }
  filling.looked = static_cast<double>(tile.looked());
  return filling;
}

// The filling in masks of another scale: shapes, in this order, stay in their cell or go to one
// beside it; those that cannot are missing.
Filling carry(const std::vector<Shape>& shapes, const Masks& masks, const Tile& empty,
              const std::vector<std::size_t>& order, const Filling& filling) {
  Filling result = filling;
  result.missing = 0.0;
  const double whole = total_area(shapes);
  Tile tile = empty;
  for (const std::size_t i : order) {
    if (filling.turn[i] < 0) {
      result.missing += share(shapes[i], whole);
      continue;
    }
    const Mask& mask = masks.of_shape[i][at(filling.turn[i])];
    bool put = false;
    for (const auto& [x, y] : kAround) {
      const Cell cell{filling.cell[i].x + x, filling.cell[i].y + y};
      if (!tile.fits(mask, cell)) continue;
      tile.put(mask, cell);
      result.cell[i] = cell;
      put = true;
      break;
    }
    if (put) continue;
    result.turn[i] = -1;
    result.missing += share(shapes[i], whole);
  }
  return result;
}

// Tries to complete a filling: takes away what lies around a random place, puts back what is
// missing there first, and goes on from what it has unless more is missing than before. Ends after
// so many tries in a row after which no less is missing, or when it has looked at `work` words of
// the tile. Deterministic.
Filling mend(const std::vector<Shape>& shapes, const Masks& masks, const Tile& empty,
             Filling filling, std::uint64_t seed, const MendLimits& limits,
             const ExecutionContext& context) {
  const double whole = total_area(shapes);
  const std::size_t n = shapes.size();
  Tile tile = empty;
  std::vector<std::size_t> missing;
  const auto mask_of = [&](std::size_t i) -> const Mask& {
    return masks.of_shape[i][at(filling.turn[i])];
  };
  for (std::size_t i = 0; i < n; ++i) {
    if (filling.turn[i] < 0) {
      missing.push_back(i);
    } else {
      tile.put(mask_of(i), filling.cell[i]);
    }
  }
  Random random(seed);
  std::size_t idle = 0;
  for (int step = 0; !missing.empty() && idle < limits.tries; ++step, ++idle) {
    if (static_cast<double>(tile.looked()) + kStep * step > limits.work) break;
    if (step % 16 == 0) context.check();
    // Around one that is placed, a few times as large as one that is missing.
    const std::size_t wanted = missing[random.below(missing.size())];
    const std::size_t at = random.below(n);
    if (filling.turn[at] < 0) continue;
    const Mask& large = masks.of_shape[wanted].front();
    const double side = std::max(large.width, large.height);
    const double reach =
        (0.4 + 0.8 * random.unit()) * side + 0.5 * std::max(mask_of(at).width, mask_of(at).height);
    const auto middle_of = [&](std::size_t i) {
      return Vector2(filling.cell[i].x + 0.5 * mask_of(i).width,
                     filling.cell[i].y + 0.5 * mask_of(i).height);
    };
    const Vector2 middle = middle_of(at);
    std::vector<std::size_t> back;
    int low = filling.cell[at].y;
    int high = low;
    for (std::size_t i = 0; i < n; ++i) {
      if (filling.turn[i] < 0 || (middle_of(i) - middle).cwiseAbs().maxCoeff() > reach) continue;
      back.push_back(i);
      low = std::min(low, filling.cell[i].y);
      high = std::max(high, filling.cell[i].y + mask_of(i).height);
      if (back.size() >= kMostTaken) break;
    }
    const std::vector<std::size_t> taken = back;
    std::vector<std::pair<int, Cell>> before;
    for (const std::size_t i : taken) {
      tile.take(mask_of(i), filling.cell[i]);
      before.emplace_back(filling.turn[i], filling.cell[i]);
      filling.turn[i] = -1;
    }
    back.insert(back.end(), missing.begin(), missing.end());
    // Larger ones first, but not always.
    std::vector<double> key(n, 0.0);
    for (const std::size_t i : back) key[i] = shapes[i].area * (0.5 + random.unit());
    key[wanted] *= 2.0;
    std::stable_sort(back.begin(), back.end(),
                     [&](std::size_t a, std::size_t b) { return key[a] > key[b]; });
    const Rule rule{random.unit(), random.unit() < 0.5 ? 0.0 : 2.0 * random.unit()};
    const int from = std::max(0, low - 2);
    double now = 0.0;
    std::vector<std::size_t> still;
    for (const std::size_t i : back) {
      const Choice choice = best_place(masks.of_shape[i], tile, rule, from, high);
      if (choice.turn < 0) {
        still.push_back(i);
        now += share(shapes[i], whole);
        continue;
      }
      filling.turn[i] = choice.turn;
      filling.cell[i] = choice.cell;
      tile.put(mask_of(i), choice.cell);
    }
    if (now <= filling.missing * (1.0 + 1e-12)) {
      if (now < filling.missing * (1.0 - 1e-12)) idle = 0;
      filling.missing = now;
      missing = std::move(still);
      continue;
    }
    for (const std::size_t i : back) {
      if (filling.turn[i] < 0) continue;
      tile.take(mask_of(i), filling.cell[i]);
      filling.turn[i] = -1;
    }
    for (std::size_t k = 0; k < taken.size(); ++k) {
      const std::size_t i = taken[k];
      filling.turn[i] = before[k].first;
      filling.cell[i] = before[k].second;
      tile.put(mask_of(i), filling.cell[i]);
    }
  }
  if (missing.empty()) filling.missing = 0.0;
  filling.looked = static_cast<double>(tile.looked());
  return filling;
}

// Where the shapes of a filling lie, in units of the tile.
std::vector<Pose> poses_of(const Filling& filling, const Masks& masks,
                           const std::vector<std::vector<Vector2>>& turns) {
  std::vector<Pose> poses(filling.turn.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (filling.turn[i] < 0) continue;
    const auto t = at(filling.turn[i]);
    poses[i].turn = turns[i][t];
    poses[i].centre =
        (Vector2(filling.cell[i].x, filling.cell[i].y) + masks.of_shape[i][t].origin) / masks.cells;
  }
  return poses;
}

// Cells to a side per square root of shapes: some 48 across each shape.
constexpr double kCellsAcross = 48.0;
constexpr double kLeastCellsToSide = 192.0;
constexpr double kMostCellsToSide = 4096.0;
constexpr double kFirstFill = 0.62;   // of the tile, where the search begins
constexpr double kFineShare = 0.004;  // the search for a scale ends at this share of it
constexpr double kSearched = 0.02;    // scales below this share of the bound are not looked for
constexpr std::size_t kManyShapes = 2000;  // shapes, of which fewer directions are tried
constexpr std::size_t kFewShapes = 150;    // shapes, which are mended longer
constexpr double kMuch = 0.2;  // of all area: such shapes are tried as square as they go too
constexpr double kLongEffort = 0.5;
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

// Those near the tile.
std::vector<Loop> loops_of(const Points2* triangles) {
  std::vector<Loop> loops;
  if (triangles == nullptr) return loops;
  const Eigen::AlignedBox2d near(Vector2(-1.0, -1.0), Vector2(2.0, 2.0));
  for (Eigen::Index i = 0; i + 2 < triangles->rows(); i += 3) {
    Loop loop = triangle_of(*triangles, i);
    Eigen::AlignedBox2d box;
    for (const Vector2& p : loop) box.extend(p);
    if (near.intersects(box)) loops.push_back(std::move(loop));
  }
  return loops;
}

Tile tile_of(const std::vector<Loop>& fixed, int cells, double radius) {
  if (fixed.empty()) return Tile(cells);
  const int words = (cells + 63) / 64;
  std::vector<Word> taken(at(cells) * at(words), 0);
  for (const Loop& loop : fixed) draw_loop(loop, cells, radius * cells, words, taken);
  return {cells, taken};
}

std::vector<std::size_t> order_by_size(const std::vector<Shape>& shapes) {
  std::vector<double> size;
  for (const Shape& s : shapes) size.push_back(2.0 * s.radius + std::sqrt(std::max(0.0, s.area)));
  std::vector<std::size_t> order(size.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return size[a] > size[b]; });
  return order;
}

Problem problem_of(const std::vector<Shape>& shapes, const NestOptions& options) {
  const auto n = static_cast<double>(shapes.size());
  const int cells =
      64 * static_cast<int>(
               std::clamp(kCellsAcross * std::sqrt(n), kLeastCellsToSide, kMostCellsToSide) / 64.0);
  std::vector<Loop> fixed = loops_of(options.fixed);
  Tile empty = tile_of(fixed, cells, 0.5 * options.margin);
  Problem problem{shapes, {}, {}, order_by_size(shapes), std::move(fixed), cells, std::move(empty)};
  std::vector<Vector2> turns = {Vector2(1.0, 0.0)};
  if (options.rotation == Rotation::kQuarters) turns = even_turns(4);
  const bool any = options.rotation == Rotation::kFree || options.rotation == Rotation::kStraight;
  if (any) turns = even_turns(shapes.size() > kManyShapes ? 4 : 8);
  problem.turns.assign(shapes.size(), turns);
  problem.may_turn.assign(shapes.size(), any ? 1 : 0);
  for (std::size_t i = 0; options.rotation == Rotation::kStraight && i < shapes.size(); ++i) {
    if (!shapes[i].upright) continue;
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
    for (std::size_t i = 0; i < shapes.size(); ++i) {
      if (shapes[i].area < kMuch * area || problem.may_turn[i] == 0) continue;
      const Vector2 t = squarest_turn(shapes[i]);
      for (const Vector2& q : even_turns(4))
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
    Filling filling = carry(problem.shapes, masks, problem.empty, problem.order, best.filling);
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

// What each rule fills the tile with; scale 0 if none does.
std::array<Found, 2> begin(const Problem& problem, const NestOptions& options,
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
  if (rules == 1 || found[1].scale == 0.0) found[1] = found[0];
  if (found[0].scale == 0.0) found[0] = found[1];
  return found;
}

}  // namespace

Layout nest(const std::vector<Shape>& shapes, const NestOptions& options,
            ExecutionContext& context) {
  if (shapes.empty()) return {};
  const double n = static_cast<double>(shapes.size());
  const bool few = shapes.size() <= kFewShapes;
  const double effort =
      options.effort * (few && options.effort >= kLongEffort ? kLongerForFew : 1.0);
  context.report("packing", 0.1);
  const Problem problem = problem_of(shapes, options);
  const std::array<Found, 2> starts = begin(problem, options, context);
  const Found& found = starts[0].scale >= starts[1].scale ? starts[0] : starts[1];
  if (!(found.scale > 0.0)) return {};
  context.report("packing", 0.4);
  InflateOptions inflating;
  inflating.margin = options.margin;
  inflating.may_turn = problem.may_turn;
  inflating.most_scale = options.scale > 0.0 ? problem.bound : 0.0;
  inflating.fixed = &problem.fixed;
  inflating.work = effort * kInflateWork * std::clamp(n / 100.0, 1.0, kMostInflated);
  if (options.effort == 0.0 || shapes.size() > kManyShapes || shapes.size() == 1 ||
      found.scale >= problem.bound)
    return inflate(shapes, {found.poses, found.scale}, inflating, context);
  // Longer for some more shapes, as each step mends only what is near.
  std::array<double, 2> work;
  work.fill(effort * kMendWords * (few ? 1.6 : std::clamp(n / 500.0, 0.5, 2.0)));
  Layout best;
  // Once more from where it began, by other chances, as long as that gains.
  std::uint64_t seed = 100;
  for (bool gained = true; gained && std::max(work[0], work[1]) > 0.0; seed += 200) {
    std::array<Layout, 2> layouts;
    parallel_for(context, layouts.size(), 1, [&](std::size_t i, std::size_t, std::size_t) {
      if (!(work[i] > 0.0)) return;
      const ExecutionContext part(&context, 1);
      const Found grown = grow(problem, starts[i], seed + 100 * i, work[i], part);
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
