#include "flipfree/unwrap/packing/nest/nest.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include "flipfree/base/parallel.h"
#include "flipfree/base/plane.h"
#include "flipfree/base/random.h"
#include "flipfree/unwrap/packing/nest/shape.h"

namespace flipfree::unwrap {
namespace {

// Cells to a side per square root of shapes: some 96 across each shape.
constexpr double kCellsAcross = 96.0;
constexpr double kLeastCellsToSide = 384.0;
constexpr double kMostCellsToSide = 4096.0;
constexpr double kFirstFill = 0.62;     // of the tile, where the search begins
constexpr double kMostMissing = 0.3;    // share of the area, of a filling that is given up
constexpr double kFineShare = 0.004;    // the search for a scale ends at this share of it
constexpr double kSearched = 0.02;      // scales below this share of the bound are not looked for
constexpr double kLeastScale = 0.7;     // nor are those below
constexpr std::size_t kMostTurns = 12;  // directions of a shape
constexpr double kMuch = 0.2;  // of all area: such shapes are tried as square as they go too
constexpr std::size_t kManyShapes = 2000;  // shapes, of which fewer directions are tried
constexpr std::size_t kFewShapes = 150;    // shapes, which are mended longer
constexpr double kLongEffort = 0.5;
constexpr double kLongerForFew = 2.0;  // with that effort, as it is half a second still
constexpr double kMendWords = 3e7;     // per unit of effort, for some hundred shapes
constexpr double kPushes = 9e7;        // per unit of effort
constexpr double kPushesOfMany = 2e7;
// Tries in a row to mend a filling that gain nothing, until it is given up.
constexpr std::size_t kLeastTries = 16;
constexpr std::size_t kTriesPerShape = 2;  // more
constexpr std::size_t kMostTaken = 16;     // shapes at a time
constexpr double kStep = 2e4;              // what a step costs beside looking, in words
// Once the masks are so much smaller than where a search last began at the bottom, it does again:
// what is smaller may fit where nothing did.
constexpr double kSmaller = 0.95;

constexpr std::array<std::array<int, 2>, 9> kAround = {
    {{0, 0}, {0, -1}, {-1, 0}, {0, 1}, {1, 0}, {-1, -1}, {1, 1}, {1, -1}, {-1, 1}}};

// How the place of a shape is chosen among the lowest ones of all its directions.
struct Rule {
  double height = 0.5;   // weight of the mask's own height: 0 its foot, 1 its top is to be low
  double contact = 1.0;  // what touching on all sides is worth, in heights of the mask
};

struct Choice {
  int turn = -1;  // the direction; -1: no place was found
  Cell cell;
  double cost = std::numeric_limits<double>::infinity();
};

// A shape in all its directions as cells.
using Masks = std::vector<Mask>;

struct Filling {
  std::vector<Choice> place;  // per shape
  double scale = 0.0;
  double looked = 0.0;   // words of the tile
  double missing = 0.0;  // area of the shapes that found no place, as a share
};

// Of the places that lowest(direction) finds the one that the rule likes best.
template <typename Lowest>
Choice best_place(const Masks& masks, const Tile& tile, const Rule& rule, Lowest lowest) {
  Choice best;
  for (std::size_t t = 0; t < masks.size(); ++t) {
    const std::optional<Cell> cell = lowest(t);
    if (!cell) continue;
    const int height = masks[t].height;
    double cost = cell->y + rule.height * height + 1e-4 * cell->x;
    if (rule.contact > 0.0) cost -= rule.contact * height * tile.contact(masks[t], *cell);
    if (cost < best.cost) best = {static_cast<int>(t), *cell, cost};
  }
  return best;
}

std::vector<Vector2> even_turns(int count) {
  std::vector<Vector2> turns;
  for (int i = 0; i < count; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / count;
    Vector2 turn(std::cos(angle), std::sin(angle));
    if (4 * i % count == 0) turn = turn.array().round();  // exact
    turns.push_back(turn);
  }
  return turns;
}

Tile tile_of(const std::vector<Loop>& fixed, int cells, double radius) {
  Tile tile(cells);
  tile.put(draw_in_unit(fixed, cells, radius * cells), {});
  return tile;
}

class Nester {
 public:
  // All must outlive this.
  Nester(const std::vector<Shape>& shapes, const NestOptions& options)
      : shapes_(shapes),
        options_(options),
        cells_(64 * static_cast<int>(
                        std::clamp(kCellsAcross * std::sqrt(static_cast<double>(shapes.size())),
                                   kLeastCellsToSide, kMostCellsToSide) /
                        64.0)),
        empty_(tile_of(options.fixed, cells_, 0.5 * options.margin)),
        order_(shapes.size()) {
    double area = 0.0;
    double radius = 0.0;
    for (const Shape& s : shapes) {
      area += s.area;
      radius = std::max(radius, s.radius);
    }
    for (const Shape& s : shapes) {
      share_.push_back(area > 0.0 ? std::max(s.area / area, 1e-12) : 1.0);
      turns_.push_back(turns_of(s, share_.back()));
    }
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    const auto size = [&](std::size_t i) {
      return 2.0 * shapes[i].radius + std::sqrt(std::max(0.0, shapes[i].area));
    };
    std::stable_sort(order_.begin(), order_.end(),
                     [&](std::size_t a, std::size_t b) { return size(a) > size(b); });
    // No shape is wider than the tile's diagonal.
    bound_ = radius > 0.0 ? std::sqrt(2.0) / radius : 1.0;
    if (area > 0.0) bound_ = std::min(bound_, 1.0 / std::sqrt(area));
    if (options.scale > 0.0) bound_ = std::min(bound_, options.scale);
  }

