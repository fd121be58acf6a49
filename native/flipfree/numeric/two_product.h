// Products of doubles without an error.
#pragma once

namespace flipfree::numeric {

// A number as the sum of two doubles that do not overlap.
struct Pair {
  double high = 0.0;
  double low = 0.0;
};

// x y as a pair (Dekker 1971; Veltkamp splitting). Not by std::fma: some systems' rounds twice.
// Precondition: |x| and |y| are below 2^996, |x y| below 2^1023. The pair is exact unless |x y| is
// below 2^-969 and not 0; its error is then below 2^-1072.
inline Pair two_product(double x, double y) {
  constexpr double kSplitter = 134217729.0;  // 2^27 + 1
  const double high = x * y;
  const double xs = kSplitter * x;
  const double xh = xs - (xs - x);
  const double xl = x - xh;
  const double ys = kSplitter * y;
  const double yh = ys - (ys - y);
  const double yl = y - yh;
  return {high, ((xh * yh - high) + xh * yl + xl * yh) + xl * yl};
}

}  // namespace flipfree::numeric
