#include "flipfree/unwrap/repair/improve_any.h"

#include <algorithm>
#include <limits>

#include "flipfree/base/error.h"
#include "flipfree/unwrap/repair/repair.h"

namespace flipfree::unwrap {

certify::Parametrization improve_any(const mesh::Surface& surface, const Points2& corner_uv,
                                     const distortion::ImproveOptions& options,
                                     ExecutionContext& context) {
  const Stopwatch watch;
  try {
    return distortion::improve(surface, corner_uv, options, context);
  } catch (const InvalidInput& refused) {
    if (refused.error().code != ErrorCode::kFlippedMap) throw;
  }
  RepairOptions mending;
  mending.pins = options.pins;
  mending.overlaps = SelfOverlaps::kKeep;
  mending.stretched = StretchedIslands::kIgnore;
  mending.max_seconds = options.max_seconds;
  mending.aspect = options.aspect;
  const certify::Parametrization mended = [&] {
    const ProgressRange range(context, 0.0, 0.5);
    return repair(surface, corner_uv, mending, context);
  }();
  distortion::ImproveOptions rest = options;
  if (options.max_seconds > 0.0) {
    constexpr double kLeastSeconds = 1e-3;
    rest.max_seconds = std::max(kLeastSeconds, options.max_seconds - watch.seconds());
  }
  const ProgressRange range(context, 0.5, 1.0);
  certify::Parametrization map =
      distortion::improve(surface, mended.uv32.cast<double>(), rest, context);
  map.stats["energy_before"] = std::numeric_limits<double>::infinity();
  map.stats.insert(mended.stats.begin(), mended.stats.end());
  map.stats["seconds"] = watch.seconds();
  return map;
}

}  // namespace flipfree::unwrap
