#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "flipfree/base/failure.h"
#include "flipfree/base/parallel.h"
#include "flipfree/distortion/valid_map.h"
#include "flipfree/matchmaker/mesh_overlay.h"
#include "flipfree/matchmaker/relax.h"
#include "flipfree/matchmaker/ways.h"

namespace flipfree::matchmaker {
namespace {

// A disk as a star with a pin at the end of each arm: the coarse map behind move_with_arms().
//
//        circle                      plane
//         .--t--.                         t
//       b' \ | / b                  b'--------.
//       |   `p'  |            C     q          p t
//       t p- c -p t                 b---------'
//        `--...--'                        t
//
// Seen from a point c of the disk the pins p have an order. Between one and the next the boundary
// (at b) is drawn in to a hub around c, whose side faces the targets; from there a straight arm
// leads to each of them, and the boundary (t) goes around its pin.

// The pins as they are seen from a point of the disk: in which direction, ascending.
struct StarView {
  Vector2 centre = Vector2::Zero();
  std::vector<std::pair<double, std::size_t>> pins;
};

// A boundary vertex that is to mark the end of an arm's share lies within this part of the gap
// between two pins.
constexpr double kMiddle = 0.6;

constexpr double kTurn = 2 * std::numbers::pi;

double angle_of(const Vector2& p) { return std::atan2(p.y(), p.x()); }
// The angle from a to b, counter-clockwise, in (0, 2 pi].
double turn_from(double a, double b) {
  const double turn = std::fmod(b - a, kTurn);
  return turn > 0 ? turn : turn + kTurn;
}

// A disk's boundary as it is seen from a point inside, with vertices where a star needs them.
class Shore {
 public:
  // `map`, which outlives this, has a convex boundary with `centre` inside; its edges are split.
  Shore(mesh::RefinedMap& map, const Vector2& centre) : map_(map), centre_(centre) {
    const VertexId first = map.surface.boundary.front();
    VertexId v = first;
    do {
      rim_.push_back({angle_at(v), v});
      v = next(v);
    } while (v != first);
    std::sort(rim_.begin(), rim_.end());
  }

  // A vertex strictly between two directions, `turn` apart, near the middle. kInvalid if there can
  // be none in doubles.
  VertexId between(double from, double turn) {
    const double middle = std::remainder(from + 0.5 * turn, kTurn);
    const std::size_t after = first_after(middle);
    VertexId best = kInvalid;
    double nearest = 0.5 * kMiddle * turn;
    for (const std::size_t i : {after, after + rim_.size() - 1}) {
      const auto& [angle, v] = rim_[i % rim_.size()];
      const double off = std::abs(turn_from(from, angle) - 0.5 * turn);
      if (off >= nearest) continue;
      nearest = off;
      best = v;
    }
    return best != kInvalid ? best : split_at(middle);
  }

  // The vertices strictly between two of the boundary, at least so many: edges are halved for it.
  // Empty if they cannot be.
  std::vector<VertexId> inside(VertexId from, VertexId to, std::size_t count) {
    while (true) {
      std::vector<VertexId> chain = {from};
      while (chain.back() != to) chain.push_back(next(chain.back()));
      if (chain.size() >= count + 2) return {chain.begin() + 1, chain.end() - 1};
      std::size_t longest = 0;
      for (std::size_t i = 1; i + 1 < chain.size(); ++i) {
        if (length(chain[i]) > length(chain[longest])) longest = i;
      }
      if (split(chain[longest], 0.5) == kInvalid) return {};
    }
  }

 private:
  VertexId next(VertexId v) const {
    const mesh::EditableTriangulation& mesh = map_.surface.mesh;
    return mesh.target(mesh.outgoing(v));
  }

  Vector2 place(VertexId v) const { return map_.uv.row(v).transpose(); }
  double angle_at(VertexId v) const { return angle_of(place(v) - centre_); }
  double length(VertexId v) const { return (place(next(v)) - place(v)).norm(); }
  std::size_t first_after(double angle) const {
    const auto after = std::upper_bound(rim_.begin(), rim_.end(),
                                        std::pair(angle, std::numeric_limits<VertexId>::max()));
    return at(after - rim_.begin());
  }

