#include "flipfree/intrinsic/overlay/overlay_positions.h"

#include <cmath>
#include <cstddef>

#include "flipfree/base/parallel.h"

namespace flipfree::intrinsic {
namespace {

// Penner lengths from one end of a curve to the two ends of the half-edge it crosses.
struct Reach {
  long double source = 0;
  long double target = 0;
};

Between normalised(long double source, long double target) {
  // Divide by the larger first: the weights themselves may be near the ends of the range.
  const long double largest = std::max(source, target);
  const long double a = source / largest, b = target / largest;
  return {static_cast<double>(a / (a + b)), static_cast<double>(b / (a + b))};
}

}  // namespace

OverlayPositions locate_crossings(const OverlayCoordinates& coordinates, const OverlayTrace& trace,
                                  const std::vector<long double>& lengths,
                                  const std::vector<long double>& scale,
                                  const ExecutionContext& context) {
  const FlipMesh& mesh = coordinates.current();
  const auto length = [&](HalfedgeId h) { return lengths[at(h >> 1)]; };
  OverlayPositions positions;
  positions.on_edge.resize(trace.crossings.size());
  positions.on_curve.resize(trace.crossings.size());
  const auto locate = [&](std::size_t c, std::vector<Reach>& ahead) {
    const auto crossings = trace.of_curve(c);
    if (crossings.empty()) return;
    const std::size_t count = crossings.size();
    // From the far end b, backwards: the reach of b to the ends of each crossed half-edge.
    ahead.resize(count);
    {
      const HalfedgeId last = FlipMesh::opposite(crossings[count - 1].through);
      // `last` runs target -> source of the crossed half-edge; its next leaves the source, its
      // previous the apex.
      ahead[count - 1] = {length(mesh.next_of(last)), length(mesh.previous(last))};
      for (std::size_t i = count - 1; i-- > 0;) {
        // The triangle between crossings i and i + 1: sides `near` (crossed before) and `far`
        // (crossed after) share one vertex; the other end of `near` is new as seen from b.
        const HalfedgeId near = FlipMesh::opposite(crossings[i].through);
        const HalfedgeId far = crossings[i + 1].through;
        const Reach& r = ahead[i + 1];
        const HalfedgeId third =
            far == mesh.next_of(near) ? mesh.previous(near) : mesh.next_of(near);
        // b's lengths to the ends of `near` (source(near) = target of the crossed half-edge i).
        if (far == mesh.next_of(near)) {
          // far: source(crossed) -> apex, shared vertex = source(crossed i) = source(far).
          const long double fresh =
              (r.source * length(third) + r.target * length(near)) / length(far);
          ahead[i] = {r.source, fresh};
        } else {
          // far: apex -> target(crossed i), shared vertex = target(far).
          const long double fresh =
              (r.target * length(third) + r.source * length(near)) / length(far);
          ahead[i] = {fresh, r.target};
        }
      }
    }
    const HalfedgeId first = crossings[0].through;
    Reach behind{length(mesh.previous(first)), length(mesh.next_of(first))};
    const VertexId a = coordinates.input().origin_of(trace.curves[c]);
    const VertexId b = coordinates.input().origin_of(FlipMesh::opposite(trace.curves[c]));
    const long double ratio = std::exp(scale[at(b)] - scale[at(a)]);
    for (std::size_t i = 0; i < count; ++i) {
      if (i > 0) {
        const HalfedgeId near = FlipMesh::opposite(crossings[i - 1].through);
        const HalfedgeId far = crossings[i].through;
        // Ptolemy across `near`: fresh = (a to one end * opposite side + ...) / near; `behind` is
        // for the crossed half-edge i - 1, whose source is target(near).
        const HalfedgeId next = mesh.next_of(near), previous = mesh.previous(near);
        const long double apex =
            (behind.source * length(previous) + behind.target * length(next)) / length(near);
        behind = far == next ? Reach{behind.source, apex} : Reach{apex, behind.target};
      }
      const Reach& r = ahead[i];
      const std::size_t id = static_cast<std::size_t>(trace.begin[c]) + i;
      // Ratios first: products of two lengths may leave even this range.
      const long double across = (behind.source / behind.target) * (r.source / r.target);
      positions.on_edge[id] = normalised(1, across);
      const long double along = (behind.source / r.source) * (behind.target / r.target) * ratio;
      positions.on_curve[id] = normalised(1, along);
    }
  };
  constexpr std::size_t kCurvesPerChunk = 4096;
  parallel_for(context, trace.curves.size(), kCurvesPerChunk,
               [&](std::size_t begin, std::size_t end, std::size_t) {
                 std::vector<Reach> ahead;
                 for (std::size_t c = begin; c < end; ++c) locate(c, ahead);
               });
  return positions;
}

}  // namespace flipfree::intrinsic
