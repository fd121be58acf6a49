#include "flipfree/quads/cells.h"

#include <algorithm>
#include <limits>
#include <map>
#include <tuple>

#include "flipfree/base/error.h"

namespace flipfree::quads {

namespace {

std::int64_t floor_of(std::int64_t a, std::int64_t b) {  // b > 0
  return a / b - (a % b < 0 ? 1 : 0);
}

// A face, or -1 - vertex; and a place in the face.
using CornerKey = std::tuple<Index, std::int64_t, std::int64_t>;

// Places are doubled, so that centres of cells are odd and corners even.
class Walker {
 public:
  Walker(const CoarseSurface& coarse, const ExecutionContext& context)
      : flat_(coarse), context_(context) {
    for (Side& side : flat_.sides) side.edge = side.integer + side.integer;
  }

  Cells run() {
    Cells cells;
    for (FaceId f = 0; f < flat_.halfedges() / 3; ++f) {
      for_each_centre(f, [&](Gauss centre) {
        if (cells.quads.size() % 256 == 0) context_.check();
        std::array<VertexId, 4> quad{};
        for (std::size_t k = 0; k < 4; ++k) {
          constexpr std::array<Gauss, 4> kCorners = {Gauss{-1, -1}, Gauss{1, -1}, Gauss{1, 1},
                                                     Gauss{-1, 1}};
          quad[k] = number_of(walk({f, centre}, centre + kCorners[k]), cells);
        }
        cells.quads.push_back(quad);
        cells.centres.push_back({3 * f, centre, false, false});
      });
    }
    return cells;
  }

 private:
  Gauss origin(HalfedgeId h) const { return quads::origin(flat_, h); }
  // Positive to the left of the half-edge.
  std::int64_t side(HalfedgeId h, Gauss p) const { return cross(flat_[h].edge, p - origin(h)); }
  bool owns(HalfedgeId h) const { return flat_[h].opposite == kInvalid || h < flat_[h].opposite; }

  // Odd places of a face; of those on an edge the ones of the face whose half-edge is smaller.
  template <typename Visit>
  void for_each_centre(FaceId f, const Visit& visit) const {
    std::int64_t low = 0, high = 0;
    for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
      low = std::min(low, origin(h).y);
      high = std::max(high, origin(h).y);
    }
    for (std::int64_t y = low + 1; y < high; y += 2) {  // corners are even
      std::int64_t from = std::numeric_limits<std::int64_t>::min(), to = -(from + 1);
      for (HalfedgeId h = 3 * f; h < 3 * f + 3; ++h) {
        // dx (y - y0) - dy (x - x0) >= 0, or > 0 where the edge is the neighbour's.
        const Gauss d = flat_[h].edge, o = origin(h);
        const std::int64_t most = d.x * (y - o.y) + d.y * o.x - (owns(h) ? 0 : 1);  // >= dy x
        if (d.y > 0)
          to = std::min(to, floor_of(most, d.y));
        else if (d.y < 0)
          from = std::max(from, -floor_of(most, -d.y));
        else if (most < 0)
          to = std::numeric_limits<std::int64_t>::min();
      }
      if (from % 2 == 0) ++from;
      for (std::int64_t x = from; x <= to; x += 2) visit(Gauss{x, y});
    }
  }

  Place walk(Place from, Gauss end) const {
    const Place found = quads::walk(flat_, from, end, [](HalfedgeId, Gauss, Gauss) {});
    if (found.face == kInvalid) throw InternalError("quads: a cell leaves the surface");
    return found;
  }

  VertexId number_of(Place place, Cells& cells) {
    const HalfedgeId first = 3 * place.face;
    for (HalfedgeId h = first; h < first + 3; ++h) {
      if (place.at == origin(h))
        return numbered(-1 - flat_[h].source, {}, {h, {}, true, false}, cells);
    }
    for (HalfedgeId h = first; h < first + 3; ++h) {
      if (side(h, place.at) != 0) continue;
      HalfedgeId on = h;
      Gauss along = place.at - origin(h);
      if (!owns(h)) {
        on = flat_[h].opposite;
        along = turned(along, flat_[h].turn) + flat_[on].edge;
      }
      return numbered(on / 3, origin(on) + along, {on, along, false, true}, cells);
    }
    return numbered(place.face, place.at, {first, place.at, false, false}, cells);
  }

  VertexId numbered(Index kind, Gauss place, const Carrier& carrier, Cells& cells) {
    const auto [found, is_new] =
        number_.try_emplace({kind, place.x, place.y}, static_cast<VertexId>(cells.corners.size()));
    if (is_new) cells.corners.push_back(carrier);
    return found->second;
  }

  FlatSurface flat_;  // with edges that are twice the integers
  const ExecutionContext& context_;
  std::map<CornerKey, VertexId> number_;
};

}  // namespace

Cells extract_cells(const CoarseSurface& coarse, const ExecutionContext& context) {
  return Walker(coarse, context).run();
}

}  // namespace flipfree::quads
