#include "flipfree/numeric/lobachevsky.h"

#include <cmath>
#include <numbers>

namespace flipfree::numeric {
namespace {

// zeta(2), zeta(4), ...; beyond, 1 + 4^-n is near enough.
constexpr double kZeta[] = {1.6449340668482264, 1.0823232337111382, 1.0173430619844491,
                            1.0040773561979443, 1.0009945751278181, 1.0002460865533080,
                            1.0000612481350587, 1.0000152822594086, 1.0000038172932650,
                            1.0000009539620339, 1.0000002384505027, 1.0000000596081891,
                            1.0000000149015548};
constexpr int kTabulated = sizeof(kZeta) / sizeof(kZeta[0]);
constexpr int kTerms = 26;  // the terms fall like 4^-n at least

}  // namespace

double lobachevsky(double x) {
  constexpr double kPi = std::numbers::pi;
  if (x > 0.5 * kPi) return -lobachevsky(kPi - x);  // odd, and of period pi
  if (!(x > 0.0)) return 0.0;
  // x (1 - log 2x + sum over n of zeta(2 n) (x / pi)^(2 n) / (n (2 n + 1)))
  const double square = (x / kPi) * (x / kPi);
  double sum = 0.0;
  for (int n = kTerms; n >= 1; --n) {
    const double zeta = n <= kTabulated ? kZeta[n - 1] : 1.0 + std::ldexp(1.0, -2 * n);
    sum = (sum + zeta / (n * (2.0 * n + 1.0))) * square;
  }
  return x * (1.0 - std::log(2.0 * x) + sum);
}

}  // namespace flipfree::numeric