  // The largest scale at which the shapes fill the tile one after another, by guesses from what
  // found no place; 0 if there is none.
  Filling search(const ExecutionContext& context) const {
    Filling best;
    const auto attempt = [&](double scale) {
      Filling filling = fill(scale, context);
      if (filling.missing == 0.0) best = filling;
      return filling.missing;
    };
    if (options_.scale > 0.0 && attempt(bound_) == 0.0) return best;
    double high = bound_;
    const double low = std::max(kLeastScale, kSearched * bound_);
    double scale =
        std::min(std::max(bound_ * std::sqrt(kFirstFill), 0.5 * (low + high)), 0.99 * high);
    while (scale > low) {
      const double missing = attempt(scale);
      if (missing == 0.0) {
        if (high - scale < kFineShare * high) break;
        scale = std::min(0.5 * (scale + high), 1.04 * scale);
        continue;
      }
      high = scale;
      const double guessed = scale * std::sqrt(std::max(0.3, 1.0 - missing)) * 0.995;
      // One shape that is most of all says little by what it misses.
      const double reached = best.scale > 0.0 ? best.scale : low;
      if (high - reached < kFineShare * high) break;
      scale = std::max(std::min(guessed, 0.997 * high), 0.5 * (reached + high));
    }
    return best;
  }

  // Larger and larger, mending what finds no place, in smaller and smaller steps until none is left
  // that works, or the work is spent.
  Filling grow(Filling best, std::uint64_t seed, const double whole_work,
               const ExecutionContext& context) const {
    double work = whole_work;
    double step = 0.01;
    constexpr double kLeastStep = 0.0002;
    while (step >= kLeastStep && work > 0.0 && best.scale < bound_) {
      const double scale = std::min(bound_, best.scale * (1.0 + step));
      Filling filling = mend(best, scale, ++seed, std::min(work, 0.25 * work + 2e6), context);
      // Drawing costs as well, at least this share of all.
      work -= filling.looked + 4e4 * static_cast<double>(shapes_.size()) + 0.01 * whole_work;
      if (filling.missing == 0.0) {
        best = std::move(filling);
      } else {
        step *= 0.6;
      }
    }
    return best;
  }

  // Where the shapes of a filling lie, in units of the tile.
  Layout layout_of(const Filling& filling, const ExecutionContext& context) const {
    Layout layout{{}, filling.scale};
    const std::vector<Masks> masks = draw(filling.scale, context);
    for (std::size_t i = 0; i < filling.place.size(); ++i) {
      const auto& [turn, cell, cost] = filling.place[i];
      const Vector2 centre = Vector2(cell.x, cell.y) + masks[i][at(turn)].origin;
      layout.poses.push_back({turns_[i][at(turn)], centre / cells_});
    }
    return layout;
  }

