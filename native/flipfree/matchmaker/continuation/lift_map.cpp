#include "flipfree/matchmaker/continuation/lift_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <deque>
#include <limits>
#include <numbers>
#include <utility>

#include "flipfree/base/plane.h"
#include "flipfree/matchmaker/continuation/creases.h"
#include "flipfree/matchmaker/overlay/side_of.h"
#include "flipfree/numeric/predicates.h"

namespace flipfree::matchmaker {
namespace {

using Mesh = mesh::EditableTriangulation;

// A triangle may have so much less area than the coarse faces at its corners give it before it is
// split.
constexpr double kSquashed = 0.1;

class Lifter {
 public:
  Lifter(mesh::RefinedMap& fine, const CoarseDisk& disk, const Creases& creases)
      : surface_(fine.surface), mesh_(surface_.mesh), creases_(creases) {
    for (Eigen::Index i = 0; i < fine.uv.rows(); ++i) {
      const auto v = static_cast<std::size_t>(i);
      const Vector2 p = fine.uv.row(i).transpose();
      add(p, disk.coarse[v] != kInvalid ? Place{Place::Kind::kVertex, disk.coarse[v]}
                                        : creases_.locate(disk.face[v], p));
    }
  }

  bool run(Index most_added, ExecutionContext& context) {
    const Index first = mesh_.vertex_count();
    for (FaceId f = 0; f < mesh_.face_slots(); ++f) {
      if (mesh_.alive(f)) look(f);
    }
    do {
      for (Index steps = 0; !open_.empty(); ++steps) {
        if (steps % 256 == 0) context.check();
        const FaceId f = open_.front();
        open_.pop_front();
        if (!is_bad(f)) continue;
        if (mesh_.vertex_count() - first >= most_added || !split(f)) return false;
      }
    } while (open_wound());
    return wound().empty();
  }

  void hand_over(Points2& uv) const {
    uv = Points2(static_cast<Eigen::Index>(after_.size()), 2);  // a resize that fails frees twice
    for (std::size_t v = 0; v < after_.size(); ++v)
      uv.row(static_cast<Eigen::Index>(v)) = after_[v].transpose();
  }

 private:
  using Place = Creases::Place;

  const Vector2& before(VertexId v) const { return before_[static_cast<std::size_t>(v)]; }
  const Vector2& after(VertexId v) const { return after_[static_cast<std::size_t>(v)]; }
  const Place& place(VertexId v) const { return place_[static_cast<std::size_t>(v)]; }

  void add(const Vector2& p, const Place& place) {
    before_.push_back(p);
    place_.push_back(place);
    wound_.push_back(0);
    after_.push_back(creases_.moved(place, p));
  }

  void look(FaceId f) {
    if (is_bad(f)) open_.push_back(f);
  }

  bool is_flipped(FaceId f) const {
    const Mesh::Triangle c = mesh_.corners(f);
    return numeric::orientation(after(c[0]), after(c[1]), after(c[2])) <= 0;
  }

  bool is_bad(FaceId f) const {
    if (is_flipped(f)) return true;
    const Mesh::Triangle c = mesh_.corners(f);
    for (const VertexId v : c) {
      if (wound_[static_cast<std::size_t>(v)] != 0) return true;
    }
    double stretch = std::numeric_limits<double>::infinity();
    for (const VertexId v : c) stretch = std::min(stretch, creases_.least_stretch(place(v)));
    return twice_area(after(c[0]), after(c[1]), after(c[2])) <
           kSquashed * stretch * twice_area(before(c[0]), before(c[1]), before(c[2]));
  }

  // Coarse faces that meet a fine one, found from those at its corners.
  void gather(FaceId f) {
    near_.clear();
    const Mesh::Triangle c = mesh_.corners(f);
    const std::array<Vector2, 3> triangle = {before(c[0]), before(c[1]), before(c[2])};
    const auto offer = [&](FaceId g) {
      if (std::find(near_.begin(), near_.end(), g) == near_.end() && creases_.meets(g, triangle))
        near_.push_back(g);
    };
    for (const VertexId v : c) creases_.for_each_face(place(v), offer);
    // NOLINTNEXTLINE(modernize-loop-convert): offer() makes near_ longer
    for (std::size_t i = 0; i < near_.size(); ++i) {
      for (HalfedgeId h = 3 * near_[i]; h < 3 * near_[i] + 3; ++h) {
        if (!creases_.mesh().is_boundary(h)) offer(creases_.mesh().opposite(h) / 3);
      }
    }
  }

