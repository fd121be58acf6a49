#include "flipfree/intrinsic/overlay/overlay_coordinates.h"

#include <algorithm>
#include <string>

#include "flipfree/base/error.h"
#include "flipfree/intrinsic/overlay/normal_coordinates.h"

namespace flipfree::intrinsic {
namespace {

constexpr std::int64_t kMostCrossings = std::int64_t{1} << 60;

}  // namespace

OverlayCoordinates::OverlayCoordinates(FlipMesh mesh)
    : input_(std::move(mesh)),
      current_(input_),
      crossings_(input_.next.size(), -1),
      roundabout_(input_.next.size(), 0),
      star_begin_(at(count_vertices(input_)) + 1, 0),
      star_(input_.next.size()) {
  const auto count = static_cast<Index>(input_.halfedge_count());
  for (HalfedgeId h = 0; h < count; ++h) ++star_begin_[at(input_.origin_of(h)) + 1];
  for (std::size_t v = 1; v < star_begin_.size(); ++v) star_begin_[v] += star_begin_[v - 1];
  std::vector<char> placed(at(count), 0);
  for (HalfedgeId first = 0; first < count; ++first) {
    if (placed[at(first)]) continue;
    const Index begin = star_begin_[at(input_.origin_of(first))];
    Index place = 0;
    HalfedgeId h = first;
    do {
      star_[at(begin + place)] = h;
      roundabout_[at(h)] = place++;
      placed[at(h)] = 1;
      h = input_.rotate_ccw(h);
    } while (h != first);
    if (place != degree(input_.origin_of(first))) {
      throw InternalError("overlay: the half-edges out of vertex " +
                          std::to_string(input_.origin_of(first)) + " are not one cycle");
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
  const Index size = degree(current_.origin_of(h));
  return static_cast<Index>(place % size);
}

void OverlayCoordinates::flip(HalfedgeId h) {
  const HalfedgeId o = current_.opposite(h);
  const HalfedgeId hn = current_.next_of(h), hp = current_.next_of(hn);
  const HalfedgeId on = current_.next_of(o), op = current_.next_of(on);
  const FlippedCrossings kl = after_flip(
      {crossings(h), crossings(hn), crossings(hp), crossings(on), crossings(op), shared(h)});
  if (kl.count > kMostCrossings) {
    throw InternalError("overlay: an edge is crossed more than 2^60 times");
  }

  flip_edge(current_, h >> 1);
  crossings_[at(h)] = crossings_[at(o)] = kl.along ? -1 : kl.count;
  // Counter-clockwise around l: op, h, opposite(on); around k: hp, o, opposite(hn).
  roundabout_[at(h)] = roundabout_after(op);
  roundabout_[at(o)] = roundabout_after(hp);
}

}  // namespace flipfree::intrinsic
