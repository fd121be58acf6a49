#include "flipfree/unwrap/packing/nest/inflate.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "flipfree/base/plane.h"

namespace flipfree::unwrap {
namespace {

// Lists hold what is within so many times the reach.
constexpr double kRemembered = 2.0;

constexpr std::size_t kGrain = 4096;  // corners between looks at the clock

using Corner = Contacts::Corner;

struct Near {
  Index edge;
  double t;         // of the nearest point along the edge
  double distance;  // from there
  bool inside;
  Vector2 away;
};

// Nothing if a neighbouring point of the outline is nearer, or it is beyond reach.
bool nearest_on(const std::vector<Corner>& corners, Index edge, const Vector2& p, double reach,
                Near& found) {
  const Corner& from = corners[at(edge)];
  const Vector2 side = corners[at(from.next)].at - from.at;
  const Vector2 off = p - from.at;
  const double square = side.squaredNorm();
  const double along = off.dot(side);
  if (along >= square && square > 0.0) return false;  // the next edge has that corner
  // Most are rejected here, without a root; rounded generously.
  const double twice = off.x() * side.y() - off.y() * side.x();
  if (along > 0.0 && twice * twice > 1.0000001 * reach * reach * square) return false;
  const double t = square > 0.0 ? along / square : 0.0;
  if (t >= 1.0) return false;
  found.edge = edge;
  if (t <= 0.0) {
    const Vector2 before = from.at - corners[at(from.previous)].at;
    if (off.dot(before) < 0.0) return false;
    found.t = 0.0;
    found.distance = off.norm();
    found.inside = false;
    found.away = found.distance > 0.0 ? Vector2(off / found.distance) : Vector2(1.0, 0.0);
    return found.distance <= reach;
  }
  const double length = std::sqrt(square);
  const Vector2 outwards(side.y() / length, -side.x() / length);
  const double height = off.dot(outwards);
  found.t = t;
  found.distance = std::abs(height);
  found.inside = height < 0.0;
  found.away = outwards;
  return found.distance <= reach;
}

double distance_to_edge(const std::vector<Corner>& corners, Index edge, const Vector2& p) {
  const Corner& from = corners[at(edge)];
  return distance_to_segment(p, from.at, corners[at(from.next)].at);
}

// Of all that is near one corner, what it touches: from outside every nearest place, from inside
// the nearest of all.
void keep_touching(std::vector<std::pair<Index, Near>>& near) {
  std::stable_sort(near.begin(), near.end(), [](const auto& a, const auto& b) {
    if (a.first != b.first) return a.first < b.first;
    if (a.second.distance != b.second.distance) return a.second.distance < b.second.distance;
    if (a.second.inside != b.second.inside) return a.second.inside < b.second.inside;
    return a.second.edge < b.second.edge;
  });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < near.size();) {
    const bool inside = near[i].second.inside;
    const Index shape = near[i].first;
    near[kept++] = near[i++];
    for (; i < near.size() && near[i].first == shape; ++i)
      if (!inside && !near[i].second.inside) near[kept++] = near[i];
  }
  near.resize(kept);
}

bool cross_each_other(const Vector2& a, const Vector2& b, const Vector2& c, const Vector2& d) {
  if (std::max(a.x(), b.x()) < std::min(c.x(), d.x()) ||
      std::max(c.x(), d.x()) < std::min(a.x(), b.x()) ||
      std::max(a.y(), b.y()) < std::min(c.y(), d.y()) ||
      std::max(c.y(), d.y()) < std::min(a.y(), b.y()))
    return false;
  return (twice_area(a, b, c) > 0.0) != (twice_area(a, b, d) > 0.0) &&
         (twice_area(c, d, a) > 0.0) != (twice_area(c, d, b) > 0.0);
}

}  // namespace

Contacts::Contacts(const std::vector<Shape>& shapes, const std::vector<Loop>& fixed)
    : shapes_(shapes) {
  const auto add = [&](const Loop& loop, Index shape) {
    const auto first = static_cast<Index>(corners_.size());
    const auto n = static_cast<Index>(loop.size());
    for (Index i = 0; i < n; ++i) {
      const Index next = first + (i + 1) % n;
      corners_.push_back({loop[at(i)], loop[at(i)], shape, next, first + (i + n - 1) % n});
      outlines_.edges.push_back({first + i, next});
      outlines_.vertices.push_back(first + i);
    }
  };
  for (std::size_t s = 0; s < shapes.size(); ++s)
    for (const Loop& loop : shapes[s].loops) add(loop, static_cast<Index>(s));
  for (const Loop& loop : fixed) add(loop, kInvalid);
  places_.resize(static_cast<Eigen::Index>(corners_.size()), 2);
}