 private:
  std::vector<Vector2> turns_of(const Shape& shape, double share) const {
    if (options_.rotation == Rotation::kNone) return {Vector2(1.0, 0.0)};
    if (!may_turn(shape, options_.rotation) || shapes_.size() > kManyShapes) return even_turns(4);
    std::vector<Vector2> turns = even_turns(8);
    if (share < kMuch) return turns;
    const Vector2 t = squarest_turn(shape);
    for (const Vector2& q : even_turns(4))
      turns.emplace_back(t.x() * q.x() - t.y() * q.y(), t.x() * q.y() + t.y() * q.x());
    return turns;
  }

  std::vector<Masks> draw(double scale, const ExecutionContext& context) const {
    std::vector<Masks> masks(shapes_.size());
    parallel_for(context, shapes_.size(), 16, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t i = begin; i < end; ++i) {
        const double radius = 0.5 * options_.margin + shapes_[i].slack * scale;
        for (const Vector2& turn : turns_[i])
          masks[i].push_back(draw_shape(shapes_[i], turn, scale * cells_, radius * cells_));
      }
    });
    return masks;
  }

  // Puts the shapes into the tile, larger ones first, each where the rule likes it best; passes
  // over those that fit nowhere, and ends once too much of the area is missing.
  Filling fill(double scale, const ExecutionContext& context) const {
    const std::vector<Masks> masks = draw(scale, context);
    Filling filling{std::vector<Choice>(shapes_.size()), scale};
    Tile tile = empty_;
    struct Memory {
      int row = 0;
      double size = std::numeric_limits<double>::infinity();
    };
    std::array<Memory, kMostTurns> memory;  // by direction
    std::size_t count = 0;
    for (const std::size_t i : order_) {
      if (++count % 32 == 0) context.check();
      Choice& place = filling.place[i];
      place = best_place(masks[i], tile, Rule{}, [&](std::size_t t) {
        auto& [row, size_then] = memory[t];
        const double size = static_cast<double>(masks[i][t].width) * masks[i][t].height;
        if (size < kSmaller * size_then) {
          row = 0;
          size_then = size;
        }
        const std::optional<Cell> cell = tile.lowest(masks[i][t], row, cells_);
        row = cell ? cell->y : cells_;
        return cell;
      });
      if (place.turn >= 0) {
        tile.put(masks[i][at(place.turn)], place.cell);
      } else if ((filling.missing += share_[i]) > kMostMissing) {
        break;
      }
    }
    return filling;
  }

