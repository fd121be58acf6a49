#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "flipfree/base/error.h"
#include "flipfree/embedding/star.h"

namespace flipfree::embedding {
namespace {

// Phase 1 of progressive embedding: collapse until nothing invalid is left (thesis 3.2.2, Algorithm
// 1).

// Half-edges collapsed so far, in order; split(collapses.back()) first.
using CollapseRecord = std::vector<HalfedgeId>;

using Size = std::size_t;

constexpr Size kReportEvery = 64;
constexpr double kShare = 0.2;  // of the progress of the embedding

double& share(PlanarMap& map, HalfedgeId h) { return map.share[at(h / 3)]; }

// visit(g) for the half-edges of h's source whose faces a collapse of h keeps, counter-clockwise.
template <typename Visit>
void for_each_kept(const PlanarMesh& mesh, HalfedgeId h, const Visit& visit) {
  const FaceId last = mesh.opposite(h) / 3;
  for (HalfedgeId g = mesh.rotate(h); g / 3 != last; g = mesh.rotate(g)) visit(g);
}

// What the star of h's source looks like once it is merged into its target: how many faces are
// invalid, and the largest energy of the others. The less, the better.
std::pair<int, double> collapsed_star(const PlanarMap& map, HalfedgeId h) {
  std::pair<int, double> outcome(0, 0.0);
  const VertexId v0 = map.mesh.target(h);
  const Vector2 p0 = map.at(v0);
  for_each_kept(map.mesh, h, [&](HalfedgeId g) {
    const VertexId q = map.mesh.target(g);
    const VertexId r = map.mesh.apex(g);
    const double energy =
        triangle_energy(p0, map.at(q), map.at(r), map.unit * map.share[at(g / 3)]);
    if (!(energy < map.invalid_energy) || !map.positive(v0, q, r)) {
      ++outcome.first;
    } else {
      outcome.second = std::max(outcome.second, energy);
    }
  });
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
  // Of the simplified mesh: the proof for the given one is the ladder's.
  const std::string place = narrowest_extent(star), vertex = vertex_id(v);
  const std::string with = map.float32 ? " with 32-bit coordinates " : " with 64-bit coordinates ";
  throw_not_converged(
      room.exact ? ErrorCode::kNoRoomInPolygon : ErrorCode::kIterationLimit,
      (room.exact
           ? "The polygon has no room for vertex " + vertex + ": no point" + with + "lies " + place
           : "No point" + with + "was found for vertex " + vertex + " " + place) +
          ". Make the polygon wider there, or move it to the origin.",
      ElementKind::kVertex, {v});
}

// kAccepted: positive, of high energy, and nothing can be done about it.
enum : char { kFree = 0, kQueued = 1, kStuck = 2, kAccepted = 3 };

// PlanarMesh::collapse, and hands the shares of the two faces that vanish to the rest of the
// vertex's star.
void collapse_vertex(PlanarMap& map, HalfedgeId h) {
  const double vanishing = share(map, h) + share(map, map.mesh.opposite(h));
  double total = 0.0;
  map.mesh.for_each_outgoing(h, [&](HalfedgeId k) { total += share(map, k); });
  const double factor = total / (total - vanishing);
  for_each_kept(map.mesh, h, [&](HalfedgeId k) { share(map, k) *= factor; });
  map.mesh.collapse(h);
}

// Algorithm 1 with a work queue instead of sweeps over the invalid set: every invalid face is
// collapsed along that edge of its three which satisfies the link condition and leaves the fewest
// invalid faces; faces that a collapse made invalid join the set; when nothing collapses any more,
// the set grows by one ring. Vertices whose neighbours all lie on the boundary cannot be collapsed;
// if their star is invalid they are moved into its kernel. Guarantee: after run() every face is
// valid. Appends to `record`. Cost: near-linear in the number of faces touched. Throws NotConverged
// (kNoRoomInPolygon) if a vertex that cannot be collapsed has no valid position.
class Simplifier {
 public:
  Simplifier(PlanarMap& map, CollapseRecord& record, ExecutionContext& context)
      : map_(map), record_(record), context_(context) {}