// Has nothing moved so far that a pair out of the lists may be within reach?
bool Contacts::remembers(const std::vector<Pose>& poses, double scale, double reach) const {
  const double most = 0.5 * (within_ - reach);
  if (!(most >= 0.0)) return false;
  for (std::size_t s = 0; s < poses.size(); ++s) {
    const Vector2 turned = scale * poses[s].turn - scale_ * poses_[s].turn;
    const double moved =
        (poses[s].centre - poses_[s].centre).norm() + shapes_[s].radius * turned.norm();
    if (!(moved <= most)) return false;
  }
  return true;
}

void Contacts::remember(const std::vector<Pose>& poses, double scale, double reach,
                        const ExecutionContext& context) {
  poses_ = poses;
  scale_ = scale;
  within_ = kRemembered * reach;
  const distortion::BoundaryGrid grid(outlines_, places_);
  begin_.assign(1, 0);
  near_.clear();
  std::vector<Index> own;
  for (std::size_t c = 0; c < corners_.size(); ++c) {
    if (c % kGrain == 0) context.check();
    const Corner& corner = corners_[c];
    grid.near(corner.at, within_, own);
    std::copy_if(own.begin(), own.end(), std::back_inserter(near_), [&](Index e) {
      return corners_[at(e)].shape != corner.shape &&
             distance_to_edge(corners_, e, corner.at) <= within_;
    });
    begin_.push_back(near_.size());
  }
}

std::vector<Contact> Contacts::find(const std::vector<Pose>& poses, double scale, double reach,
                                    const ExecutionContext& context) {
  for (std::size_t c = 0; c < corners_.size(); ++c) {
    Corner& corner = corners_[c];
    if (corner.shape != kInvalid) corner.at = poses[at(corner.shape)](corner.local, scale);
    places_.row(static_cast<Eigen::Index>(c)) = corner.at.transpose();
  }
  if (!remembers(poses, scale, reach)) remember(poses, scale, reach, context);
  std::vector<Contact> contacts;
  std::vector<std::pair<Index, Near>> near;
  for (std::size_t c = 0; c < corners_.size(); ++c) {
    if (c % kGrain == 0) context.check();
    const Corner& corner = corners_[c];
    near.clear();
    for (std::size_t i = begin_[c]; i < begin_[c + 1]; ++i) {
      Near found;
      if (nearest_on(corners_, near_[i], corner.at, reach, found))
        near.emplace_back(corners_[at(near_[i])].shape, found);
    }
    if (near.size() > 1) keep_touching(near);
    for (const auto& [shape, found] : near) {
      const Corner& from = corners_[at(found.edge)];
      const Corner& to = corners_[at(from.next)];
      contacts.push_back({corner.shape, shape, corner.local,
                          from.local + found.t * (to.local - from.local), found.away,
                          found.inside ? -found.distance : found.distance});
    }
  }
  return contacts;
}

bool Contacts::any_crossing(const ExecutionContext& context) const {
  return distortion::BoundaryGrid(outlines_, places_).any_pair(context, [&](Index e, Index f) {
    const Corner &a = corners_[at(e)], &b = corners_[at(f)];
    return a.shape != b.shape &&
           cross_each_other(a.at, corners_[at(a.next)].at, b.at, corners_[at(b.next)].at);
  });
}

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
        near_(shapes, options.fixed == nullptr ? std::vector<Loop>() : *options.fixed) {}

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
        return !near_.any_crossing(context);
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
  const Pose& body(Index i) const { return bodies_[at(i)].pose; }

  // Between rounds shapes move at most so far together.
  double allowance(double) const { return std::max(0.5 * options_.margin, 1e-3); }

  double slack(double scale) const {
    double most = 0.0;
    for (const Shape& s : shapes_) most = std::max(most, s.slack);
    return most * scale;
  }

  double slack_of(Index i, double scale) const {
    return i == kInvalid ? 0.0 : shapes_[at(i)].slack * scale;
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
    Body* a = c.a == kInvalid ? nullptr : &bodies_[at(c.a)];
    Body* b = c.b == kInvalid ? nullptr : &bodies_[at(c.b)];
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
    if (a != nullptr) move(*a, arm_a, c.away, push, shapes_[at(c.a)].radius * scale);
    if (b != nullptr) move(*b, arm_b, -c.away, push, shapes_[at(c.b)].radius * scale);
    return off;
  }

  double correct(const Wall& w, double scale, double most) {
    Body& a = bodies_[at(w.a)];
    const Vector2 p = a.pose(w.corner, scale);
    const double off = w.least - p.dot(w.inwards);
    if (off <= 0.0) return 0.0;
    if (a.moved > most) return off;
    const Vector2 arm = p - a.pose.centre;
    const double lever = cross(arm, w.inwards);
    move(a, arm, w.inwards, off / (a.light + a.loose * lever * lever),
         shapes_[at(w.a)].radius * scale);
    return off;
  }

  const std::vector<Shape>& shapes_;
  const InflateOptions& options_;
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
