#include "flipfree/embedding/progressive/simplify.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/embedding/progressive/room.h"

namespace flipfree::embedding {
namespace {

using Size = std::size_t;

constexpr Size kReportEvery = 64;
constexpr double kShare = 0.2;  // of the progress of the embedding
// Of a search for places in kernels: corners of a kernel, and ring vertices times corners per face.
// A start from nothing smooths every vertex some ten times, in about the time that 5000 of them
// take.
constexpr Size kFewCorners = 64;
constexpr Size kMostSearch = 5000;
constexpr Size kCheckSearch = 1'000'000;

double& share(PlanarMap& map, HalfedgeId h) { return map.share[static_cast<Size>(h / 3)]; }

// What the star of m looks like once it is merged into its neighbour.
struct CollapsedStar {
  int invalid = std::numeric_limits<int>::max();
  double energy = HUGE_VAL;
  HalfedgeId halfedge = kInvalid;
  bool better_than(const CollapsedStar& other) const {
    return invalid != other.invalid ? invalid < other.invalid : energy < other.energy;
  }
};

CollapsedStar collapsed_star(const PlanarMap& map, HalfedgeId h) {
  CollapsedStar outcome{0, 0.0, h};
  const VertexId v0 = map.mesh.target(h);
  const Vector2 p0 = map.at(v0);
  // Faces of m from a counter-clockwise to b, without the two beside h.
  const FaceId face_b = map.mesh.opposite(h) / 3;
  for (HalfedgeId g = map.mesh.rotate(h); g / 3 != face_b; g = map.mesh.rotate(g)) {
    const VertexId q = map.mesh.target(g);
    const VertexId r = map.mesh.apex(g);
    const double energy =
        triangle_energy(p0, map.at(q), map.at(r), map.unit * map.share[static_cast<Size>(g / 3)]);
    if (!(energy < map.invalid_energy) || !map.positive(v0, q, r)) {
      ++outcome.invalid;
    } else {
      outcome.energy = std::max(outcome.energy, energy);
    }
  }
  return outcome;
}

// Puts a vertex that cannot be collapsed into the kernel of its star.
void place_alone(PlanarMap& map, VertexId v, Star& star) {
  if (centre_in_kernel(map, v, star)) return;
  const Room room = find_room(map, star);
  if (room.points > 0) {
    map.move(v, room.middle);
    return;
  }
  const std::string place = narrowest_extent(star);
  const std::string numbers = map.float32 ? "32-bit" : "64-bit";
  if (room.exact) {
    // Of the simplified mesh: the proof for the given one is the ladder's.
    throw_not_converged(ErrorCode::kNoRoomInPolygon,
                        "The polygon has no room for vertex " + vertex_id(v) + ": no point with " +
                            numbers + " coordinates lies " + place +
                            ". Make the polygon wider there, or move it to the origin.",
                        ElementKind::kVertex, {v});
  }
  throw_not_converged(ErrorCode::kIterationLimit,
                      "No point with " + numbers + " coordinates was found for vertex " +
                          vertex_id(v) + " " + place +
                          ". Make the polygon wider there, or move it to the origin.",
                      ElementKind::kVertex, {v});
}

// kAccepted: positive, of high energy, and nothing can be done about it.
enum : char { kFree = 0, kQueued = 1, kStuck = 2, kAccepted = 3 };

class Simplifier {
 public:
  Simplifier(PlanarMap& map, bool move_first, Size most_collapses, CollapseRecord& record,
             ExecutionContext& context)
      : map_(map),
        move_first_(move_first),
        most_collapses_(most_collapses),
        record_(record),
        context_(context) {}