  // The filling at another scale. Shapes stay in their cell or go to one beside it; to complete it,
  // what lies around a random place is taken away, what is missing is put back there first, and it
  // goes on from what it has unless more is missing than before. Ends after so many tries in a row
  // after which no less is missing, or when it has looked at `work` words of the tile.
  // Deterministic.
  Filling mend(const Filling& before, double scale, std::uint64_t seed, double work,
               const ExecutionContext& context) const {
    const std::vector<Masks> masks = draw(scale, context);
    Filling filling{before.place, scale};
    std::vector<Choice>& place = filling.place;
    Tile tile = empty_;
    const auto mask_of = [&](std::size_t i) -> const Mask& { return masks[i][at(place[i].turn)]; };
    std::vector<std::size_t> missing;
    for (const std::size_t i : order_) {
      const Cell old = place[i].cell;
      const auto fits = [&](const std::array<int, 2>& off) {
        place[i].cell = {old.x + off[0], old.y + off[1]};
        return tile.fits(mask_of(i), place[i].cell);
      };
      if (std::any_of(kAround.begin(), kAround.end(), fits)) {
        tile.put(mask_of(i), place[i].cell);
      } else {
        place[i].turn = -1;
        missing.push_back(i);
        filling.missing += share_[i];
      }
    }
    const std::size_t tries = kLeastTries + kTriesPerShape * shapes_.size();
    Random random(seed);
    std::size_t idle = 0;
    for (int step = 0; !missing.empty() && idle < tries; ++step, ++idle) {
      if (static_cast<double>(tile.looked()) + kStep * step > work) break;
      if (step % 16 == 0) context.check();
      // Around one that is placed, a few times as large as one that is missing.
      const std::size_t wanted = missing[random.below(missing.size())];
      const std::size_t around = random.below(shapes_.size());
      if (place[around].turn < 0) continue;
      const auto size_of = [](const Mask& mask) { return std::max(mask.width, mask.height); };
      const double reach = (0.4 + 0.8 * random.unit()) * size_of(masks[wanted].front()) +
                           0.5 * size_of(mask_of(around));
      const auto middle_of = [&](std::size_t i) {
        return Vector2(place[i].cell.x + 0.5 * mask_of(i).width,
                       place[i].cell.y + 0.5 * mask_of(i).height);
      };
      const Vector2 middle = middle_of(around);
      std::vector<std::size_t> back;
      int low = place[around].cell.y;
      int high = low;
      for (std::size_t i = 0; i < place.size() && back.size() < kMostTaken; ++i) {
        if (place[i].turn < 0 || (middle_of(i) - middle).cwiseAbs().maxCoeff() > reach) continue;
        back.push_back(i);
        low = std::min(low, place[i].cell.y);
        high = std::max(high, place[i].cell.y + mask_of(i).height);
      }
      const std::vector<std::size_t> taken = back;
      std::vector<Choice> old;
      const auto take = [&](std::size_t i) {
        if (place[i].turn >= 0) tile.take(mask_of(i), place[i].cell);
        place[i].turn = -1;
      };
      for (const std::size_t i : taken) {
        old.push_back(place[i]);
        take(i);
      }
      back.insert(back.end(), missing.begin(), missing.end());
      // Larger ones first, but not always.
      std::vector<double> key(place.size(), 0.0);
      for (const std::size_t i : back) key[i] = shapes_[i].area * (0.5 + random.unit());
      key[wanted] *= 2.0;
      std::stable_sort(back.begin(), back.end(),
                       [&](std::size_t a, std::size_t b) { return key[a] > key[b]; });
      const Rule rule{random.unit(), random.unit() < 0.5 ? 0.0 : 2.0 * random.unit()};
      double now = 0.0;
      std::vector<std::size_t> still;
      for (const std::size_t i : back) {
        place[i] = best_place(masks[i], tile, rule, [&](std::size_t t) {
          return tile.lowest(masks[i][t], std::max(0, low - 2), high);
        });
        if (place[i].turn >= 0) {
          tile.put(mask_of(i), place[i].cell);
        } else {
          still.push_back(i);
          now += share_[i];
        }
      }
      if (now <= filling.missing * (1.0 + 1e-12)) {
        if (now < filling.missing * (1.0 - 1e-12)) idle = 0;
        filling.missing = now;
        missing = std::move(still);
        continue;
      }
      for (const std::size_t i : back) take(i);
      for (std::size_t k = 0; k < taken.size(); ++k) {
        place[taken[k]] = old[k];
        tile.put(mask_of(taken[k]), old[k].cell);
      }
    }
    if (missing.empty()) filling.missing = 0.0;
    filling.looked = static_cast<double>(tile.looked());
    return filling;
  }

  const std::vector<Shape>& shapes_;
  const NestOptions& options_;
  int cells_;  // of the tile, to a side
  Tile empty_;
  std::vector<std::size_t> order_;           // larger ones first
  std::vector<double> share_;                // of the area, per shape
  std::vector<std::vector<Vector2>> turns_;  // per shape: its directions
  double bound_ = 0.0;                       // no larger scale is of use
};

// Position-based dynamics (Mueller et al. 2007, "Position based dynamics") of rigid shapes.
//
// Shares of the least gap. Shapes are never nearer than half of it when they are looked at, and
// between two looks no point moves farther than a quarter, so that none passes through another and
// distances need no sign.
constexpr double kNearest = 0.5;
constexpr double kMoved = 0.25;
constexpr double kCare = 0.002;  // pushed so much farther, so that pushing ends
constexpr double kPush = 1.5;    // of what lacks (over-relaxation)
constexpr int kLooks = 100;      // until a scale is given up
constexpr int kSweeps = 10;      // over what is near, between two looks
constexpr double kFirstGrowth = 0.004;
constexpr double kLeastGrowth = 1e-4;
constexpr double kLookWork = 20.0;  // per corner and beside its near edges, in pushes

struct Body {
  Similarity pose;
  double radius = 0.0;
  double light = 0.0;  // 1 / mass; 0: fixed
  double loose = 0.0;  // 1 / moment of inertia; 0: does not turn
  double moved = 0.0;  // since the last look, of any of its points at most
};

