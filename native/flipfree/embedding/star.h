// Vertex-wise Newton smoothing (thesis 3.2.2, "local smoothing"; Hormann and Greiner 2000): one
// inner vertex at a time goes down the energy of its star, never past a triangle that would not
// stay positive by exact test.
//
// Deviation: the thesis uses the triangle itself as reference where it is valid (scaffold energy)
// and the canonical equilateral one where it is not; here every triangle has an equilateral
// reference with its share of the area (planar_map.h). That is the same barrier, and it also pulls
// the map towards a state that has room for every vertex.
//
// Is there a number inside? The degenerate case of thesis 3.5 (Figure 3.13), decided exactly.
//
// A vertex inside a ring of fixed vertices needs a grid point (pair of doubles, or of 32-bit
// floats) on the positive side of every ring edge. In each row of the grid the admissible values
// form an interval whose ends are found by bisection over the floating-point numbers with exact
// predicates; the rows are those between the ring's extremes, along the axis that has fewer.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/embedding/planar_map.h"

namespace flipfree::embedding {

// The triangles around one inner vertex: ring[i], ring[i + 1] and the vertex. Reused to avoid
// allocation.
struct Star {
  std::vector<VertexId> ring;
  std::vector<Vector2> at;
  std::vector<double> target;  // twice the target area D0 of triangle i

  std::size_t size() const { return at.size(); }
  std::size_t next(std::size_t i) const { return i + 1 == at.size() ? 0 : i + 1; }
};
// The ring begins with the target of `first`.
void gather_star(const PlanarMap& map, HalfedgeId first, Star& star);

// The largest t for which no triangle of the star around p + t d has lost its area, of those that
// have one around p.
double step_to_boundary(const Star& star, const Vector2& p, const Vector2& d);

// Is every triangle of the star with its centre v at p positive (exact, as given and as stored)? v
// itself is not read.
bool star_positive(const PlanarMap& map, const Star& star, const Vector2& p);

// Best position found for v with its neighbours fixed: the centre of the kernel of its ring. False
// if that kernel holds no grid point that was found; v is then left alone. Moves v only to where
// its star is positive (exact).
bool centre_in_kernel(PlanarMap& map, VertexId v, Star& scratch);

// Sweeps over `vertices` (inner, stars positive), in their order. Stops early when no vertex moves
// by more than `tolerance` star sizes.
void smooth_sweeps(PlanarMap& map, const std::vector<VertexId>& vertices, int sweeps,
                   double tolerance, const ExecutionContext& context);

// Vertices of higher degree are moved by sweeps only: one step for each insertion beside a hub
// would be quadratic.
inline constexpr Index kMaxQueuedDegree = 200;

// Work queue for smoothing around an insertion.
class SmoothingQueue {
 public:
  explicit SmoothingQueue(Index vertex_count) : queued_(at(vertex_count), 0) {}
  void push(const PlanarMap& map, VertexId v) {
    if (map.mesh.is_boundary(v) || map.mesh.degree(v) > kMaxQueuedDegree || queued_[at(v)] != 0)
      return;
    queued_[at(v)] = 1;
    queue_.push_back(v);
  }
  // v and its neighbours; nothing if v is a hub.
  void push_star(const PlanarMap& map, VertexId v);
  // Improves queued vertices, first in first out; a vertex that moves by more than `tolerance` star
  // sizes queues its neighbours and itself. At most `steps` Newton steps; what is left is dropped.
  void run(PlanarMap& map, std::size_t steps, double tolerance);

 private:
  std::vector<VertexId> queue_;
  std::vector<char> queued_;
  Star star_;
};

struct Room {
  bool exact =
      false;  // all rows were looked at: `points` is the true number of admissible grid points
  std::uint64_t points = 0;  // number of admissible grid points in the rows looked at; saturates
  Vector2 middle =
      Vector2::Zero();  // one of them, in the middle of the widest row, if there is any
};

// Rows of the grid times corners that a proof that there is no room may look at.
inline constexpr std::uint64_t kRoomBudget = 1'000'000;

// `star.ring` and `star.at` give the ring, counter-clockwise. If there are more rows than `budget`
// / ring size, that many are sampled evenly. Cost: O(rows * ring * 64) predicates.
Room find_room(const PlanarMap& map, const Star& star, std::uint64_t budget = kRoomBudget);

// "between the edge (a, b) and vertex c": the narrowest extent of the ring.
std::string narrowest_extent(const Star& star);

}  // namespace flipfree::embedding
