#include "flipfree/matchmaker/walk/push_point.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <deque>
#include <tuple>

#include "flipfree/base/plane.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

using Mesh = mesh::EditableTriangulation;

// A triangle may lose this much more of its area than phi takes from the pieces it consists of
// before it is split.
constexpr double kSquashed = 0.2;
// A crease that passes a vertex nearer than this, in units of the tent's height, passes through it.
constexpr double kOnCrease = 1e-9;
// Corners below this height may be left out of the corridor.
constexpr double kLow = 1e-4;

// lambda is the least of one affine function per side, each 1 at the apex and 0 on the side, or 0
// where one of them is negative. What a vertex knows of it are the values of these functions, its
// levels; creases are decided from levels alone, those of new vertices are interpolated. So
// rounding moves creases a little, but consistently.
class Tent {
 public:
  Tent(const Polygon& corridor, const Vector2& apex) {
    for (std::size_t i = 0; i < corridor.size(); ++i) {
      const Vector2& a = corridor[i];
      const Vector2 along = corridor[(i + 1) % corridor.size()] - a;
      const Vector2 normal(-along.y(), along.x());
      sides_.push_back({normal / normal.dot(apex - a), a});
    }
  }

  std::size_t sides() const { return sides_.size(); }

  void levels(const Vector2& p, double* level) const {
    for (std::size_t i = 0; i < sides_.size(); ++i) {
      level[i] = sides_[i].slope.dot(p - sides_[i].point);
    }
    snap(level);
  }

  double height(const double* level) const {
    return std::max(0.0, *std::min_element(level, level + sides_.size()));
  }

  // Smallest determinant of phi's pieces.
  double least_determinant(const Vector2& shift) const {
    double least = 1.0;
    for (const Side& s : sides_) least = std::min(least, 1.0 + s.slope.dot(shift));
    return least;
  }

  // A crease that crosses an edge: where the levels `first` and `second` agree, or, if these are
  // the same, where that level is 0.
  struct Crossing {
    std::size_t first = kNone;
    std::size_t second = kNone;
    double t = 0.5;

    // Sides come first, then spokes, then none.
    bool before(const Crossing& other) const {
      return std::tuple(first == kNone, first != second, first, second) <
             std::tuple(other.first == kNone, other.first != other.second, other.first,
                        other.second);
    }
  };
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  static constexpr std::size_t kMostSides = 64;

  // The first crease, in the order of before(), that crosses an edge with these levels at its ends.
  Crossing first_crossing(const double* a, const double* b) const {
    const std::size_t n = sides_.size();
    for (std::size_t i = 0; i < n; ++i) {
      if (crosses(a[i], b[i]) && active(a, b, i, a[i] / (a[i] - b[i]))) {
        return {i, i, a[i] / (a[i] - b[i])};
      }
    }
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j) {
        const double fa = a[i] - a[j];
        const double fb = b[i] - b[j];
        if (crosses(fa, fb) && active(a, b, i, fa / (fa - fb))) return {i, j, fa / (fa - fb)};
      }
    }
    return {};
  }

  void interpolate(const double* a, const double* b, const Crossing& at, double* level) const {
    for (std::size_t i = 0; i < sides_.size(); ++i) level[i] = a[i] + at.t * (b[i] - a[i]);
    level[at.second] = at.first == at.second ? 0.0 : level[at.first];
    snap(level);
  }

  void snap(double* level) const {
    for (std::size_t i = 0; i < sides_.size(); ++i) {
      if (std::abs(level[i]) < kOnCrease) level[i] = 0.0;
      for (std::size_t j = 0; j < i; ++j) {
        if (std::abs(level[i] - level[j]) < kOnCrease) level[i] = level[j];
      }
    }
  }

 private:
  static bool crosses(double a, double b) { return (a > 0 && b < 0) || (a < 0 && b > 0); }

  // Is level i the least one at t, and not negative?
  bool active(const double* a, const double* b, std::size_t i, double t) const {
    const double height = a[i] + t * (b[i] - a[i]);
    if (height < -kOnCrease) return false;
    for (std::size_t k = 0; k < sides_.size(); ++k) {
      if (a[k] + t * (b[k] - a[k]) < height - kOnCrease) return false;
    }
    return true;
  }

  struct Side {
    Vector2 slope;
    Vector2 point;
  };
  std::vector<Side> sides_;
};

class Pusher {
 public:
  Pusher(mesh::RefinedMap& map, VertexId vertex, const Vector2& goal, const Polygon& corridor)
      : surface_(map.surface),
        mesh_(surface_.mesh),
        vertex_(vertex),
        goal_(goal),
        corners_(corridor),
        shift_(goal - map.uv.row(vertex).transpose()),
        tent_(corridor, map.uv.row(vertex).transpose()) {
    least_share_ = kSquashed * tent_.least_determinant(shift_);
    for (Eigen::Index v = 0; v < map.uv.rows(); ++v) {
      const Vector2 p = map.uv.row(v).transpose();
      level_.resize(level_.size() + tent_.sides());
      tent_.levels(p, &level_[level_.size() - tent_.sides()]);
      before_.push_back(p);
      after_.push_back(pushed(static_cast<VertexId>(v)));
    }
    after_[static_cast<std::size_t>(vertex)] = goal;
    corners_.emplace_back(map.uv.row(vertex).transpose());
  }

