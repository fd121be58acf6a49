#include "flipfree/holonomy/needed_topology.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <utility>

#include "flipfree/base/plane.h"
#include "flipfree/mesh/adjacency.h"
#include "flipfree/mesh/cut.h"
#include "flipfree/seamless/penner/penner.h"
#include "flipfree/seamless/request.h"

namespace flipfree::holonomy {
namespace {

// Which of the field's directions each boundary edge runs along, counted from that of its face, in
// quarter turns (d(h) of cross_field.h, rounded): the cones of the boundary, and the turns of
// strips between boundaries, follow from these and the matching.
class Border {
 public:
  Border(const mesh::Surface& surface, const field::CrossField& field, double ragged)
      : surface_(surface),
        loops_(mesh::boundary_halfedge_loops(surface.faces, surface.adjacency())),
        ragged_(ragged),
        quarter_(field.matching.size(), 0),
        angle_(at(surface.vertices.rows()), 0.0) {
    const field::Frames frames = field::measure_frames(surface);
    for (CornerId c = 0; at(c) < frames.corner.size(); ++c)
      angle_[at(source(c))] += frames.corner[at(c)] / kQuarterTurn;
    for (const auto& loop : loops_) {
      for (const HalfedgeId h : loop) quarter_[at(h)] = field::nearest_quarter(frames, field, h);
    }
    cones_ = field::cone_turns(frames, field);
  }

  // A quarter turn more of an edge moves one from its target to its source. Every move brings the
  // two nearer to each other, or to the angles of the surface, so there is an end.
  void even_out() {
    std::vector<HalfedgeId> queue;
    for (const auto& loop : loops_) {
      queue.assign(loop.begin(), loop.end());
      for (std::size_t i = 0; i < queue.size(); ++i) {
        const HalfedgeId h = queue[i];
        const VertexId from = source(h), to = source(next_corner(h));
        const Index step = is_lower(from, to) ? 1 : is_lower(to, from) ? -1 : 0;
        if (step == 0) continue;
        quarter_[at(h)] += step;
        cones_[at(from)] += step;
        cones_[at(to)] -= step;
        // This one again, and those beside it.
        const std::size_t place = at(std::find(loop.begin(), loop.end(), h) - loop.begin());
        queue.push_back(h);
        queue.push_back(loop[(place + 1) % loop.size()]);
        queue.push_back(loop[(place + loop.size() - 1) % loop.size()]);
      }
    }
  }

  // Corners that still have no angle get what the nearest vertex of their loop can spare.
  void give_angles() {
    for (const auto& loop : loops_) {
      const std::size_t n = loop.size();
      const auto cone = [&](std::size_t i) -> Index& { return cones_[at(source(loop[i % n]))]; };
      for (std::size_t i = 0; i < n; ++i) {
        while (cone(i) < 1) {
          std::size_t far = 1;
          while (far < n && cone(i + far) < 2 && cone(i + n - far) < 2) ++far;
          if (far == n) break;
          const bool ahead = cone(i + far) >= 2;
          for (std::size_t k = 0; k < far; ++k)
            quarter_[at(loop[(ahead ? i + k : i + n - 1 - k) % n])] += ahead ? 1 : -1;
          ++cone(i);
          --cone(ahead ? i + far : i + n - far);
        }
      }
    }
  }

  std::vector<Index>& quarters() { return quarter_; }
  std::vector<Index>& cones() { return cones_; }

 private:
  VertexId source(HalfedgeId h) const { return surface_.faces(h / 3, h % 3); }
  // Should a quarter turn go from b to a? Where a has none, and where a bends out and b in, and the
  // surface does not: the corners of a step stay, those that a field makes on a smooth line go, and
  // those of steps that are too short to count.
  bool is_lower(VertexId a, VertexId b) const {
    constexpr double kGain = 1.5;  // of 2 where the surface is straight, 0 where it bends as much
    const Index of_a = cones_[at(a)], of_b = cones_[at(b)];
    if (of_a < 1 && of_b > of_a + 1) return true;
    const double length = (surface_.vertices.row(a) - surface_.vertices.row(b)).norm();
    return of_a < 2 && of_b > 2 &&
           (length < ragged_ || (of_b - angle_[at(b)]) - (of_a - angle_[at(a)]) > kGain);
  }

