#include "flipfree/embedding/roomy_boundary.h"

#include <algorithm>
#include <cstddef>
#include <numeric>

#include "flipfree/embedding/chords.h"

namespace flipfree::embedding {
namespace {

using Size = std::size_t;

// An edge's share grows by at most 2^this; a strip of a million squares needs 2^12.
constexpr int kMostDoublings = 24;

// Doubles the edges on the shorter side of each chord.
void widen(std::vector<double>& lengths, const std::vector<HalfedgeId>& chords,
           const Triangles& faces, const std::vector<Index>& place) {
  const Size n = lengths.size();
  std::vector<double> along(n + 1, 0.0);  // up to point i
  std::partial_sum(lengths.begin(), lengths.end(), along.begin() + 1);
  std::vector<int> starts(n + 1, 0);  // of arcs to double at edge i, less those that have ended
  const auto mark = [&](Size from, Size to) {
    ++starts[from];
    --starts[to];
  };
  for (const HalfedgeId h : chords) {
    const auto i = static_cast<Size>(place[static_cast<Size>(faces.data()[h])]);
    const auto j = static_cast<Size>(place[static_cast<Size>(faces.data()[next_corner(h)])]);
    const Size low = std::min(i, j), high = std::max(i, j);
    const double between = along[high] - along[low];
    if (2.0 * between <= along[n]) {
      mark(low, high);
    } else {
      mark(0, low);
      mark(high, n);
    }
  }
  int arcs = 0;
  for (Size i = 0; i < n; ++i) {
    arcs += starts[i];
    if (arcs > 0) lengths[i] *= 2.0;
  }
}

}  // namespace

Points2 place_with_room(BoundaryShape shape, const std::vector<double>& lengths,
                        const Triangles& faces, Index vertex_count,
                        const std::vector<VertexId>& loop, const ExecutionContext& context) {
  const Points2 given = place_boundary(shape, lengths).positions;
  if (shape != BoundaryShape::kCircle) return given;
  const auto without_room = [&](const Points2& positions) {
    context.check();
    return chords_to_split(faces, vertex_count, loop, positions, true);
  };
  std::vector<HalfedgeId> chords = without_room(given);
  std::vector<Index> place(static_cast<Size>(vertex_count), kInvalid);
  for (Size i = 0; i < loop.size(); ++i) place[static_cast<Size>(loop[i])] = static_cast<Index>(i);
  std::vector<double> wider = lengths;
  for (int doubling = 0; doubling < kMostDoublings && !chords.empty(); ++doubling) {
    widen(wider, chords, faces, place);
    const Points2 positions = spread_on_circle(wider);
    chords = without_room(positions);
    if (chords.empty() && is_strictly_convex(positions)) return positions;
  }
  return given;
}

}  // namespace flipfree::embedding