  // Where the ray in this direction meets the boundary.
  VertexId split_at(double angle) {
    const VertexId v = rim_[(first_after(angle) + rim_.size() - 1) % rim_.size()].second;
    const Vector2 ray(std::cos(angle), std::sin(angle));
    const Vector2 a = place(v) - centre_;
    const Vector2 b = place(next(v)) - centre_;
    const double left = cross(ray, b);
    const double right = cross(a, ray);
    return split(v, right / (right + left));
  }

  // Splits the boundary edge that leaves v.
  VertexId split(VertexId v, double share) {
    if (!(share > 0 && share < 1)) return kInvalid;
    mesh::RefinedSurface& surface = map_.surface;
    const HalfedgeId h = surface.mesh.outgoing(v);
    const VertexId w = surface.mesh.target(h);
    const mesh::Support where =
        mesh::rounded_between(surface.support[at(v)], surface.support[at(w)], share);
    if (!divides(surface, h, where)) return kInvalid;
    const Vector2 p = (1 - share) * place(v) + share * place(w);
    const VertexId fresh = surface.split_edge(h, where);
    map_.uv.conservativeResize(map_.uv.rows() + 1, 2);
    map_.uv.row(fresh) = p.transpose();
    const std::pair seen(angle_at(fresh), fresh);
    rim_.insert(std::upper_bound(rim_.begin(), rim_.end(), seen), seen);
    return fresh;
  }

  mesh::RefinedMap& map_;
  Vector2 centre_;
  std::vector<std::pair<double, VertexId>> rim_;  // direction and vertex, ascending
};

// Points to look from, along each axis, within this part of the disk. Odd shares, so that they do
// not fall on the symmetries of meshes.
constexpr int kCentres = 12;
constexpr double kCentral = 0.618;
constexpr double kOffGrid = 0.45;
// Directions, seen from the targets, in which the hub may lie.
constexpr int kDirections = 16;
// Boundary vertices around a pin, or around the hub's centre, at least: the triangles there have
// angles below a half-turn.
constexpr std::size_t kAround = 2;
// Points between a pin and a long boundary around it, so that few lines run across the surface, and
// how far out they lie: in the disk, and in the map.
constexpr std::size_t kRing = 4;
constexpr double kRingShare = 0.75;
constexpr double kRingReach = 0.4;
// The hub's distance from the targets, in units of their extent, and its least height.
constexpr double kDistance = 0.25;
constexpr double kLeastHubHeight = 0.5;
// How far an arm reaches beyond its pin, in units of its width at the hub.
constexpr double kTip = 0.5;

StarView view_from(const Vector2& centre, const std::vector<Vector2>& pins) {
  StarView view{centre, {}};
  for (const Vector2& p : pins) view.pins.emplace_back(angle_of(p - centre), view.pins.size());
  std::ranges::sort(view.pins);
  return view;
}

// Where the hub lies seen from the targets, and which pin has its first arm.
struct Side {
  Vector2 right = {1, 0};  // from the hub to the targets
  std::size_t first = 0;   // in the view's order
};

// The side on which arms climb or fall least.
Side best_side(const StarView& view, const Constraints& constraints) {
  const std::size_t n = view.pins.size();
  Side best;
  double least = std::numeric_limits<double>::infinity();
  std::vector<double> height(n);
  for (int d = 0; d < kDirections; ++d) {
    const double angle = kTurn * d / kDirections;
    const Vector2 right(std::cos(angle), std::sin(angle));
    const Vector2 up(-right.y(), right.x());
    for (std::size_t i = 0; i < n; ++i)
      height[i] = up.dot(constraints.pins[view.pins[i].second].uv);
    const auto [low, high] = std::minmax_element(height.begin(), height.end());
    const double step = (*high - *low) / static_cast<double>(n);
    for (std::size_t first = 0; first < n; ++first) {
      double cost = 0;
      for (std::size_t k = 0; k < n; ++k) {
        const double off = height[(first + k) % n] - (*low + (static_cast<double>(k) + 0.5) * step);
        cost += off * off;
      }
      if (cost < least) {
        least = cost;
        best = {right, first};
      }
    }
  }
  return best;
}

class Star {
 public:
  Star(mesh::RefinedMap& map, const Constraints& constraints, const StarView& view)
      : map_(map), constraints_(constraints), view_(view), shore_(map, view.centre) {}

