#include "flipfree/mesh/files/text.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <limits>

#include "mesh/files/file_meshes.h"

namespace flipfree::mesh::text_test {
namespace {

using namespace test;

TEST(Text, NumbersNearerToZeroThanDoublesAreZero) {
  const MeshFile mesh =
      read_mesh("v 1e-400 -1e-999 0.000e-5\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", Format::kObj);
  EXPECT_EQ(mesh.vertices.row(0).norm(), 0.0);
}

TEST(Text, LinesEndAsAllSystemsWriteThemAndAreCounted) {
  Lines lines("\xEF\xBB\xBFone\r\n\ntwo");
  ASSERT_TRUE(lines.next());
  EXPECT_EQ(lines.line(), "one");
  EXPECT_EQ(lines.rest(), "\ntwo");
  ASSERT_TRUE(lines.next());
  EXPECT_EQ(lines.line(), "");
  ASSERT_TRUE(lines.next());
  EXPECT_EQ(lines.line(), "two");
  EXPECT_EQ(lines.place(), "Line 3");
  EXPECT_FALSE(lines.next());
}

TEST(Text, WordsStandBetweenBlanks) {
  std::string_view rest = " \t a  bc\v";
  EXPECT_EQ(next_word(rest), "a");
  EXPECT_EQ(next_word(rest), "bc");
  EXPECT_EQ(next_word(rest), "");
}

TEST(Text, NumbersThatAreNoneAreShownWithoutWhatCannotBePrinted) {
  const auto said = [](std::string_view word) {
    return refusal_of([&] { return to_number(word, "Here", "a side"); });
  };
  EXPECT_EQ(said(""), "Here: a side should be a finite number, not nothing." + kAgain);
  EXPECT_EQ(said("1\x01z"), "Here: a side should be a finite number, not '1?z'." + kAgain);
  EXPECT_EQ(said("123456789012345678901234567890x"),
            "Here: a side should be a finite number, not '123456789012345678901234...'." + kAgain);
  EXPECT_NE(said("inf"), "accepted");
  EXPECT_NE(said("+-1"), "accepted");
  EXPECT_EQ(to_number("+1.5e3", "", ""), 1500.0);
}

TEST(Text, FloatsAreTheNearestAndRefusedBeyondTheLargest) {
  EXPECT_EQ(to_float("0.1", "", ""), 0.1F);
  EXPECT_EQ(narrowed(0x1.fffffefp127, "", ""), std::numeric_limits<float>::max());
  EXPECT_NE(refusal_of([] { return narrowed(0x1.ffffffp127, "Here", "a side"); }), "accepted");
}

TEST(Text, IntegersHaveNoRest) {
  EXPECT_EQ(to_integer("+7", "", ""), 7);
  EXPECT_EQ(to_integer("-7", "", ""), -7);
  for (const char* word : {"7.0", "7a", "", "99999999999999999999"})
    EXPECT_NE(refusal_of([&] { return to_integer(word, "Here", "a count"); }), "accepted") << word;
}

TEST(Text, CountsEndWhereCornersHaveNoIds) {
  const auto most = static_cast<std::size_t>(std::numeric_limits<Index>::max() / 3);
  EXPECT_EQ(count_of(most, ""), static_cast<Index>(most));
  EXPECT_NE(refusal_of([&] { return count_of(most + 1, "Here"); }), "accepted");
}

TEST(Text, NumbersAreWrittenWithAllTheirDigits) {
  std::string text;
  append_number(text, 0.1);
  text += ' ';
  append_number(text, 0.1F);
  text += ' ';
  append_number(text, -12LL);
  EXPECT_EQ(text, "0.1 0.100000001 -12");
  std::string bytes;
  append_bytes(bytes, std::uint16_t{0x0102});
  EXPECT_EQ(bytes, std::string("\x02\x01", 2));
}

}  // namespace
}  // namespace flipfree::mesh::text_test
