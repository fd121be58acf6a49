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
  // What is left of the time; errors speak of all of it.
  constexpr double kLeastSeconds = 1e-3;
  const TimeLimit left(context, options.max_seconds > 0.0
                                    ? std::max(kLeastSeconds, options.max_seconds - watch.seconds())
                                    : limit_of(0.0));
  const ProgressRange range(context, 0.5, 1.0);
  certify::Parametrization map =
      distortion::improve(surface, mended.uv32.cast<double>(), options, context);
  map.stats["energy_before"] = std::numeric_limits<double>::infinity();
  map.stats.insert(mended.stats.begin(), mended.stats.end());
  map.stats["seconds"] = watch.seconds();
  return map;
}

}  // namespace flipfree::unwrap
