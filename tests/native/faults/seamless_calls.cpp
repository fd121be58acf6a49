#include <utility>

#include "faults/calls.h"
#include "flipfree/seamless/exact/seamless_map.h"
#include "support/shapes.h"

namespace flipfree::test {
namespace {

Call seamless_call(std::string name, const mesh::Surface& surface, std::vector<Index> cones,
                   const seamless::SeamlessOptions& options) {
  return {std::move(name), [=](ExecutionContext& context, double max_seconds) {
            seamless::SeamlessOptions limited = options;
            limited.max_seconds = max_seconds;
            const certify::Parametrization map =
                cones.empty() ? seamless::map_with_suggested_cones(surface, limited, context)
                              : seamless::compute_seamless_map(surface, cones, limited, context);
            if (limited.exact && map.certificate.seams_exact32 != map.certificate.seam_edges)
              throw WrongResult("a seamless map came back with seams that are not exact");
            return bytes_of_valid(map, surface);
          }};
}

}  // namespace

std::vector<Call> seamless_calls() {
  const mesh::Surface ring = torus(7, 5), ball = sphere(6, 5);
  std::vector<Index> cones(static_cast<std::size_t>(ring.vertices.rows()), 4);
  cones[0] = cones[17] = 3;
  cones[9] = cones[30] = 5;
  seamless::SeamlessOptions rough;
  rough.exact = false;
  return {seamless_call("seamless", ring, cones, {}),
          seamless_call("seamless, up to rounding", ring, cones, rough),
          seamless_call("seamless, suggested", ball, {}, {})};
}

}  // namespace flipfree::test
