#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "flipfree/base/plane.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/unwrap/packing/nest/nest.h"

namespace flipfree::unwrap {
namespace {

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
  Pose pose;
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
    outlines_.add({{low, low}, {high, low}, {high, high}, {low, high}}, bodies_.size());
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
      context.check();
      const double narrowest = look(work);
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
    return body_of(corner).light > 0.0 ? body_of(corner).pose(local, scale_) : local;
  }

  // Finds the corners and edges of different bodies that may come too near each other until the
  // next look; the least distance.
  double look(double& work) {
    for (Index c = 0; c < places_.rows(); ++c) places_.row(c) = place_of(c).transpose();
    for (Body& b : bodies_) b.moved = 0.0;
    const double reach = (1.0 + kCare + 2.0 * kMoved) * least_;
    const distortion::BoundaryGrid grid(outlines_.boundary, places_);
    double narrowest = std::numeric_limits<double>::infinity();
    pairs_.clear();
    std::vector<Index> near;
    for (Index c = 0; c < places_.rows(); ++c) {
      const Vector2 p = places_.row(c).transpose();
      grid.near(p, reach, near);
      work -= kLookWork + static_cast<double>(near.size());
      for (const Index e : near) {
        const auto& [from, to] = outlines_.boundary.edges[at(e)];
        if (outlines_.owner[at(from)] == outlines_.owner[at(c)]) continue;
        const double distance =
            distance_to_segment(p, places_.row(from).transpose(), places_.row(to).transpose());
        if (distance <= reach) pairs_.emplace_back(c, e);
        narrowest = std::min(narrowest, distance);
      }
    }
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
    const double lever_a = cross(p - a.pose.centre, away) / scale_;
    const double lever_b = cross(foot - b.pose.centre, away) / scale_;
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
    body.pose.centre += body.light * push * away;
    const double angle = body.loose * push * lever / scale_;
    const Vector2 t = body.pose.turn;
    body.pose.turn = Vector2(t.x() - angle * t.y(), t.y() + angle * t.x()).normalized();
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

}  // namespace

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

}  // namespace flipfree::unwrap
