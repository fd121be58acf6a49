#include "targets.h"

namespace flipfree::fuzz {

std::span<const Target> targets() {
  static constexpr Target kTargets[] = {
      {"validate", fuzz_validate},
      {"embed", fuzz_embed},
      {"metric", fuzz_metric},
      {"pins", fuzz_pins},
      {"unwrap", fuzz_unwrap},
      {"certify", fuzz_certify, true},
      {"certify_any", fuzz_certify_any, true},
      {"rounding", fuzz_rounding, true},
      {"files", fuzz_files},
      {"cells", fuzz_cells},
  };
  return kTargets;
}

}  // namespace flipfree::fuzz