class Dynamics {
 public:
  Dynamics(const std::vector<Shape>& shapes, const NestOptions& options) : margin_(options.margin) {
    for (const Shape& s : shapes) {
      for (const Loop& loop : s.loops) outlines_.add(loop, bodies_.size());
      const double square = std::max(s.radius * s.radius, 1e-18);
      const bool turns = may_turn(s, options.rotation);
      bodies_.push_back({{}, s.radius, 1.0 / square, turns ? 2.0 / (square * square) : 0.0});
      slack_ = std::max(slack_, s.slack);
    }
    const double low = -0.5 * margin_;
    const double high = 1.0 - low;
    outlines_.add(Loop{{low, low}, {high, low}, {high, high}, {low, high}}, bodies_.size());
    for (const Loop& loop : options.fixed) outlines_.add(loop, bodies_.size());
    bodies_.emplace_back();
    places_.resize(static_cast<Eigen::Index>(outlines_.corners.size()), 2);
  }

  // Pushes shapes apart until all gaps are wide enough; false if they do not become so.
  bool settle(Layout& layout, double& work, const ExecutionContext& context) {
    scale_ = layout.scale;
    least_ = margin_ + 2.0 * slack_ * scale_;
    for (std::size_t s = 0; s < layout.poses.size(); ++s) bodies_[s].pose = layout.poses[s];
    for (int i = 0; i < kLooks && work > 0.0; ++i) {
      const double narrowest = look(work, context);
      if (narrowest < kNearest * least_) return false;
      if (narrowest >= least_) {
        for (std::size_t s = 0; s < layout.poses.size(); ++s) layout.poses[s] = bodies_[s].pose;
        return true;
      }
      for (int sweep = 0; sweep < kSweeps; ++sweep)
        for (const auto& [corner, edge] : pairs_) correct(corner, edge);
      work -= kSweeps * static_cast<double>(pairs_.size());
    }
    return false;
  }

 private:
  const Body& body_of(Index corner) const { return bodies_[outlines_.owner[at(corner)]]; }
  Body& body_of(Index corner) { return bodies_[outlines_.owner[at(corner)]]; }

  Vector2 place_of(Index corner) const {
    const Vector2& local = outlines_.corners[at(corner)];
    return body_of(corner).light > 0.0 ? body_of(corner).pose(scale_ * local) : local;
  }

  // Finds the corners and edges of different bodies that may come too near each other until the
  // next look; the least distance.
  double look(double& work, const ExecutionContext& context) {
    for (Index c = 0; c < places_.rows(); ++c) places_.row(c) = place_of(c).transpose();
    for (Body& b : bodies_) b.moved = 0.0;
    const double reach = (1.0 + kCare + 2.0 * kMoved) * least_;
    double narrowest = std::numeric_limits<double>::infinity();
    pairs_.clear();
    const std::size_t looked =
        outlines_.for_near(places_, reach, context, [&](Index corner, Index edge, double distance) {
          pairs_.emplace_back(corner, edge);
          narrowest = std::min(narrowest, distance);
        });
    work -= kLookWork * static_cast<double>(places_.rows()) + static_cast<double>(looked);
    return narrowest;
  }

  // Moves and turns the two bodies apart, by their masses.
  void correct(Index corner, Index edge) {
    const auto& [from, to] = outlines_.boundary.edges[at(edge)];
    Body& a = body_of(corner);
    Body& b = body_of(from);
    const Vector2 p = place_of(corner);
    const Vector2 q = place_of(from);
    const Vector2 side = place_of(to) - q;
    const double square = side.squaredNorm();
    const double t = square > 0.0 ? std::clamp((p - q).dot(side) / square, 0.0, 1.0) : 0.0;
    const Vector2 foot = q + t * side;
    const double gap = (p - foot).norm();
    const double lacks = (1.0 + kCare) * least_ - gap;
    if (!(lacks > 0.0) || !(gap > 0.0)) return;
    const Vector2 away = (p - foot) / gap;
    const double lever_a = cross(p - a.pose.translation, away) / scale_;
    const double lever_b = cross(foot - b.pose.translation, away) / scale_;
    const double weight =
        a.light + a.loose * lever_a * lever_a + b.light + b.loose * lever_b * lever_b;
    const double push =
        std::max(0.0, std::min({kPush * lacks / weight, most(a, lever_a), most(b, lever_b)}));
    move(a, push, away, lever_a);
    move(b, push, -away, -lever_b);
  }