  // False if doubles do not tell its points apart.
  bool build() {
    const std::size_t n = view_.pins.size();
    const Side side = best_side(view_, constraints_);
    right_ = side.right;
    up_ = {-right_.y(), right_.x()};
    Eigen::AlignedBox2d box;
    for (const PinnedVertex& p : constraints_.pins) box.extend(turned(p.uv));
    const double extent = box.sizes().maxCoeff();
    const double height = std::max(box.sizes().y(), kLeastHubHeight * extent);
    const double middle = 0.5 * (box.min().y() + box.max().y());
    const double hub = box.min().x() - kDistance * extent;
    step_ = height / static_cast<double>(n);

    const auto pin_angle = [&](std::size_t k) { return view_.pins[(side.first + k) % n].first; };
    std::vector<VertexId> notch(n + 1, kInvalid);
    for (std::size_t k = 1; k < n; ++k)
      notch[k] = shore_.between(pin_angle(k - 1), turn_from(pin_angle(k - 1), pin_angle(k)));
    // The gap between the last arm and the first one holds the hub's back.
    const double third = turn_from(pin_angle(n - 1), pin_angle(0)) / 3;
    notch[n] = shore_.between(pin_angle(n - 1), third);
    notch[0] = shore_.between(pin_angle(n - 1) + 2 * third, third);
    if (std::find(notch.begin(), notch.end(), kInvalid) != notch.end()) return false;

    const Index centre = add(kInvalid, view_.centre, {hub - 0.5 * height, middle});
    std::vector<Index> foot;
    for (std::size_t k = 0; k <= n; ++k) {
      const double up = static_cast<double>(k) - 0.5 * static_cast<double>(n);
      foot.push_back(add(notch[k], disk(notch[k]), {hub, middle + step_ * up}));
    }
    for (std::size_t k = 0; k < n; ++k) {
      const PinnedVertex& pin = constraints_.pins[view_.pins[(side.first + k) % n].second];
      if (!add_arm(centre, foot[k], foot[k + 1], pin)) return false;
    }
    return add_fan(centre, foot[n], foot[0], 0.5 * height);
  }

  PlaneMap plane() const { return {rows_of(faces_), rows_of(before_), rows_of(after_), vertex_}; }

 private:
  // Coordinates of the map in which the hub lies to the left of the targets.
  Vector2 turned(const Vector2& p) const { return {right_.dot(p), up_.dot(p)}; }
  Vector2 disk(VertexId v) const { return map_.uv.row(v).transpose(); }
  Vector2 before(Index i) const { return before_[at(i)]; }
  Vector2 after(Index i) const { return turned(after_[at(i)]); }
  VertexId vertex(Index i) const { return vertex_[at(i)]; }

  // A point of the star, its place in the map in turned coordinates.
  Index add(VertexId vertex, const Vector2& before, const Vector2& after) {
    vertex_.push_back(vertex);
    before_.push_back(before);
    after_.push_back(after.x() * right_ + after.y() * up_);
    return static_cast<Index>(vertex_.size()) - 1;
  }
  void add_face(Index a, Index b, Index c) { faces_.push_back({a, b, c}); }
  // Triangles of a point with each edge of a chain.
  void add_faces(Index tip, const std::vector<Index>& chain) {
    for (std::size_t i = 0; i + 1 < chain.size(); ++i) add_face(tip, chain[i], chain[i + 1]);
  }

  bool add_arm(Index centre, Index below, Index above, const PinnedVertex& pin) {
    const Vector2 here = disk(pin.vertex);
    const Index tip = add(pin.vertex, here, turned(pin.uv));
    after_.back() = pin.uv;  // bit for bit
    const Index root =
        add(kInvalid, 0.5 * (view_.centre + here), 0.5 * (after(below) + after(above)));
    add_face(centre, below, root);
    add_face(centre, root, above);
    if (map_.surface.mesh.is_boundary_vertex(pin.vertex)) {
      add_straight(root, below, tip);
      add_straight(root, tip, above);
      return true;
    }
    add_face(below, tip, root);
    add_face(root, tip, above);
    return add_fan(tip, below, above, kTip * step_);
  }

  // The boundary straight from one point of the star to another, in triangles with a third.
  void add_straight(Index root, Index from, Index to) {
    const std::vector<VertexId> inside = shore_.inside(vertex(from), vertex(to), 0);
    std::vector<Index> chain = {from};
    for (std::size_t i = 0; i < inside.size(); ++i) {
      const double t = static_cast<double>(i + 1) / static_cast<double>(inside.size() + 1);
      chain.push_back(add(inside[i], disk(inside[i]), (1 - t) * after(from) + t * after(to)));
    }
    chain.push_back(to);
    add_faces(root, chain);
  }

