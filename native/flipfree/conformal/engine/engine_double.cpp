#include "flipfree/conformal/engine/engine_impl.h"

namespace flipfree::conformal {

std::unique_ptr<MetricEngine> make_double_engine(const EngineInput& input,
                                                 ExecutionContext& context) {
  return std::make_unique<ScalarEngine<double>>(input, 53, context);
}

std::unique_ptr<MetricEngine> make_engine(const EngineInput& input, int bits,
                                          ExecutionContext& context) {
  return bits <= 53 ? make_double_engine(input, context) : make_mpfr_engine(input, bits, context);
}

}  // namespace flipfree::conformal