  bool moves(VertexId v) const { return at(before_, v) != at(after_, v); }

  bool run(Index most_added, ExecutionContext& context) {
    const Index first = mesh_.vertex_count();
    for (FaceId f = 0; f < mesh_.face_slots(); ++f) {
      if (mesh_.alive(f)) look(f);
    }
    for (Index steps = 0; !open_.empty(); ++steps) {
      if (steps % 256 == 0) context.check();
      const FaceId f = open_.front();
      open_.pop_front();
      if (!is_bad(f)) continue;
      if (mesh_.vertex_count() - first >= most_added || !split(f)) return false;
    }
    return true;
  }

  void hand_over(Points2& uv) const {
    uv.resize(static_cast<Eigen::Index>(after_.size()), 2);
    for (std::size_t v = 0; v < after_.size(); ++v) {
      uv.row(static_cast<Eigen::Index>(v)) = after_[v].transpose();
    }
  }

 private:
  static const Vector2& at(const std::vector<Vector2>& points, VertexId v) {
    return points[static_cast<std::size_t>(v)];
  }
  const double* levels(VertexId v) const {
    return &level_[static_cast<std::size_t>(v) * tent_.sides()];
  }
  Vector2 pushed(VertexId v) const {
    const double lambda = tent_.height(levels(v));
    return lambda > 0.0 ? Vector2(at(before_, v) + lambda * shift_) : at(before_, v);
  }

  void look(FaceId f) {
    const Mesh::Triangle c = mesh_.corners(f);
    if ((moves(c[0]) || moves(c[1]) || moves(c[2])) && is_bad(f)) open_.push_back(f);
  }

  bool is_bad(FaceId f) const {
    const Mesh::Triangle c = mesh_.corners(f);
    const Vector2& a = at(after_, c[0]);
    const Vector2& b = at(after_, c[1]);
    const Vector2& d = at(after_, c[2]);
    if (numeric::orientation(a, b, d) <= 0) return true;
    return twice_area(a, b, d) <
           least_share_ * twice_area(at(before_, c[0]), at(before_, c[1]), at(before_, c[2]));
  }