  // The boundary from one point of the star to another, in a circle around a third.
  bool add_fan(Index hub, Index from, Index to, double radius) {
    const std::vector<VertexId> inside = shore_.inside(vertex(from), vertex(to), kAround);
    if (inside.empty()) return false;
    const Vector2 around = after(hub);
    const double begin = angle_of(after(from) - around);
    const double turn = turn_from(begin, angle_of(after(to) - around));
    const auto place = [&](std::size_t i, double reach) -> Vector2 {
      const double angle =
          begin + turn * static_cast<double>(i + 1) / static_cast<double>(inside.size() + 1);
      return around + reach * Vector2(std::cos(angle), std::sin(angle));
    };
    std::vector<Index> rim;
    for (std::size_t i = 0; i < inside.size(); ++i)
      rim.push_back(add(inside[i], disk(inside[i]), place(i, radius)));
    add_face(hub, from, rim.front());
    add_face(hub, rim.back(), to);
    if (!add_ring(hub, rim, [&](std::size_t i) { return place(i, kRingReach * radius); }))
      add_faces(hub, rim);
    return true;
  }

  // Joins a long part of the boundary to points between it and the hub, `place` in the map. False,
  // and nothing added, where it is short or too near.
  template <typename Place>
  bool add_ring(Index hub, const std::vector<Index>& rim, const Place& place) {
    const std::size_t count = rim.size() - 1;
    if (count <= 2 * kRing) return false;
    const auto spoke = [&](std::size_t j) { return j * count / (kRing + 1); };
    const double reach = before(hub).norm();
    const std::size_t points = vertex_.size();
    const std::size_t faces = faces_.size();
    Index last = rim.front();
    std::size_t done = 0;
    for (std::size_t j = 1; j <= kRing; ++j) {
      const Vector2 end = before(rim[spoke(j)]);
      const Vector2 near = (reach + kRingShare * (end.norm() - reach)) * end.normalized();
      const Index here = add(kInvalid, near, place(spoke(j)));
      add_face(hub, last, here);
      if (j > 1) add_face(last, rim[done], here);
      const std::size_t until = j == kRing ? count : (spoke(j) + spoke(j + 1)) / 2;
      for (; done < until; ++done) add_face(here, rim[done], rim[done + 1]);
      last = here;
    }
    add_face(hub, last, rim.back());
    const bool fits = std::all_of(
        faces_.begin() + static_cast<std::ptrdiff_t>(faces), faces_.end(), [&](const auto& f) {
          return numeric::orientation(before(f[0]), before(f[1]), before(f[2])) > 0;
        });
    if (fits) return true;
    vertex_.resize(points);
    before_.resize(points);
    after_.resize(points);
    faces_.resize(faces);
    return false;
  }

