#include "targets.h"

namespace flipfree::fuzz {

std::span<const Target> targets() {
  static constexpr Target kTargets[] = {
      {"validate", fuzz_validate}, {"cut", fuzz_cut},       {"embed", fuzz_embed},
      {"flips", fuzz_flips},       {"metric", fuzz_metric}, {"self_overlap", fuzz_self_overlap},
      {"pins", fuzz_pins},         {"unwrap", fuzz_unwrap}, {"certify", fuzz_certify},
      {"rounding", fuzz_rounding}, {"files", fuzz_files},   {"certify_any", fuzz_certify_any},
  };
  return kTargets;
}

}  // namespace flipfree::fuzz