  void run() {
    const Index faces = map_.mesh.face_count();
    state_.assign(static_cast<Size>(faces), kFree);
    for (FaceId f = 0; f < faces; ++f) {
      if (map_.mesh.is_alive(f) && invalid(f)) enqueue(f);
    }
    while (true) {
      drain();
      // Faces that are still invalid did not collapse: let their surroundings try.
      std::erase_if(stuck_, [&](FaceId f) {
        const bool done = !map_.mesh.is_alive(f) || state_[static_cast<Size>(f)] != kStuck;
        return done;
      });
      if (!any_invalid_left()) return;
      grow();
    }
  }

 private:
  bool invalid(FaceId f) const {
    return !is_valid_face(map_, f) &&
           !(state_[static_cast<Size>(f)] == kAccepted && map_.positive(f));
  }

  void enqueue(FaceId f) {
    if (state_[static_cast<Size>(f)] == kQueued) return;
    state_[static_cast<Size>(f)] = kQueued;
    queue_.push_back(f);
  }

  void drain() {
    while (head_ < queue_.size()) {
      const FaceId f = queue_[head_++];
      if (!map_.mesh.is_alive(f)) continue;
      state_[static_cast<Size>(f)] = kFree;
      const bool is_invalid = invalid(f);
      if (!is_invalid && !grown_) continue;
      if (++steps_ % kReportEvery == 0) report();
      if (is_invalid && move_first_ && move(f)) continue;
      if (!collapse_face(f)) {
        state_[static_cast<Size>(f)] = kStuck;
        stuck_.push_back(f);
      } else if (grown_) {
        // Progress: back to the invalid faces alone.
        grown_ = false;
        requeue_stuck();
      }
    }
    queue_.clear();
    head_ = 0;
  }

  // Nobody knows how far it is: every face once is half of the way.
  void report() {
    const auto steps = static_cast<double>(steps_);
    context_.report("repairing", kShare * steps / (steps + static_cast<double>(state_.size())));
  }

  void requeue_stuck() {
    std::vector<FaceId> stuck;
    stuck.swap(stuck_);
    for (const FaceId f : stuck) {
      if (map_.mesh.is_alive(f) && state_[static_cast<Size>(f)] == kStuck) enqueue(f);
    }
  }

  bool any_invalid_left() {
    return std::any_of(stuck_.begin(), stuck_.end(), [&](FaceId f) { return invalid(f); });
  }

  // Adds the neighbours of the stuck faces; they are collapsed even though they are valid.
  void grow() {
    grown_ = true;
    bool any = false;
    const std::vector<FaceId> stuck = stuck_;
    for (const FaceId f : stuck) {
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
        const HalfedgeId o = map_.mesh.opposite(h);
        if (o == kInvalid || state_[static_cast<Size>(o / 3)] != kFree) continue;
        enqueue(o / 3);
        any = true;
      }
    }
    if (any) return;
    // The set cannot grow: no inner edge of the connected region satisfies the link condition, so
    // by Theorem 3.8 each inner vertex left in it is alone between boundary vertices.
    for (const FaceId f : stuck) {
      if (!invalid(f)) continue;
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
        if (!map_.mesh.is_boundary(map_.mesh.source(h)))
          place_alone(map_, map_.mesh.source(h), star_);
      }
      if (!map_.positive(f)) throw_unplaceable(f);
      if (!is_valid_face(map_, f)) state_[static_cast<Size>(f)] = kAccepted;
    }
    grown_ = false;
    requeue_stuck();
  }

  [[noreturn]] void throw_unplaceable(FaceId f) {
    const VertexId a = map_.mesh.source(3 * f);
    const VertexId b = map_.mesh.source(3 * f + 1);
    const VertexId c = map_.mesh.source(3 * f + 2);
    throw_not_converged(
        ErrorCode::kNoRoomInPolygon,
        "The face with vertices " + vertex_id(a) + ", " + vertex_id(b) + ", " + vertex_id(c) +
            " cannot be positive in the required precision. Use a larger or less flat polygon.",
        ElementKind::kVertex, {a, b, c});
  }

