// STL, binary or text. Told apart by size: a binary file has 84 bytes and 50 for each triangle.
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "flipfree/mesh/files/plain_form.h"
#include "flipfree/mesh/files/text.h"

namespace flipfree::mesh {
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::size_t kHeader = 80, kStart = 84, kTriangle = 50;

std::uint32_t promised(std::string_view bytes) {
  std::uint32_t count = 0;
  std::memcpy(&count, bytes.data() + kHeader, sizeof count);
  return count;
}

std::string to_binary(const std::vector<float>& corners) {
  const auto count = static_cast<std::uint32_t>(corners.size() / 9);
  std::string text(kStart + kTriangle * count, '\0');
  std::memcpy(text.data() + kHeader, &count, sizeof count);
  for (std::size_t t = 0; t < count; ++t)
    std::memcpy(text.data() + kStart + kTriangle * t + 12, corners.data() + 9 * t, 36);
  return text;
}

std::vector<float> from_binary(std::string_view bytes) {
  const std::size_t count = promised(bytes);
  std::vector<float> corners(9 * count);
  for (std::size_t t = 0; t < count; ++t) {
    std::memcpy(corners.data() + 9 * t, bytes.data() + kStart + kTriangle * t + 12, 36);
    for (std::size_t i = 9 * t; i < 9 * t + 9; ++i)
      if (!std::isfinite(corners[i]))
        refuse("Triangle " + std::to_string(t), "a coordinate is NaN or infinite",
               "Delete or move that vertex, and write the file again");
  }
  return corners;
}

std::vector<float> from_text(std::string_view bytes) {
  std::vector<float> corners;
  std::size_t loop = 0;
  bool ended = false;
  Lines lines(bytes);
  while (lines.next()) {
    std::string_view rest = lines.line();
    const std::string_view keyword = next_word(rest);
    if (keyword == "outer") loop = corners.size();
    ended = keyword == "endsolid" || (ended && keyword.empty());
    if (keyword == "vertex") {
      for (int i = 0; i < 3; ++i)
        corners.push_back(to_float(next_word(rest), lines.place(), "a coordinate"));
    } else if (keyword == "endloop" && corners.size() != loop + 9) {
      refuse(lines.place(), "a facet does not have three corners");
    }
  }
  if (!ended) refuse("End of the file", "the file ends before 'endsolid'");
  if (corners.size() % 9 != 0) refuse("End of the file", "corners outside of facets");
  return corners;
}

}  // namespace

PlainForm plain_stl(std::string_view bytes) {
  const bool binary =
      bytes.size() >= kStart && kStart + kTriangle * std::size_t{promised(bytes)} == bytes.size();
  std::string_view rest = bytes.substr(0, kHeader);
  rest.remove_prefix(std::min(rest.find_first_not_of(" \t\r\n"), rest.size()));
  if (!binary && !rest.starts_with("solid"))
    refuse("Start of the file",
           "neither text, which begins with 'solid', nor as many bytes as a "
           "binary file with that number of triangles has");
  PlainForm plain;
  const std::vector<float> corners = binary ? from_binary(bytes) : from_text(bytes);
  plain.polygons = count_of(corners.size() / 9, "End of the file");
  plain.text = to_binary(corners);
  plain.extension = ".stl";
  plain.binary = true;
  return plain;
}

}  // namespace flipfree::mesh