  struct Cut {
    HalfedgeId edge = kInvalid;
    Tent::Crossing crossing;
  };
  Cut first_cut(FaceId f) const {
    Cut cut;
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      const Tent::Crossing crossing =
          tent_.first_crossing(levels(mesh_.source(h)), levels(mesh_.target(h)));
      if (crossing.before(cut.crossing)) cut = {h, crossing};
    }
    return cut;
  }

  // Splits f at a corner of the corridor inside, or an edge of f where a crease crosses it. Creases
  // are cut in their order, in both faces of an edge, and corners before them: then a new edge
  // meets none of the creases that are done, and their crossings die out one after another. True
  // also if f is only squashed and cannot be helped.
  bool split(FaceId f) {
    if (split_at_corner(f)) return true;
    Cut cut = first_cut(f);
    while (cut.edge != kInvalid && !mesh_.is_boundary(cut.edge)) {
      const FaceId other = mesh_.opposite(cut.edge) / 3;
      if (split_at_corner(other)) {
        open_.push_back(f);
        return true;
      }
      const Cut beyond = first_cut(other);
      if (!beyond.crossing.before(cut.crossing)) break;
      cut = beyond;
    }
    if (cut.edge != kInvalid && split_edge(cut.edge, cut.crossing)) {
      open_.push_back(f);
      return true;
    }
    const Mesh::Triangle c = mesh_.corners(f);
    return numeric::orientation(at(after_, c[0]), at(after_, c[1]), at(after_, c[2])) > 0 ||
           leave(f);
  }

  // A corner that the corridor's side hardly includes stays where it was, as if the side passed
  // through it.
  bool leave(FaceId f) {
    VertexId lowest = kInvalid;
    double height = kLow;
    for (const VertexId v : mesh_.corners(f)) {
      if (v == vertex_ || !moves(v)) continue;
      const double now = tent_.height(levels(v));
      if (now < height) {
        height = now;
        lowest = v;
      }
    }
    if (lowest == kInvalid) return false;
    after_[static_cast<std::size_t>(lowest)] = at(before_, lowest);
    for (const FaceId g : mesh_.star(lowest)) {
      if (is_bad(g)) open_.push_back(g);
    }
    return true;
  }

  bool split_edge(HalfedgeId h, const Tent::Crossing& crossing) {
    const double t = crossing.t;
    const VertexId a = mesh_.source(h);
    const VertexId b = mesh_.target(h);
    const mesh::Support where =
        mesh::rounded_between(surface_.support[static_cast<std::size_t>(a)],
                              surface_.support[static_cast<std::size_t>(b)], t);
    const Vector2 p = at(before_, a) + t * (at(before_, b) - at(before_, a));
    const HalfedgeId o = mesh_.opposite(h);
    if (!divides(h, where, p) || (o != kInvalid && !divides(o, where, p))) return false;
    const VertexId s = surface_.split_edge(h, where);
    level_.resize(level_.size() + tent_.sides());
    tent_.interpolate(levels(a), levels(b), crossing, &level_[level_.size() - tent_.sides()]);
    before_.push_back(p);
    after_.push_back(pushed(s));
    for (const FaceId g : mesh_.star(s)) look(g);
    return true;
  }

  // Are the two parts of h's face positive, in the map as it was and on the surface?
  bool divides(HalfedgeId h, const mesh::Support& where, const Vector2& p) const {
    const VertexId a = mesh_.source(h);
    const VertexId b = mesh_.target(h);
    const VertexId c = mesh_.apex(h);
    const FaceId parent = mesh_.parent(h / 3);
    const auto support = [&](VertexId v) { return surface_.support[static_cast<std::size_t>(v)]; };
    return numeric::orientation(at(before_, a), p, at(before_, c)) > 0 &&
           numeric::orientation(p, at(before_, b), at(before_, c)) > 0 &&
           surface_.orientation_in_parent(parent, support(a), where, support(c)) > 0 &&
           surface_.orientation_in_parent(parent, where, support(b), support(c)) > 0;
  }

  bool split_at_corner(FaceId f) {
    const Mesh::Triangle c = mesh_.corners(f);
    const std::array<Vector2, 3> p = {at(before_, c[0]), at(before_, c[1]), at(before_, c[2])};
    for (const Vector2& corner : corners_) {
      bool inside = true;
      for (std::size_t k = 0; k < 3; ++k) {
        inside = inside && numeric::orientation(p[k], p[(k + 1) % 3], corner) > 0;
      }
      if (!inside) continue;
      const double whole = twice_area(p[0], p[1], p[2]);
      const double first = twice_area(corner, p[1], p[2]) / whole;
      const double second = twice_area(p[0], corner, p[2]) / whole;
      const auto support = [&](VertexId v) {
        return surface_.support[static_cast<std::size_t>(v)];
      };
      const mesh::Support on_edge =
          mesh::rounded_between(support(c[0]), support(c[1]), second / (first + second));
      const mesh::Support where = mesh::rounded_between(support(c[2]), on_edge, first + second);
      const FaceId parent = mesh_.parent(f);
      for (std::size_t k = 0; k < 3; ++k) {
        if (surface_.orientation_in_parent(parent, support(c[k]), support(c[(k + 1) % 3]), where) <=
            0)
          return false;
      }
      const VertexId s = surface_.split_face(f, where);
      level_.resize(level_.size() + tent_.sides());
      tent_.levels(corner, &level_[level_.size() - tent_.sides()]);
      before_.push_back(corner);
      after_.push_back(pushed(s));
      for (const FaceId g : mesh_.star(s)) look(g);
      return true;
    }
    return false;
  }

  mesh::RefinedSurface& surface_;
  Mesh& mesh_;
  VertexId vertex_;
  Vector2 goal_;
  // Where creases meet: the corridor's corners and the apex, which is a vertex on one sheet only if
  // the map overlaps itself.
  std::vector<Vector2> corners_;
  Vector2 shift_;
  Tent tent_;
  double least_share_ = 0;
  std::vector<double> level_;  // per vertex, one per side
  std::vector<Vector2> before_;
  std::vector<Vector2> after_;
  std::deque<FaceId> open_;
};

bool is_convex_around(const Polygon& corridor, const Vector2& p) {
  for (std::size_t i = 0; i < corridor.size(); ++i) {
    if (numeric::orientation(corridor[i], corridor[(i + 1) % corridor.size()], p) <= 0)
      return false;
  }
  return true;
}

}  // namespace

bool push_point(mesh::RefinedMap& map, VertexId vertex, const Vector2& goal,
                const Polygon& corridor, const std::vector<char>& held, Index most_added,
                ExecutionContext& context) {
  if (corridor.size() < 3 || corridor.size() > Tent::kMostSides) return false;
  if (!is_convex_around(corridor, map.uv.row(vertex).transpose()) ||
      !is_convex_around(corridor, goal)) {
    return false;
  }
  mesh::RefinedMap trial = map;
  Pusher pusher(trial, vertex, goal, corridor);
  for (VertexId v = 0; v < static_cast<VertexId>(held.size()); ++v) {
    if (held[static_cast<std::size_t>(v)] != 0 && v != vertex && pusher.moves(v)) return false;
  }
  if (!pusher.run(most_added, context)) return false;
  pusher.hand_over(trial.uv);
  map = std::move(trial);
  return true;
}

}  // namespace flipfree::matchmaker
