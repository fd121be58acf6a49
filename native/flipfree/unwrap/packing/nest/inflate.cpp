#include "flipfree/unwrap/packing/nest/inflate.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "flipfree/base/plane.h"
#include "flipfree/unwrap/packing/nest/contacts.h"

namespace flipfree::unwrap {
namespace {

constexpr double kAtRest = 2e-7;  // gaps may be so much narrower within this file
constexpr double kFirstGrowth = 0.01;
constexpr double kLeastGrowth = 1e-4;
constexpr int kContactRounds = 24;  // of contacts, until a layout is at rest or given up
constexpr int kSweeps = 12;         // over the contacts of a round

struct Body {
  Pose pose;
  double light = 0.0;  // 1 / mass
  double loose = 0.0;  // 1 / moment of inertia
  double moved = 0.0;  // in this round, of any of its points at most
};

// A wall of the tile and a corner near it.
struct Wall {
  Index a;
  Vector2 corner;
  Vector2 inwards;
  double least;  // of corner . inwards
};

class Dynamics {
 public:
  Dynamics(const std::vector<Shape>& shapes, const InflateOptions& options)
      : shapes_(shapes),
        options_(options),
        fixed_(options.fixed == nullptr ? kNone : *options.fixed),
        near_(shapes, fixed_) {}

  // At rest at this scale after some rounds; poses are changed in any case.
  bool settle(Layout& layout, double& work, const ExecutionContext& context) {
    const double scale = layout.scale;
    start(layout);
    for (int round = 0; round < kContactRounds; ++round) {
      context.check();
      const double reach = options_.margin + allowance(scale) + 2.0 * slack(scale);
      contacts_ = near_.find(poses(), scale, reach, context);
      find_walls(scale, reach);
      work -= 4.0 * corners_ + 2.0 * static_cast<double>(contacts_.size());
      double worst = 0.0;
      for (const Contact& c : contacts_) worst = std::max(worst, target(c, scale) - c.gap);
      for (const Wall& w : walls_)
        worst = std::max(worst, w.least - body(w.a)(w.corner, scale).dot(w.inwards));
      if (worst <= kAtRest) {
        layout.poses = poses();
        return !any_crossing(shapes_, layout.poses, scale, fixed_, context);
      }
      if (work < 0.0) return false;
      const double most = 0.5 * allowance(scale);
      for (Body& b : bodies_) b.moved = 0.0;
      for (int sweep = 0; sweep < kSweeps; ++sweep) {
        double off = 0.0;
        for (const Contact& c : contacts_) off = std::max(off, correct(c, scale, most));
        for (const Wall& w : walls_) off = std::max(off, correct(w, scale, most));
        work -= static_cast<double>(contacts_.size() + walls_.size());
        if (off < 0.5 * kAtRest) break;
      }
    }
    return false;
  }

 private:
  const Pose& body(Index i) const { return bodies_[static_cast<std::size_t>(i)].pose; }

  // Between rounds shapes move at most so far together.
  double allowance(double) const { return std::max(0.5 * options_.margin, 1e-3); }

  double slack(double scale) const {
    double most = 0.0;
    for (const Shape& s : shapes_) most = std::max(most, s.slack);
    return most * scale;
  }

  double slack_of(Index i, double scale) const {
    return i == kInvalid ? 0.0 : shapes_[static_cast<std::size_t>(i)].slack * scale;
  }

  double target(const Contact& c, double scale) const {
    return options_.margin + slack_of(c.a, scale) + slack_of(c.b, scale);
  }

  void start(const Layout& layout) {
    bodies_.resize(shapes_.size());
    corners_ = 0.0;
    for (std::size_t i = 0; i < shapes_.size(); ++i) {
      const double size = std::max(shapes_[i].radius * layout.scale, 1e-9);
      Body& b = bodies_[i];
      b.pose = layout.poses[i];
      b.light = 1.0 / (size * size);
      const bool may_turn = options_.may_turn.empty() || options_.may_turn[i] != 0;
      b.loose = may_turn ? 2.0 * b.light / (size * size) : 0.0;
      for (const Loop& loop : shapes_[i].loops) corners_ += static_cast<double>(loop.size());
    }
  }

  std::vector<Pose> poses() const {
    std::vector<Pose> result;
    for (const Body& b : bodies_) result.push_back(b.pose);
    return result;
  }

  void find_walls(double scale, double reach) {
    walls_.clear();
    for (std::size_t i = 0; i < shapes_.size(); ++i) {
      const double least = 0.5 * options_.margin + slack_of(static_cast<Index>(i), scale);
      const Pose& pose = bodies_[i].pose;
      const double size = shapes_[i].radius * scale + least + reach;
      if (pose.centre.minCoeff() > size && pose.centre.maxCoeff() < 1.0 - size) continue;
      for (const Loop& loop : shapes_[i].loops) {
        for (const Vector2& p : loop) {
          const Vector2 at = pose(p, scale);
          const auto a = static_cast<Index>(i);
          if (at.x() < least + reach) walls_.push_back({a, p, {1.0, 0.0}, least});
          if (at.y() < least + reach) walls_.push_back({a, p, {0.0, 1.0}, least});
          if (at.x() > 1.0 - least - reach) walls_.push_back({a, p, {-1.0, 0.0}, least - 1.0});
          if (at.y() > 1.0 - least - reach) walls_.push_back({a, p, {0.0, -1.0}, least - 1.0});
        }
      }
    }
  }