  // How far a unit push moves any of its points, at most.
  static double reach_of(const Body& body, double lever) {
    return body.light + body.loose * std::abs(lever) * body.radius;
  }

  double most(const Body& body, double lever) const {
    return (kMoved * least_ - body.moved) / reach_of(body, lever);
  }

  void move(Body& body, double push, const Vector2& away, double lever) {
    if (body.light == 0.0) return;
    body.moved += push * reach_of(body, lever);
    body.pose.translation += body.light * push * away;
    const double angle = body.loose * push * lever / scale_;
    const Vector2 t = body.pose.linear;
    body.pose.linear = Vector2(t.x() - angle * t.y(), t.y() + angle * t.x()).normalized();
  }

  double margin_;
  double slack_ = 0.0;
  double scale_ = 1.0;
  double least_ = 0.0;  // gap
  // The last one is what is fixed, with the tile's border half of the margin outside.
  std::vector<Body> bodies_;
  Outlines outlines_;                           // of bodies, where they are at scale 1
  Points2 places_;                              // of the corners
  std::vector<std::pair<Index, Index>> pairs_;  // corner and edge
};

// A layout whose gaps are at least the margin, at a larger scale if pushing shapes aside and
// turning them (those that may turn by eighths) makes room; it has these gaps as well.
// Deterministic. Cost: at most `work`, in pushes of one corner.
Layout inflate(const std::vector<Shape>& shapes, const NestOptions& options, Layout layout,
               double work, const ExecutionContext& context) {
  double radius = 0.0;
  for (const Shape& s : shapes) radius = std::max(radius, s.radius);
  Dynamics dynamics(shapes, options);
  double growth = std::min(kFirstGrowth, kMoved * options.margin / (radius * layout.scale));
  while (growth >= kLeastGrowth && work > 0.0) {
    Layout tried = layout;
    tried.scale *= 1.0 + growth;
    if (options.scale > 0.0) tried.scale = std::min(tried.scale, options.scale);
    if (!(tried.scale > layout.scale)) break;
    if (dynamics.settle(tried, work, context)) {
      layout = std::move(tried);
    } else {
      growth *= 0.5;
    }
  }
  return layout;
}

// The only shape in an empty tile: as square as it may turn, in the lower left corner.
Layout nest_alone(const Shape& shape, const NestOptions& options) {
  Similarity pose;
  if (may_turn(shape, options.rotation)) pose.linear = squarest_turn(shape);
  const Eigen::AlignedBox2d box = box_of(shape.loops, pose.linear);
  const double extent = box.sizes().maxCoeff() + 2.0 * shape.slack;
  const double most = (1.0 - options.margin) / extent;
  const double scale = options.scale > 0.0 ? std::min(options.scale, most) : most;
  pose.translation =
      Vector2::Constant(0.5 * options.margin + scale * shape.slack) - scale * box.min();
  return {{pose}, scale};
}

}  // namespace

Layout nest(const std::vector<Shape>& shapes, const NestOptions& options,
            ExecutionContext& context) {
  if (shapes.empty()) return {};
  context.report("packing", 0.1);
  if (shapes.size() == 1 && options.fixed.empty()) return nest_alone(shapes.front(), options);
  const Nester nester(shapes, options);
  Filling best = nester.search(context);
  if (!(best.scale > 0.0)) return {};
  context.report("packing", 0.4);
  if (shapes.size() > 1 && shapes.size() <= kManyShapes) {
    // Longer for some more shapes, as each step mends only what is near.
    const bool few = shapes.size() <= kFewShapes;
    const double longer = few && options.effort >= kLongEffort ? kLongerForFew : 1.0;
    const double more =
        few ? 1.6 : std::clamp(static_cast<double>(shapes.size()) / 500.0, 0.5, 2.0);
    std::array<Layout, 2> grown;
    parallel_for(context, grown.size(), 1, [&](std::size_t i, std::size_t, std::size_t) {
      const ExecutionContext part(&context, 1);
      const Filling mended =
          nester.grow(best, 100 * (i + 1), options.effort * longer * more * kMendWords, part);
      grown[i] = inflate(shapes, options, nester.layout_of(mended, part),
                         options.effort * (few ? kPushes : kPushesOfMany), part);
    });
    return grown[grown[1].scale > grown[0].scale ? 1 : 0];
  }
  return nester.layout_of(best, context);
}

}  // namespace flipfree::unwrap
