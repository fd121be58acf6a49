#include "flipfree/intrinsic/overlay/overlay_coordinates.h"

#include <algorithm>
#include <string>

#include "flipfree/base/error.h"

namespace flipfree::intrinsic {
namespace {

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

// Curves that start at the corner between sides a and b and cross side c, for crossing numbers a,
// b, c.
std::int64_t emanating(std::int64_t a, std::int64_t b, std::int64_t c) {
  return std::max<std::int64_t>(0, c - a - b);
}

// Curves that cross both a and b. At most one corner of a triangle has emanating curves (two such
// curves would cross); those of another corner are not counted twice.
std::int64_t turning(std::int64_t a, std::int64_t b, std::int64_t c) {
  if (c >= a + b) return 0;
  if (a >= b + c) return b;
  if (b >= a + c) return a;
  return (a + b - c) / 2;
}

}  // namespace

void FlipMesh::flip(HalfedgeId h) {
  const HalfedgeId o = opposite_of(h);
  const HalfedgeId hn = next_of(h), hp = next_of(hn);
  const HalfedgeId on = next_of(o), op = next_of(on);
  next[at(h)] = hp, next[at(hp)] = on, next[at(on)] = h;
  next[at(o)] = op, next[at(op)] = hn, next[at(hn)] = o;
  source[at(h)] = source_of(op);
  source[at(o)] = source_of(hp);
}

void FlipMesh::check_invariants() const {
  const Index count = halfedge_count();
  const auto fail = [](Index h) {
    throw InternalError("flip mesh: half-edge " + std::to_string(h) + " breaks an invariant");
  };
  for (HalfedgeId h = 0; h < count; ++h) {
    const HalfedgeId o = opposite_of(h);
    if (o >= count) fail(h);
    if (next_of(h) < 0 || next_of(h) >= count || next_of(previous_of(h)) != h) fail(h);
    if (source_of(next_of(h)) != source_of(o)) fail(h);
  }
}

OverlayCoordinates::OverlayCoordinates(FlipMesh mesh)
    : input_(std::move(mesh)),
      current_(input_),
      crossings_(input_.next.size(), -1),
      roundabout_(input_.next.size(), 0),
      star_begin_(at(input_.vertex_count) + 1, 0),
      star_(input_.next.size()) {
  const Index count = input_.halfedge_count();
  for (HalfedgeId h = 0; h < count; ++h) ++star_begin_[at(input_.source_of(h)) + 1];
  for (std::size_t v = 1; v < star_begin_.size(); ++v) star_begin_[v] += star_begin_[v - 1];
  std::vector<char> placed(at(count), 0);
  for (HalfedgeId first = 0; first < count; ++first) {
    if (placed[at(first)]) continue;
    const Index begin = star_begin_[at(input_.source_of(first))];
    Index place = 0;
    HalfedgeId h = first;
    do {
      star_[at(begin + place)] = h;
      roundabout_[at(h)] = place++;
      placed[at(h)] = 1;
      h = input_.rotate_ccw(h);
    } while (h != first);
    if (place != degree(input_.source_of(first))) {
      throw InternalError("overlay: the half-edges out of vertex " +
                          std::to_string(input_.source_of(first)) + " are not one cycle");
    }
  }
}

CornerCounts OverlayCoordinates::corner(HalfedgeId h) const {
  const HalfedgeId n = current_.next_of(h), p = current_.next_of(n);
  const std::int64_t a = crossings(h), b = crossings(p), c = crossings(n);
  return {emanating(a, b, c), turning(a, b, c)};
}

// The roundabout of the half-edge that follows h counter-clockwise, from those of h.
Index OverlayCoordinates::roundabout_after(HalfedgeId h) const {
  const std::int64_t between = corner(h).emanating + (shared(h) ? 1 : 0);
  const std::int64_t place = roundabout(h) + between;
  const Index size = degree(current_.source_of(h));
  return static_cast<Index>(place % size);
}

void OverlayCoordinates::flip(HalfedgeId h) {
  const HalfedgeId o = current_.opposite_of(h);
  const HalfedgeId hn = current_.next_of(h), hp = current_.next_of(hn);
  const HalfedgeId on = current_.next_of(o), op = current_.next_of(on);
  const std::int64_t ij = crossings(h), jk = crossings(hn), ki = crossings(hp);
  const std::int64_t il = crossings(on), lj = crossings(op);

  // Curves across ij in order from i: in the upper triangle first those that turn around i, then
  // those that end at k, then those that turn around j; in the lower triangle the same with l. A
  // curve crosses kl if it passes from the side of i to the side of j, or separates k or l from the
  // diagonal, or starts at i or j into the opposite side.
  const std::int64_t up_i = turning(ij, ki, jk), up_k = emanating(jk, ki, ij);
  const std::int64_t low_i = turning(ij, il, lj), low_l = emanating(il, lj, ij);
  std::int64_t kl = turning(jk, ki, ij) + turning(il, lj, ij)                 // around k, around l
                    + emanating(ij, ki, jk) + emanating(ij, jk, ki)           // from i or j, upper
                    + emanating(ij, il, lj) + emanating(ij, lj, il)           // from i or j, lower
                    + std::max<std::int64_t>(0, up_i - low_i - low_l)         // ki to lj
                    + std::max<std::int64_t>(0, low_i - up_i - up_k)          // il to jk
                    + (shared(h) ? 1 : 0);                                    // ij itself
  if (std::min(up_i + up_k, low_i + low_l) > std::max(up_i, low_i)) kl = -1;  // a curve from k to l
  if (kl > (std::int64_t{1} << 60)) {
    throw InternalError("overlay: an edge is crossed more than 2^60 times");
  }

  current_.flip(h);
  crossings_[at(h)] = crossings_[at(o)] = kl;
  // Counter-clockwise around l: op, h, opposite(on); around k: hp, o, opposite(hn).
  roundabout_[at(h)] = roundabout_after(op);
  roundabout_[at(o)] = roundabout_after(hp);
}

}  // namespace flipfree::intrinsic