  // Moves a body whose point `arm` (from its centre) is pushed by `push` along `way`.
  void move(Body& b, const Vector2& arm, const Vector2& way, double push, double radius) {
    b.pose.centre += b.light * push * way;
    b.moved += b.light * push;
    if (b.loose > 0.0) {
      const double angle = b.loose * push * cross(arm, way);
      const Vector2 t = b.pose.turn;
      b.pose.turn = Vector2(t.x() - angle * t.y(), t.y() + angle * t.x()).normalized();
      b.moved += std::abs(angle) * radius;
    }
  }

  double correct(const Contact& c, double scale, double most) {
    Body* a = c.a == kInvalid ? nullptr : &bodies_[static_cast<std::size_t>(c.a)];
    Body* b = c.b == kInvalid ? nullptr : &bodies_[static_cast<std::size_t>(c.b)];
    const Vector2 p = a == nullptr ? c.corner : a->pose(c.corner, scale);
    const Vector2 q = b == nullptr ? c.point : b->pose(c.point, scale);
    const double off = target(c, scale) - (p - q).dot(c.away);
    if (off <= 0.0) return 0.0;
    double weight = 0.0;
    Vector2 arm_a = Vector2::Zero();
    Vector2 arm_b = Vector2::Zero();
    if (a != nullptr) {
      arm_a = p - a->pose.centre;
      const double lever = cross(arm_a, c.away);
      weight += a->light + a->loose * lever * lever;
    }
    if (b != nullptr) {
      arm_b = q - b->pose.centre;
      const double lever = cross(arm_b, c.away);
      weight += b->light + b->loose * lever * lever;
    }
    if (!(weight > 0.0)) return off;
    if ((a != nullptr && a->moved > most) || (b != nullptr && b->moved > most)) return off;
    const double push = off / weight;
    if (a != nullptr)
      move(*a, arm_a, c.away, push, shapes_[static_cast<std::size_t>(c.a)].radius * scale);
    if (b != nullptr)
      move(*b, arm_b, -c.away, push, shapes_[static_cast<std::size_t>(c.b)].radius * scale);
    return off;
  }

  double correct(const Wall& w, double scale, double most) {
    Body& a = bodies_[static_cast<std::size_t>(w.a)];
    const Vector2 p = a.pose(w.corner, scale);
    const double off = w.least - p.dot(w.inwards);
    if (off <= 0.0) return 0.0;
    if (a.moved > most) return off;
    const Vector2 arm = p - a.pose.centre;
    const double lever = cross(arm, w.inwards);
    move(a, arm, w.inwards, off / (a.light + a.loose * lever * lever),
         shapes_[static_cast<std::size_t>(w.a)].radius * scale);
    return off;
  }

  const std::vector<Shape>& shapes_;
  const InflateOptions& options_;
  inline static const std::vector<Loop> kNone;
  const std::vector<Loop>& fixed_;
  Contacts near_;
  std::vector<Body> bodies_;
  std::vector<Contact> contacts_;
  std::vector<Wall> walls_;
  double corners_ = 0.0;
};

}  // namespace

Layout inflate(const std::vector<Shape>& shapes, const Layout& start, const InflateOptions& options,
               const ExecutionContext& context) {
  Dynamics dynamics(shapes, options);
  double work = options.work;
  Layout best = start;
  // Margins of the start may be a little too narrow: smaller until they are not.
  constexpr int kShrinks = 12;
  bool sound = false;
  for (int i = 0; i < kShrinks && !sound; ++i) {
    Layout tried = best;
    double enough = std::numeric_limits<double>::infinity();
    sound = dynamics.settle(tried, enough, context);
    if (sound) {
      best = tried;
    } else {
      best.scale *= i < 5 ? 0.997 : 0.98;
    }
  }
  if (!sound) return {start.poses, 0.0};
  double radius = 0.0;
  for (const Shape& s : shapes) radius = std::max(radius, s.radius);
  // What grows in one step moves an outline by less than would let it jump over another.
  const double most = std::max(0.4 * options.margin, 1e-3);
  double growth = kFirstGrowth;
  while (growth >= kLeastGrowth && work > 0.0) {
    const double step = std::min(growth, most / std::max(radius * best.scale, 1e-9));
    Layout tried = best;
    tried.scale *= 1.0 + step;
    if (options.most_scale > 0.0) tried.scale = std::min(tried.scale, options.most_scale);
    if (!(tried.scale > best.scale)) break;
    if (dynamics.settle(tried, work, context)) {
      best = tried;
    } else {
      growth = 0.5 * step;
    }
  }
  return best;
}

}  // namespace flipfree::unwrap
