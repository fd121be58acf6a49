#include "flipfree/certify/measures/flips.h"

#include "flipfree/numeric/predicates.h"

namespace flipfree::certify {
namespace {

template <typename Matrix>
std::vector<FaceId> collect(const Matrix& uv) {
  std::vector<FaceId> flipped;
  for (FaceId f = 0; f < uv.rows() / 3; ++f) {
    const auto* a = uv.data() + 6 * static_cast<std::ptrdiff_t>(f);
    const bool finite = uv.template middleRows<3>(3 * f).allFinite();
    if (!finite || numeric::orientation(a, a + 2, a + 4) <= 0) flipped.push_back(f);
  }
  return flipped;
}

}  // namespace

std::vector<FaceId> flipped_faces(const Points2& corner_uv) { return collect(corner_uv); }
std::vector<FaceId> flipped_faces(const Points2f& corner_uv) { return collect(corner_uv); }

}  // namespace flipfree::certify
