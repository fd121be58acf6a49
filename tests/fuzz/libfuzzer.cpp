// libFuzzer's entry point; FLIPFREE_FUZZ_TARGET is the function to fuzz (CMakeLists.txt).
#include <cstdio>
#include <cstdlib>

#include "finding.h"
#include "targets.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  try {
    flipfree::fuzz::FLIPFREE_FUZZ_TARGET({data, size});
  } catch (const flipfree::fuzz::Finding& finding) {
    std::fprintf(stderr, "FINDING: %s\n", finding.what.c_str());
    std::abort();
  }
  return 0;
}
