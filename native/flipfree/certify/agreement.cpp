#include "flipfree/certify/agreement.h"

#include <utility>

namespace flipfree::certify {

void agree_with_storage(Parametrization& map, const CertifyRequest& request,
                        const ExecutionContext& context) {
  map.agreed.resize(0, 2);
  const Points2f nearest = map.uv.cast<float>();
  if (nearest == map.uv32) return;
  map.agreed = map.uv32.cast<double>();
  if (!request.cone_angles.empty()) return;
  Points2 mixed = map.agreed;
  for (Eigen::Index row = 0; row < mixed.rows(); ++row) {
    if (nearest.row(row) == map.uv32.row(row)) mixed.row(row) = map.uv.row(row);
  }
  CertifyRequest again = request;
  again.uv = &mixed;
  again.parent = nullptr;  // the same subdivision
  if (certify(again, context).ok) {
    map.agreed = std::move(mixed);
    return;
  }
  again.uv = &map.agreed;
  again.pins.clear();  // met as stored
  Certificate stored = certify(again, context);
  if (!stored.ok) map.certificate = std::move(stored);
}

}  // namespace flipfree::certify