  struct Cut {
    HalfedgeId edge = kInvalid;    // of the fine mesh
    HalfedgeId crease = kInvalid;  // Mesh::edge of the coarse one
    double t = 0.5;                // where on the edge

    bool before(const Cut& other) const {
      return crease != kInvalid && (other.crease == kInvalid || crease < other.crease);
    }
  };

  bool ends_on(VertexId v, HalfedgeId crease) const {
    const Place& p = place(v);
    return (p.kind == Place::Kind::kEdge && p.id == crease) ||
           (p.kind == Place::Kind::kVertex &&
            (p.id == creases_.mesh().source(crease) || p.id == creases_.mesh().target(crease)));
  }

  // The first crease that crosses an edge of f. `near_` is that of f.
  Cut first_cut(FaceId f) const {
    Cut cut;
    for (const FaceId g : near_) {
      for (HalfedgeId side = 3 * g; side < 3 * g + 3; ++side) {
        const HalfedgeId crease = creases_.mesh().edge(side);
        if (cut.crease != kInvalid && cut.crease <= crease) continue;
        const Vector2& p = creases_.before(creases_.mesh().source(crease));
        const Vector2& q = creases_.before(creases_.mesh().target(crease));
        for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
          const VertexId a = mesh_.source(h);
          const VertexId b = mesh_.target(h);
          if (ends_on(a, crease) || ends_on(b, crease)) continue;
          if (side_of(p, q, before(a)) * side_of(p, q, before(b)) >= 0) continue;
          if (side_of(before(a), before(b), p) * side_of(before(a), before(b), q) >= 0) continue;
          const double from = twice_area(p, q, before(a));
          cut = {h, crease, from / (from - twice_area(p, q, before(b)))};
          break;
        }
      }
    }
    return cut;
  }

  // Splits f at a coarse vertex, or where the first crease crosses an edge. A crease is cut in both
  // faces of an edge, coarse vertices before: then a new edge meets none of the creases that are
  // done, and their crossings die out one after another. True also if f is only squashed and
  // cannot be helped.
  bool split(FaceId f) {
    gather(f);
    if (split_at_vertex(f)) return true;
    Cut cut = first_cut(f);
    while (cut.edge != kInvalid && !mesh_.is_boundary(cut.edge)) {
      const FaceId other = mesh_.opposite(cut.edge) / 3;
      gather(other);
      if (split_at_vertex(other)) {
        open_.push_back(f);
        return true;
      }
      const Cut beyond = first_cut(other);
      if (!beyond.before(cut)) break;
      cut = beyond;
    }
    if (cut.edge != kInvalid && split_at_crease(cut)) {
      open_.push_back(f);
      return true;
    }
    return !is_flipped(f);
  }

  bool split_at_crease(const Cut& cut) {
    const Vector2& a = before(mesh_.source(cut.edge));
    const Vector2& b = before(mesh_.target(cut.edge));
    return split_edge(cut.edge, cut.t, a + cut.t * (b - a), {Place::Kind::kEdge, cut.crease});
  }

  // A coarse vertex inside f, or on one of its edges. `near_` is that of f.
  bool split_at_vertex(FaceId f) {
    const Mesh::Triangle c = mesh_.corners(f);
    for (const FaceId g : near_) {
      for (const VertexId v : creases_.mesh().corners(g)) {
        const Vector2& p = creases_.before(v);
        std::array<int, 3> side{};
        bool corner = false;
        for (std::size_t k = 0; k < 3; ++k) {
          side[k] = side_of(before(c[k]), before(c[(k + 1) % 3]), p);
          corner = corner || (place(c[k]).kind == Place::Kind::kVertex && place(c[k]).id == v) ||
                   before(c[k]) == p;
        }
        if (corner || *std::min_element(side.begin(), side.end()) < 0) continue;
        for (Index k = 0; k < 3; ++k) {
          if (side[static_cast<std::size_t>(k)] != 0) continue;
          const Vector2& a = before(mesh_.source(3 * f + k));
          const Vector2& b = before(mesh_.target(3 * f + k));
          return split_edge(3 * f + k, (p - a).dot(b - a) / (b - a).squaredNorm(), p,
                            {Place::Kind::kVertex, v});
        }
        if (split_face(f, p, {Place::Kind::kVertex, v})) return true;
      }
    }
    return false;
  }

  const mesh::Support& support(VertexId v) const {
    return surface_.support[static_cast<std::size_t>(v)];
  }

