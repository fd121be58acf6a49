// Carries a map along when the triangulated polygon under it changes shape.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/matchmaker/target/target_domain.h"
#include "flipfree/mesh/refined/refined_surface.h"

namespace flipfree::matchmaker {

// The triangle of the domain that holds b at shape `place`, found along the segment a -> b from
// face f, which holds a, or, if `corner` is given, from that domain vertex, which lies at a.
// kInvalid if the segment leaves the domain. Cost: O(triangles crossed).
FaceId find_along(const TargetDomain& domain, const std::vector<Vector2>& place, FaceId f,
                  Index corner, const Vector2& a, const Vector2& b);

// The vertices of a map, each in a triangle of the domain, on which it rides when the domain
// changes shape. The domain may overlap itself: triangles are found along mesh edges, starting from
// the boundary, which stay within the disk. What is carried is a guess for where a map goes,
// without guarantee: long edges may cross after it.
class Carrier {
 public:
  // Preconditions: uv is flip-free, its boundary vertices are at `here`, a shape of the domain (a
  // point per domain vertex); the domain has no inner vertices. All must outlive it. Cost: O(#E +
  // domain edges crossed by a spanning tree of mesh edges).
  Carrier(const mesh::RefinedSurface& surface, const Points2& uv, const TargetDomain& domain,
          const std::vector<Vector2>& here, const ExecutionContext& context);

  // All vertices when the domain has shape `there`.
  Points2 vertices(const std::vector<Vector2>& there) const;
  // The point that lies at share s of the edge a -> b now.
  Vector2 on_edge(VertexId a, VertexId b, double s, const std::vector<Vector2>& there) const;

 private:
  Vector2 ride(FaceId f, const Vector2& p, const std::vector<Vector2>& there) const;

  const Points2& uv_;
  const TargetDomain& domain_;
  const std::vector<Vector2>& here_;
  std::vector<FaceId> face_;   // per vertex; kInvalid if not found: it stays where it is
  std::vector<Index> corner_;  // per vertex the domain vertex it is, if any
};

}  // namespace flipfree::matchmaker