  mesh::RefinedMap& map_;
  const Constraints& constraints_;
  const StarView& view_;
  Shore shore_;
  Vector2 right_ = {1, 0};
  Vector2 up_ = {0, 1};
  double step_ = 0;  // an arm's width at the hub
  std::vector<VertexId> vertex_;
  std::vector<Vector2> before_;
  std::vector<Vector2> after_;
  std::vector<std::array<Index, 3>> faces_;
};

// Views from a grid of points in the unit disk; those from where two pins lie in one direction are
// left out.
std::vector<StarView> star_views(const std::vector<Vector2>& pins) {
  std::vector<StarView> views;
  const auto place = [](int i) { return kCentral * (2 * (i + kOffGrid) / kCentres - 1); };
  for (int x = 0; x < kCentres; ++x) {
    for (int y = 0; y < kCentres; ++y) {
      StarView view = view_from({place(x), place(y)}, pins);
      const auto direction = [](const auto& pin) { return pin.first; };
      if (std::ranges::adjacent_find(view.pins, {}, direction) == view.pins.end())
        views.push_back(std::move(view));
    }
  }
  return views;
}

// The star of a view, positive on both sides by exact test, the pins at their targets bit for bit.
// Its vertices are those of the boundary, the pins and some others; it has some twenty triangles
// per pin and one per boundary edge. Precondition: disk.uv is flip-free with a convex boundary;
// free boundary, no lines. Where the boundary is short of vertices, edges are split, in
// `disk`. Nothing if doubles do not tell the star's points apart. Cost: O(#boundary) per split,
// and O(#pins^2) for the side on which the hub lies.
std::optional<PlaneMap> make_star(mesh::RefinedMap& disk, const Constraints& constraints,
                                  const StarView& view, const ExecutionContext& context) {
  Star star(disk, constraints, view);
  if (!star.build()) return std::nullopt;
  PlaneMap plane = star.plane();
  if (!plane.valid(context)) return std::nullopt;
  return plane;
}

constexpr std::size_t kFewestPins = 3;
// Newton steps of a star without the surface.
constexpr int kStepsOfStar = 30;
// So many stars are brought to rest, of these so many have the surface laid on them.
constexpr std::size_t kShort = 24;
constexpr std::size_t kLifted = 4;

struct Candidate {
  StarView view;
  PlaneMap plane;
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
  for (HalfedgeId h = 0; h < plane.faces.size(); ++h) {
    const VertexId a = plane.faces.data()[h], b = plane.faces.data()[next_corner(h)];
    length += (plane.before.row(a) - plane.before.row(b)).norm();
  }
  return length;
}

// Brings the star to rest with the pins where they are; its energy is its cost.
void relax_star(Candidate& candidate, const std::vector<VertexId>& pins,
                ExecutionContext& context) {
  PlaneMap& plane = candidate.plane;
  distortion::MinimizeOptions options;
  options.max_iterations = kStepsOfStar;
  options.lengthen = true;
  for (std::size_t v = 0; v < plane.vertex.size(); ++v) {
    if (std::binary_search(pins.begin(), pins.end(), plane.vertex[v]))
      options.fixed.push_back(static_cast<VertexId>(v));
  }
  std::optional<distortion::TargetsResult> rest =
      reach_targets(flat_surface(plane.faces, plane.before), plane.after, {}, options, context);
  candidate.cost = rest ? rest->energy : std::numeric_limits<double>::infinity();
  if (rest) plane.after = std::move(rest->uv);
}

// Stars that promise most.
std::vector<Candidate> best_stars(const mesh::RefinedMap& disk, const Constraints& constraints,
                                  ExecutionContext& context) {
  std::vector<Vector2> places;
  for (const PinnedVertex& p : constraints.pins) places.emplace_back(disk.uv.row(p.vertex));
  const std::vector<VertexId> pins = held_vertices(disk.surface, constraints);
  std::vector<Candidate> all;
  for (StarView& view : star_views(places)) {
    context.check();
    mesh::RefinedMap split = disk;
    std::optional<PlaneMap> plane = make_star(split, constraints, view, context);
    if (!plane) continue;
    const double length = length_of(*plane);
    all.push_back({std::move(view), std::move(*plane), length});
    if (all.size() > 2 * kShort) keep_best(all, kShort);
  }
  keep_best(all, kShort);
  parallel_for(context, all.size(), 1, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      ExecutionContext part(&context, 1);
      relax_star(all[i], pins, part);
    }
  });
  keep_best(all, kLifted);
  return all;
}

// The map by the star that adds fewest vertices.
std::optional<mesh::RefinedMap> best_map(const mesh::RefinedMap& disk,
                                         const std::vector<Candidate>& stars,
                                         const Constraints& constraints,
                                         ExecutionContext& context) {
  std::optional<mesh::RefinedMap> best;
  for (const Candidate& c : stars) {
    mesh::RefinedMap map = disk;
    // The star has come to rest since; what it splits is the same again.
    if (!make_star(map, constraints, c.view, context) || !follow_by(map, c.plane, context))
      continue;
    map = mesh::compacted_map(map);  // with the boundary as it is now
    if (!best || map.surface.mesh.vertex_count() < best->surface.mesh.vertex_count())
      best = std::move(map);
  }
  return best;
}

}  // namespace

bool move_with_arms(mesh::RefinedMap& map, const Constraints& constraints,
                    ExecutionContext& context) {
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
  std::optional<mesh::RefinedMap> best = best_map(disk, stars, constraints, context);
  if (!best) return false;
  map = std::move(*best);
  return true;
}

}  // namespace flipfree::matchmaker
