// What is near what in a layout: corners of one shape and edges of another.
#pragma once

#include <vector>

#include "flipfree/base/context.h"
#include "flipfree/distortion/minimize/boundary_barrier.h"
#include "flipfree/unwrap/packing/nest/shape.h"

namespace flipfree::unwrap {

// A corner of shape `a` near an edge or corner of shape `b`; kInvalid stands for what is fixed.
// Both points in the coordinates of their shape, or of the plane.
struct Contact {
  Index a = kInvalid;
  Index b = kInvalid;
  Vector2 corner = Vector2::Zero();
  Vector2 point = Vector2::Zero();  // of b, the nearest one
  Vector2 away = Vector2::Zero();   // unit, in the plane: where a is to go to leave b
  double gap = 0.0;                 // between the loops, negative for corners inside b
};

// Contacts in one layout after another. What is near each corner is remembered for as long as
// nothing has moved far (Verlet's lists).
class Contacts {
 public:
  // The shapes must outlive this. `fixed`: loops in the plane, counter-clockwise.
  Contacts(const std::vector<Shape>& shapes, const std::vector<Loop>& fixed);

  // All pairs with a gap of at most `reach`, one for each place where the distance from the corner
  // is least, ordered by a's corners: the same whatever is remembered. Cost: O(corners + pairs
  // within a few times the reach).
  std::vector<Contact> find(const std::vector<Pose>& poses, double scale, double reach,
                            const ExecutionContext& context);

  // Do outlines of different shapes, or of a shape and of what is fixed, cross where they were seen
  // last? In floating point. Cost: O(corners + pairs of edges in the same small cells).
  bool any_crossing(const ExecutionContext& context) const;

  struct Corner {
    Vector2 at;     // in the plane
    Vector2 local;  // in the shape's coordinates
    Index shape;
    Index next;  // corner: the edge from this one goes there
    Index previous;
  };

 private:
  bool remembers(const std::vector<Pose>& poses, double scale, double reach) const;
  void remember(const std::vector<Pose>& poses, double scale, double reach,
                const ExecutionContext& context);

  const std::vector<Shape>& shapes_;
  std::vector<Corner> corners_;
  distortion::Boundary outlines_;  // corners as vertices, and where these are
  Points2 places_;
  // Of each corner the edges of other shapes that were within so far when all lay like this.
  std::vector<std::size_t> begin_;
  std::vector<Index> near_;
  std::vector<Pose> poses_;
  double scale_ = 0.0;
  double within_ = -1.0;
};

// A layout that grows: shapes push each other aside until none can grow any more.

struct InflateOptions {
  double margin = 0.0;  // least gap between shapes; half of it to the border of the unit tile
  std::vector<char> may_turn;                // per shape, by any angle; empty: all may
  double most_scale = 0.0;                   // not larger than this; 0: no end
  const std::vector<Loop>* fixed = nullptr;  // in the plane, counter-clockwise
  // Steps of contacts' corrections in all.
  double work = 0.0;
};

struct Layout {
  std::vector<Pose> poses;
  double scale = 0.0;
};

// Position-based dynamics: the scale grows by a little, then every contact that is too close moves
// and turns its two shapes apart, by their masses, until all gaps are as wide as they shall be;
// layouts that come to rest are kept, of those that do not the growth is halved. The layout
// returned has all gaps (along contacts, contacts.h), and the scale of the given one at least if
// that had them; otherwise it may be smaller. Deterministic. Cost: `work`.
Layout inflate(const std::vector<Shape>& shapes, const Layout& start, const InflateOptions& options,
               const ExecutionContext& context);

}  // namespace flipfree::unwrap