  [[noreturn]] static void throw_too_much(const char* what) {
    throw_not_converged(
        ErrorCode::kIterationLimit,
        std::string("Repairing the embedding takes too many ") + what + ". Start it from nothing.");
  }

  // Tries to cure f by moving one of its vertices into its kernel.
  bool move(FaceId f) {
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      const VertexId v = map_.mesh.source(h);
      if (map_.mesh.is_boundary(v)) continue;
      // Clipping is quadratic where the kernel has many corners.
      const auto degree = static_cast<Size>(map_.mesh.degree(v));
      searched_ += degree * std::min(degree, kFewCorners);
      if (searched_ > kMostSearch * state_.size()) throw_too_much("places for vertices");
      if (searched_ / kCheckSearch != checked_) {
        checked_ = searched_ / kCheckSearch;
        context_.check();
      }
      if (!centre_in_kernel(map_, v, star_)) continue;
      if (is_valid_face(map_, f)) return true;
    }
    return false;
  }

  bool collapse_face(FaceId f) {
    CollapsedStar best;
    for (const bool hubs : {false, true}) {
      for (HalfedgeId k = 3 * f; k < 3 * f + 3; ++k) {
        const HalfedgeId o = map_.mesh.opposite(k);
        if (o == kInvalid) continue;
        for (const HalfedgeId h : {k, o}) {
          // Removing a hub costs its degree: only where nothing else can be removed.
          if ((map_.mesh.degree(map_.mesh.source(h)) > kMaxQueuedDegree) != hubs) continue;
          if (!map_.mesh.can_collapse(h)) continue;
          const CollapsedStar outcome = collapsed_star(map_, h);
          if (outcome.better_than(best)) best = outcome;
        }
      }
      if (best.halfedge != kInvalid) break;
    }
    if (best.halfedge == kInvalid) return false;
    if (record_.size() >= most_collapses_) throw_too_much("collapses");
    const VertexId v0 = map_.mesh.target(best.halfedge);
    collapse_vertex(map_, best.halfedge);
    record_.push_back(best.halfedge);
    if (best.invalid > 0 && map_.mesh.degree(v0) <= kMaxQueuedDegree) {
      centre_in_kernel(map_, v0, star_);
    }
    // Its star may be invalid now, or stuck faces in it may have become collapsible.
    const HalfedgeId first = map_.mesh.outgoing(v0);
    HalfedgeId h = first;
    do {
      if (state_[static_cast<Size>(h / 3)] == kStuck || !is_valid_face(map_, h / 3)) enqueue(h / 3);
      h = map_.mesh.rotate(h);
    } while (h != first);
    return true;
  }

  PlanarMap& map_;
  bool move_first_;
  Size most_collapses_;
  CollapseRecord& record_;
  ExecutionContext& context_;
  std::vector<char> state_;
  std::vector<FaceId> queue_;
  Size head_ = 0;
  std::vector<FaceId> stuck_;
  bool grown_ = false;
  Size steps_ = 0;
  Size searched_ = 0;  // ring vertices times corners of kernels looked at, at most
  Size checked_ = 0;
  Star star_;
};

}  // namespace

std::vector<VertexId> vertices_left(const PlanarMap& map, const CollapseRecord& record) {
  std::vector<char> removed(static_cast<Size>(map.mesh.vertex_count()), 0);
  for (const HalfedgeId h : record) removed[static_cast<Size>(map.mesh.source(h))] = 1;
  std::vector<VertexId> left;
  for (VertexId v = 0; v < map.mesh.vertex_count(); ++v) {
    if (map.mesh.outgoing(v) != kInvalid && !map.mesh.is_boundary(v) &&
        removed[static_cast<Size>(v)] == 0) {
      left.push_back(v);
    }
  }
  return left;
}

