#include "flipfree/intrinsic/overlay/overlay_trace.h"

#include <string>
#include <utility>

#include "flipfree/base/error.h"

namespace flipfree::intrinsic {
namespace {

[[noreturn]] void broken(HalfedgeId g, const char* what) {
  throw InternalError("overlay: input half-edge " + std::to_string(g) + " " + what);
}

// For every half-edge of M0 where it starts in T.
std::vector<CurveStart> find_starts(const OverlayCoordinates& coordinates) {
  const FlipMesh& mesh = coordinates.current();
  std::vector<CurveStart> start(mesh.halfedge_count());
  for (HalfedgeId h = 0; at(h) < mesh.halfedge_count(); ++h) {
    const VertexId v = mesh.origin_of(h);
    const Index degree = coordinates.degree(v);
    const HalfedgeId* star = coordinates.star(v);
    Index place = coordinates.roundabout(h);
    const auto assign = [&](std::int32_t rank) {
      CurveStart& s = start[at(star[place])];
      if (s.halfedge != kInvalid) broken(star[place], "starts in two corners");
      s = {h, rank};
      place = place + 1 == degree ? 0 : place + 1;
    };
    if (coordinates.shared(h)) assign(-1);
    const std::int64_t count = coordinates.corner(h).emanating;
    if (count > degree) broken(star[place], "starts in a corner with too many others");
    for (std::int32_t i = 0; i < count; ++i) assign(i);
  }
  return start;
}

// Position of a curve on half-edge `through`, counted from its source; moves it into the next face.
// Returns false if the curve ends at the vertex opposite to `through` there.
bool advance(const OverlayCoordinates& coordinates, HalfedgeId& through, std::int64_t& position) {
  const FlipMesh& mesh = coordinates.current();
  const HalfedgeId o = FlipMesh::opposite(through);
  const std::int64_t from_source = coordinates.crossings(o) - 1 - position;
  const HalfedgeId on = mesh.next_of(o), op = mesh.next_of(on);
  const std::int64_t turning = coordinates.corner(o).turning;
  if (from_source < turning) {
    through = op;
    position = coordinates.crossings(op) - 1 - from_source;
    return true;
  }
  if (from_source < turning + coordinates.corner(op).emanating) return false;
  through = on;
  position = coordinates.crossings(o) - 1 - from_source;
  return true;
}

}  // namespace

OverlayTrace trace_overlay(const OverlayCoordinates& coordinates, std::vector<HalfedgeId> curves,
                           std::int64_t max_crossings, const ExecutionContext& context) {
  const FlipMesh& mesh = coordinates.current();
  OverlayTrace trace;
  trace.start = find_starts(coordinates);
  trace.curves = std::move(curves);
  trace.begin.reserve(trace.curves.size() + 1);
  trace.begin.push_back(0);
  for (std::size_t c = 0; c < trace.curves.size(); ++c) {
    if (c % 4096 == 0) context.check();
    const HalfedgeId g = trace.curves[c];
    const CurveStart& s = trace.start[at(g)];
    if (s.halfedge == kInvalid) broken(g, "starts nowhere");
    if (!s.shared()) {
      HalfedgeId through = mesh.next_of(s.halfedge);
      std::int64_t position = coordinates.crossings(s.halfedge) + s.place;
      do {
        if (static_cast<std::int64_t>(trace.crossings.size()) >= max_crossings) {
          throw_not_converged(
              ErrorCode::kIterationLimit,
              "The common refinement of input and final triangulation has more than " +
                  std::to_string(max_crossings) +
                  " crossings. Use a finer or better shaped mesh, or milder target angles.");
        }
        if (trace.crossings.size() % 65536 == 65535) context.check();
        trace.crossings.push_back(
            {through, through % 2 == 0 ? position : coordinates.crossings(through) - 1 - position});
      } while (advance(coordinates, through, position));
      const HalfedgeId apex = mesh.previous(FlipMesh::opposite(through));
      if (mesh.origin_of(apex) != coordinates.input().origin_of(FlipMesh::opposite(g))) {
        broken(g, "does not end at its target");
      }
    }
    trace.begin.push_back(static_cast<std::int64_t>(trace.crossings.size()));
  }
  return trace;
}

}  // namespace flipfree::intrinsic