  void run() {
    const Index faces = map_.mesh.face_count();
    state_.assign(at(faces), kFree);
    for (FaceId f = 0; f < faces; ++f) {
      if (map_.mesh.is_alive(f) && invalid(f)) enqueue(f);
    }
    while (true) {
      drain();
      // Faces that are still invalid did not collapse: let their surroundings try.
      std::erase_if(stuck_, [&](FaceId f) { return !is_stuck(f); });
      if (std::none_of(stuck_.begin(), stuck_.end(), [&](FaceId f) { return invalid(f); })) return;
      grow();
    }
  }

 private:
  bool invalid(FaceId f) const {
    return !is_valid_face(map_, f) && !(state_[at(f)] == kAccepted && map_.positive(f));
  }

  bool is_stuck(FaceId f) const { return map_.mesh.is_alive(f) && state_[at(f)] == kStuck; }

  void enqueue(FaceId f) {
    if (state_[at(f)] == kQueued) return;
    state_[at(f)] = kQueued;
    queue_.push_back(f);
  }

  void drain() {
    while (head_ < queue_.size()) {
      const FaceId f = queue_[head_++];
      if (!map_.mesh.is_alive(f)) continue;
      state_[at(f)] = kFree;
      if (!invalid(f) && !grown_) continue;
      // Nobody knows how far it is: every face once is half of the way.
      if (const auto steps = static_cast<double>(++steps_); steps_ % kReportEvery == 0)
        context_.report("repairing", kShare * steps / (steps + static_cast<double>(state_.size())));
      if (!collapse_face(f)) {
        state_[at(f)] = kStuck;
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

  void requeue_stuck() {
    for (const FaceId f : std::exchange(stuck_, {})) {
      if (is_stuck(f)) enqueue(f);
    }
  }

  // Adds the neighbours of the stuck faces; they are collapsed even though they are valid.
  void grow() {
    grown_ = true;
    bool any = false;
    const std::vector<FaceId> stuck = stuck_;
    for (const FaceId f : stuck) {
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
        const HalfedgeId o = map_.mesh.opposite(h);
        if (o == kInvalid || state_[at(o / 3)] != kFree) continue;
        enqueue(o / 3);
        any = true;
      }
    }
    if (any) return;
    // The set cannot grow: no inner edge of the connected region satisfies the link condition, so
    // by Theorem 3.8 each inner vertex left in it is alone between boundary vertices.
    for (const FaceId f : stuck) {
      if (!invalid(f)) continue;
      const auto [a, b, c] = map_.mesh.corners(f);
      for (const VertexId v : {a, b, c}) {
        if (!map_.mesh.is_boundary(v)) place_alone(map_, v, star_);
      }
      if (!map_.positive(f)) {
        throw_not_converged(
            ErrorCode::kNoRoomInPolygon,
            "The face with vertices " + vertex_id(a) + ", " + vertex_id(b) + ", " + vertex_id(c) +
                " cannot be positive in the required precision. Use a larger or less flat polygon.",
            ElementKind::kVertex, {a, b, c});
      }
      if (!is_valid_face(map_, f)) state_[at(f)] = kAccepted;
    }
    grown_ = false;
    requeue_stuck();
  }

  bool collapse_face(FaceId f) {
    HalfedgeId best = kInvalid;
    std::pair<int, double> least;
    for (const bool hubs : {false, true}) {
      for (HalfedgeId k = 3 * f; k < 3 * f + 3; ++k) {
        const HalfedgeId o = map_.mesh.opposite(k);
        if (o == kInvalid) continue;
        for (const HalfedgeId h : {k, o}) {
          // Removing a hub costs its degree: only where nothing else can be removed.
          if ((map_.mesh.degree(map_.mesh.source(h)) > kMaxQueuedDegree) != hubs) continue;
          if (!map_.mesh.can_collapse(h)) continue;
          const std::pair<int, double> outcome = collapsed_star(map_, h);
          if (best != kInvalid && outcome >= least) continue;
          best = h;
          least = outcome;
        }
      }
      if (best != kInvalid) break;
    }
    if (best == kInvalid) return false;
    const VertexId v0 = map_.mesh.target(best);
    collapse_vertex(map_, best);
    record_.push_back(best);
    if (least.first > 0 && map_.mesh.degree(v0) <= kMaxQueuedDegree)
      centre_in_kernel(map_, v0, star_);
    // Its star may be invalid now, or stuck faces in it may have become collapsible.
    map_.mesh.for_each_outgoing(map_.mesh.outgoing(v0), [&](HalfedgeId h) {
      if (state_[at(h / 3)] == kStuck || !is_valid_face(map_, h / 3)) enqueue(h / 3);
    });
    return true;
  }

  PlanarMap& map_;
  CollapseRecord& record_;
  ExecutionContext& context_;
  std::vector<char> state_;
  std::vector<FaceId> queue_;
  Size head_ = 0;
  std::vector<FaceId> stuck_;
  bool grown_ = false;
  Size steps_ = 0;
  Star star_;
};

// Inner vertices that no collapse in the record has removed, by id.
std::vector<VertexId> vertices_left(const PlanarMap& map, const CollapseRecord& record) {
  std::vector<char> removed(at(map.mesh.vertex_count()), 0);
  for (const HalfedgeId h : record) removed[at(map.mesh.source(h))] = 1;
  std::vector<VertexId> left;
  for (VertexId v = 0; v < map.mesh.vertex_count(); ++v) {
    if (map.mesh.outgoing(v) != kInvalid && !map.mesh.is_boundary(v) && removed[at(v)] == 0)
      left.push_back(v);
  }
  return left;
}

// Undoes both. The position of the vertex that comes back is left as it was.
void split_vertex(PlanarMap& map, HalfedgeId h) {
  map.mesh.split(h);
  const double vanishing = share(map, h) + share(map, map.mesh.opposite(h));
  double total = 0.0;
  for_each_kept(map.mesh, h, [&](HalfedgeId k) { total += share(map, k); });
  const double factor = (total - vanishing) / total;
  for_each_kept(map.mesh, h, [&](HalfedgeId k) { share(map, k) *= factor; });
}

// Collapses every inner vertex that can be, lowest degree first, in rounds of independent vertices,
// and puts what remains (one vertex per part of the disk between chords) into its kernel: the start
// from nothing.
void collapse_all(PlanarMap& map, CollapseRecord& record, ExecutionContext& context) {
  // Rounds: in each, vertices of low degree that touch no vertex removed or grown in the same
  // round.
  std::vector<Index> blocked(at(map.mesh.vertex_count()),
                             kInvalid);  // round in which the vertex was touched
  const Size total = vertices_left(map, record).size();
  for (Index round = 0;; ++round) {
    const std::vector<VertexId> alive = vertices_left(map, record);
    if (alive.empty()) return;
    context.report("simplifying",
                   1.0 - static_cast<double>(alive.size()) / static_cast<double>(total));
    Size sum = 0;
    for (const VertexId v : alive) sum += at(map.mesh.degree(v));
    const Index bound = static_cast<Index>(sum / alive.size()) + 2;
    std::vector<VertexId> order = alive;
    std::stable_sort(order.begin(), order.end(), [&](VertexId a, VertexId b) {
      return map.mesh.degree(a) < map.mesh.degree(b);
    });
    const Size before = record.size();
    Size steps = 0;
    for (const VertexId v : order) {
      if (blocked[at(v)] == round) continue;
      if (map.mesh.degree(v) > bound && record.size() > before) break;
      if (++steps % 256 == 0) context.check();
      // Into the neighbour of lowest degree that the link condition allows.
      HalfedgeId best = kInvalid;
      const HalfedgeId first = map.mesh.outgoing(v);
      map.mesh.for_each_outgoing(first, [&](HalfedgeId h) {
        const VertexId w = map.mesh.target(h);
        if ((best == kInvalid || map.mesh.degree(w) < map.mesh.degree(map.mesh.target(best))) &&
            map.mesh.can_collapse(h))
          best = h;
      });
      if (best == kInvalid) continue;
      map.mesh.for_each_outgoing(first,
                                 [&](HalfedgeId h) { blocked[at(map.mesh.target(h))] = round; });
      collapse_vertex(map, best);
      record.push_back(best);
    }
    if (record.size() > before) continue;
    Star star;
    for (const VertexId v : alive) place_alone(map, v, star);
    return;
  }
}

// Phase 2 of progressive embedding: put one vertex back (thesis 3.2.2, Algorithm 2, Lemma 3.11).

constexpr double kStep = 0.8;   // thesis 3.2.2
constexpr int kMaxSteps = 75;   // thesis 3.2.2
constexpr Size kMaxGoals = 24;  // rays tried around vertices of high degree, evenly spread

// Largest energy over the closed star with its centre at p.
double worst_energy(const Star& star, const Vector2& p) {
  double worst = 0.0;
  for (Size i = 0; i < star.ring.size(); ++i) {
    worst =
        std::max(worst, triangle_energy(p, star.at[i], star.at[star.next(i)], star.target[i] / 2));
  }
  return worst;
}

// Places `mover`, one end of the edge of the half-edge g = (mover -> stayer), whose ends both lie
// at p0 = the stayer's position. `star`: reused between calls.
bool place_mover(PlanarMap& map, HalfedgeId g, Star& star) {
  const Vector2 p0 = map.at(map.mesh.target(g));
  gather_star(map, g, star);  // from the stayer on

  // Goals: inner vertices of the fan and midpoints of its edges; its ends lie on the border of the
  // sector.
  const Size n = star.ring.size();
  const Size last =
      2 * n - 4;  // goals 0 .. last - 1: midpoint of (1, 2), vertex 2, midpoint of (2, 3), ...
  const Size goals = n >= 3 ? last - 1 : 0;
  const Size stride = (goals + kMaxGoals - 1) / kMaxGoals;
  double best_energy = HUGE_VAL;
  Vector2 best = p0;
  const auto try_goal = [&](const Vector2& goal) {
    const Vector2 d = goal - p0;
    const double bound = step_to_boundary(star, p0, d);
    double t = 1.0;
    int k = 0;
    if (bound < 1.0 && bound > 0.0) {
      k = std::max(0, static_cast<int>(std::ceil(std::log(bound) / std::log(kStep))) - 1);
      t = std::pow(kStep, k);
    }
    // The thesis takes the first valid step. It lies close to the far side of the ring; going on
    // while the energy falls costs two or three evaluations and saves many smoothing steps.
    double here = HUGE_VAL;
    for (; k < kMaxSteps; ++k, t *= kStep) {
      const Vector2 p = map.snap(p0 + t * d);
      if (p == p0) break;
      const double energy = worst_energy(star, p);
      if (energy >= here && here < HUGE_VAL) break;
      if (!(energy < HUGE_VAL) || !star_positive(map, star, p)) continue;
      here = energy;
      if (energy < best_energy) {
        best_energy = energy;
        best = p;
      }
    }
  };
  for (Size k = 0; k < goals; k += stride) {
    const Size i = 1 + k / 2;
    try_goal(k % 2 == 0 ? Vector2((star.at[i] + star.at[i + 1]) / 2) : star.at[i + 1]);
  }
  if (!(best_energy < HUGE_VAL)) return false;
  map.move(map.mesh.source(g), best);
  return true;
}

// Undoes the collapse of h = (m -> v0) and finds a position for m. Of the two vertices, the one
// whose fan spans less than half a turn moves into its sector, the other takes v0's old position
// (Figure 3.5). Candidates lie on the rays from there to the ring's vertices in the sector and to
// the midpoints of the ring's edges, at the first of the steps 1, 0.8, 0.64, ... (75 at most) that
// is valid by exact test; steps that are invalid by the analytic step bound are skipped. The
// candidate with the smallest largest energy of the star wins.
// False if there is none: connectivity and positions are then as before the call.
// Precondition: the star of v0 is positive. Guarantee: the stars of both vertices are positive on
// success.
bool insert_vertex(PlanarMap& map, HalfedgeId h, Star& star) {
  const VertexId m = map.mesh.source(h);
  const HalfedgeId g = map.mesh.opposite(h);
  const VertexId v0 = map.mesh.target(h);
  const Vector2 p0 = map.at(v0);
  const Vector2 before = map.at(m);
  const double angle = turn(map.at(map.mesh.apex(h)) - p0, map.at(map.mesh.apex(g)) - p0);
  split_vertex(map, h);
  map.move(m, p0);
  // m's fan runs from a counter-clockwise to b.
  const bool m_moves = angle >= 0 && angle < std::numbers::pi;
  if (place_mover(map, m_moves ? h : g, star) || place_mover(map, m_moves ? g : h, star))
    return true;
  map.move(v0, p0);
  map.move(m, before);
  collapse_vertex(map, h);
  return false;
}

constexpr int kMaxRetries = 4;
// How much is smoothed.
struct Effort {
  // Whole-mesh sweeps, run each time the mesh has grown by `growth`, and at the end.
  int sweeps;
  double growth;
  int final_sweeps;
  // Around each insertion: at most this many Newton steps per edge of the new vertex (thesis: 10
  // iterations over the whole mesh); a vertex that moved less than `settled` star sizes does not
  // wake its neighbours.
  Size local_steps;
  double settled;
};
constexpr Effort kOrdinaryEffort{2, 1.5, 5, 2, 0.3};
// From starts that are far from a good map.
constexpr Effort kThoroughEffort{3, 1.25, 10, 10, 0.1};

// Inner vertices within `rings` edges of v.
std::vector<VertexId> neighbourhood(const PlanarMap& map, VertexId v, int rings) {
  std::vector<VertexId> found{v};
  for (int ring = 0; ring < rings; ++ring) {
    for (Size i = found.size(); i-- > 0;) {
      map.mesh.for_each_outgoing(map.mesh.outgoing(found[i]), [&](HalfedgeId h) {
        if (!map.mesh.is_boundary(map.mesh.target(h))) found.push_back(map.mesh.target(h));
      });
    }
    sort_unique(found);
  }
  return found;
}

}  // namespace

void progressive_embedding(PlanarMap& map, ProgressiveStart start, ExecutionContext& context) {
  const Effort& effort = start == ProgressiveStart::kInitial ? kThoroughEffort : kOrdinaryEffort;
  CollapseRecord record;
  if (start == ProgressiveStart::kNothing) {
    const ProgressRange range(context, 0.0, 0.2);
    collapse_all(map, record, context);
  } else {
    Simplifier(map, record, context).run();
  }

  std::vector<VertexId> alive = vertices_left(map, record);
  const Size total = record.size();
  smooth_sweeps(map, alive, effort.final_sweeps, effort.settled / 10, context);
  Size next_sweep = static_cast<Size>(static_cast<double>(alive.size()) * effort.growth) + 1;

  Star star;
  SmoothingQueue queue(map.mesh.vertex_count());
  while (!record.empty()) {
    const HalfedgeId h = record.back();
    const VertexId v0 = map.mesh.target(h);
    if (record.size() % 64 == 0) {
      context.report("progressive embedding",
                     0.2 + 0.7 * std::max(0.0, 1.0 - static_cast<double>(record.size()) /
                                                         static_cast<double>(total)));
    }
    bool inserted = insert_vertex(map, h, star);
    for (int attempt = 0; !inserted && attempt < kMaxRetries; ++attempt) {
      // Algorithm 2, line 11: improve the quality and try again, over ever more rings.
      smooth_sweeps(map, neighbourhood(map, v0, 2 + 2 * attempt), 50, 1e-3, context);
      inserted = insert_vertex(map, h, star);
    }
    if (!inserted) {
      throw_not_converged(ErrorCode::kIterationLimit,
                          "Vertex " + vertex_id(map.mesh.source(h)) +
                              " found no valid position beside vertex " + vertex_id(v0) + ".",
                          ElementKind::kVertex, {map.mesh.source(h), v0});
    }
    record.pop_back();
    const VertexId m = map.mesh.source(h);
    alive.push_back(m);
    queue.push_star(map, m);
    queue.push_star(map, v0);
    queue.run(map, effort.local_steps * at(std::min<Index>(16, map.mesh.degree(m))),
              effort.settled);
    if (alive.size() >= next_sweep) {
      smooth_sweeps(map, alive, effort.sweeps, effort.settled / 10, context);
      next_sweep = static_cast<Size>(static_cast<double>(alive.size()) * effort.growth) + 1;
    }
  }
  smooth_sweeps(map, alive, effort.final_sweeps, effort.settled / 10, context);
}

}  // namespace flipfree::embedding
