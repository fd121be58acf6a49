// Padding widths: not negative, and mates equally long to the last of many bits.
#include "flipfree/seamless/padding/padded_metric.h"

#include <gtest/gtest.h>

#include <cmath>

#include "seamless/padding/geometry/hand_cuts.h"

namespace flipfree::seamless::equalize_test {
namespace {

std::vector<Wide> lengths_of(std::size_t count, double growth) {
  std::vector<Wide> length;
  double l = 1.0;
  for (std::size_t i = 0; i < count; ++i, l *= growth)
    length.push_back(Wide(l + 0.3 * static_cast<double>(i % 3), kWideBits));
  return length;
}

void expect_equalized(const AdmissibleCut& cut, double growth) {
  const CutSegments segments = cut_segments(cut, test::adjacency_of(cut));
  const EqualizationSystem system = equalization_system(cut, segments);
  const std::vector<Wide> length = lengths_of(segments.segments.size(), growth);
  const std::vector<Wide> width = padding_widths(system, length);
  for (const Wide& w : width) EXPECT_GE(w.sign(), 0);
  const std::vector<Wide> padded = padded_lengths(segments, length, width);
  for (const EqualizationRow& row : system.rows) {
    Wide mates(0.0);
    for (const Index mate : row.mates) mates += padded[static_cast<std::size_t>(mate)];
    const Wide& own = padded[static_cast<std::size_t>(row.segment)];
    EXPECT_LT(std::abs(numeric::ratio(own - mates, own)), 1e-40);
  }
}

TEST(Equalize, MatesBecomeEquallyLong) {
  const AdmissibleCut cut = test::digon_cut().cut;
  expect_equalized(cut, 1.0);
  expect_equalized(cut, 1.7);
  expect_equalized(cut, 40.0);
}

TEST(Equalize, NothingIsPaddedWhereNothingIsMissing) {
  const AdmissibleCut cut = test::digon_cut().cut;
  const CutSegments segments = cut_segments(cut, test::adjacency_of(cut));
  const std::vector<Wide> same(segments.segments.size(), Wide(2.0, kWideBits));
  for (const Wide& w : padding_widths(equalization_system(cut, segments), same))
    EXPECT_EQ(w.sign(), 0);
}

TEST(Equalize, OneSquareTakesWhatItsMetricMisses) {
  const test::GridTorus torus(6, 6);
  const AdmissibleCut cut = test::square_cut(torus).cut;
  const CutSegments segments = cut_segments(cut, test::adjacency_of(cut));
  std::vector<Wide> length(4, Wide(1.0, kWideBits));
  length[2] = Wide(1.0 + 1e-12);
  EXPECT_NO_THROW(padding_widths(equalization_system(cut, segments), length));
}

TEST(Equalize, ComponentsGetTheScaleAtWhichTheirMatesAgree) {
  const AdmissibleCut cut = test::digon_cut().cut;
  const CutSegments segments = cut_segments(cut, test::adjacency_of(cut));
  std::vector<Wide> length;
  for (const CutSegment& segment : segments.segments)
    length.push_back(Wide(segment.component == 0 ? 1.0 : 1e-8, kWideBits));
  const std::vector<double> scale =
      component_scales(segments, equalization_system(cut, segments), length);
  ASSERT_EQ(scale.size(), 2u);
  EXPECT_NEAR(scale[1] / scale[0], 1e8, 1e3);
}

}  // namespace
}  // namespace flipfree::seamless::equalize_test