void collapse_vertex(PlanarMap& map, HalfedgeId h) {
  const HalfedgeId g = map.mesh.opposite(h);
  const double vanishing = share(map, h) + share(map, g);
  double total = 0.0;
  HalfedgeId k = h;
  do {
    total += share(map, k);
    k = map.mesh.rotate(k);
  } while (k != h);
  const double factor = total / (total - vanishing);
  for (k = map.mesh.rotate(h); k / 3 != g / 3; k = map.mesh.rotate(k)) share(map, k) *= factor;
  map.mesh.collapse(h);
}

void split_vertex(PlanarMap& map, HalfedgeId h) {
  map.mesh.split(h);
  const HalfedgeId g = map.mesh.opposite(h);
  const double vanishing = share(map, h) + share(map, g);
  double total = 0.0;
  for (HalfedgeId k = map.mesh.rotate(h); k / 3 != g / 3; k = map.mesh.rotate(k))
    total += share(map, k);
  const double factor = (total - vanishing) / total;
  for (HalfedgeId k = map.mesh.rotate(h); k / 3 != g / 3; k = map.mesh.rotate(k))
    share(map, k) *= factor;
}

void collapse_invalid(PlanarMap& map, bool move_first, std::size_t most_collapses,
                      CollapseRecord& record, ExecutionContext& context) {
  Simplifier(map, move_first, most_collapses, record, context).run();
}

void collapse_all(PlanarMap& map, CollapseRecord& record, ExecutionContext& context) {
  // Rounds: in each, vertices of low degree that touch no vertex removed or grown in the same
  // round.
  const Index n = map.mesh.vertex_count();
  std::vector<VertexId> alive = vertices_left(map, record);
  std::vector<Index> blocked(static_cast<Size>(n),
                             kInvalid);  // round in which the vertex was touched
  std::vector<char> removed(static_cast<Size>(n), 0);
  std::vector<std::vector<VertexId>> by_degree;
  const Size total = alive.size();
  for (Index round = 0; !alive.empty(); ++round) {
    context.report("simplifying",
                   1.0 - static_cast<double>(alive.size()) / static_cast<double>(total));
    by_degree.clear();
    Size sum = 0;
    for (const VertexId v : alive) sum += static_cast<Size>(map.mesh.degree(v));
    const Index bound = static_cast<Index>(sum / alive.size()) + 2;
    for (const VertexId v : alive) {
      const Size d = static_cast<Size>(std::min(map.mesh.degree(v), bound + 1));
      if (by_degree.size() <= d) by_degree.resize(d + 1);
      by_degree[d].push_back(v);
    }
    Size collapsed = 0;
    Size steps = 0;
    for (Size d = 0; d < by_degree.size(); ++d) {
      if (d > static_cast<Size>(bound) && collapsed > 0) break;
      for (const VertexId v : by_degree[d]) {
        if (blocked[static_cast<Size>(v)] == round) continue;
        if (++steps % 256 == 0) context.check();
        // Into the neighbour of lowest degree that the link condition allows.
        HalfedgeId best = kInvalid;
        const HalfedgeId first = map.mesh.outgoing(v);
        HalfedgeId h = first;
        do {
          const VertexId w = map.mesh.target(h);
          if ((best == kInvalid || map.mesh.degree(w) < map.mesh.degree(map.mesh.target(best))) &&
              map.mesh.can_collapse(h)) {
            best = h;
          }
          h = map.mesh.rotate(h);
        } while (h != first);
        if (best == kInvalid) continue;
        h = first;
        do {
          blocked[static_cast<Size>(map.mesh.target(h))] = round;
          h = map.mesh.rotate(h);
        } while (h != first);
        collapse_vertex(map, best);
        record.push_back(best);
        removed[static_cast<Size>(v)] = 1;
        ++collapsed;
      }
    }
    if (collapsed == 0) break;
    std::erase_if(alive, [&](VertexId v) { return removed[static_cast<Size>(v)] != 0; });
  }
  Star star;
  for (const VertexId v : alive) place_alone(map, v, star);
}

}  // namespace flipfree::embedding
