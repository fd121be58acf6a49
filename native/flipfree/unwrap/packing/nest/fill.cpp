#include "flipfree/unwrap/packing/nest/fill.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <utility>

#include "flipfree/base/parallel.h"

namespace flipfree::unwrap {
namespace {

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

}  // namespace

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

std::vector<Vector2> quarter_turns() { return even_turns(4); }

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
    tile.put(masks.of_shape[i][static_cast<std::size_t>(choice.turn)], choice.cell);
  }
  filling.looked = static_cast<double>(tile.looked());
  return filling;
}

Filling carry(const std::vector<Shape>& shapes, const Masks& masks, const Tile& empty,
              const Filling& filling) {
  Filling result = filling;
  result.missing = 0.0;
  const double whole = total_area(shapes);
  Tile tile = empty;
  std::vector<std::size_t> order(shapes.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return shapes[a].area > shapes[b].area; });
  for (const std::size_t i : order) {
    if (filling.turn[i] < 0) {
      result.missing += share(shapes[i], whole);
      continue;
    }
    const Mask& mask = masks.of_shape[i][static_cast<std::size_t>(filling.turn[i])];
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

Filling mend(const std::vector<Shape>& shapes, const Masks& masks, const Tile& empty,
             Filling filling, std::uint64_t seed, const MendLimits& limits,
             const ExecutionContext& context) {
  const double whole = total_area(shapes);
  const std::size_t n = shapes.size();
  Tile tile = empty;
  std::vector<std::size_t> missing;
  const auto mask_of = [&](std::size_t i) -> const Mask& {
    return masks.of_shape[i][static_cast<std::size_t>(filling.turn[i])];
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

std::vector<Pose> poses_of(const Filling& filling, const Masks& masks,
                           const std::vector<std::vector<Vector2>>& turns) {
  std::vector<Pose> poses(filling.turn.size());
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (filling.turn[i] < 0) continue;
    const auto t = static_cast<std::size_t>(filling.turn[i]);
    poses[i].turn = turns[i][t];
    poses[i].centre =
        (Vector2(filling.cell[i].x, filling.cell[i].y) + masks.of_shape[i][t].origin) / masks.cells;
  }
  return poses;
}

}  // namespace flipfree::unwrap