  const mesh::Surface& surface_;
  const std::vector<std::vector<HalfedgeId>> loops_;  // of the boundary
  double ragged_;
  std::vector<Index> quarter_;
  std::vector<Index> cones_;
  std::vector<double> angle_;  // #V: of the surface, in quarter turns
};

// From the first edge of a strip between boundaries to its last one.
Index turn_between(const mesh::Surface& surface, const field::CrossField& field,
                   const std::vector<Index>& border, const DualLoop& strip) {
  Index turns = border[at(strip.front())] - border[at(strip.back())];
  HalfedgeId entered = strip.front();
  for (std::size_t i = 1; i < strip.size(); ++i) {
    turns += field::turn_at_corner(entered, strip[i]);
    if (i + 1 == strip.size()) break;
    turns += field.matching[at(strip[i])];
    entered = surface.adjacency().opposite[at(strip[i])];
  }
  return turns;
}

}  // namespace

NeededTopology needed_topology(const mesh::Surface& surface, const field::CrossField& field,
                               bool aligned, double ragged, const ExecutionContext& context) {
  Border border(surface, field, ragged);
  if (aligned) {
    border.even_out();
    border.give_angles();
  }
  NeededTopology needed;
  needed.cones = std::move(border.cones());
  needed.border = std::move(border.quarters());
  std::vector<FaceId> own(at(surface.faces.rows()));
  std::iota(own.begin(), own.end(), FaceId{0});
  needed.loops =
      turned_loops({surface, surface, own}, needed.cones, field, needed.border, aligned, context);
  return needed;
}

namespace {

// Squared distance of a point from the line through a side.
double off_side(const mesh::Surface& s, HalfedgeId side, const Vector3& p) {
  const Vector3 a = s.vertices.row(mesh::source(s.faces, side));
  const Vector3 b = s.vertices.row(mesh::target(s.faces, side));
  const Vector3 along = (b - a).normalized();
  return ((p - a) - along * along.dot(p - a)).squaredNorm();
}

}  // namespace

HalfedgeId Refinement::input_halfedge(HalfedgeId h) const {
  const HalfedgeId o = surface.adjacency().opposite[at(h)];
  const FaceId from = parent_face[at(h / 3)];
  const FaceId to = o == kInvalid ? kInvalid : parent_face[at(o / 3)];
  if (from == to) return kInvalid;
  const Vector3 a = surface.vertices.row(mesh::source(surface.faces, h));
  const Vector3 b = surface.vertices.row(mesh::target(surface.faces, h));
  const std::vector<HalfedgeId>& opposite = input.adjacency().opposite;
  HalfedgeId best = kInvalid;
  double least = std::numeric_limits<double>::infinity();
  for (HalfedgeId side = 3 * from; side < 3 * from + 3; ++side) {
    const HalfedgeId beyond = opposite[at(side)];
    if (beyond == kInvalid ? to != kInvalid : beyond / 3 != to) continue;
    // Two faces may share two sides.
    const double off = off_side(input, side, 0.5 * (a + b));
    if (best != kInvalid && !(off < least)) continue;
    best = side;
    least = off;
  }
  return best;
}

DualLoop Refinement::projected(const DualLoop& loop, bool closed) const {
  const std::vector<HalfedgeId>& opposite = input.adjacency().opposite;
  DualLoop strip;
  for (const HalfedgeId h : loop) {
    const HalfedgeId side = input_halfedge(h);
    if (side != kInvalid) intrinsic::go_across(strip, side, opposite);
  }
  if (closed) intrinsic::close_strip(strip, opposite);
  return strip;
}

std::vector<intrinsic::LoopTurn> turned_loops(const Refinement& refined,
                                              const std::vector<Index>& cones,
                                              const field::CrossField& field,
                                              const std::vector<Index>& border, bool aligned,
                                              const ExecutionContext& context) {
  std::vector<intrinsic::LoopTurn> loops;
  for (const mesh::Chart& chart : seamless::connected_parts(refined.surface, cones)) {
    for (auto& loop : seamless::loops_to_turn(chart.surface, aligned, context)) {
      for (HalfedgeId& h : loop.loop) h = 3 * chart.faces[at(h / 3)] + h % 3;
      const DualLoop strip = &refined.surface == &refined.input
                                 ? loop.loop
                                 : refined.projected(loop.loop, !loop.between_boundaries);
      loop.quarter_turns = loop.between_boundaries
                               ? turn_between(refined.input, field, border, strip)
                               : field::turning_number(refined.input, field, strip);
      loops.push_back(std::move(loop));
    }
  }
  return loops;
}

}  // namespace flipfree::holonomy
