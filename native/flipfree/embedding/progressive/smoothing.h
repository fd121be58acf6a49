// Vertex-wise Newton smoothing (thesis 3.2.2, "local smoothing"; Hormann and Greiner 2000): one
// inner vertex at a time goes down the energy of its star, never past a triangle that would not
// stay positive by exact test.
//
// Deviation: the thesis uses the triangle itself as reference where it is valid (scaffold energy)
// and the canonical equilateral one where it is not; here every triangle has an equilateral
// reference with its share of the area (planar_map.h). That is the same barrier, and it also pulls
// the map towards a state that has room for every vertex.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/embedding/progressive/planar_map.h"

namespace flipfree::embedding {

// The triangles around one inner vertex: ring[i], ring[i + 1] and the vertex. Reused to avoid
// allocation.
struct Star {
  std::vector<VertexId> ring;
  std::vector<Vector2> at;
  std::vector<double> target;  // twice the target area D0 of triangle i
};
// The ring begins with the target of `first`.
void gather_star(const PlanarMap& map, HalfedgeId first, Star& star);

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
  explicit SmoothingQueue(Index vertex_count)
      : queued_(static_cast<std::size_t>(vertex_count), 0) {}
  void push(const PlanarMap& map, VertexId v) {
    if (map.mesh.is_boundary(v) || map.mesh.degree(v) > kMaxQueuedDegree ||
        queued_[static_cast<std::size_t>(v)] != 0)
      return;
    queued_[static_cast<std::size_t>(v)] = 1;
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

}  // namespace flipfree::embedding
