#include "flipfree/conformal/engine/engine.h"

#include "flipfree/conformal/engine/scalar_engine.h"
#include "flipfree/conformal/engine/scalar_engine_angles.h"
#include "flipfree/conformal/engine/scalar_engine_relax.h"

namespace flipfree::conformal {

std::unique_ptr<MetricEngine> make_engine(const EngineInput& input, int bits,
                                          ExecutionContext& context) {
  if (bits <= 53) return std::make_unique<ScalarEngine<double>>(input, 53, context);
  if (bits <= 256)
    return std::make_unique<ScalarEngine<numeric::BigFloat<4>>>(input, bits, context);
  if (bits <= 1024)
    return std::make_unique<ScalarEngine<numeric::BigFloat<16>>>(input, bits, context);
  return std::make_unique<ScalarEngine<numeric::BigFloat<64>>>(input, std::min(bits, 4096),
                                                               context);
}

}  // namespace flipfree::conformal