  bool split_edge(HalfedgeId h, double t, const Vector2& p, const Place& at) {
    const mesh::Support where =
        mesh::rounded_between(support(mesh_.source(h)), support(mesh_.target(h)), t);
    const HalfedgeId o = mesh_.opposite(h);
    if (!divides(h, where, p) || (o != kInvalid && !divides(o, where, p))) return false;
    finish(surface_.split_edge(h, where), p, at);
    return true;
  }

  // Are the two parts of h's face positive, in the map as it was and on the surface?
  bool divides(HalfedgeId h, const mesh::Support& where, const Vector2& p) const {
    const VertexId a = mesh_.source(h);
    const VertexId b = mesh_.target(h);
    const VertexId c = mesh_.apex(h);
    const FaceId parent = mesh_.parent(h / 3);
    return numeric::orientation(before(a), p, before(c)) > 0 &&
           numeric::orientation(p, before(b), before(c)) > 0 &&
           surface_.orientation_in_parent(parent, support(a), where, support(c)) > 0 &&
           surface_.orientation_in_parent(parent, where, support(b), support(c)) > 0;
  }

  bool split_face(FaceId f, const Vector2& p, const Place& at) {
    const Mesh::Triangle c = mesh_.corners(f);
    const double whole = twice_area(before(c[0]), before(c[1]), before(c[2]));
    const double first = twice_area(p, before(c[1]), before(c[2])) / whole;
    const double second = twice_area(before(c[0]), p, before(c[2])) / whole;
    const mesh::Support on_edge =
        mesh::rounded_between(support(c[0]), support(c[1]), second / (first + second));
    const mesh::Support where = mesh::rounded_between(support(c[2]), on_edge, first + second);
    for (std::size_t k = 0; k < 3; ++k) {
      if (surface_.orientation_in_parent(mesh_.parent(f), support(c[k]), support(c[(k + 1) % 3]),
                                         where) <= 0)
        return false;
    }
    finish(surface_.split_face(f, where), p, at);
    return true;
  }

  void finish(VertexId v, const Vector2& p, const Place& at) {
    add(p, at);
    for (const FaceId g : mesh_.star(v)) look(g);
  }

  // Positive triangles can wind twice around an inner vertex; a bound in the middle of once and
  // twice decides beyond rounding.
  std::vector<VertexId> wound() const {
    std::vector<double> angle(after_.size(), 0.0);
    for (FaceId f = 0; f < mesh_.face_slots(); ++f) {
      if (!mesh_.alive(f)) continue;
      const Mesh::Triangle c = mesh_.corners(f);
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector2 a = after(c[(k + 1) % 3]) - after(c[k]);
        const Vector2 b = after(c[(k + 2) % 3]) - after(c[k]);
        angle[static_cast<std::size_t>(c[k])] += turn(a, b);
      }
    }
    std::vector<VertexId> result;
    for (VertexId v = 0; v < mesh_.vertex_count(); ++v) {
      if (angle[static_cast<std::size_t>(v)] > 3 * std::numbers::pi && !mesh_.is_boundary_vertex(v))
        result.push_back(v);
    }
    return result;
  }

  // Creases around a vertex that winds twice are cut without regard to whether triangles fold: with
  // all of them in place it winds as the composition does. False if there is no such vertex, or
  // none for the first time.
  bool open_wound() {
    bool fresh = false;
    for (const VertexId v : wound()) {
      if (std::exchange(wound_[static_cast<std::size_t>(v)], char{1}) != 0) continue;
      fresh = true;
      for (const FaceId f : mesh_.star(v)) open_.push_back(f);
    }
    return fresh;
  }

  mesh::RefinedSurface& surface_;
  Mesh& mesh_;
  const Creases& creases_;
  std::vector<Vector2> before_;
  std::vector<Vector2> after_;
  std::vector<Place> place_;
  std::vector<char> wound_;
  std::deque<FaceId> open_;
  std::vector<FaceId> near_;
};

}  // namespace

bool lift_map(mesh::RefinedMap& fine, const CoarseDisk& disk, const mesh::RefinedMap& coarse,
              Index most_added, ExecutionContext& context) {
  const Creases creases(coarse, disk, fine.uv);
  if (!creases.valid()) return false;
  mesh::RefinedMap trial = fine;
  Lifter lifter(trial, disk, creases);
  if (!lifter.run(most_added, context)) return false;
  lifter.hand_over(trial.uv);
  fine = std::move(trial);
  return true;
}

}  // namespace flipfree::matchmaker
